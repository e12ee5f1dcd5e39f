"""An arm of a station between process image and gate: palm, wrench, hold, and the stop of its own."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, radians

import numpy as np
import pinocchio as pin

from ...control.end_stop import EndStop
from ...control.ft_calibration import Tool
from ...control.hand_wrench import HandWrench, Load
from ...control.hold import Hold, HoldGains, bearable, limited
from ...control.limit_avoidance import Avoidance, JointLimits, LimitAvoidance, slowed
from ...control.task_arm import Posture, TaskArm
from ...models import Array, Robot
from ..rendering.sections import Arm
from .sections import OwnChain, Station

PALM, FLANGE = "palm", "flange"
SIDES = ("left", "right")
SLOWS = Avoidance(0.7, radians(40.0), radians(2.0))
"""Against the largest speeds; stronger than the law's own default: hands that turn a wrist as fast as they
can stopped the station (experiments/strange_pair.py)."""
END_STOP = 0.025
"""Part of a joint's range at each end in which the hold's spring keeps it from going on [rad]: the avoidance
of limits is gentle, and a palm that is led further than it reaches pulls its arm through them."""
NEAR = 0.3
"""Distance to a joint's largest speed from which on a law drives it on ever less [rad/s]."""
TOO_FAST = 1.04
"""Multiple of its largest speed at which a joint stops its arm; the monitor stops the station at 1.1."""


def chain_of(robot: Robot, chain: Arm, tool: pin.Inertia | None = None) -> Robot:
    """One arm of a station's model with its palm, and with what hangs on its flange, as a serial chain.

    Args:
        robot: the whole model.
        chain: which arm, and where its palm is.
        tool: in the flange's axes.

    Raises:
        ModelError: the model has no such flange.
    """
    alone = robot.without([name for name in robot.names if not name.startswith(chain.prefix)])
    model = alone.model
    flange = alone.frame(f"{chain.prefix}{FLANGE}")
    own = model.frames[flange]
    T = own.placement * pin.SE3(pin.exp3(np.array(chain.turned)), np.array(chain.palm))
    model.addFrame(pin.Frame(PALM, own.parentJoint, flange, T, pin.FrameType.OP_FRAME))
    if tool is not None:
        model.appendBodyToJoint(own.parentJoint, tool, own.placement)
    return Robot(model)


def palm_to_sensor(chain: Arm) -> Array:
    """Pose of the flange, where the sensor is, in the palm's frame, (4, 4) [m]."""
    T: Array = pin.SE3(pin.exp3(np.array(chain.turned)), np.array(chain.palm)).inverse().homogeneous
    return T


def weight(tool: Tool) -> pin.Inertia:
    """What hangs on the flange, as the controller knows it: a point of its mass."""
    return pin.Inertia(tool.mass, tool.centre, np.zeros((3, 3)))


class StationArm:
    """State and torques that do not depend on whether the arm leads or follows.

    Attributes:
        side: "left" or "right".
        task: palm, inertia, weight, posture; n: joints.
        force: wrench on the palm in its axes, (6,), as it is measured: ``force.wrench``.
        avoidance: of its joint limits.
        ends: torques of its end stops in the last tick, (n,) [N m].
        stopped: why it stopped itself, "" where it did not.
        torque: for its motors, (n,) [N m].
    """

    def __init__(
        self,
        side: str,
        station: Station,
        tool: Tool,
        robot: Robot,
        q: Array,
        qd: Array,
        measured: Array,
        dt: float,
    ) -> None:
        """Bind to the image.

        Args:
            side: of the station.
            station: its section of the configuration.
            tool: what hangs on its sensor.
            robot: the whole model.
            q: measured joints, (n,) [rad].
            qd: their velocities, (n,) [rad/s].
            measured: wrench of the sensor in its axes, (6,) [N, N m].
            dt: of a tick [s].
        """
        chain: OwnChain = getattr(station.arms, side)
        self.side, self.chain = side, chain
        self.robot = own = chain_of(robot, chain, weight(tool))
        n = self.n = own.nv
        posture = Posture(np.array(chain.home), station.posture.stiffness, station.posture.damping)
        self.task = TaskArm(own, PALM, q, qd, posture)
        self.force = HandWrench(
            Load(tool.bias, tool.mass, tool.centre), palm_to_sensor(chain), self.task.palm.rotation, measured
        )
        limits = JointLimits(*(np.array(x, float) for x in (chain.lower, chain.upper, chain.velocity)))
        self.avoidance = LimitAvoidance(limits, q, qd, velocity=SLOWS)
        hold = station.hold
        stiffness, damping, deceleration = (
            np.array(x, float) for x in (hold.stiffness, hold.damping, hold.deceleration)
        )
        self._hold = Hold(HoldGains(stiffness, damping, deceleration, own.effort), dt)
        self._end_stop = EndStop(limits.lower, limits.upper, stiffness, damping, deceleration, END_STOP)
        self.ends = self._end_stop.torque
        self._velocity: list[float] = limits.velocity.tolist()
        self._fastest: list[float] = (TOO_FAST * limits.velocity).tolist()
        self._most = station.stop.force, station.stop.torque
        self.stopped = ""
        self.torque = np.zeros(n)
        self._effort, self._still = own.effort, np.zeros(n)
        self._moved = False

    def estimate(self) -> None:
        """Everything that follows from the measurements of a tick."""
        self.task.update()
        self.force.update()
        self.avoidance.update()

    def engage(self) -> None:
        """Held where it is."""
        self.stopped, self._moved = "", False
        self._hold.reset(self.task.q, self._still)

    def move(self, torque: Array, kept: float) -> None:
        """The torques of a law beside those that carry the arm, and a share of its hold, 0 to 1.

        Args:
            torque: of the law, (n,) [N m].
            kept: of the torques that hold it where it was engaged.
        """
        guards = self.avoidance.torque
        ends = self._end_stop.update(self.task.q, self.task.qd)
        np.subtract(torque, guards, out=self.torque)
        bearable(self.torque, guards + ends + self.task.weight, self._effort)
        self.torque += guards
        self._end_stop.restrain(self.task.q, self.torque)
        slowed(self.torque, self.task.qd, self._velocity, NEAR)
        if kept > 0.0:
            self.torque += kept * self._hold.update(self.task.q, self.task.qd)
        self.torque += ends
        self._moved = True
        self._carry()

    def halt(self) -> bool:
        """Bring it to rest and hold it there; whether it is commanded to stand."""
        if self._moved:
            self._hold.reset(self.task.q, self.task.qd, self.torque - self.task.weight)
            self._moved = False
        self.torque[:] = self._hold.update(self.task.q, self.task.qd)
        # what presses on the palm would throw a joint out of its range that its end stop kept in it
        self.torque += self._end_stop.update(self.task.q, self.task.qd)
        self._carry()
        return self._hold.at_rest

    def excess(self) -> str:
        """What is more than the arm may feel or do, for people; "" where nothing is."""
        wrench = self.force.wrench.tolist()
        force, torque = hypot(*wrench[:3]), hypot(*wrench[3:])
        if force > self._most[0]:
            return f"{force:.0f} N at the palm, more than {self._most[0]:g} N"
        if torque > self._most[1]:
            return f"{torque:.1f} N m at the palm, more than {self._most[1]:g} N m"
        for i, (speed, most) in enumerate(zip(self.task.qd.tolist(), self._fastest, strict=True)):
            if abs(speed) > most:
                return f"joint {i + 1} turns at {abs(speed):.2f} rad/s"
        return ""

    def _carry(self) -> None:
        self.torque += self.task.weight
        limited(self.torque, self._effort)


def quaternion(rotation: Array) -> Sequence[float]:
    """Of a rotation (3, 3): x, y, z, w, of the two the one with w not below 0."""
    x, y, z, w = pin.Quaternion(rotation).coeffs().tolist()
    return (-x, -y, -z, -w) if w < 0.0 else (x, y, z, w)
