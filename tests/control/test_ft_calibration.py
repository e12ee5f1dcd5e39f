"""Bias, mass and centre from poses at rest: exact without noise, and as wrong as theory says with it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hapticd.control.ft_calibration import (
    CalibrationError,
    Sample,
    Tool,
    calibrate,
    condition,
    fit,
    gravity_at,
    theory,
)
from hapticd.models import Array

GRAVITY = np.array([0.0, 0.0, -9.81])
TOOL = Tool(np.array([4.0, -7.0, 12.0, 0.3, -0.2, 0.1]), 1.3, np.array([0.01, -0.02, 0.06]))
SCATTER = 0.03, 0.002
"""Of the mean of a pose [N, N m]."""
SCALES = 200.0, 20.0
HALF = np.radians(0.5)
SETS = 200


def turned(rng: np.random.Generator, n: int = 20) -> Array:
    """Rotations without a preference, (n, 3, 3)."""
    q = rng.standard_normal((n, 4))
    return np.array([pin.Quaternion(x / np.linalg.norm(x)).toRotationMatrix() for x in q])


def within(rng: np.random.Generator, angle: float, n: int = 20) -> Array:
    """Rotations with gravity within a cone about one axis of the sensor."""
    found = []
    while len(found) < n:
        R = turned(rng, 1)[0]
        if R.T @ GRAVITY @ [0.0, 0.0, -1.0] > 9.81 * np.cos(angle):
            found.append(R)
    return np.array(found)


def vector(tool: Tool) -> Array:
    return np.concatenate([tool.bias, [tool.mass], tool.centre])


def noise(rng: np.random.Generator, n: int) -> Array:
    return rng.standard_normal((n, 6)) * np.repeat(SCATTER, 3)


def samples(rng: np.random.Generator, rotations: Array, sigma: float = 0.3) -> list[Sample]:
    """A hundred readings in each pose."""
    truth = TOOL.reading(gravity_at(rotations, GRAVITY))
    stds = sigma * np.array([1.0, 1.0, 1.0, 0.05, 0.05, 0.05])
    still = np.zeros((100, 7))
    return [
        Sample.of(R, row + stds * rng.standard_normal((100, 6)), still)
        for R, row in zip(rotations, truth, strict=True)
    ]


def test_without_noise_the_tool_is_found_exactly() -> None:
    """The readings come from another formula: the wrench of a point mass, moved to the sensor."""
    rng = np.random.default_rng(1)
    rotations = turned(rng)
    readings = []
    for R in rotations:
        at_centre = pin.SE3(R, np.zeros(3)) * pin.SE3(np.eye(3), TOOL.centre)
        weight = pin.Force(TOOL.mass * GRAVITY, np.zeros(3))
        at_sensor = pin.SE3(np.eye(3), TOOL.centre).act(
            pin.Force(at_centre.rotation.T @ weight.linear, np.zeros(3))
        )
        readings.append(at_sensor.vector + TOOL.bias)
    found = fit(gravity_at(rotations, GRAVITY), np.array(readings))
    np.testing.assert_allclose(vector(found.tool), vector(TOOL), atol=1e-12)
    assert max(found.scatter) < 1e-12


@pytest.mark.parametrize("tilt", [0.0, HALF], ids=["level", "half a degree out of level"])
def test_errors_of_200_sets_are_within_20_percent_of_theory(tilt: float) -> None:
    """Ten ratios of an error to what theory expects of it, each by its root mean square over the sets."""
    rng = np.random.default_rng(2)
    ratios = []
    for _ in range(SETS):
        rotations, heading = turned(rng), rng.uniform(0.0, 2.0 * np.pi)
        leaning = pin.exp3(tilt * np.array([np.cos(heading), np.sin(heading), 0.0])) @ GRAVITY
        mean = TOOL.reading(gravity_at(rotations, leaning)) + noise(rng, 20)
        found = fit(gravity_at(rotations, GRAVITY), mean)
        expected = theory(rotations, GRAVITY, TOOL, SCATTER, tilt)
        ratios.append((vector(found.tool) - vector(TOOL)) / vector(expected))
    rms = np.sqrt(np.mean(np.square(ratios), axis=0))
    assert ((rms > 0.8) & (rms < 1.2)).all(), rms


def test_half_a_degree_of_gravity_outweighs_the_noise() -> None:
    """More samples help against noise, not against a base that is out of level."""
    rotations = turned(np.random.default_rng(3))
    quiet = tuple(x / 10.0 for x in SCATTER)
    level, leaning = (theory(rotations, GRAVITY, TOOL, quiet, tilt) for tilt in (0.0, HALF))
    assert (leaning.bias[:3] > 2.0 * level.bias[:3]).all()
    assert leaning.mass > 1.5 * level.mass


def test_theory_is_the_textbook_formula_where_gravity_comes_from_all_around() -> None:
    """Six directions, each three times: sigma / sqrt(n) of the bias, sigma / (g sqrt(n)) of the mass."""
    faces = [pin.exp3(np.pi / 2 * k * np.eye(3)[0]) for k in range(4)]
    faces += [pin.exp3(np.pi / 2 * k * np.eye(3)[1]) for k in (1, 3)]
    rotations = np.array(3 * faces)
    expected = theory(rotations, GRAVITY, TOOL, SCATTER, 0.0)
    np.testing.assert_allclose(expected.bias, np.repeat(SCATTER, 3) / 18**0.5, rtol=1e-12)
    assert expected.mass == pytest.approx(SCATTER[0] / 9.81 / 18**0.5)
    assert condition(gravity_at(rotations, GRAVITY)) == pytest.approx(1.5**0.5)


def test_standard_errors_that_a_fit_gives_are_those_of_theory() -> None:
    rng = np.random.default_rng(4)
    rotations = turned(rng, 400)
    mean = TOOL.reading(gravity_at(rotations, GRAVITY)) + noise(rng, 400)
    found = fit(gravity_at(rotations, GRAVITY), mean)
    np.testing.assert_allclose(found.scatter, SCATTER, rtol=0.1)
    expected = theory(rotations, GRAVITY, TOOL, SCATTER, 0.0)
    np.testing.assert_allclose(vector(found.error), vector(expected), rtol=0.1)


def test_a_cone_of_poses_is_refused_and_would_have_been_worse() -> None:
    rng = np.random.default_rng(5)
    wide, narrow = turned(rng), within(rng, np.radians(30.0))
    worse = vector(theory(narrow, GRAVITY, TOOL, SCATTER, 0.0)) / vector(
        theory(wide, GRAVITY, TOOL, SCATTER, 0.0)
    )
    assert worse.max() > 2.0
    with pytest.raises(CalibrationError, match=r"cone of \d\d degrees.*condition number"):
        calibrate(samples(rng, narrow), GRAVITY, SCALES)
    assert calibrate(samples(rng, wide), GRAVITY, SCALES).condition < 2.0
    # one direction only, as of an arm with vertical axes: nothing tells bias and weight apart
    with pytest.raises(CalibrationError, match="condition number is inf"):
        calibrate(samples(rng, np.array([np.eye(3)] * 20)), GRAVITY, SCALES)


def test_a_tool_that_somebody_touched_in_one_pose_is_refused() -> None:
    rng = np.random.default_rng(6)
    taken = samples(rng, turned(rng))
    taken[6].mean[0] += 2.0
    with pytest.raises(CalibrationError, match=r"pose 7: .* N of force remain unexplained"):
        calibrate(taken, GRAVITY, SCALES)
    taken[6].mean[0] -= 2.0
    taken[11].mean[4] += 0.3
    with pytest.raises(CalibrationError, match=r"pose 12: .* N m of torque remain unexplained"):
        calibrate(taken, GRAVITY, SCALES)


def test_a_sensor_that_is_mounted_otherwise_is_refused() -> None:
    rng = np.random.default_rng(7)
    taken = samples(rng, turned(rng))
    for turn in (pin.exp3(np.array([0.0, 0.0, 0.5])), np.diag([-1.0, -1.0, 1.0])):
        other = [replace(sample, rotation=sample.rotation @ turn) for sample in taken]
        with pytest.raises(CalibrationError, match=r"mounted otherwise|the other way"):
            calibrate(other, GRAVITY, SCALES)
    with pytest.raises(CalibrationError, match="gravity pulls the other way"):
        calibrate([replace(sample, mean=-sample.mean) for sample in taken], GRAVITY, SCALES)


def test_motion_while_a_sample_is_taken_is_refused() -> None:
    rng = np.random.default_rng(8)
    taken = samples(rng, turned(rng))
    ramp = np.linspace(0.0, 1.0, 100)[:, None]
    readings = taken[2].mean + 0.3 * rng.standard_normal((100, 6))
    moving = Sample.of(taken[2].rotation, readings, 0.01 * ramp * np.ones(7))
    with pytest.raises(CalibrationError, match=r"pose 3: a joint moved by 10 mrad"):
        calibrate([*taken[:2], moving, *taken[3:]], GRAVITY, SCALES)
    pushed = Sample.of(taken[2].rotation, readings + 4.0 * ramp * np.eye(6)[1], np.zeros((100, 7)))
    with pytest.raises(CalibrationError, match=r"pose 3: the reading moved by .* N while"):
        calibrate([*taken[:2], pushed, *taken[3:]], GRAVITY, SCALES)


def test_too_few_poses_are_refused() -> None:
    rng = np.random.default_rng(9)
    with pytest.raises(CalibrationError, match="4 poses"):
        calibrate(samples(rng, turned(rng, 4)), GRAVITY, SCALES)
    with pytest.raises(CalibrationError, match="0 poses"):
        calibrate([], GRAVITY, SCALES)
