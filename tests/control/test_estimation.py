"""Observer of the PPU and the operator's wrench."""

import numpy as np
import pinocchio as pin
import pytest
from hapticd.control.estimation import PpuObserver, WrenchEstimator

DT = 1e-3


def test_the_observer_follows_a_moving_axis_and_finds_the_bias_of_its_accelerometer() -> None:
    position, force = np.array([0.2, 0.0]), np.zeros(2)
    observer = PpuObserver(DT, position, force)
    observer.reset()
    bias = np.array([0.3, -0.2])
    previous = np.array([0.2, 0.0]), np.zeros(2), np.zeros(2)
    for k in range(1, 3000):
        q, v, a = previous
        position[:], force[:] = np.round(q * 1e6) / 1e6, a + bias  # one tick old, encoder of 1 um
        observer.update()
        t = k * DT
        previous = (
            np.array([0.2 + 0.5 * (1 - np.cos(2 * t)), 0.0]),
            np.array([np.sin(2 * t), 0.0]),
            np.array([2 * np.cos(2 * t), 0.0]),
        )
    q, v, a = previous
    np.testing.assert_allclose(observer.q, q, atol=5e-6)
    np.testing.assert_allclose(observer.qd, v, atol=5e-3)
    np.testing.assert_allclose(observer.qdd, a, atol=2e-2)


def test_weight_and_inertia_of_the_tool_do_not_look_like_the_operator() -> None:
    rng = np.random.default_rng(4)
    mass, centre = 0.9, np.array([0.01, -0.02, 0.0368])
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = pin.exp3(np.array([0.1, -0.3, 0.2])), [0.0, 0.01, -0.042]
    measured, specific, rotation = np.zeros(6), np.zeros(3), np.eye(3)
    estimator = WrenchEstimator(mass, centre, T, measured, specific, rotation, DT)
    for _ in range(50):
        R = pin.exp3(rng.standard_normal(3))
        acceleration, applied = rng.standard_normal(3), rng.standard_normal(6)
        f_b = acceleration - np.array([0.0, 0.0, -9.81])  # a - g in B
        # the truth: operator's wrench at H in B and the tool's -m (a - g) at its centre, seen at the sensor
        R_s = R @ T[:3, :3]
        pull = -mass * f_b
        force = applied[:3] + pull
        torque = applied[3:] + np.cross(-R @ T[:3, 3], applied[:3]) + np.cross(R_s @ centre, pull)
        measured[:] = np.concatenate([R_s.T @ force, R_s.T @ torque])
        specific[:], rotation[:] = R.T @ f_b, R
        estimator.update()
        np.testing.assert_allclose(estimator.wrench, applied, atol=1e-12)


def test_an_axis_at_rest_stays_at_rest() -> None:
    observer = PpuObserver(DT, np.array([1.0, -1.0]), np.zeros(2))
    observer.reset()
    for _ in range(100):
        observer.update()
    assert observer.q == pytest.approx([1.0, -1.0])
    assert not observer.qd.any()


class Sensor:
    """A force-torque sensor without a tool."""

    def __init__(self, share: float = 1.0) -> None:
        self.measured = np.zeros(6)
        self.share = share
        zero, T = np.zeros(3), np.eye(4)
        self.estimator = WrenchEstimator(
            0.0, zero, T, self.measured, zero.copy(), np.eye(3), DT, drifts=(share, share)
        )
        self.random = np.random.default_rng(7)

    def run(self, seconds: float, force: object, tremor: float = 0.0) -> np.ndarray:
        """The estimate after a time under a force, with noise and a hand that trembles."""
        for k in range(round(seconds / DT)):
            noise = self.share * 0.03 * self.random.standard_normal(6)
            noise[3:] *= 0.05
            self.measured[:] = np.concatenate([force, np.zeros(3)]) + noise
            self.measured[0] += tremor * np.sin(2 * np.pi * 2.0 * k * DT)
            self.estimator.update()
        return self.estimator.wrench


def test_a_small_steady_wrench_is_drift_and_fades_out() -> None:
    sensor = Sensor()
    assert np.linalg.norm(sensor.run(0.9, [1.0, -1.0, 1.0])[:3]) > 1.5
    assert np.linalg.norm(sensor.run(7.0, [1.0, -1.0, 1.0])[:3]) < 0.15
    assert np.linalg.norm(sensor.run(0.1, [11.0, -1.0, 1.0])[:3]) == pytest.approx(10.0, abs=0.2)


@pytest.mark.parametrize(("force", "tremor"), [([3.0, 0.0, 0.0], 0.0), ([1.0, 0.0, 0.0], 0.5)])
def test_what_a_hand_does_is_no_drift(force: list[float], tremor: float) -> None:
    sensor = Sensor()
    sensor.run(8.0, force, tremor)
    assert np.linalg.norm(sensor.run(0.5, [0.0] * 3)[:3]) < 0.2  # it lets go, and nothing pushes


def test_the_drift_of_a_small_sensor_is_as_much_smaller() -> None:
    sensor, strong = Sensor(0.02), Sensor()
    assert sensor.run(8.0, [0.2, 0.0, 0.0])[0] == pytest.approx(0.2, abs=0.01)  # a hand at a weak arm
    assert strong.run(8.0, [0.2, 0.0, 0.0])[0] < 0.05
    assert sensor.run(1.0, [0.0] * 3)[0] == pytest.approx(0.0, abs=0.01)
    assert sensor.run(8.0, [0.02, 0.0, 0.0])[0] < 0.01


def test_drift_beyond_its_bound_is_not_taken_off_and_what_is_no_number_spoils_nothing() -> None:
    sensor = Sensor()
    for step in range(8):
        sensor.run(4.0, [0.7 * step, 0.0, 0.0])
    assert sensor.run(0.1, [0.7 * 7, 0.0, 0.0])[0] > 2.5
    sensor.measured[2] = np.nan
    sensor.estimator.update()
    assert np.isfinite(sensor.run(0.01, [0.0] * 3)).all()
