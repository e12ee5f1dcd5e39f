"""Whole-body control of a humanoid on its feet, Talos of example-robot-data, in simulation: a recording.

Variables are the accelerations of the floating base and the joints, and three forces at each corner of both
soles. Levels, most important first: dynamics of the base, limits of the torques, friction pyramids, feet that
stay, limits of the joints, centre of mass with a hand, posture, distribution of the forces. Targets jump.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..hqp import Level, Solver
from ..hqp.certificate import slack_norms
from .recorded import PARTS, BenchError, Recording

Array = NDArray[np.float64]
URDF = "talos_reduced.urdf"
FEET = ("leg_left_6_joint", "leg_right_6_joint")
HAND = "arm_right_7_joint"
CORNERS = np.array([[x, y, -0.107] for x in (-0.1, 0.1) for y in (-0.06, 0.06)])
FRICTION, LEAST_FORCE, MOST_FORCE = 0.5, 0.0, 1000.0
DT_S = 1e-3
JUMP_EVERY = 150
"""Ticks between jumps of the targets."""
FASTEST = 8.0
"""A joint velocity (rad/s) at which the robot has left what can be controlled: it stands up again."""


def _urdf() -> str:
    try:
        found = [path for path in files("example-robot-data") or () if path.name == URDF]
        return str(found[0].locate())
    except (PackageNotFoundError, IndexError) as error:
        mend = "install hapticd[bench]"
        raise BenchError(f"the humanoid needs {URDF} of example-robot-data; {mend}") from error


class Humanoid:
    """The robot, its state and its targets.

    Args:
        seed: of all that is random.
    """

    def __init__(self, seed: int) -> None:
        import pinocchio as pin

        self.pin, self.rng = pin, np.random.default_rng(seed)
        self.model: Any = pin.buildModelFromUrdf(_urdf(), pin.JointModelFreeFlyer())
        self.data: Any = self.model.createData()
        self.feet = [self.model.getJointId(name) for name in FEET]
        self.hand = self.model.getJointId(HAND)
        self.nv, self.contacts = self.model.nv, len(self.feet) * len(CORNERS)
        self.n = self.nv + 3 * self.contacts
        self.torque = np.maximum(self.model.effortLimit[6:], 1.0)
        self.stand()

    def stand(self) -> None:
        """Knees bent, at rest."""
        self.q = self.pin.neutral(self.model)
        for side in ("left", "right"):
            for joint, angle in ((3, -0.4), (4, 0.8), (5, -0.4)):
                self.q[self.model.joints[self.model.getJointId(f"leg_{side}_{joint}_joint")].idx_q] = angle
            for joint, angle in ((2, 0.3 if side == "left" else -0.3), (4, -1.0)):
                self.q[self.model.joints[self.model.getJointId(f"arm_{side}_{joint}_joint")].idx_q] = angle
        self.v = np.zeros(self.nv)
        self.rest = self.q.copy()
        self.pin.forwardKinematics(self.model, self.data, self.q)
        self.centre0 = self.pin.centerOfMass(self.model, self.data, self.q).copy()
        self.hand0 = self.data.oMi[self.hand].translation.copy()
        self.jump()

    def jump(self) -> None:
        """Other targets, some of them out of reach."""
        rng = self.rng
        self.centre = self.centre0 + rng.normal(size=3) * rng.choice([0.0, 0.02, 0.05])
        self.reach = self.hand0 + rng.normal(size=3) * rng.choice([0.0, 0.1, 0.3])
        self.posture = self.rest[7:] + rng.normal(size=self.nv - 6) * rng.choice([0.0, 0.1, 0.4])
        self.share = rng.choice([0.5, 0.5, 0.2, 0.0])

    def step(self, acceleration: Array) -> None:
        """One tick with this acceleration, (nv,)."""
        self.v = self.v + DT_S * acceleration
        self.q = self.pin.integrate(self.model, self.q, DT_S * self.v)
        if not np.isfinite(self.v).all() or np.abs(self.v).max() > FASTEST:
            self.stand()

    def levels(self) -> list[Level]:
        """The problem of this tick."""
        pin, model, data = self.pin, self.model, self.data
        pin.forwardKinematics(model, data, self.q, self.v, np.zeros(self.nv))
        pin.computeJointJacobians(model, data, self.q)
        mass = pin.crba(model, data, self.q)
        mass = np.triu(mass) + np.triu(mass, 1).T
        bias = pin.nonLinearEffects(model, data, self.q, self.v)
        forces = np.vstack(list(self._corner_jacobians()))
        dynamics = np.hstack([mass, -forces.T])
        joints = self.nv - 6
        return [
            Level(A=dynamics[:6], b=-bias[:6]),
            Level(C=dynamics[6:], lb=-self.torque - bias[6:], ub=self.torque - bias[6:]),
            self._pyramids(),
            self._feet_stay(),
            self._joint_limits(joints),
            self._tasks(),
            Level(A=self._wide(np.eye(self.nv)[6:]), b=self._towards(self.posture, self.q[7:], 60.0)),
            Level(A=np.eye(self.n)[self.nv :], b=self._even_forces()),
        ]

    def _wide(self, rows: Array) -> Array:
        """Rows over the accelerations as rows over all variables."""
        return np.hstack([rows, np.zeros((len(rows), self.n - self.nv))])

    def _towards(self, target: Array, now: Array, stiffness: float) -> Array:
        return np.asarray(stiffness * (target - now) - 2.0 * np.sqrt(stiffness) * self.v[6:])

    def _jacobian(self, joint: int) -> tuple[Array, Array]:
        """Jacobian of a joint's frame along the world's axes, (6, nv), and its acceleration at rest, (6,)."""
        frame = self.pin.LOCAL_WORLD_ALIGNED
        drift = self.pin.getClassicalAcceleration(self.model, self.data, joint, frame)
        return self.pin.getJointJacobian(self.model, self.data, joint, frame), drift.vector

    def _corner_jacobians(self) -> Iterator[Array]:
        for foot in self.feet:
            jacobian, _ = self._jacobian(foot)
            for corner in CORNERS:
                yield jacobian[:3] - self.pin.skew(self.data.oMi[foot].rotation @ corner) @ jacobian[3:]

    def _pyramids(self) -> Level:
        normal, one = np.array([0.0, 0.0, 1.0]), np.eye(3)
        pyramid = np.array([sign * one[k] - FRICTION * normal for k in (0, 1) for sign in (-1.0, 1.0)])
        rows = np.zeros((5 * self.contacts, self.n))
        for contact in range(self.contacts):
            first = self.nv + 3 * contact
            rows[5 * contact : 5 * contact + 5, first : first + 3] = np.vstack([pyramid, normal])
        lb = np.tile([-np.inf] * 4 + [LEAST_FORCE], self.contacts)
        return Level(C=rows, lb=lb, ub=np.tile([0.0] * 4 + [MOST_FORCE], self.contacts))

    def _feet_stay(self) -> Level:
        rows, b = [], []
        for foot in self.feet:
            jacobian, drift = self._jacobian(foot)
            rows.append(self._wide(jacobian))
            b.append(-drift - 20.0 * jacobian @ self.v)
        return Level(A=np.vstack(rows), b=np.concatenate(b))

    def _joint_limits(self, joints: int) -> Level:
        """Limits of position and velocity, over the next 50 ms, as accelerations."""
        horizon, model = 0.05, self.model
        now, velocity = self.q[7:], self.v[6:]
        lb = np.maximum(
            2.0 * (model.lowerPositionLimit[7:] - now - horizon * velocity) / horizon**2,
            (-model.velocityLimit[6:] - velocity) / horizon,
        )
        ub = np.minimum(
            2.0 * (model.upperPositionLimit[7:] - now - horizon * velocity) / horizon**2,
            (model.velocityLimit[6:] - velocity) / horizon,
        )
        middle = 0.5 * (lb + ub)
        lb, ub = np.minimum(lb, middle), np.maximum(ub, middle)
        return Level(C=self._wide(np.eye(self.nv)[6:]), lb=np.minimum(lb, ub), ub=ub)

    def _tasks(self) -> Level:
        pin, model, data = self.pin, self.model, self.data
        centre = pin.centerOfMass(model, data, self.q, self.v, np.zeros(self.nv)).copy()
        speed, drift = data.vcom[0].copy(), data.acom[0].copy()
        of_centre = pin.jacobianCenterOfMass(model, data, self.q)
        of_hand, hand_drift = self._jacobian(self.hand)
        hand = data.oMi[self.hand].translation
        b_centre = 40.0 * (self.centre - centre) - 12.0 * speed - drift
        b_hand = 60.0 * (self.reach - hand) - 15.0 * of_hand[:3] @ self.v - hand_drift[:3]
        rows = self._wide(np.vstack([of_centre, of_hand[:3]]))
        return Level(A=rows, b=np.concatenate([b_centre, b_hand]))

    def _even_forces(self) -> Array:
        weight = -9.81 * float(self.data.mass[0]) / len(CORNERS)
        target = np.zeros((self.contacts, 3))
        target[: len(CORNERS), 2] = -self.share * weight
        target[len(CORNERS) :, 2] = -(1.0 - self.share) * weight
        return target.ravel()


def humanoid(ticks: int, seed: int = 1) -> Recording:
    """Simulate so many ticks, the robot moving as the warm solver says.

    Args:
        ticks: at 1 kHz.
        seed: of the targets.

    Returns:
        The problems, with the warm solver's answers.

    Raises:
        BenchError: example-robot-data is not installed.
    """
    robot = Humanoid(seed)
    solver: Solver | None = None
    problems, points, norms = [], [], []
    for tick in range(ticks):
        if tick % JUMP_EVERY == 0:
            robot.jump()
        levels = robot.levels()
        solver = solver or Solver(robot.n, [level.rows for level in levels])
        x = solver.solve(levels).x.copy()
        problems.append(levels)
        points.append(x)
        norms.append(slack_norms(levels, x))
        robot.step(x[: robot.nv])
    parts = [
        tuple(np.array([getattr(levels[p], name) for levels in problems]) for name in PARTS)
        for p in range(len(problems[0]))
    ]
    return Recording("humanoid", np.zeros(ticks, dtype=np.int32), np.array(points), np.array(norms), parts)
