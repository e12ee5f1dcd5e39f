"""How far a commanded twin is from the constrained multibody system, which pinocchio computes anew.

The system: the twin's equation of motion (9), its end on the handle (12), and the limits that are tight as
constraints. Nothing of the controller's matrices is used but the accelerations that the limits allow.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ..control.chain import Gains
from ..control.chain_twin import ChainTwin, Mechanism
from ..control.force_control import ForceControl
from ..models import Array, Robot

TIGHT = 1e-6
"""A limit is tight within this times (1 + |bound|)."""
FLOOR = 0.05
"""Accelerations below this count as this large [rad/s^2 or m/s^2]: at rest nothing is relative."""
PULLING = 1e-3
"""Part of the largest constraint force that one may pull where it should push: rounding."""


@dataclass(frozen=True, slots=True)
class Judgement:
    """One tick.

    Attributes:
        deviation: largest of the joints', as a share of the largest acceleration, free or constrained.
        tight: how many limits were.
        pulling: whether one of them pulled where a limit can only push; False where limits depend on each
            other, so that what each of them contributes is open.
    """

    deviation: float
    tight: int
    pulling: bool


class Judge:
    """Judges ticks of a force control between ``optimise`` and ``advance``."""

    def __init__(
        self,
        control: ForceControl,
        manipulator: Robot,
        robot: Robot,
        end: str,
        mechanism: Mechanism,
        gravity: float,
        gains: Gains,
    ) -> None:
        """The chain that the twin is made of: links, frame of its end, drives; the gains of its coupling."""
        assert isinstance(control.twin, ChainTwin)
        self._control, self._twin, self._manipulator = control, control.twin, manipulator
        self._robot, self._mechanism = Robot(robot.model.copy()), mechanism
        self._end, self._handle = robot.frame(end), manipulator.frame("handle")
        self._gains = gains
        self._gravity = np.array([0.0, 0.0, -gravity])

    def judge(self, wrench: Array, share: float = 1.0) -> Judgement:
        """The tick under the operator's wrench (6,) at the handle in B [N, N m].

        ``share`` is that of what drives the chain besides: 0 to 1, while it fades in.
        """
        control, twin = self._control, self._twin
        m, n = control.arm.n, len(twin.q)
        M, force, J_a, drift_a = self._dynamics(wrench, share)
        free = np.linalg.solve(M, force)
        A, b = self._coupling(J_a, drift_a)
        C, c, sides = self._tight()
        rows = np.vstack([A, C])
        k = len(rows)
        system = np.zeros((m + n + k, m + n + k))
        system[m : m + n, m : m + n] = M
        system[: m + n, m + n :] = rows.T
        system[m + n :, : m + n] = rows
        right = np.concatenate([np.zeros(m), force, b, c])
        solution = np.linalg.lstsq(system, right, rcond=1e-12)[0]
        expected, pushes = solution[m : m + n], solution[m + n + len(A) :] * sides
        told = control.solution.x[m : m + n]
        scale = max(np.abs(expected).max(), np.abs(free).max(), FLOOR)
        most = max(np.abs(solution[m + n :]).max(initial=0.0), 1e-9)
        unique = np.linalg.matrix_rank(rows) == k
        pulling = unique and bool((pushes[sides != 0.0] < -PULLING * most).any())
        return Judgement(float(np.abs(told - expected).max() / scale), len(C), pulling)

    def _dynamics(self, wrench: Array, share: float) -> tuple[Array, Array, Array, Array]:
        """Inertia, generalised force, and the end's Jacobian and drift in B."""
        robot, mechanism, twin = self._robot, self._mechanism, self._twin
        model, data = robot.model, robot.data
        q, v = robot.configuration(twin.q), twin.qd
        R = twin.base[:3, :3]
        model.gravity.linear = R.T @ (share * self._gravity)
        M = np.triu(pin.crba(model, data, q))
        M = M + np.triu(M, 1).T + np.diag(mechanism.inertia)
        bias = pin.nonLinearEffects(model, data, q, v)
        frame = pin.LOCAL_WORLD_ALIGNED
        J = pin.computeFrameJacobian(model, data, q, self._end, frame)
        pin.forwardKinematics(model, data, q, v, np.zeros(robot.nv))
        drift = pin.getFrameClassicalAcceleration(model, data, self._end, frame)
        J_a = np.vstack([R @ J[:3], R @ J[3:]])
        spring = mechanism.stiffness * (mechanism.rest - twin.q)
        driven = share * (spring + mechanism.drive)
        force = J_a.T @ wrench - bias - mechanism.damping * v + driven
        for detent in mechanism.detents:
            x = (twin.q[detent.joint] - detent.at) / detent.width
            force[detent.joint] -= share * detent.torque * x * np.exp((1.0 - x * x) / 2.0)
        return M, force, J_a, np.concatenate([R @ drift.linear, R @ drift.angular])

    def _coupling(self, J_a: Array, drift_a: Array) -> tuple[Array, Array]:
        """(12): J_m qdd_m - J_a qdd_a = s - drift_H + drift_E."""
        control, twin, robot = self._control, self._twin, self._manipulator
        model, data, frame = robot.model, robot.data, pin.LOCAL_WORLD_ALIGNED
        q = robot.configuration(control.q)
        J = pin.computeFrameJacobian(model, data, q, self._handle, frame)
        pin.forwardKinematics(model, data, q, control.qd, np.zeros(robot.nv))
        drift = pin.getFrameClassicalAcceleration(model, data, self._handle, frame)
        place = pin.updateFramePlacement(model, data, self._handle)
        base = control.base
        x, v, a = place.translation.copy(), J @ control.qd, np.concatenate([drift.linear, drift.angular])
        x[:2] += base.q
        v[:2] += base.qd
        a[:2] += base.qdd
        turn = place.rotation @ pin.log3(place.rotation.T @ twin.rotation)
        error = np.concatenate([twin.position - x, turn])
        gains = self._gains
        k_p = np.repeat([gains.p_translation, gains.p_rotation], 3)
        k_d = np.repeat([gains.d_translation, gains.d_rotation], 3)
        sync = k_p * error + k_d * (twin.twist - v)
        return np.hstack([J, -J_a]), sync - a + drift_a

    def _tight(self) -> tuple[Array, Array, NDArray[np.float64]]:
        """Rows and bounds of the limits that are tight, and their sides: 1 upper, -1 lower, 0 both.

        One that others of a higher level do not let keep its bound holds where it has yielded to, on both
        sides: the twin's dynamics is a level below, and may change none of that.
        """
        control = self._control
        x = control.solution.x
        rows: list[Array] = []
        bounds: list[float] = []
        sides: list[float] = []
        size = control.arm.n + len(self._twin.q)
        limits = [level for level in control.levels if level.C.size and level.C[:, :size].any()]
        for level in limits:  # the others are of constraint torques
            for row, lower, upper in zip(level.C, level.lb, level.ub, strict=True):
                y = float(row @ x)
                below, above = TIGHT * (1 + abs(lower)), TIGHT * (1 + abs(upper))
                low, high = y <= lower + below, y >= upper - above
                if (low or high) and not any(np.array_equal(row[:size], other) for other in rows):
                    yields = y < lower - below or y > upper + above
                    rows.append(row[:size])
                    bounds.append(y if yields else lower if low else upper)
                    sides.append(0.0 if yields else float(high) - float(low))
        return np.array(rows).reshape(-1, size), np.array(bounds), np.array(sides)
