"""Inertia and friction that a hand feels along a line, from how its pushes move the handle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..models import Array
from .least_squares import Estimate, least_squares
from .zero_phase import zero_phase

CUT_OFF = 80.0
"""Cut-off of the filter [Hz]; the paper gives its order only."""
WINDOW = 0.01
"""Samples this close to the point take part [m]."""
LEAST_SAMPLES = 50
"""Fewer say nothing."""
WORST_CONDITION = 50.0
"""Of the regressor, its columns scaled to one length: beyond, inertia and friction pass for each other."""
EXPLAINED = 0.8
"""Part of the force, root mean square, that the model has to explain."""
ASIDE = 0.005
"""Acceleration across the line that counts, as a share of that along it, root mean square."""
TINY = 1e-300
"""A column of zeros stays one."""
TRUSTED = 0.1
"""Standard error, as a share of the inertia, beyond which nothing is told."""


@dataclass(frozen=True, slots=True)
class Push:
    """Ticks in a row.

    Attributes:
        along: the handle's coordinate along the line (k,) [m]; across: two others (k, 2) [m].
        force: on it, along the line (k,) [N].
    """

    along: Array
    across: Array
    force: Array


@dataclass(frozen=True, slots=True)
class Apparent:
    """What the pushes say.

    Attributes:
        inertia: [kg]; friction: viscous [N s/m]; change: of the inertia along the line [kg/m].
        residual: standard deviation of the force that is left [N].
        condition: number of the regressor.
        samples: that took part: acceleration, speed, force and what the fit leaves of it, (4, k).
    """

    inertia: Estimate
    friction: Estimate
    change: Estimate
    residual: float
    condition: float
    samples: Array


class UnexcitedError(ValueError):
    """Pushes that do not tell inertia and friction."""


def apparent(pushes: Sequence[Push], point: float, rate: float, window: float = WINDOW) -> Apparent:
    """Least squares on F = M a + b v + M' (a (x - p) + v^2 / 2) + o over the samples x next to a point p.

    That is (22) of ContactAware with the force that a change M' of the inertia along the line takes, which
    would pass for friction; and, where there are pushes both ways, with an offset o of sensor or motors.
    Where the handle yields across the line, what that takes along it by inertia and friction is fitted, too.
    All terms pass the same filter.

    Args:
        pushes: recorded at a rate [Hz].
        point: coordinate along the line where inertia and friction are asked for [m].
        rate: of the samples.
        window: distance from the point up to which they take part [m].

    Raises:
        UnexcitedError: the pushes do not tell; says what they lack.
    """
    parts = [_terms(push, point, rate)[:, np.abs(push.along - point) < window] for push in pushes]
    a, v, changes, f, *across = np.concatenate(parts, axis=1)
    if len(f) < LEAST_SAMPLES:
        raise UnexcitedError(
            f"{len(f)} samples within {1e3 * window:g} mm of the point; it takes {LEAST_SAMPLES}"
        )
    columns = [a, v, changes]
    if v.min() < 0.0 < v.max():
        columns.append(np.ones(len(f)))
    pairs = zip(across[::2], across[1::2], strict=True)
    least = ASIDE * np.linalg.norm(a)
    yields = [each for pair in pairs if np.linalg.norm(pair[0]) > least for each in pair]
    columns += yields
    A = np.column_stack(columns)
    condition = float(np.linalg.cond(A / np.maximum(np.linalg.norm(A, axis=0), TINY)))
    if not condition < WORST_CONDITION:
        alike = "its acceleration and speed" + (", and what it does across the line," if yields else "")
        raise UnexcitedError(
            f"{alike} are alike in all samples, condition number {condition:.0f} above {WORST_CONDITION:g}:"
            " inertia cannot be told from what else takes force"
        )
    found = least_squares(columns, f)
    values, errors = found.values.tolist(), found.errors.tolist()
    inertia, friction, change = map(Estimate, values[:3], errors[:3])
    size = float(np.sqrt(np.mean(f * f)))
    if found.residual > (1.0 - EXPLAINED) * size:
        raise UnexcitedError(
            f"inertia and viscous friction leave {found.residual:.2g} N of {size:.2g} N (root mean square);"
            " something else pushes, or sticks"
        )
    if not inertia.value > 0.0 or inertia.error > TRUSTED * inertia.value:
        raise UnexcitedError(
            f"the inertia is {inertia.value:.2g} +- {inertia.error:.1g} kg: too uncertain to be told"
        )
    samples = np.array([a, v, f, f - A @ found.values])
    return Apparent(inertia, friction, change, found.residual, condition, samples)


def _terms(push: Push, point: float, rate: float) -> Array:
    """Acceleration, speed, what a change of the inertia multiplies, force; both across, twice, (8, k)."""
    v, a = _rates(push.along, rate)
    terms = [a, v, a * (push.along - point) + 0.5 * v * v, push.force]
    for coordinate in push.across.T:
        terms += reversed(_rates(coordinate, rate))
    return np.array([zero_phase(term, CUT_OFF, rate, mirrored=True) for term in terms])


def _rates(coordinate: Array, rate: float) -> tuple[Array, Array]:
    v = np.gradient(coordinate, 1.0 / rate)
    return v, np.gradient(v, 1.0 / rate)
