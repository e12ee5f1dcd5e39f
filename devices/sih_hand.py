"""A hand with five drives."""

from __future__ import annotations

from typing import ClassVar

from .robot_hand import RobotHand


class SihHand(RobotHand, frozen=True, kw_only=True, tag="sih_hand"):
    """As Bimanual, section III: fewer drives, the strong one of the two."""

    group: str = "sih_hands"
    eds: str = "sih_hand.eds"
    drives: ClassVar[tuple[str, ...]] = (
        "thumb_opposition",
        "thumb_flexion",
        "index",
        "middle",
        "ring_little",
    )
