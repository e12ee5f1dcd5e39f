"""Errors of simulated sensors: what each key does, by its statistics, and that the seed draws them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hapticd.configs.quantities import (
    Acceleration,
    DriftTime,
    ErrorAcceleration,
    ErrorAngle,
    ErrorAngularSpeed,
    ErrorForce,
    ErrorTorque,
    Force,
    Torque,
)
from hapticd.devices.network import Network
from hapticd.runtime.configuration import config
from hapticd.sim.force_torque import SimForceTorque
from hapticd.sim.imu import SimImu
from hapticd.sim.joint_drive import SimJointDrive
from hapticd.sim.nodes import SimNodes
from hapticd.sim.sensor_errors import AHEAD, SensorErrors
from hapticd.sim.sensors import (
    AccelerationError,
    AngleError,
    ForceError,
    LoadError,
    RateError,
    Sensors,
    SpeedError,
    TorqueError,
)

WRENCH = [10.0, -20.0, 5.0, 1.0, -0.5, 0.2]


def nodes() -> SimNodes:
    return SimNodes(Network(list(config.load("giant").config.devices.values())))


def sense(made: SimNodes, wrench: list[float] = WRENCH) -> None:
    """The truth, as a machine would set it."""
    for drive in made.of(SimJointDrive):
        drive.position, drive.velocity, drive.link_position, drive.load_torque = 0.5, -0.2, 0.4, 100.0
    made.of(SimForceTorque)[0].wrench = list(wrench)
    for imu in made.of(SimImu):
        imu.acceleration, imu.angular_velocity = [0.0, 1.0, 9.81], [0.1, 0.0, -0.3]


def readings(
    sensors: Sensors, read: Callable[[SimNodes], list[float]], ticks: int, seed: int = 1
) -> np.ndarray:
    """What a sensor says of the same truth, (ticks, components)."""
    made = nodes()
    errors = SensorErrors(made.nodes, sensors, seed)
    said = []
    for _ in range(ticks):
        sense(made)
        errors.spoil(1e-3)
        said.append(read(made))
    return np.array(said)


def wrench(made: SimNodes) -> list[float]:
    return list(made.of(SimForceTorque)[0].wrench)


def loads(made: SimNodes) -> list[float]:
    return [drive.load_torque for drive in made.of(SimJointDrive)]


def test_noise_is_white_and_of_its_size() -> None:
    said = readings(Sensors(load_torque=LoadError(noise=ErrorTorque(0.3))), loads, 4000) - 100.0
    np.testing.assert_allclose(said.std(axis=0), 0.3, rtol=0.05)
    assert np.abs(said.mean(axis=0)).max() < 0.03
    assert abs(np.mean(said[1:] * said[:-1])) < 0.03 * 0.09
    assert abs(np.mean(said[:, 0] * said[:, 1])) < 0.05 * 0.09


def test_bias_and_gain_are_constant_within_what_is_given_and_each_component_has_its_own() -> None:
    for error, most in (
        (LoadError(bias=ErrorTorque(0.5)), 0.5),
        (LoadError(gain=0.02), 0.02 * 100.0),
    ):
        drawn = []
        for seed in range(30):
            said = readings(Sensors(load_torque=error), loads, 3, seed) - 100.0
            np.testing.assert_array_equal(said[0], said[2])
            drawn += said[0].tolist()
        assert np.abs(drawn).max() <= most
        assert len(set(drawn)) == 180 and max(drawn) > 0.8 * most and min(drawn) < -0.8 * most


def test_drift_begins_at_nothing_and_wanders_as_a_first_order_process_does() -> None:
    error = LoadError(drift=ErrorTorque(0.4), drift_time=DriftTime(0.05))
    said = readings(Sensors(load_torque=error), loads, 20000) - 100.0
    assert np.abs(said[0]).max() < 0.4
    np.testing.assert_allclose(said.std(axis=0), 0.4, rtol=0.15)
    lag = 50  # one time constant
    correlation = np.mean(said[lag:] * said[:-lag]) / np.mean(said**2)
    assert correlation == pytest.approx(np.exp(-1.0), abs=0.06)
    slow = LoadError(drift=ErrorTorque(0.4), drift_time=DriftTime(1000.0))
    assert np.abs(readings(Sensors(load_torque=slow), loads, 100) - 100.0).max() < 0.05


def test_coupling_mixes_the_axes_of_one_sensor_by_their_full_scales() -> None:
    made = nodes()
    device = made.of(SimForceTorque)[0].device
    full = np.array([device.force] * 3 + [device.torque] * 3)  # type: ignore[attr-defined]
    sensors = Sensors(force=ForceError(coupling=0.01))
    for seed in range(10):
        errors = SensorErrors(made.nodes, sensors, seed)
        response = []
        for axis in range(6):
            sense(made, (np.eye(6)[axis] * full[axis]).tolist())
            errors.spoil(0.0)
            response.append(np.array(wrench(made)) / full)
        mixed = np.array(response).T - np.eye(6)
        assert np.all(np.diag(mixed) == 0.0) and np.all(mixed[3:] == 0.0)
        assert np.abs(mixed[:3]).max() <= 0.01 and np.count_nonzero(mixed[:3]) == 15
        assert np.abs(mixed[:3, :3]).max() > 0.003 < np.abs(mixed[:3, 3:]).max()


def test_readings_saturate_and_come_in_steps() -> None:
    limits = Sensors(
        load_torque=LoadError(range=Torque(80.0)),
        acceleration=AccelerationError(step=ErrorAcceleration(0.5), range=Acceleration(9.0)),
    )
    made = nodes()
    errors = SensorErrors(made.nodes, limits, 1)
    sense(made)
    errors.spoil(1e-3)
    assert loads(made) == [80.0] * 6
    assert [list(imu.acceleration) for imu in made.of(SimImu)] == [[0.0, 1.0, 9.0]] * 2
    sense(made)
    for imu in made.of(SimImu):
        imu.acceleration = [0.26, -0.24, 1.74]
    errors.spoil(1e-3)
    assert [list(imu.acceleration) for imu in made.of(SimImu)] == [[0.5, 0.0, 1.5]] * 2


def test_gain_and_coupling_come_first_then_what_is_drawn_then_the_range_then_the_steps() -> None:
    one, two = ErrorForce(1.0), ErrorForce(2.0)
    sensors = Sensors(
        load_torque=LoadError(noise=ErrorTorque(1.0), bias=ErrorTorque(2.0), gain=0.1, range=Torque(99.0)),
        force=ForceError(
            noise=one, bias=two, drift=one, gain=0.1, coupling=0.05, step=ErrorForce(0.25), range=Force(12.0)
        ),
    )
    made = nodes()
    errors = SensorErrors(made.nodes, sensors, 3)
    beyond = 0
    for k in range(2 * AHEAD + 5):
        felt = [*(np.array(WRENCH[:3]) * np.cos(k)), *WRENCH[3:]]
        sense(made, felt)
        errors.spoil(1e-3)
        seen = errors._mix @ [*[100.0] * 6, *felt] + errors._offset[k % AHEAD]
        assert loads(made) == pytest.approx(np.clip(seen[:6], -99.0, 99.0), rel=1e-12)
        whole = np.clip(seen[6:9], -12.0, 12.0)
        assert wrench(made)[:3] == pytest.approx(0.25 * np.rint(whole / 0.25), rel=1e-12)
        assert wrench(made)[3:] == felt[3:]
        beyond += np.count_nonzero(np.abs(seen[6:9]) > 12.0)
    assert beyond > 10


def test_machines_whose_sensors_do_not_err_say_the_truth() -> None:
    made = nodes()
    errors = SensorErrors(made.nodes, Sensors(), 3)
    sense(made)
    for _ in range(2):
        errors.spoil(1e-3)
    assert wrench(made) == WRENCH and loads(made) == [100.0] * 6


EVERY = {
    "motor_encoder": (AngleError(bias=ErrorAngle(1e-3)), SimJointDrive, "position"),
    "motor_speed": (SpeedError(bias=ErrorAngularSpeed(1e-2)), SimJointDrive, "velocity"),
    "link_encoder": (AngleError(bias=ErrorAngle(1e-3)), SimJointDrive, "link_position"),
    "load_torque": (LoadError(bias=ErrorTorque(0.1)), SimJointDrive, "load_torque"),
    "force": (ForceError(bias=ErrorForce(0.1)), SimForceTorque, "wrench"),
    "torque": (TorqueError(bias=ErrorTorque(0.1)), SimForceTorque, "wrench"),
    "acceleration": (AccelerationError(bias=ErrorAcceleration(0.1)), SimImu, "acceleration"),
    "angular_rate": (RateError(bias=ErrorAngularSpeed(0.1)), SimImu, "angular_velocity"),
}


@pytest.mark.parametrize("key", EVERY)
def test_each_key_spoils_its_own_sensors_and_no_other(key: str) -> None:
    error, kind, field = EVERY[key]
    made, truth = nodes(), nodes()
    sense(made)
    sense(truth)
    SensorErrors(made.nodes, Sensors(**{key: error}), 1).spoil(1e-3)
    for _, other_kind, other in EVERY.values():
        pairs = zip(made.of(other_kind), truth.of(other_kind), strict=True)
        for spoilt, true in pairs:
            wrong = np.atleast_1d(getattr(spoilt, other)) != np.atleast_1d(getattr(true, other))
            expected = (other_kind, other) == (kind, field)
            mask = np.full(wrong.shape, expected)
            if field == "wrench":
                mask[:3] &= key == "force"
                mask[3:] &= key == "torque"
            np.testing.assert_array_equal(wrong, mask)


def test_the_seed_draws_them() -> None:
    sensors = Sensors(force=ForceError(bias=ErrorForce(0.1), drift=ErrorForce(0.1), noise=ErrorForce(0.1)))
    first = readings(sensors, wrench, 20, 7)
    np.testing.assert_array_equal(first, readings(sensors, wrench, 20, 7))
    assert np.all(first[:, :3] != readings(sensors, wrench, 20, 8)[:, :3])
