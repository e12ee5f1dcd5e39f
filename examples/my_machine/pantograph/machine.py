"""The pantograph between process image and gate: an admittance, whose twin the motors follow."""

import numpy as np
from hapticd.control.hold import Hold, HoldGains
from hapticd.control.standstill import Standstill
from hapticd.devices.force_torque import SensorStatus
from hapticd.devices.torque_drive import JointDrives
from hapticd.runtime.core.machine import DRIFT, REST_S
from hapticd.runtime.core.measured import sensor
from hapticd.safety import Plausibility

from .linkage import Linkage
from .twin import Puck

AT_REST = 0.25  # slower than that a motor stands; a hand goes on pulling at one that holds [rad/s]
STATE = [(name, "<f8", 2) for name in ("q", "torque", "handle", "puck", "force")] + [("depth", "<f8")]


class PantographMachine:
    """``hapticd.runtime.core.machine.Machine`` says what each member is for."""

    outputs = (("joints", "target_torque"),)
    state = np.dtype(STATE)

    def __init__(self, config, robot, image, mark) -> None:
        self._own = own = config.pantograph
        self._dt = 1.0 / config.loop.rate
        self._linkage, self.puck = Linkage(robot, own.base), Puck(own)
        self._drives, self._force = JointDrives(image), image["planar_force.force"][0]
        self._status, self._full = image.word("planar_force.status"), config.devices["force"].force
        motors, self._pull = self._linkage.motors, np.zeros(2)
        self._most = np.array(motors.torque)
        self.axes, self.thresholds = motors.limits(config), motors.thresholds(config, image)
        self._sensor = sensor(image, "planar_force", 0, self._force, [self._full] * 2, self._dt)
        self.plausibility = Plausibility((motors.checks(config, image, self._pull),), (self._sensor,))
        gains = (np.full(2, float(x)) for x in (own.hold, own.hold_damping, own.deceleration))
        self._hold = Hold(HoldGains(*gains, self._most), self._dt)
        self._standstill = Standstill((AT_REST,) * 2, round(REST_S * config.loop.rate))
        self.play, self.braking = tuple(self._most / own.hold), motors.velocity[0] / own.deceleration
        self._q, self._qd, self._handle, self._jacobian = *np.zeros((3, 2)), np.eye(2)
        self.position, self.velocity, self.commands = [0.0] * 2, [0.0] * 2, [0.0] * 2
        self.raw_wrench, self.inertial, self.solved, self.astray, self.overload = None, True, True, (), ""

    @property
    def inside_limits(self) -> bool:
        return all(a.lower <= q <= a.upper for a, q in zip(self.axes, self.position, strict=True))

    def unrest(self, first: bool) -> list[str]:
        drifts = first and np.hypot(*self._force) > DRIFT * self._full
        return ["the handle is pulled; let go, or check the sensor"] if drifts else []

    def estimate(self) -> None:
        self._q[:], self._qd[:] = self._drives.link_position, self._drives.velocity
        self.position, self.velocity = self._q.tolist(), self._qd.tolist()
        self._handle, self._jacobian = self._linkage.at(self._q)
        valid = self._sensor.current and self._status[0] == SensorStatus.READY
        self.raw_wrench = [*self._force.tolist(), 0.0, 0.0, 0.0, 0.0] if valid else None
        np.matmul(-self._force, self._jacobian, out=self._pull)

    def engage(self) -> None:
        self.puck.reset(self._handle)
        self._hold.reset(self._q, np.zeros(2))

    def update(self, gain: float, trust: float) -> None:
        own, puck = self._own, self.puck
        puck.push(gain * trust * self._force, self._dt)
        lag, slip = puck.position - self._handle, puck.velocity - self._jacobian @ self._qd
        torque = (own.coupling * lag + own.coupling_damping * slip) @ self._jacobian
        self.commands = np.clip(torque, -self._most, self._most).tolist()
        self._hold.reset(self._q, self._qd)
        self._standstill.reset()

    def brake(self, dropped) -> bool:
        self.commands = self._hold.update(self._q, self._qd).tolist()
        return self._standstill.update(self.plausibility.speed, dropped) and self._hold.at_rest

    def bind_state(self, state) -> None:
        self._logged = state

    def fill(self) -> None:
        now = (self._q, self._drives.target_torque, self._handle, self.puck.position, self._force)
        self._logged[0] = (*now, self.puck.depth)
