"""The eleven levels of HapticGiant, Table II, written by the C core into arrays that the solver reads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..hqp import Level
from ..models import Array
from ._kernels import ffi, lib
from .limits import Limits

TWIN_START = 6
LEVEL_OF_RANGE = 9
"""Index of level 10, the first that depends on which limits are active."""
REACHED = 1e-6
"""A row counts as active within this times (1 + |bound|), violated rows included."""

LOWER = int(lib.CHAIN_LOWER_ACTIVE)
UPPER = int(lib.CHAIN_UPPER_ACTIVE)


@dataclass(frozen=True, slots=True)
class Gains:
    """Synchronisation gains of (11): translation and rotation, [1/s^2] and [1/s]."""

    p_translation: float
    p_rotation: float
    d_translation: float
    d_rotation: float


@dataclass(frozen=True, slots=True)
class Horizons:
    """How far the bounds look ahead [s]; with the control period alone they are dead-beat and bounce.

    Attributes:
        viability: of set B, joint positions, speeds and accelerations.
        point: of (8), the tilt and the boxes.
    """

    viability: float
    point: float


def input_shapes(n: int) -> dict[str, tuple[int, ...]]:
    """Arrays that the levels are written from, by their names in csrc/chain.h, for a twin of n joints.

    ``q, qd``: commanded state of the manipulator. ``J, drift, x_H, R_H``: Jacobian, drift acceleration and
    pose of the handle without the PPU; ``J_elbow, drift_elbow, x_elbow`` the same of the elbow.
    ``q_p, qd_p, qdd_p``: motion of the PPU. ``q_a, qd_a, J_a, drift_a, M_a``: state, Jacobian and drift at E,
    inertia of the twin; ``force_a``: J_a^T (w - w_ref) - tau_dis + tau_dri - c_a; ``x_E, R_E, v_E``: pose and
    twist of E in B.
    """
    return {
        **dict.fromkeys(("q", "qd", "drift", "drift_elbow", "drift_a", "v_E"), (6,)),
        **dict.fromkeys(("J", "J_elbow"), (6, 6)),
        **dict.fromkeys(("x_H", "x_elbow", "x_E"), (3,)),
        **dict.fromkeys(("R_H", "R_E"), (3, 3)),
        **dict.fromkeys(("q_p", "qd_p", "qdd_p"), (2,)),
        **dict.fromkeys(("q_a", "qd_a", "force_a"), (n,)),
        "J_a": (6, n),
        "M_a": (n, n),
    }


class ChainLevels:
    """Levels over x = [qdd_m, qdd_a, alpha_a, alpha_m, alpha_sing, alpha_ee, alpha_elbow], see csrc/chain.h.

    The inputs stay with their owners, who write them in place; ``assemble`` reads them where they are.

    Attributes:
        levels: the eleven levels, always the same objects.
        error: from H to E after ``assemble``: translation and rotation vector in B, (6,) [m, rad].
        active: which limits are active, a flag word for each constraint torque, (n + 13,).
    """

    def __init__(
        self,
        inputs: Mapping[str, Array],
        manipulator: Limits,
        twin: Limits,
        tilt: tuple[float, float],
        box: tuple[Sequence[float], Sequence[float]],
        gains: Gains,
        horizons: Horizons,
        dt: float,
    ) -> None:
        """The inputs are those of ``input_shapes``, each a C-contiguous float64 array.

        Raises:
            ValueError: for inputs or limits of another shape.
        """
        if manipulator.n != 6:
            raise ValueError(f"the manipulator has 6 joints, not {manipulator.n}")
        if not 1 <= twin.n <= lib.CHAIN_MAX_DOF:
            raise ValueError(f"a twin of {twin.n} joints; 1 to {lib.CHAIN_MAX_DOF} are supported")
        n = self.n = twin.n
        self.dim = 6 + 2 * n + 13
        self._keep: list[object] = []
        c = self._c = ffi.new("chain *")
        c.n, c.dt = n, dt
        c.viability_horizon, c.point_horizon = horizons.viability, horizons.point
        c.tilt_lower, c.tilt_upper = tilt
        for i in range(3):
            c.box_lower[i], c.box_upper[i] = float(box[0][i]), float(box[1][i])
            c.k_p[i], c.k_p[3 + i] = gains.p_translation, gains.p_rotation
            c.k_d[i], c.k_d[3 + i] = gains.d_translation, gains.d_rotation
        c.manipulator, c.twin = self._limits(manipulator), self._limits(twin)
        for name, shape in input_shapes(n).items():
            array = inputs[name]
            if array.shape != shape or array.dtype != np.float64 or not array.flags.c_contiguous:
                raise ValueError(
                    f"{name} must be a C-contiguous float64 array of shape {shape}, not {array.shape}"
                )
            self._bind(name, array)
        self.error = self._array("error", 6)
        self.active: NDArray[np.uint8] = np.zeros(n + 13, np.uint8)
        self._active = ffi.cast("unsigned char *", self.active.ctypes.data)
        self._x: Array | None = None
        self._x_pointer = ffi.NULL
        self.levels = self._levels()

    def assemble(self) -> bool:
        """Write levels 1 to 9 from the inputs; False where J or M_a is singular (levels unusable)."""
        return bool(lib.chain_levels(self._c) == 0)

    def set_range(self) -> None:
        """Write the bounds of level 10 from ``active``, (26) and (31)."""
        lib.chain_range(self._c, self._active)

    def detect(self, x: Array) -> int:
        """Add the limits that x, (dim,), reaches to ``active``; how many were new."""
        if x is not self._x:  # bound once: the solver always answers in the same array
            self._x, self._x_pointer = x, ffi.cast("double *", x.ctypes.data)
        return int(lib.chain_detect(self._c, self._x_pointer, REACHED, self._active))

    def _array(self, name: str, *shape: int) -> Array:
        array = np.zeros(shape)
        self._bind(name, array)
        return array

    def _bind(self, name: str, array: Array) -> None:
        setattr(self._c, name, ffi.cast("double *", array.ctypes.data))
        self._keep.append(array)

    def _limits(self, limits: Limits) -> object:
        rows = ffi.new("bounds_limits[]", limits.n)
        for row, *values in zip(
            rows, limits.lower, limits.upper, limits.velocity, limits.acceleration, strict=True
        ):
            row.lower, row.upper, row.velocity, row.acceleration = map(float, values)
        self._keep.append(rows)
        return rows

    def _levels(self) -> tuple[Level, ...]:
        n, dim = self.n, self.dim
        torques = n + 13
        unit = np.eye(dim)
        manipulator, twin, alpha = unit[:6], unit[6 : 6 + n], unit[6 + n :]
        tilt = (unit[3] + unit[4])[None, :]
        dynamics = self._array("A9", n, dim)
        dynamics[:, 6 : 6 + n] = np.eye(n)

        def bounds(level: int, rows: int) -> dict[str, Array]:
            return {"lb": self._array(f"lb{level}", rows), "ub": self._array(f"ub{level}", rows)}

        return (
            Level(A=self._array("A1", 6, dim), b=self._array("b1", 6)),
            Level(C=manipulator, **bounds(2, 6)),
            Level(C=tilt, **bounds(3, 1)),
            Level(C=self._array("C4", 3, dim), **bounds(4, 3)),
            Level(C=self._array("C5", 3, dim), **bounds(5, 3)),
            Level(C=twin, **bounds(6, n)),
            Level(C=manipulator, **bounds(7, 6)),
            Level(C=twin, **bounds(8, n)),
            Level(A=dynamics, b=self._array("b9", n)),
            Level(C=alpha, **bounds(10, torques)),
            Level(A=alpha, b=np.zeros(torques)),
        )
