"""Bias of a force-torque sensor, and mass and centre of what hangs on it, from poses at rest.

At rest a sensor that gravity g reaches in its own axes reads f = b_f + m g and t = b_t + (m c) x g
(Bimanual, section IV-D): linear in ten unknowns, in the order b_f, b_t, m, m c. Forces and torques share
none of them, so their units need no weights.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import radians, sin

import numpy as np

from ..models import Array

UNKNOWNS = 10
FEWEST_POSES = 6
"""Less leave residuals that say nothing."""
MOST_CONDITION = 3.0
"""Of a set of poses: directions of gravity all around have 1.2, within a cone of 60 degrees 3."""
LEVEL = radians(2.0)
"""What gravity's direction may be wrong by: a base that is out of level, encoders, links that bend."""
SPREAD = 5.0
"""Standard deviations beyond which noise explains nothing."""
LARGEST_SWAY = 1e-3
"""What a joint may move by while samples are taken [rad or m]."""
LARGEST_SHIFT = 1e-3
"""Part of the full scale by which both halves of the samples may differ beyond their noise."""
LARGEST_DRIFT = 2e-3
"""Part of the full scale by which the bias may wander between poses."""


@dataclass(frozen=True, slots=True)
class Tool:
    """What a sensor and what hangs on it add to a reading.

    Attributes:
        bias: of the sensor, (6,) [N, N m].
        mass: [kg].
        centre: of mass, in the sensor's frame, (3,) [m].
    """

    bias: Array
    mass: float
    centre: Array

    def reading(self, gravity: Array) -> Array:
        """Readings at rest, (n, 6) [N, N m], for gravity in the sensor's frame, (n, 3) [m/s^2]."""
        weight = self.mass * gravity
        return np.hstack([weight, np.cross(self.centre, weight)]) + self.bias


@dataclass(frozen=True, slots=True)
class Sample:
    """What was measured in one pose.

    Attributes:
        rotation: of the sensor's frame in that of the base, (3, 3).
        mean: of the readings, (6,) [N, N m].
        noise: standard deviation of one reading, (6,) [N, N m].
        count: of readings.
        shift: mean of their second half less that of the first, (6,) [N, N m].
        sway: the furthest that any joint moved meanwhile [rad or m].
    """

    rotation: Array
    mean: Array
    noise: Array
    count: int
    shift: Array
    sway: float

    @classmethod
    def of(cls, rotation: Array, readings: Array, joints: Array) -> Sample:
        """From readings (count, 6), at least four, and what the joints (count, m) did meanwhile."""
        half = len(readings) // 2
        shift = readings[half:].mean(axis=0) - readings[:half].mean(axis=0)
        return cls(
            rotation,
            readings.mean(axis=0),
            readings.std(axis=0, ddof=1),
            len(readings),
            shift,
            float(np.ptp(joints, axis=0).max(initial=0.0)),
        )


@dataclass(frozen=True, slots=True)
class Fit:
    """What a set of samples says.

    Attributes:
        tool: the estimate.
        error: its standard error by the residuals, as a tool: bias, mass, centre.
        condition: of the equations, gravity counted as one; 1 is best.
        residuals: measured less explained, (n, 6) [N, N m].
        scatter: standard deviations of a pose's force and torque by the residuals [N, N m].
    """

    tool: Tool
    error: Tool
    condition: float
    residuals: Array
    scatter: tuple[float, float]


class CalibrationError(Exception):
    """Samples that no calibration may be taken from.

    Attributes:
        reasons: why, each as a sentence for people.
    """

    def __init__(self, reasons: Sequence[str]) -> None:
        self.reasons = tuple(reasons)
        super().__init__("; ".join(reasons))


def gravity_at(rotations: Array, gravity: Array) -> Array:
    """Gravity (3,) of the base in the frames of sensors turned by rotations (n, 3, 3), (n, 3) [m/s^2]."""
    seen: Array = np.einsum("nji,j->ni", rotations, gravity)
    return seen


def equations(gravity: Array) -> tuple[Array, Array]:
    """Rows of the forces (3n, 4) in b_f and m, and of the torques (3n, 6) in b_t and m c; gravity (n, 3)."""
    n = len(gravity)
    ones = np.tile(np.eye(3), (n, 1))
    return (
        np.hstack([ones, gravity.reshape(-1, 1)]),
        np.hstack([ones, -np.vstack([_cross(g) for g in gravity])]),
    )


def condition(gravity: Array) -> float:
    """Condition number of the equations, the worse of forces and torques, gravity (n, 3) counted as one."""
    units = gravity / np.linalg.norm(gravity, axis=1, keepdims=True)
    worst = max(float(np.linalg.cond(rows)) for rows in equations(units))
    return worst if worst < 1.0 / np.finfo(float).eps else float("inf")


def fit(gravity: Array, mean: Array) -> Fit:
    """Least squares of mean readings (n, 6) [N, N m] under gravity (n, 3) [m/s^2] in the sensor's frame.

    Raises:
        CalibrationError: too few poses, or none that tell bias and weight apart, or a mass that is none.
    """
    n = len(gravity)
    if n < FEWEST_POSES:
        raise CalibrationError([f"{n} poses; it takes {FEWEST_POSES} at least, and 20 are usual"])
    worst = condition(gravity)
    if worst > MOST_CONDITION:
        raise CalibrationError([_cone(gravity, worst)])
    forces, torques = equations(gravity)
    x_f, spread_f, left_f = _solve(forces, mean[:, :3])
    x_t, spread_t, left_t = _solve(torques, mean[:, 3:])
    mass = float(x_f[3])
    if mass <= 0.0:
        problem = f"a mass of {mass:.3g} kg: gravity pulls the other way than the model says"
        raise CalibrationError([f"{problem}; check the sensor's frame, and its sign"])
    tool = Tool(np.concatenate([x_f[:3], x_t[:3]]), mass, x_t[3:] / mass)
    covariance = np.zeros((UNKNOWNS, UNKNOWNS))
    f, t = [0, 1, 2, 6], [3, 4, 5, 7, 8, 9]
    covariance[np.ix_(f, f)], covariance[np.ix_(t, t)] = spread_f, spread_t
    scatter = (
        float(np.sqrt(np.sum(left_f**2) / (3 * n - 4))),
        float(np.sqrt(np.sum(left_t**2) / (3 * n - 6))),
    )
    return Fit(tool, _errors(covariance, tool), worst, np.hstack([left_f, left_t]), scatter)


def theory(rotations: Array, gravity: Array, tool: Tool, scatter: Sequence[float], tilt: float) -> Tool:
    """Standard errors to expect of ``fit``, as a tool: what each pose scatters, and a base out of level.

    With directions of gravity all around, scatter s of the force gives s / sqrt(n) for the bias and
    s / (g sqrt(n)) for the mass. A tilt of the base is the same in all poses, so more of them do not help.

    Args:
        rotations: of the sensor's frame in that of the base, (n, 3, 3).
        gravity: as the base believes it, (3,) [m/s^2].
        tool: what hangs on the sensor.
        scatter: standard deviation of a pose's mean force [N] and torque [N m].
        tilt: root mean square of the angle between gravity and what the base believes [rad].
    """
    seen = gravity_at(rotations, gravity)
    f, t = [0, 1, 2, 6], [3, 4, 5, 7, 8, 9]
    covariance = np.zeros((UNKNOWNS, UNKNOWNS))
    forces, torques = equations(seen)
    covariance[np.ix_(f, f)] = scatter[0] ** 2 * np.linalg.inv(forces.T @ forces)
    covariance[np.ix_(t, t)] = scatter[1] ** 2 * np.linalg.inv(torques.T @ torques)
    along = gravity / np.linalg.norm(gravity)
    level = np.linalg.svd(along[None])[2][1:]  # two axes about which the base tilts
    for axis in level:
        turned = gravity_at(rotations, np.cross(axis, gravity))
        force = tool.mass * turned
        moved = np.zeros(UNKNOWNS)
        moved[f] = np.linalg.lstsq(forces, force.reshape(-1), rcond=None)[0]
        moved[t] = np.linalg.lstsq(torques, np.cross(tool.centre, force).reshape(-1), rcond=None)[0]
        covariance += tilt**2 / 2.0 * np.outer(moved, moved)
    return _errors(covariance, tool)


def calibrate(samples: Sequence[Sample], gravity: Array, scales: Sequence[float]) -> Fit:
    """The fit of samples that were taken at rest, around, and of one tool.

    Args:
        samples: one a pose.
        gravity: of the base, (3,) [m/s^2].
        scales: full scale of the sensor's force [N] and torque [N m].

    Raises:
        CalibrationError: with everything that speaks against them.
    """
    if moved := [line for i, sample in enumerate(samples, 1) for line in _unrest(i, sample, scales)]:
        raise CalibrationError(moved)
    seen = gravity_at(np.array([sample.rotation for sample in samples]).reshape(-1, 3, 3), gravity)
    found = fit(seen, np.array([sample.mean for sample in samples]).reshape(-1, 6))
    g, tool = float(np.linalg.norm(gravity)), found.tool
    weight = tool.mass * g * sin(LEVEL)
    parts = (
        (slice(3), weight, scales[0], "N of force"),
        (slice(3, 6), weight * float(np.linalg.norm(tool.centre)), scales[1], "N m of torque"),
    )
    reasons = []
    for part, lever, scale, unit in parts:
        noise = max(float(np.max(s.noise[part])) / s.count**0.5 for s in samples)
        allowed = lever + SPREAD * noise + LARGEST_DRIFT * scale
        left = np.linalg.norm(found.residuals[:, part], axis=1)
        worst = int(left.argmax())
        if left[worst] > allowed:
            reasons.append(
                f"pose {worst + 1}: {left[worst]:.3g} {unit} remain unexplained; noise, drift and gravity "
                f"that is wrong by 2 degrees make at most {allowed:.3g}: was the tool touched or changed, or "
                "is the sensor mounted otherwise than the model says?"
            )
    if reasons:
        raise CalibrationError(reasons)
    return found


def _unrest(number: int, sample: Sample, scales: Sequence[float]) -> list[str]:
    """Motion while a sample was taken."""
    if sample.sway > LARGEST_SWAY:
        return [f"pose {number}: a joint moved by {1e3 * sample.sway:.2g} mrad or mm while it was sampled"]
    half = SPREAD * sample.noise * (4.0 / sample.count) ** 0.5
    allowed = half + LARGEST_SHIFT * np.repeat(scales, 3)
    over = np.abs(sample.shift) - allowed
    if not over.max() > 0.0:
        return []
    axis = int(over.argmax())
    unit = "N" if axis < 3 else "N m"
    problem = f"pose {number}: the reading moved by {abs(sample.shift[axis]):.2g} {unit} while it was sampled"
    return [f"{problem}: let nobody touch the tool, and cables hang free"]


def _cone(gravity: Array, worst: float) -> str:
    """Why a set of directions is a bad one."""
    units = gravity / np.linalg.norm(gravity, axis=1, keepdims=True)
    middle = units.mean(axis=0)
    length = float(np.linalg.norm(middle))
    axis = middle / length if length > 0.0 else middle
    angle = np.degrees(np.arccos(np.clip(units @ axis, -1.0, 1.0))).max()
    return (
        f"the poses do not tell bias and weight apart: gravity stays within a cone of {angle:.0f} degrees "
        f"about one direction of the sensor, the condition number is {worst:.3g}, at most "
        f"{MOST_CONDITION:g} is good: turn the sensor further, upside down too"
    )


def _solve(rows: Array, values: Array) -> tuple[Array, Array, Array]:
    """Least squares: solution, its covariance by the residuals, and the residuals (n, 3)."""
    x: Array = np.array(np.linalg.lstsq(rows, values.reshape(-1), rcond=None)[0], float)
    left = values.reshape(-1) - rows @ x
    variance = float(left @ left) / (len(left) - len(x))
    covariance: Array = np.array(variance * np.linalg.inv(rows.T @ rows), float)
    return x, covariance, left.reshape(-1, 3)


def _errors(covariance: Array, tool: Tool) -> Tool:
    """Standard errors as a tool: those of the centre follow from m c and m."""
    to_centre = np.zeros((3, UNKNOWNS))
    to_centre[:, 6], to_centre[:, 7:] = -tool.centre / tool.mass, np.eye(3) / tool.mass
    std = np.sqrt(np.diag(covariance))
    centre = np.sqrt(np.diag(to_centre @ covariance @ to_centre.T))
    return Tool(std[:6], float(std[6]), centre)


def _cross(v: Array) -> Array:
    """The matrix of v x."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
