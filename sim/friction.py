"""Dry friction of joints: it holds what it can, and opposes with all it has what it cannot hold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..binding.bind import pointer
from ..models import Array
from ._plant import ffi, lib

Braked = Sequence[bool] | NDArray[np.bool_]
"""Which brakes are closed, (n,)."""


@dataclass(frozen=True, slots=True)
class Friction:
    """Dry friction of joints, (n,) each.

    Attributes:
        gear: acts on the rotors [N m or N].
        share: of the torque that a gear carries, which rubs besides.
        bearing: acts on the links [N m or N].
    """

    gear: Array
    share: Array
    bearing: Array

    @classmethod
    def none(cls, n: int) -> Friction:
        """Joints without any."""
        return cls(np.zeros(n), np.zeros(n), np.zeros(n))


def dry_impulse(A: Array, v: Array, most: Array) -> Array:
    """Impulses (n,) [N m s] of dry friction by maximum dissipation: they leave the least kinetic energy.

    Args:
        A: inverse inertia, (n, n).
        v: speeds without friction, (n,).
        most: largest impulses, (n,).

    Raises:
        ValueError: for more joints than C has room for.
    """
    n = len(v)
    if n > lib.DRY_MAX:
        raise ValueError(f"{n} joints; at most {lib.DRY_MAX} are supported")
    inverse, speed, bound, p = (np.ascontiguousarray(x, float) for x in (A, v, most, np.zeros(n)))
    stuck = ffi.new("unsigned char[]", n)
    lib.dry_impulse(
        n,
        pointer(inverse, "const double", n, n),
        pointer(speed, "const double", n),
        pointer(bound, "const double", n),
        pointer(p, "double", n),
        stuck,
    )
    return p


def braked_speed(M: Array, qd: Array, braked: Braked, most: Array) -> Array:
    """Speeds (n,) after closed brakes have acted, which are dry friction.

    Args:
        M: inertia, (n, n).
        qd: speeds before, (n,).
        braked: which brakes are closed, (n,).
        most: largest impulses, (n,) [N m s].
    """
    if not any(braked):
        return qd
    inverse = np.asarray(np.linalg.inv(M), float)
    stopped: Array = qd + inverse @ dry_impulse(inverse, qd, most * np.array(braked))
    return stopped
