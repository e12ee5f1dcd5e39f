"""A tick of an arm that renders a twin: force control, joint tracking, and a stop that trusts no sensor."""

from __future__ import annotations

from collections.abc import Sequence
from math import exp, hypot

import numpy as np

from ...control.ability import Ability
from ...control.compliance import Compliance
from ...control.external_torque import ExternalTorque
from ...control.following import Following
from ...control.force_control import ForceControl
from ...control.handle_lead import HandleLead
from ...control.handle_passivity import HandlePassivity
from ...control.inertial_kalman import InertialKalman
from ...control.shared_wrench import SharedWrench
from ...control.tracking import Admitted, DriveFriction, SeriesElasticity, Tracking
from ...control.twin_exchange import TwinExchange
from ...devices.torque_drive import JointDrives
from ...models import Array, Robot
from ...runtime.core.machine import DRIFT
from ...runtime.core.stages import Mark, Stage
from ...safety import AxisLimits, Heat

AT_REST = 1e-6
"""Commanded speeds below this are standstill [rad/s or m/s]."""
JOINTS_AT_REST = 0.25
"""Measured speeds below this are standstill: a hand goes on pulling at the springs of joints that are held
[rad/s or m/s]."""
ASTRAY_SHARE = 0.5
"""Part of a motor's torque that its feedback alone may give while it follows the hand, but for what its
spring's yielding takes: what the model gets wrong takes less."""
STRAIN_S = 15e-3
"""For so long the feedback may give that part while the link has not gone far."""
OVERLOAD_S = 0.3
"""An overload accounts for what it led to so much later."""
ADMITTED = ("power", "lower", "upper")
"""What the gate admits to an axis besides its torque, as the tracking plans with it."""
SETTLED = 0.01
"""Commanded speeds below this end a stop within a tick [rad/s or m/s]."""
CONTRADICTED_S = 0.2
"""A stop believes no wrench that the joints have contradicted for so long, less the time they did not."""
STOP_FADE_S = 5e-3
"""Time constant with which the operator's wrench leaves the feedforward of a stop."""
RECKONED_S = 50e-3
"""After a start, and after a wrench that was not believed, nothing gives way for so long [s]."""
FEEDFORWARD_GAIN = 10.0
"""The feedforward of the operator's wrench fades in so many times as fast as the wrench itself."""
CARRIED = 0.1
"""Part of a motor's torque that a hand may ask of it when its brake opens, and be met as slowly as that. One
that asks more hangs on the brake: the motor takes it over at once, if the springs show it."""


class Rendering:
    """Renders a twin with an arm whose base may move along x and y.

    A tick is ``render`` or ``slow_down``, then ``torque``, then ``advance``.

    Attributes:
        control: the force control.
        exchange: of its twins.
        astray: whether each joint is further from where it is led than loads explain, after a tick.
        overload: axis at which the hand, and what the arm carries, ask for more torque than is rated, now or
            lately; "" for none.
        doubtful: whether an overload led to a stop: a sensor that lies looks like a strong hand, so nobody
            may hold the handle at the next start.
        felt: wrench of the operator that moves the twin, (6,) [N, N m].
        wrench: the one that the joints hold against, (6,) [N, N m].
        passivity: of the handle; None where nothing watches it.
        ahead: foretells ``felt`` for the twin; None where it is taken as measured.
        fade: what is left after a tick of what fades out in a stop.
        coordinated: whether the limits were kept in the last tick of a stop, or each joint braked for itself.
    """

    def __init__(
        self,
        manipulator: Robot,
        control: ForceControl,
        joints: JointDrives,
        elasticity: SeriesElasticity,
        friction: DriveFriction,
        gains: tuple[Array, Array],
        axes: Sequence[AxisLimits],
        heat: Heat,
        mark: Mark,
        dt: float,
        fade: float,
        watched: bool = False,
        estimator: InertialKalman | None = None,
        lead: float | None = None,
    ) -> None:
        """Motor-side gains of the joints: proportional and derivative, (m,) each; what the gate admits.

        ``heat`` says how much of that the motors may give now; ``fade``: time in which a twin's forces
        fade in [s]; ``watched``: the twin is damped where its handle is not passive. Motors are where
        ``estimator`` says, or where their encoders do. The twin is moved by the wrench foretold by
        ``lead`` [s], or as measured.
        """
        self.control = control
        self.exchange = TwinExchange(control, fade, dt)
        self._shared = SharedWrench()
        self.felt, self.wrench, self._damped = self._shared.felt, self._shared.held, np.zeros(6)
        self.passivity = HandlePassivity(dt) if watched else None
        self.ahead = HandleLead(dt, lead) if lead else None
        n = control.arm.n
        self.astray, self.overload = [False] * n, ""
        self.doubtful = False
        self._believed = 0.0
        self._carried, self._begun = False, 0
        self._contradicted, self._longest_contradiction = 0, round(CONTRADICTED_S / dt)
        self._settled = self.coordinated = False
        rated = np.array([axis.command for axis in axes], float)
        self._link = joints.link_position
        self._rated = rated
        # the feedback alone then gives this part of a motor's torque
        self._most_fed_back = ASTRAY_SHARE * rated
        ability = control.ability or Ability(n)
        self._following = Following(
            [axis.name for axis in axes],
            self._link,
            self._most_fed_back / gains[0],
            self._most_fed_back,
            round(STRAIN_S / dt),
            ability,
            heat.able,
            round(OVERLOAD_S / dt),
            control.qdd,
            gains[0],
            dt,
        )
        self._yield = 1.0 / gains[0] + 1.0 / elasticity.stiffness
        self._known, self._reckoned = 0, round(RECKONED_S / dt)
        self._external = ExternalTorque(
            manipulator, control.arm, joints.link_position, joints.load_torque, control.handle.J, dt
        )
        self.fade = exp(-dt / STOP_FADE_S)
        self._mark = mark
        self._estimator, self._acting = estimator, np.zeros(n)
        motor = (estimator.motor, estimator.motor_rate) if estimator else (joints.position, joints.velocity)
        self._tracking = Tracking(
            manipulator,
            control.arm,
            elasticity,
            friction,
            *gains,
            Admitted(
                heat.able, *(np.array([getattr(axis, name) for axis in axes], float) for name in ADMITTED)
            ),
            ability,
            {
                **{"q": control.q, "qd": control.qd, "qdd": control.qdd, "J": control.handle.J},
                **{"wrench": self.wrench, "motor": motor[0], "motor_rate": motor[1]},
                **{"link": joints.link_position, "sensed": joints.load_torque},
            },
            dt,
        )

    @property
    def still(self) -> bool:
        """Whether no joint is commanded to move."""
        return max(map(abs, self.control.qd.tolist())) < AT_REST

    def engage(self, q: Array, wrench: Array) -> None:
        """Twin on the handle, everything at rest at measured joints (m,), even a little outside limits.

        ``wrench`` is measured at the handle in B, (6,) [N, N m]: what hangs on the brakes.
        """
        control = self.control
        self.exchange.reset()
        control.reset(q)
        self._following.reset(q)
        self.overload = ""
        self._settled = False
        self.wrench[:] = self._believed = 0.0
        self._contradicted = self._known = 0
        self._carried = bool((np.abs(wrench @ control.handle.J) > CARRIED * self._rated).any())
        self._begun = 0
        if control.compliance:
            control.compliance.reset()
        self._tracking.reset()
        if self.passivity:
            self.passivity.reset()
        if self.ahead:
            self.ahead.reset()
        if self._estimator:
            self._tracking.torque[:] = self._acting[:] = 0.0
            self._estimator.reset()

    def _estimate(self, estimator: InertialKalman) -> None:
        """Take the measurements of this tick, on which the torques of the last tick but one acted."""
        estimator.update(self._acting)
        self._acting[:] = self._tracking.torque

    def render(self, wrench: Array, gain: float, trust: float, base: Array) -> bool:
        """Motion of arm and twin under the operator's wrench (6,); whether the solver stands by its answer.

        Args:
            wrench: measured, at the handle in B [N, N m].
            gain: 0 to 1, how far it moves the machine while it engages; what drives the twin besides
                lags behind.
            trust: 0 to 1, how far it is believed.
            base: acceleration of what carries the arm, (2,) [m/s^2].
        """
        if self._estimator:
            self._estimate(self._estimator)
        control = self.control
        self._settled = False
        risen = min(1.0, FEEDFORWARD_GAIN * gain)
        held = trust * (1.0 if self._hangs() else risen)
        self._shared.take(wrench, trust * gain, held)
        self._believed = held
        self._contradicted = 0
        self._judge(wrench, 1.0 - held)
        self.exchange.update()
        control.prepare(self._moving(), gain * gain)  # a hand can hold against what drives the twin
        if control.ability:
            self._tracking.forecast(base)
            self._weigh()
        if control.compliance:
            self._give_way(control.compliance, wrench, trust, base)
        self._mark(Stage.MODEL)
        regular = control.assemble()
        self._mark(Stage.ASSEMBLE)
        solved = regular and control.optimise()
        self._mark(Stage.SOLVE)
        if not regular:
            control.brake()
        return solved

    def _hangs(self) -> bool:
        """Whether the joints hold all of the wrench from the start, for their springs show it at first."""
        self._begun += 1
        if self._begun == 2:
            self._carried = self._carried and not self._tracking.contradicted
        self._tracking.doubt(self._carried and self._begun == 1)
        return self._carried

    def _give_way(self, compliance: Compliance, wrench: Array, trust: float, base: Array) -> None:
        """To what pushes beside the wrench (6,), as long as that is believed."""
        if trust < 1.0:
            self._known = 0
        if not self._known:
            self._external.reset()
        self._known += 1
        external = self._external.update(wrench, base)
        if self._known > self._reckoned:
            compliance.update(external, self.control.qd)
        else:
            compliance.reset()

    def _moving(self) -> Array:
        """What moves the twin, (6,): the operator's wrench, foretold, less what keeps the handle passive."""
        wrench: Array = self.felt
        if self.ahead:
            self.ahead.update(self.felt)
            wrench = self.ahead.wrench
        if self.passivity:
            control, twist = self.control, self.control.twin.twist
            self.passivity.update(self.felt, twist, control.handle.J @ (self._link - control.q))
            wrench = np.add(wrench, self.passivity.wrench, out=self._damped)
        return wrench

    def lead(self, q: Array, qd: Array, qdd: Array, base: Array) -> None:
        """Motion of the arm by a plan instead of the operator: joints (m,), their speeds and accelerations.

        Args:
            q: where they are led in this tick [rad or m].
            qd: their speeds [rad/s or m/s].
            qdd: their accelerations [rad/s^2 or m/s^2].
            base: acceleration of what carries the arm, (2,) [m/s^2].
        """
        if self._estimator:
            self._estimate(self._estimator)
        control = self.control
        self.wrench[:] = 0.0
        self._following.led[:] = control.q
        self._judge(self.wrench, 0.0)
        control.q[:], control.qd[:], control.qdd[:] = q, qd, qdd
        control.arm.update()
        if control.ability:
            self._tracking.forecast(base, planned=False)
            self._weigh()

    def _judge(self, wrench: Array, yielded: float) -> None:
        """Whether the joints follow, while they yield to a part of the wrench that they do not hold yet."""
        control, following, leash = self.control, self._following, None
        if yielded > 0.0:
            leash = following.leash + yielded * np.abs(wrench @ control.handle.J) * self._yield
        if compliance := control.compliance:
            # what gives way yields to what it is known to be pushed with
            pushed = np.minimum(np.abs(compliance.external), self._most_fed_back) * self._yield
            leash = (following.leash if leash is None else leash) + pushed
        # the strain is that of the last tick
        following.judge(leash, control.ability is not None and yielded <= 0.0)
        self.astray = following.astray

    def _weigh(self) -> None:
        """Whether more is asked of a motor than it can hold by now, however the arm moves."""
        self._following.weigh()
        self.overload = self._following.overload

    def _let_go(self) -> None:
        """A stop begins: what does not follow is held where it is, not where it was led; see ``doubtful``."""
        following = self._following
        if following.astray is not following.nowhere:
            control, astray = self.control, np.array(self.astray)
            control.q[astray], control.qd[astray] = self._link[astray], 0.0
            self._tracking.reset()
            self.astray = following.astray = following.nowhere
        if following.overload:
            self.doubtful, self.overload, following.overload = True, "", ""

    def slow_down(
        self, base: Array, wrench: Array | None, carried: bool = False, together: bool = True
    ) -> None:
        """Arm to rest within its limits, as fast as joints are rated for or motors can.

        The operator is held against as far as the joints show the wrench; the rest fades out. Once
        everything is slow the joints stand, and what carries them may tremble.

        Args:
            base: acceleration of what carries the arm, (2,) [m/s^2].
            wrench: measured, at the handle in B, (6,) [N, N m]; None where nothing valid is.
            carried: whether that still moves.
            together: whether all that the limits depend on is measured; if not, each joint stops for itself.
        """
        if self._estimator:
            self._estimate(self._estimator)
        self._let_go()
        self._doubt(wrench)
        control = self.control
        control.arm.update()
        if control.ability:
            self._tracking.forecast(base, planned=False)
        self._settled |= not carried and max(map(abs, control.qd.tolist())) < SETTLED
        if self._settled and control.ability:
            self._weigh()
        self.coordinated = together and not self._settled and control.stop()
        if not self.coordinated:
            control.brake()

    def _doubt(self, wrench: Array | None) -> None:
        """Hold against a wrench (6,) as far as the joints show it, or let the last one fade."""
        self._tracking.doubt(True)
        if wrench is None or self._contradicted > self._longest_contradiction:
            self._believed *= self.fade
            np.multiply(self.wrench, self.fade, out=self.wrench)
            return
        np.multiply(wrench, self._believed, out=self.wrench)
        self._contradicted = max(0, self._contradicted + (1 if self._tracking.contradicted else -1))

    def torque(self, base: Array) -> list[float]:
        """Motor torques, (m,) [N m or N], on a base with an acceleration (2,) [m/s^2]."""
        torque: list[float] = self._tracking.update(base).tolist()
        return torque

    def advance(self) -> None:
        """Arm and twin over this tick."""
        self._following.led[:] = self.control.q
        self.control.advance()


def sensor_pose(robot: Robot, handle: str, sensor: str) -> Array:
    """Pose of the force-torque sensor in the handle's frame, (4, 4) [m]."""
    zero = np.zeros(robot.nv)
    T: Array = np.linalg.inv(robot.placement(zero, handle)) @ robot.placement(zero, sensor)
    return T


def pulled(wrench: Array, scales: Sequence[float]) -> list[str]:
    """A sentence where a sensor with full scales (6,) shows a wrench (6,) at rest, when nobody pulls."""
    (force, *_, torque), values = scales, wrench.tolist()
    if hypot(*values[:3]) <= DRIFT * force and hypot(*values[3:]) <= DRIFT * torque:
        return []
    measured = f"{hypot(*values[:3]):.1f} N and {hypot(*values[3:]):.2f} N m"
    return [f"the handle is pulled with {measured}; let go, or check the sensor and the tool"]
