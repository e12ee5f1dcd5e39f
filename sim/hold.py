"""What a hand does to what it holds: spring and damper, of limited strength, that move with it."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..binding import bind
from ..models import Array
from ._plant import ffi, lib


class Hold:
    """A grip as the dynamics integrate it, together with what is held: it is stable however stiff it is.

    It begins open.

    Attributes:
        rows: 3 where a point is held, 6 for a frame.
        stiffness, damping, strength: of translation and rotation, (2,); without strength nothing is held.
        error: from what is held to where the hand wants it: translation, rotation vector, (rows,) in B.
        rate: at which that place moves as seen from the arm's base, (rows,).
        wrench: what the hand did in the last step, (rows,) in B [N, N m].
        core: all of it but the wrench as C knows it (csrc/hand.h).
    """

    def __init__(self, rows: int = 6) -> None:
        self.rows = rows
        self.stiffness, self.damping, self.strength = np.ones(2), np.ones(2), np.zeros(2)
        self.error, self.rate, self.wrench = np.zeros(rows), np.zeros(rows), np.zeros(rows)
        self.core = ffi.new("hold *", {"rows": rows})
        bind(
            lib,
            self.core,
            stiffness=self.stiffness,
            damping=self.damping,
            strength=self.strength,
            error=self.error,
            rate=self.rate,
        )


def chain(hold: Hold, inverse: Array, J: Array, dry: Array, friction: Array) -> Any:
    """What is held, as C steps it (csrc/held.h).

    Args:
        hold: of it.
        inverse: of its inertia, (n, n); the upper triangle is read.
        J: of what the hand holds, (rows, n).
        dry: largest dry friction of its joints, (n,).
        friction: that of the last step, (n,).

    Raises:
        ValueError: for more joints than C has room for.
    """
    if len(dry) > lib.DRY_MAX:
        raise ValueError(f"a chain of {len(dry)} joints; at most {lib.DRY_MAX} are supported")
    made = ffi.new("held *", {"n": len(dry), "rows": hold.rows})
    bind(
        lib,
        made,
        inverse=inverse,
        J=J,
        stiffness=hold.stiffness,
        damping=hold.damping,
        strength=hold.strength,
        error=hold.error,
        rate=hold.rate,
        dry=dry,
        wrench=hold.wrench,
        friction=friction,
    )
    return made
