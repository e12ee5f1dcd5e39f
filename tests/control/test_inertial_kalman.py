"""What an inertial unit is expected to measure, against pinocchio; what it corrects, on a noisy walk."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hapticd.configs import read_text
from hapticd.control._kernels import lib
from hapticd.control.inertial_kalman import InertialKalman, InertialNoise
from hapticd.control.joint_kalman import STATES, JointKalman, JointNoise, link_inertia, model
from hapticd.models import Array, Robot

DT, GRAVITY = 1e-3, np.array([0.0, 0.0, -9.81])
FRAME, N = "imu_handle", 6
ROTOR, STIFFNESS = np.array([1.5, 1.5, 0.6, 0.6, 0.15, 0.15]), np.array([15e3, 15e3, 8e3, 8e3, 2.5e3, 2.5e3])
RATED = np.array([25.0, 25.0, 35.0, 40.0, 60.0, 90.0])
POSTURE = np.array([-0.9, 1.57, -0.67, 0.96, 0.08, 0.1])
FREQUENCY = np.array([0.9, 1.4, 2.1, 6.0, 3.3, 8.0])
AMPLITUDE = np.array([0.05, 0.02, 0.01, 1e-3, 3e-3, 3e-4])


@pytest.fixture(scope="module")
def whole() -> Robot:
    """The arm on its gantry, with a unit that is turned and beside the handle."""
    text = read_text("giant.urdf")
    mount = '<origin xyz="0.0 0.0 -0.005" rpy="0.0 0.0 0.0" />\n    <parent link="handle" />'
    assert text.count(mount) == 1
    askew = '<origin xyz="0.04 -0.03 0.06" rpy="0.7 -0.4 1.9" />\n    <parent link="handle" />'
    return Robot.from_urdf(text.replace(mount, askew), "giant.urdf")


def walk(t: float) -> tuple[Array, Array, Array]:
    """Angles, speeds and accelerations of the joints, (6,) each, from rest on."""
    w = 2.0 * np.pi * FREQUENCY
    s, c = np.sin(w * t), np.cos(w * t)
    return (
        POSTURE + AMPLITUDE * s**3,
        AMPLITUDE * 3.0 * w * s**2 * c,
        AMPLITUDE * 3.0 * w**2 * (2.0 * s * c**2 - s**3),
    )


def gantry(t: float) -> tuple[Array, Array]:
    """Its place and acceleration along x and y."""
    w = np.array([4.0, 7.0])
    return 0.1 * np.sin(w * t), -0.1 * w * w * np.sin(w * t)


def pose(whole: Robot, t: float) -> pin.SE3:
    return pin.SE3(whole.placement(np.concatenate([gantry(t)[0], walk(t)[0]]), FRAME))


def truth(whole: Robot, t: float) -> Array:
    """Specific force and angular velocity of the unit in its axes, by differences of its poses."""
    h = 1e-4
    before, now, after = (pose(whole, t + s) for s in (-h, 0.0, h))
    a = (after.translation - 2.0 * now.translation + before.translation) / h**2
    turned = pin.log3(before.rotation.T @ after.rotation) / (2.0 * h)
    return np.concatenate([now.rotation.T @ (a - GRAVITY), turned])


class Rig:
    """Filters of the giant's joints, the unit, and what they read."""

    def __init__(self, whole: Robot, noise: InertialNoise | None = None) -> None:
        arm = whole.without(["ppu_x", "ppu_y"])
        self.measured = np.zeros(N), np.zeros(N), np.zeros(N), np.zeros(N)
        self.inertia = np.maximum(link_inertia(arm, POSTURE), ROTOR)
        joints = ROTOR, STIFFNESS, self.inertia, arm.effort, RATED
        self.joints = JointKalman(*joints, self.measured, DT)
        self.base, self.unit = np.zeros(2), (np.zeros(3), np.zeros(3))
        self.kalman = InertialKalman(self.joints, arm, FRAME, self.base, self.unit, noise)
        self.effort = arm.effort

    def told(self, t: float) -> Array:
        """Torques of the motors of a joint that carries nothing but its inertia."""
        _, _, qdd = walk(t)
        return ROTOR * qdd + self.inertia * qdd

    def measure(self, t: float, noise: Array, off: Array) -> None:
        """What encoders and speeds say at a time, with errors (4, 6), and the unit, with (6,)."""
        q, qd, qdd = walk(t)
        load = self.inertia * qdd
        values = q + load / STIFFNESS, qd, q, load
        for array, value, error in zip(self.measured, values, noise, strict=True):
            array[:] = value + error
        self.base[:] = gantry(t)[1]
        self.unit[0][:], self.unit[1][:] = off[:3], off[3:]


def test_what_a_unit_should_measure_is_how_its_frame_moves(whole: Robot) -> None:
    rig = Rig(whole)
    for t in (0.1, 0.47, 1.3):
        rig.joints.link[:], rig.joints.link_rate[:], rig.joints.link_acceleration[:] = walk(t)
        rig.base[:] = gantry(t)[1]
        rig.kalman._chain.update()
        lib.inertial_expect(*rig.kalman._call)
        np.testing.assert_allclose(rig.kalman.expected, truth(whole, t), atol=1e-4)


def test_a_correction_is_the_update_of_kalman_over_all_joints(whole: Robot) -> None:
    """Against dense matrices; H are differences of what is expected."""
    rig, noise = Rig(whole), InertialNoise()
    kalman, joints = rig.kalman, rig.joints
    rig.measure(0.2, np.zeros((4, N)), truth(whole, 0.2))
    kalman.sensed = True
    kalman.reset()
    kalman.update(rig.told(0.2))  # takes up the biases
    x, bias, start = joints.state, kalman.bias, joints.state.copy()

    def expected(state: Array) -> Array:
        x[:] = state
        lib.joint_kalman_show(joints.pointer)
        lib.inertial_expect(*kalman._call)
        return kalman.expected.copy()

    steps = 1e-3 * np.eye(N * STATES).reshape(-1, N, STATES)
    of_states = [(expected(start + step) - expected(start - step)) / 2e-3 for step in steps]
    H = np.hstack([np.array(of_states).T, np.eye(6)])
    P = np.zeros((N * STATES + 6,) * 2)
    for i in range(N):
        here = slice(STATES * i, STATES * (i + 1))
        P[here, here] = joints.covariance[i]
    P[-6:, -6:] = np.diag(np.repeat([noise.acceleration_bias, noise.rate_bias], 3) ** 2)
    R = np.diag(np.repeat([noise.acceleration, noise.rate], 3) ** 2)
    off = np.random.default_rng(5).standard_normal(6)
    rig.unit[0][:], rig.unit[1][:] = np.split(expected(start) + bias + off, 2)
    before, step = bias.copy(), P @ H.T @ np.linalg.solve(H @ P @ H.T + R, off)
    lib.inertial_correct(*kalman._call)
    np.testing.assert_allclose((x - start).reshape(-1), step[:-6], rtol=1e-6, atol=1e-10)
    np.testing.assert_allclose(bias - before, step[-6:], rtol=1e-6, atol=1e-10)
    # what is shown is what was corrected
    acceleration = STIFFNESS / rig.inertia * (x[:, 0] - x[:, 2]) + x[:, 5]
    np.testing.assert_allclose(joints.link_acceleration, acceleration, rtol=1e-12)


def test_no_error_grows_in_the_metric_of_the_covariance(whole: Robot) -> None:
    """So it is with the correction, whatever the posture: no sequence of both makes an error grow."""
    rig, noise = Rig(whole), JointNoise()
    for i, P in enumerate(rig.joints.covariance):
        A, _, H = model(ROTOR[i], STIFFNESS[i], rig.inertia[i], DT)
        R = np.diag([noise.angle, noise.rate, noise.angle, noise.load * rig.effort[i]]) ** 2
        E = (np.eye(STATES) - P @ H.T @ np.linalg.solve(R, H)) @ A
        scale = np.sqrt(np.diag(P))
        assert np.linalg.eigvalsh((P - E @ P @ E.T) / np.outer(scale, scale)).min() > -1e-9


def errors(rig: Rig, whole: Robot, seed: int, biased: Array, sensed: bool = True) -> Array:
    """RMS of the errors of links' speeds and accelerations, (2, 6), on a noisy walk.

    The biases appear after 0.3 s; errors count from 1.8 s on.
    """
    rng, noise, found = np.random.default_rng(seed), JointNoise(), []
    alike = (np.full(N, size) for size in (noise.angle, noise.rate, noise.angle))
    sizes = np.array([*alike, noise.load * rig.effort])
    rig.kalman.sensed = sensed
    for k in range(3000):
        t = k * DT
        unit = truth(whole, t) if sensed else np.zeros(6)
        shaken = np.repeat([0.02, 2e-3], 3) * rng.standard_normal(6)
        rig.measure(t, sizes * rng.standard_normal((4, N)), unit + shaken + (k >= 300) * biased)
        if k:
            rig.kalman.update(rig.told(t - 0.5 * DT))
        else:
            rig.kalman.reset()
        if k >= 1800:
            found.append([rig.joints.link_rate - walk(t)[1], rig.joints.link_acceleration - walk(t)[2]])
    return np.asarray(np.sqrt((np.array(found) ** 2).mean(0)))


def test_a_noisy_unit_mends_speeds_and_accelerations_whatever_its_biases(whole: Robot) -> None:
    """Joints 1, 2, 4 move the handle most of what is fast; biases appear in the middle of the motion."""
    alone = errors(Rig(whole), whole, 1, np.zeros(6), sensed=False)
    mended = errors(Rig(whole), whole, 1, np.zeros(6))
    assert (mended / alone)[:, [0, 1, 3]].max() < 0.8
    assert (mended**2).sum() < 0.5 * (alone**2).sum()
    off = np.array([0.3, -0.2, 0.1, 0.02, -0.03, 0.01])
    biased = errors(Rig(whole), whole, 1, off)
    np.testing.assert_allclose(biased, mended, rtol=0.1)
    never_learnt = InertialNoise(acceleration_bias=0.0, rate_bias=0.0)
    assert (errors(Rig(whole, never_learnt), whole, 1, off) / mended).max() > 1.5


def test_without_the_unit_the_joints_go_on_alone_and_what_is_no_number_is_not_taken(whole: Robot) -> None:
    rigs = Rig(whole), Rig(whole)
    for k in range(20):
        for rig, sensed in zip(rigs, (False, True), strict=True):
            rig.measure(k * DT, np.zeros((4, N)), np.full(6, np.nan))
            rig.kalman.sensed = sensed
            if k:
                rig.kalman.update(rig.told(k * DT))
            else:
                rig.kalman.reset()
    np.testing.assert_array_equal(rigs[0].joints.state, rigs[1].joints.state)
    assert not rigs[1].kalman.bias.any()
