"""Hierarchical force control: renders a digital twin with the manipulator (HapticGiant, section VI)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from ..hqp import Solution, Solver, Status
from ..models import Array, Robot
from ._kernels import ffi, lib
from .chain import LEVEL_OF_RANGE, TWIN_START, ChainLevels, Gains, Horizons
from .limits import Limits
from .serial import Frame, SerialChain
from .twin import Twin

MAX_REDETECTIONS = 5
"""Solves a tick under the re-detecting rule; it is monotone, and 5 were the most ever seen."""
MAX_ITERATIONS = 64
"""Of one solve: the bound on its time. Recorded sessions needed 49 at most."""
SAFE_LEVELS = 8
"""Levels that keep the machine inside its limits; those after them shape what the operator feels."""

Detection = Literal["previous", "redetect"]


class PpuMotion(Protocol):
    """The PPU's motion, a known disturbance: position, velocity, acceleration, (2,) each [m, s]."""

    q: Array
    qd: Array
    qdd: Array


class ForceControl:
    """Keeps the commanded state of manipulator and twin and advances both by one tick at a time.

    A tick is ``prepare``, ``assemble``, ``optimise`` (or ``brake``), ``advance``.

    Which constraint torques may act follows from the limits that are active, (26). ``detection`` says how
    that is decided: ``previous`` takes the limits of the last tick's optimum (the paper's rule),
    ``redetect`` starts from those and solves again in the same tick until no further limit is reached.

    Attributes:
        arm: kinematics at the commanded state; handle: of it, relative to the PPU.
        twin: the rendered mechanism.
        q, qd, qdd: commanded state of the manipulator, (6,) [rad, s].
        solution: of the last solve.
        solves, iterations: of the last tick.
    """

    def __init__(
        self,
        manipulator: Robot,
        limits: Limits,
        twin: Twin,
        ppu: PpuMotion,
        tilt: tuple[float, float],
        box: tuple[Sequence[float], Sequence[float]],
        gains: Gains,
        detection: Detection,
        dt: float,
        horizons: Horizons,
    ) -> None:
        self.arm = SerialChain(manipulator, ["handle", "joint_4"])
        handle, elbow = self.arm.frames
        self.handle: Frame = handle
        self.twin = twin
        self.detection: Detection = detection
        self.q, self.qd, self.qdd = np.zeros(6), np.zeros(6), np.zeros(6)
        self.solves = self.iterations = 0
        self._dt, self._limits = dt, limits
        inputs = {
            **{"q": self.q, "qd": self.qd, "J": handle.J, "J_elbow": elbow.J},
            **{"drift": handle.drift, "drift_elbow": elbow.drift},
            **{"x_H": handle.position, "R_H": handle.rotation, "x_elbow": elbow.position},
            **{"q_p": ppu.q, "qd_p": ppu.qd, "qdd_p": ppu.qdd},
            **{"q_a": twin.q, "qd_a": twin.qd, "J_a": twin.J, "drift_a": twin.drift, "M_a": twin.M},
            **{"force_a": twin.force, "x_E": twin.position, "R_E": twin.rotation, "v_E": twin.twist},
        }
        self.arm.bind(self.q, self.qd)
        self._ppu = ppu
        self._chain = ChainLevels(inputs, limits, twin.limits, tilt, box, gains, horizons, dt)
        rows = [level.rows for level in self._chain.levels]
        self._solver = Solver(self._chain.dim, rows, max_iterations=MAX_ITERATIONS)
        self.solution: Solution = self._solver.solution
        self._qdd_twin = np.zeros(twin.limits.n)
        self._twin_part = slice(TWIN_START, TWIN_START + twin.limits.n)
        self._motion = [ffi.from_buffer("double[]", array) for array in (self.q, self.qd, self.qdd)]

    @property
    def active(self) -> NDArray[np.uint8]:
        """Flag words of the active limits, in the order of the constraint torques, (n + 13,)."""
        return self._chain.active

    @property
    def coupling_error(self) -> Array:
        """From the handle to the twin's end effector: translation and rotation vector in B, (6,)."""
        return self._chain.error

    def reset(self, q: Array) -> None:
        """Rest at a posture (6,) [rad]; the twin's E is put on the handle."""
        self.q[:], self.qd[:], self.qdd[:] = q, 0.0, 0.0
        self.arm.update()
        position = self.handle.position.copy()
        position[:2] += self._ppu.q
        self.twin.reset(position, self.handle.rotation)
        self._chain.active[:] = 0
        self._solver.reset()

    def prepare(self, wrench: Array) -> None:
        """Kinematics and dynamics of this tick.

        Args:
            wrench: of the operator at the handle in B, (6,) [N, N m].
        """
        self.arm.update()
        self.twin.update(wrench)

    def assemble(self) -> bool:
        """Form the levels of this tick; False where they cannot be formed (a singular posture)."""
        return self._chain.assemble()

    def optimise(self) -> bool:
        """Solve the levels; False where the solver does not stand by its answer.

        Without a full answer the levels up to SAFE_LEVELS still hold, or else both chains brake.
        """
        chain = self._chain
        chain.set_range()
        self.solution = self._solver.solve(chain.levels)
        self.solves, self.iterations = 1, self.solution.iterations
        if self.detection == "redetect":
            while chain.detect(self.solution.x) and self.solves < MAX_REDETECTIONS:
                chain.set_range()
                self.solution = self._solver.resolve(chain.levels, LEVEL_OF_RANGE)
                self.solves += 1
                self.iterations += self.solution.iterations
        chain.active[:] = 0  # only what this optimum reaches starts the next tick as active
        chain.detect(self.solution.x)
        solved = self.solution.status == Status.SOLVED
        if not solved and self.solution.levels_done < SAFE_LEVELS:
            self.brake()
        else:
            self.qdd[:] = self.solution.x[:TWIN_START]
            self._qdd_twin[:] = self.solution.x[self._twin_part]
        return solved

    def brake(self) -> None:
        """Accelerations that stop manipulator and twin as fast as they are rated for."""
        manipulator, twin = (
            (self.qdd, self.qd, self._limits),
            (self._qdd_twin, self.twin.qd, self.twin.limits),
        )
        for qdd, qd, limits in (manipulator, twin):
            np.multiply(qd, -1.0 / self._dt, out=qdd)
            np.minimum(qdd, limits.acceleration, out=qdd)
            np.maximum(qdd, -limits.acceleration, out=qdd)

    def advance(self) -> None:
        """Integrate manipulator and twin over one tick under constant acceleration."""
        lib.serial_advance(self.arm.n, *self._motion, self._dt)
        self.twin.integrate(self._qdd_twin, self._dt)
