"""A hand with nine drives."""

from __future__ import annotations

from typing import ClassVar

from .robot_hand import RobotHand


class SvhHand(RobotHand, frozen=True, kw_only=True, tag="svh_hand"):
    """As Bimanual, section III: all fingers, the dexterous one of the two."""

    group: str = "svh_hands"
    eds: str = "svh_hand.eds"
    drives: ClassVar[tuple[str, ...]] = (
        "thumb_flexion",
        "thumb_opposition",
        "index_distal",
        "index_proximal",
        "middle_distal",
        "middle_proximal",
        "ring",
        "little",
        "spread",
    )
