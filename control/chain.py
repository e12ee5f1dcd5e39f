"""The levels of HapticGiant, Table II, written by the C core into arrays that the solver reads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..binding import bind, pointer
from ..hqp import Level
from ..models import Array
from ._kernels import ffi, lib
from .ability import Ability
from .compliance import Compliance
from .limits import Limits

REACHED = 1e-6
"""A row counts as active within this times (1 + |bound|), violated rows included."""

LOWER = int(lib.CHAIN_LOWER_ACTIVE)
UPPER = int(lib.CHAIN_UPPER_ACTIVE)

HOMING = 0.05
"""Speed at which what is outside its limits returns while a twin is rendered [rad/s or m/s]."""

FREE, CAUGHT, LOCKED = int(lib.CHAIN_FREE), int(lib.CHAIN_CAUGHT), int(lib.CHAIN_LOCKED)
"""What a lock does to a joint of the twin: nothing; it may fall, not rise; it stands."""

ALL_DIRECTIONS = (0, 1, 2, 3, 4, 5)

Rule = Literal["torques", "gauss"]
"""How limits reach the twin: through constraint torques on the limits that are active, as printed, or as the
least deviation from its free motion in the metric of its inertia (Gauss's principle)."""


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


@dataclass(frozen=True, slots=True)
class JointSum:
    """A weighted sum of joint positions with limits like a joint's, (14); one weight a joint [rad or m]."""

    weight: Sequence[float]
    lower: float
    upper: float


@dataclass(frozen=True, slots=True)
class BoxedPoint:
    """A point of the manipulator that stays in a box along the axes of the base, (15) and (16).

    Attributes:
        position: without the motion of the base, (3,) [m].
        J: Jacobian, (6, m).
        drift: acceleration at qdd = 0, (6,).
        lower, upper: corners of the box, (3,) [m]; infinite where there is no limit.
    """

    position: Array
    J: Array
    drift: Array
    lower: Sequence[float]
    upper: Sequence[float]


def input_shapes(m: int, n: int) -> dict[str, tuple[int, ...]]:
    """Arrays that the levels are written from, by their names in csrc/chain.h.

    ``q, qd``: commanded state of the manipulator with m joints. ``J, drift, x_H, R_H``: Jacobian, drift
    acceleration and pose of the handle without the base's motion ``q_p, qd_p, qdd_p``. ``q_a, qd_a, J_a,
    drift_a, M_a``: state, Jacobian and drift at E, inertia of the twin with n joints; ``force_a``:
    J_a^T (w - w_ref) - tau_dis + tau_dri - c_a; ``x_E, R_E, v_E``: pose and twist of E in B.
    """
    return {
        **dict.fromkeys(("q", "qd"), (m,)),
        **dict.fromkeys(("drift", "drift_a", "v_E"), (6,)),
        "J": (6, m),
        **dict.fromkeys(("x_H", "x_E"), (3,)),
        **dict.fromkeys(("R_H", "R_E"), (3, 3)),
        **dict.fromkeys(("q_p", "qd_p", "qdd_p"), (2,)),
        **dict.fromkeys(("q_a", "qd_a", "force_a"), (n,)),
        "J_a": (6, n),
        "M_a": (n, n),
    }


class ChainLevels:
    """Levels over x = [qdd_m, qdd_a, constraint torques], see csrc/chain.h.

    The motors' torques, where they are known; set A of the manipulator; sums of joints; one level a point;
    set A of the twin; what gives way to pushes, where something does; coupling; set B of the manipulator; set
    B of the twin; the twin's dynamics. Under the printed rule the range of the constraint torques and their
    size follow; under Gauss's principle the posture, where the coupling leaves one free.

    Table II has the coupling first. Here limits outrank it: where those of manipulator and twin contradict
    each other, the handle leaves the twin for a while, and neither passes its limits.

    The inputs stay with their owners, who write them in place; ``assemble`` reads them where they are.

    Attributes:
        levels: always the same objects.
        coupling_level: index of the coupling of handle and twin.
        range_level: index of the level with the range of the constraint torques (printed rule).
        safe_levels: how many levels keep the machine inside its limits; the rest shape what is felt.
        stop_levels: those of a stop: the limits, without coupling and compliance, and then ``braking``.
        kept: indices among ``levels`` of all of those but ``braking``.
        braking: accelerations of manipulator and twin that come nearest to rest, (m + n,).
        error: from H to E after ``assemble``: translation and rotation vector in B, (6,) [m, rad].
        active: which limits are active, a flag word for each joint of twin and manipulator, sum and
            direction of a point, in that order.
        spent: which motors give all they are admitted, after ``detect``, (m,).
        posture: acceleration that the manipulator takes where nothing else decides, (m,).
    """

    def __init__(
        self,
        inputs: Mapping[str, Array],
        manipulator: Limits,
        twin: Limits,
        sums: Sequence[JointSum],
        points: Sequence[BoxedPoint],
        gains: Gains,
        horizons: Horizons,
        dt: float,
        rule: Rule = "torques",
        directions: Sequence[int] = ALL_DIRECTIONS,
        held: NDArray[np.uint8] | None = None,
        ability: Ability | None = None,
        compliance: Compliance | None = None,
    ) -> None:
        """The inputs are those of ``input_shapes``, each a C-contiguous float64 array.

        ``held``, (n,): what locks do to the twin's joints now, each FREE, CAUGHT or LOCKED, (31). Where it is
        known what the motors can give, no more is asked of them, and what moves towards a limit counts on no
        more to brake. What gives way does so within those limits, and takes the twin along: coupling and
        twin come after it.

        Raises:
            BindError: for inputs or limits of another shape.
            ValueError: for constraint torques on a manipulator whose coupling cannot be inverted.
        """
        m, n = self.m, self.n = manipulator.n, twin.n
        _check(m, n, sums, rule, directions)
        limits = n + m + len(sums) + 3 * len(points)
        torques = limits if rule == "torques" else 0
        self.dim = m + n + torques
        c = self._c = ffi.new("chain *")
        self._sizes = {"dim": self.dim}
        c.m, c.n, c.torques, c.dt = m, n, torques, dt
        c.rows = len(directions)
        for i, direction in enumerate(directions):
            c.direction[i] = direction
        c.viability_horizon, c.point_horizon = horizons.viability, horizons.point
        for i in range(3):
            c.k_p[i], c.k_p[3 + i] = gains.p_translation, gains.p_rotation
            c.k_d[i], c.k_d[3 + i] = gains.d_translation, gains.d_rotation
        bind(lib, c, manipulator=_rows(manipulator), twin=_rows(twin), held=held)
        bind(lib, c, **{name: inputs[name] for name in input_shapes(m, n)})
        self._bind_sums(sums)
        self._bind_points(points)
        self.error = self._array("error", 6)
        self.active: NDArray[np.uint8] = np.zeros(limits, np.uint8)
        self._active = pointer(self.active, "unsigned char", limits)
        self.spent: NDArray[np.uint8] = np.zeros(m, np.uint8)
        self._spent = pointer(self.spent, "unsigned char", m)
        self._x: Array | None = None
        self._x_pointer = ffi.NULL
        self.posture = np.zeros(m)
        self._posture = pointer(self.posture, "double", m)
        self._home: Array | None = None
        self._home_pointer: object = None
        self._motors = [self._torque_level(ability)] if ability else []
        self._giving = [self._compliance_level(compliance)] if compliance else []
        first = 3 + len(points) + len(self._motors) + len(self._giving)
        self.coupling_level, self.safe_levels, self.range_level = first, first + 3, first + 4
        self.levels = self._levels()
        self.braking = np.zeros(m + n)
        come_to_rest = Level(A=np.eye(m + n, self.dim), b=self.braking)
        shaping = range(first - len(self._giving), first + 1)
        self.kept = [i for i in range(self.safe_levels) if i not in shaping]
        self.stop_levels = (*(self.levels[i] for i in self.kept), come_to_rest)

    def assemble(self) -> bool:
        """Write the levels from the inputs; False where they cannot be formed (levels unusable)."""
        return bool(lib.chain_assemble(self._c, HOMING) == 0)

    def assemble_stop(self) -> bool:
        """Write the levels of a stop, which does not return from outside, but for ``braking``."""
        self._c.homing = 0.0
        return bool(lib.chain_limits(self._c) == 0)

    def draw(self, home: Array, stiffness: float, damping: float) -> None:
        """Let ``posture`` draw the manipulator home, (m,), as with springs [1/s^2] and dampers [1/s]."""
        if home is not self._home:  # bound once: it always comes in the same array
            self._home, self._home_pointer = home, pointer(home, "const double", self.m, name="home")
        lib.chain_draw(self._c, self._home_pointer, stiffness, damping, self._posture)

    def outline(self) -> list[tuple[str, str]]:
        """Name of every level, and the unit of its slack."""
        motion = "rad/s^2, m/s^2"
        torques = [("torques of the motors", "N m, N")] if self._motors else []
        sums = [("limits of joint sums", motion)]
        giving = [("links give way", motion)] if self._giving else []
        points = [
            (f"box of point {k + 1}" if len(self._boxes) > 1 else "box", "m/s^2")
            for k in range(len(self._boxes))
        ]
        found = [
            *torques,
            ("joints: position, speed", motion),
            *sums,
            *points,
            ("twin: position, speed", motion),
            *giving,
            ("handle on twin", "m/s^2, rad/s^2"),
            ("joints: braking", motion),
            ("twin: braking", motion),
        ]
        if self._c.torques:
            return [
                *found,
                ("twin: dynamics", "N, N m"),
                ("constraints: sign", "N, N m"),
                ("constraints: size", "N, N m"),
            ]
        posture = [("posture", motion)] if len(self.levels) > len(found) + 1 else []
        return [*found, ("twin: dynamics", "sqrt(kg) m/s^2"), *posture]

    def set_range(self) -> None:
        """Write the bounds of level 10 from ``active``, (26) and (31)."""
        lib.chain_range(self._c, self._active)

    def detect(self, x: Array) -> int:
        """Add the limits that x, (dim,), reaches to ``active``; how many were new."""
        if x is not self._x:
            self._bind_x(x)
        lib.chain_spend(self._c, self._x_pointer, REACHED, self._spent)
        return int(lib.chain_detect(self._c, self._x_pointer, REACHED, self._active))

    def settle(self, x: Array) -> None:
        """Only the limits that x, (dim,), reaches are active from now on."""
        if x is not self._x:
            self._bind_x(x)
        lib.chain_settle(self._c, self._x_pointer, REACHED, self._active, self._spent)

    def _bind_x(self, x: Array) -> None:
        """Once: the solver always answers in the same array."""
        self._x, self._x_pointer = x, pointer(x, "const double", self.dim, name="x")

    def _array(self, name: str, *shape: int) -> Array:
        array = np.zeros(shape)
        bind(lib, self._c, self._sizes, **{name: array})
        return array

    def _bind_sums(self, sums: Sequence[JointSum]) -> None:
        self._c.sums = len(sums)
        self._weight = self._array("weight", len(sums), self.m)
        lower, upper = self._array("sum_lower", len(sums)), self._array("sum_upper", len(sums))
        for k, joint_sum in enumerate(sums):
            self._weight[k], lower[k], upper[k] = joint_sum.weight, joint_sum.lower, joint_sum.upper

    def _bind_points(self, points: Sequence[BoxedPoint]) -> None:
        structs = ffi.new("chain_point[]", len(points))
        self._c.points = len(points)
        bind(lib, self._c, point=structs)
        self._boxes: list[tuple[Array, Array, Array]] = []
        for k, (struct, point) in enumerate(zip(structs, points, strict=True)):
            struct.lower, struct.upper = list(map(float, point.lower)), list(map(float, point.upper))
            C, lb, ub = np.zeros((3, self.dim)), np.zeros(3), np.zeros(3)
            sizes = {"m": self.m, **self._sizes}
            bind(lib, structs, sizes, k, x=point.position, J=point.J, drift=point.drift, C=C, lb=lb, ub=ub)
            self._boxes.append((C, lb, ub))

    def _torque_level(self, ability: Ability) -> Level:
        sizes = {"m": self.m, **self._sizes}
        inputs = {name: getattr(ability, name) for name in ("inertia", "load", "feedback", "least", "most")}
        C, lb, ub = np.zeros((self.m, self.dim)), np.zeros(self.m), np.zeros(self.m)
        bind(lib, self._c, sizes, **inputs, C_torque=C, lb_torque=lb, ub_torque=ub)
        return Level(C=C, lb=lb, ub=ub)

    def _compliance_level(self, compliance: Compliance) -> Level:
        return Level(C=np.eye(self.m, self.dim), lb=compliance.least, ub=compliance.most)

    def _levels(self) -> tuple[Level, ...]:
        m, n, dim = self.m, self.n, self.dim
        rows, torques = self._c.rows, self._c.torques
        unit = np.eye(dim)
        manipulator, twin, alpha = unit[:m], unit[m : m + n], unit[m + n :]
        sums = np.zeros((len(self._weight), dim))
        sums[:, :m] = self._weight
        dynamics = self._array("A9", n, dim)
        if torques:
            dynamics[:, m : m + n] = np.eye(n)

        def bounds(level: int, rows: int) -> dict[str, Array]:
            return {"lb": self._array(f"lb{level}", rows), "ub": self._array(f"ub{level}", rows)}

        levels = [
            *self._motors,
            Level(C=manipulator, **bounds(2, m)),
            Level(C=sums, **bounds(3, len(sums))),
            *(Level(C=C, lb=lb, ub=ub) for C, lb, ub in self._boxes),
            Level(C=twin, **bounds(6, n)),
            *self._giving,
            Level(A=self._array("A1", rows, dim), b=self._array("b1", rows)),
            Level(C=manipulator, **bounds(7, m)),
            Level(C=twin, **bounds(8, n)),
            Level(A=dynamics, b=self._array("b9", n)),
        ]
        if torques:
            levels += [Level(C=alpha, **bounds(10, torques)), Level(A=alpha, b=np.zeros(torques))]
        elif m > rows:
            levels.append(Level(A=manipulator, b=self.posture))
        return tuple(levels)


def _rows(limits: Limits) -> object:
    rows = ffi.new("bounds_limits[]", limits.n)
    for row, *values in zip(
        rows, limits.lower, limits.upper, limits.velocity, limits.acceleration, strict=True
    ):
        row.lower, row.upper, row.velocity, row.acceleration = map(float, values)
    return rows


def _check(m: int, n: int, sums: Sequence[JointSum], rule: Rule, directions: Sequence[int]) -> None:
    if not 1 <= m <= lib.CHAIN_MAX_JOINTS:
        raise ValueError(f"a manipulator of {m} joints; 1 to {lib.CHAIN_MAX_JOINTS} are supported")
    if not 1 <= n <= lib.CHAIN_MAX_DOF:
        raise ValueError(f"a twin of {n} joints; 1 to {lib.CHAIN_MAX_DOF} are supported")
    if not directions or sorted(set(directions)) != list(directions) or not set(directions) <= set(range(6)):
        raise ValueError(f"directions {list(directions)}; give some of 0 to 5 in rising order")
    if rule == "torques" and (m, len(directions)) != (6, 6):
        raise ValueError(
            f"{m} joints coupled in {len(directions)} directions; constraint torques need six of both, "
            "take Gauss's principle"
        )
    for joint_sum in sums:
        if len(joint_sum.weight) != m:
            raise ValueError(f"a sum of {len(joint_sum.weight)} joints; the manipulator has {m}")
