"""Hierarchical force control: renders a digital twin with the manipulator (HapticGiant, section VI)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from ..binding import pointer
from ..hqp import Level, Slacks, Solution, Solver, Status
from ..models import Array, Robot
from ._kernels import lib
from .ability import Ability
from .chain import ALL_DIRECTIONS, BoxedPoint, ChainLevels, Gains, Horizons, JointSum, Rule
from .compliance import Compliance
from .copies import Copies
from .limits import Limits
from .serial import Frame, SerialChain
from .twin import Twin

MAX_REDETECTIONS = 5
"""Solves a tick under the re-detecting rule; it is monotone, and 5 were the most ever seen."""
MAX_ITERATIONS = 64
"""Iterations of one solve: the bound on its time. Recorded sessions needed 49 at most."""

LEAST_BRAKING = 0.2
"""Part of an acceleration that is left in a step, whatever a motor can give."""
SOFTENINGS = 3
"""Steps in which the accelerations of a stop are brought within the torques: joints load each other."""

Detection = Literal["previous", "redetect", "gauss"]


class BaseMotion(Protocol):
    """Motion of a base along x and y, a known disturbance: position, velocity, acceleration, (2,) [m, s]."""

    q: Array
    qd: Array
    qdd: Array


class FixedBase:
    """A base that does not move."""

    def __init__(self) -> None:
        self.q, self.qd, self.qdd = np.zeros(2), np.zeros(2), np.zeros(2)


@dataclass(frozen=True, slots=True)
class Posture:
    """What a manipulator with more joints than coupled directions does with the rest.

    Attributes:
        home: where it is drawn to, (m,) [rad or m].
        stiffness: [1/s^2]; damping: [1/s].
    """

    home: Array
    stiffness: float
    damping: float


@dataclass(frozen=True, slots=True)
class Box:
    """A frame of the manipulator and the box along the axes of B that its origin stays in [m]."""

    frame: str
    lower: Sequence[float]
    upper: Sequence[float]


class _Coupling:
    """What couples one twin to the handle: levels, and solvers that answer in the same arrays each time."""

    def __init__(self, twin: Twin, chain: ChainLevels, qdd: Array) -> None:
        """The arrays that hold its levels, and the accelerations of the manipulator, which it writes."""
        self.twin, self.chain = twin, chain
        m, n, count = chain.m, twin.limits.n, len(chain.levels)
        self.solver, self.stop_solver = (
            Solver(chain.dim, [level.rows for level in levels], max_iterations=MAX_ITERATIONS)
            for levels in (chain.levels, chain.stop_levels)
        )
        self.slacks = {
            self.solver: Slacks(self.solver.solution, count, range(count)),
            self.stop_solver: Slacks(self.stop_solver.solution, count, [*chain.kept, None]),
        }
        self.qdd = np.zeros(n)
        self.answer, self.stop_answer = (
            Copies(((x[:m], qdd), (x[m : m + n], self.qdd)))
            for x in (self.solver.solution.x, self.stop_solver.solution.x)
        )


class ForceControl:
    """Keeps the commanded state of manipulator and twin and advances both by one tick at a time.

    A tick is ``prepare``, ``assemble``, ``optimise`` (or ``brake``), ``advance``; in a stop ``stop`` (or
    ``brake``), ``advance``.

    Which constraint torques may act follows from the limits that are active, (26). ``detection`` says how
    that is decided: ``previous`` takes the limits of the last tick's optimum (the paper's rule),
    ``redetect`` starts from those and solves again in the same tick until no further limit is reached.
    ``gauss`` needs no such decision: the twin's acceleration deviates from the free one as little as the
    limits allow, in the metric of its inertia, so that constraint forces are the multipliers of the limits;
    what the motors can give is then a limit like the others.

    Attributes:
        arm: kinematics at the commanded state; handle: of it, relative to the PPU.
        twin: the rendered mechanism.
        ability: what the motors can give at this tick, to be filled between ``prepare`` and ``assemble``;
            None where the levels do not ask for it.
        compliance: what gives way to pushes; None where nothing does.
        base: what carries it.
        q, qd, qdd: commanded state of the manipulator, (m,) [rad or m, s].
        twins: those that can be rendered; rendered: index of ``twin`` among them.
        share: of its forces that move the twin, (1,).
        slowing: rate at which it is braked besides [1/s].
        solution: of the last solve.
        solves, iterations: of the last tick.
    """

    def __init__(
        self,
        manipulator: Robot,
        limits: Limits,
        twin: Twin | Sequence[Twin],
        sums: Sequence[JointSum],
        boxes: Sequence[Box],
        gains: Gains,
        detection: Detection,
        dt: float,
        horizons: Horizons,
        base: BaseMotion | None = None,
        directions: Sequence[int] = ALL_DIRECTIONS,
        handle: str = "handle",
        posture: Posture | None = None,
        limited: bool = False,
        compliance: Compliance | None = None,
    ) -> None:
        """The directions, 0 to 5, in which handle and twin are coupled; the frame that is the handle.

        Of several twins the first is rendered until ``exchange``.

        Without a posture to be drawn to, what the coupling leaves free is damped by nothing but limits.
        ``limited``: no more is asked of the motors than they can give. ``compliance``: what gives way, to be
        updated before ``assemble``.
        """
        names = list(dict.fromkeys([handle, *(box.frame for box in boxes)]))
        self.arm = SerialChain(manipulator, names)
        frames = dict(zip(names, self.arm.frames, strict=True))
        self.handle: Frame = frames[handle]
        self.detection: Detection = detection
        m = self.arm.n
        self.q, self.qd, self.qdd = np.zeros(m), np.zeros(m), np.zeros(m)
        base = self.base = base or FixedBase()
        self.solves = self.iterations = 0
        self.share, self.slowing = np.ones(1), 0.0
        self._dt, self._limits = dt, limits
        self._at = np.zeros(3)
        self.arm.bind(self.q, self.qd)
        points = [
            BoxedPoint(frame.position, frame.J, frame.drift, box.lower, box.upper)
            for box in boxes
            for frame in [frames[box.frame]]
        ]
        rule: Rule = "gauss" if detection == "gauss" else "torques"
        self.ability = Ability(m) if limited else None
        self.compliance = compliance
        self.twins = list(twin) if isinstance(twin, Sequence) else [twin]
        self._couplings = [
            _Coupling(
                each,
                ChainLevels(
                    _inputs((self.q, self.qd), self.handle, base, each),
                    *(limits, each.limits, sums, points, gains, horizons, dt, rule, directions, each.held),
                    ability=self.ability,
                    compliance=compliance,
                ),
                self.qdd,
            )
            for each in self.twins
        ]
        self._posture = posture
        self._motion = [pointer(array, "double", m) for array in (self.q, self.qd, self.qdd)]
        self._take(0)

    def _take(self, index: int) -> None:
        """Render a twin."""
        coupling = self._couplings[index]
        self.rendered, self.twin, self._chain = index, coupling.twin, coupling.chain
        self._solver, self._stop_solver = coupling.solver, coupling.stop_solver
        self.solution: Solution = self._solver.solution
        self._slacks, self._asked = coupling.slacks, self._solver
        self._qdd_twin = coupling.qdd
        self._answer, self._stop_answer = coupling.answer, coupling.stop_answer

    def exchange(self, index: int) -> None:
        """Render another twin from now on: its E is put, at rest, where the last one has it."""
        last = self.twin
        self._take(index)
        self.twin.reset(last.position.copy(), last.rotation.copy())
        self._forget()

    def _forget(self) -> None:
        """No limit of the twin is known to be active."""
        self._chain.active[:] = self._chain.spent[:] = 0
        self._solver.reset()
        self._stop_solver.reset()

    @property
    def active(self) -> NDArray[np.uint8]:
        """Flag words of the active limits, in the order of ``ChainLevels.active``."""
        return self._chain.active

    @property
    def spent(self) -> NDArray[np.uint8]:
        """Which motors gave all they are admitted in the last tick that was solved, (m,)."""
        return self._chain.spent

    @property
    def levels(self) -> Sequence[Level]:
        """The hierarchy of this tick, always the same objects."""
        return self._chain.levels

    def write_slack(self, slack: Array) -> None:
        """How far each level was from being met in the last solve, (levels,); 0 where a stop has none."""
        self._slacks[self._asked].write(slack)

    def outline(self) -> list[tuple[str, str]]:
        """Name of every level, and the unit of its slack."""
        return self._chain.outline()

    @property
    def coupling_error(self) -> Array:
        """From the handle to the twin's end effector: translation and rotation vector in B, (6,)."""
        return self._chain.error

    def reset(self, q: Array) -> None:
        """Rest at a posture (m,) [rad or m]; the twin's E is put on the handle."""
        self.q[:], self.qd[:], self.qdd[:] = q, 0.0, 0.0
        self.arm.update()
        self._place()
        self.twin.reset(self._at, self.handle.rotation)
        self._forget()

    def _place(self) -> None:
        """Where the base has carried the handle."""
        self._at[:] = self.handle.position
        self._at[:2] += self.base.q

    def prepare(self, wrench: Array, share: float = 1.0) -> None:
        """Kinematics and dynamics of this tick.

        Args:
            wrench: of the operator at the handle in B, (6,) [N, N m].
            share: of what drives the twin besides, 0 to 1, while it fades in.
        """
        self.arm.update()
        if self.twin.partial:
            self._place()
            self.twin.follow(self._at, self.handle.rotation)
        self.twin.update(wrench, share)
        if self.share[0] < 1.0:
            self.twin.force *= self.share
            self.twin.force -= self.slowing * (self.twin.M @ self.twin.qd)

    def assemble(self) -> bool:
        """Form the levels of this tick; False where they cannot be formed (a singular posture)."""
        if posture := self._posture:
            self._chain.draw(posture.home, posture.stiffness, posture.damping)
        return self._chain.assemble()

    def optimise(self) -> bool:
        """Solve the levels; False where the solver does not stand by its answer.

        Without a full answer the levels that keep the limits still hold, or else both chains brake.
        """
        chain, solution = self._chain, self._solve()
        chain.settle(solution.x)  # only what this optimum reaches starts the next tick as active
        solved = solution.status is Status.SOLVED
        if not solved and solution.levels_done < chain.safe_levels:
            self.brake()
        else:
            self._answer.update()
        return solved

    def _solve(self) -> Solution:
        chain, solver = self._chain, self._solver
        if self.detection != "gauss":
            chain.set_range()
        self._asked = solver
        self.solution = solution = solver.solve(chain.levels)
        self.solves, self.iterations = 1, solution.iterations
        if self.detection == "redetect":
            while chain.detect(self.solution.x) and self.solves < MAX_REDETECTIONS:
                chain.set_range()
                self.solution = self._solver.resolve(chain.levels, chain.range_level)
                self.solves += 1
                self.iterations += self.solution.iterations
        return self.solution

    def stop(self) -> bool:
        """Accelerations that come as near to rest as the limits allow while the base still moves.

        What is outside a limit stays where it comes to rest. The arm's kinematics, the base's motion and the
        ability are those of this tick.

        Returns:
            Whether the solver stands by its answer; if not, ``brake``.
        """
        chain = self._chain
        if not (self.ability and chain.assemble_stop()):
            return False
        self._rest()
        chain.braking[: self.arm.n], chain.braking[self.arm.n :] = self.qdd, self._qdd_twin
        self._asked = self._stop_solver
        self.solution = self._stop_solver.solve(chain.stop_levels)
        self.solves, self.iterations = 1, self.solution.iterations
        if self.solution.status != Status.SOLVED:
            return False
        chain.settle(self.solution.x)
        self._stop_answer.update()
        return True

    def brake(self) -> None:
        """Each joint stops for itself, as fast as it is rated for, and its motor can."""
        self._rest()
        if self.ability:
            self._soften(self.ability)

    def _rest(self) -> None:
        """Accelerations that stop manipulator and twin as fast as they are rated for."""
        manipulator, twin = (
            (self.qdd, self.qd, self._limits),
            (self._qdd_twin, self.twin.qd, self.twin.limits),
        )
        for qdd, qd, limits in (manipulator, twin):
            np.multiply(qd, -1.0 / self._dt, out=qdd)
            np.minimum(qdd, limits.acceleration, out=qdd)
            np.maximum(qdd, -limits.acceleration, out=qdd)

    def _soften(self, ability: Ability) -> None:
        """Brake each joint of the manipulator no harder than its motor can, while the others brake, too."""
        fixed = ability.load + ability.feedback
        for _ in range(SOFTENINGS):
            torque = ability.inertia @ self.qdd
            room = np.where(torque > 0.0, ability.most - fixed, fixed - ability.least)
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                share = np.where((room > 0.0) & (torque != 0.0), room / np.abs(torque), 1.0)
            self.qdd *= np.clip(share, LEAST_BRAKING, 1.0)

    def advance(self) -> None:
        """Integrate manipulator and twin over one tick under constant acceleration."""
        lib.serial_advance(self.arm.n, *self._motion, self._dt)
        self.twin.integrate(self._qdd_twin, self._dt)


def _inputs(state: tuple[Array, Array], handle: Frame, base: BaseMotion, twin: Twin) -> dict[str, Array]:
    """What the levels read each tick, by the names of ``ChainLevels``."""
    q, qd = state
    return {
        "q": q,
        "qd": qd,
        "J": handle.J,
        "drift": handle.drift,
        "x_H": handle.position,
        "R_H": handle.rotation,
        "q_p": base.q,
        "qd_p": base.qd,
        "qdd_p": base.qdd,
        "q_a": twin.q,
        "qd_a": twin.qd,
        "J_a": twin.J,
        "drift_a": twin.drift,
        "M_a": twin.M,
        "force_a": twin.force,
        "x_E": twin.position,
        "R_E": twin.rotation,
        "v_E": twin.twist,
    }
