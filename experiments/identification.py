"""Least squares for what is between a motor and its link: rotor, friction of the gear, spring.

A recording has, of each joint, what its motor was told, its speed, the torque sensor, and both encoders.
Means over windows satisfy

    told - load = J dw / T + (c + s |load|) sign(w) + b w + e load + offset
                                                                        (rotor and gear; HapticGiant, VI-E)
    load        = k (motor - link) + d (motor - link)' + offset         (spring)

Neither needs a model of the links, and nothing is differentiated twice. Offsets, and the error e of its gain,
are those of the sensors.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..models import Array
from .least_squares import Estimate, Fit, least_squares

WINDOW = 10
"""Ticks of a window."""
MOST_LATE = 5
"""Ticks at most from a command to what is measured of it."""
MOVING = 0.02
"""Part of its top speed at which friction has the direction of the motion."""
LEAST_WINDOWS = 100
"""Fewer say nothing of errors."""
LEAST_LOAD = 0.03
"""Part of its largest torque by which a load must vary to tell a spring: two standard deviations."""
LEAST_INERTIAL = 0.02
"""The same for what its rotor takes."""
LEAST_SHARE = 0.1
"""Part of the windows in each direction without which Coulomb friction is an offset."""
MOTOR = "rotor_inertia", "coulomb", "load_friction", "viscous"
"""What is identified with the motor."""
KNOWN = 0.01
"""Part of a joint's largest torque, at its top speed or under a load of that size, by which a friction may be
uncertain: feeding forward less than is known helps nobody."""
TRUSTED = 0.1
"""Standard error, as a share of the estimate, beyond which a stiffness or an inertia is not identified."""


@dataclass(frozen=True, slots=True)
class Recorded:
    """Ticks of one joint in a row while its drive moved it, (k,) each [rad or m, s, N m or N].

    Attributes:
        told: what the motor was told; load: by its torque sensor.
        speed: of the motor; deflection: motor less link.
    """

    told: Array
    load: Array
    speed: Array
    deflection: Array


@dataclass(frozen=True, slots=True)
class Identified:
    """What a joint's recording says.

    Attributes:
        found: by name: "rotor_inertia"; "viscous", "coulomb", "load_friction" (a share of the load) of the
            gear; "stiffness".
        residual: standard deviations of what is left of both equations [N m or N].
        late: ticks from a command to what was measured of it; 0 where that is not known.
        refused: what could not be told, and why, as sentences.
    """

    found: Mapping[str, Estimate]
    residual: Mapping[str, float]
    late: int
    refused: Sequence[str]


def identify(runs: Sequence[Recorded], torque: float, top_speed: float, dt: float) -> Identified:
    """What is between a motor and its link.

    Args:
        runs: of the joint.
        torque: its largest [N m or N].
        top_speed: [rad/s or m/s].
        dt: of a tick [s].
    """
    found: dict[str, Estimate] = {}
    residual: dict[str, float] = {}
    refused: list[str] = []
    _spring(runs, torque, dt, found, residual, refused)
    late = _motor(runs, torque, top_speed, dt, found, residual, refused)
    return Identified(found, residual, late, refused)


def _means(values: Array, begin: int, end: int) -> Array:
    """Means over windows of ticks begin to end, (w,)."""
    windows = (end - begin) // WINDOW
    means: Array = values[begin : begin + windows * WINDOW].reshape(windows, WINDOW).mean(axis=1)
    return means


def _spring(
    runs: Sequence[Recorded],
    torque: float,
    dt: float,
    found: dict[str, Estimate],
    residual: dict[str, float],
    refused: list[str],
) -> None:
    load = np.concatenate([_means(run.load, 0, len(run.load)) for run in runs])
    deflection = np.concatenate([_means(run.deflection, 0, len(run.load)) for run in runs])
    rate = np.concatenate([_means(np.gradient(run.deflection, dt), 0, len(run.load)) for run in runs])
    if len(load) < LEAST_WINDOWS or 2.0 * load.std() < LEAST_LOAD * torque:
        swing = 2.0 * load.std() if len(load) else 0.0
        refused.append(
            f"stiffness: the load varied by {swing:.3g} of {torque:g}; it takes {LEAST_LOAD:.0%}: pull harder"
        )
        return
    fit = least_squares([deflection, rate, np.ones(len(load))], load)
    residual["spring"] = fit.residual
    # what the rate takes is the spring's damping and what its sensors lag each other by, both in one
    _keep(found, refused, {"stiffness": (fit.values[0], fit.errors[0])}, {"stiffness"})


def _motor(
    runs: Sequence[Recorded],
    torque: float,
    top_speed: float,
    dt: float,
    found: dict[str, Estimate],
    residual: dict[str, float],
    refused: list[str],
) -> int:
    best: tuple[Fit, int, Array] | None = None
    for late in range(1, MOST_LATE + 1):
        columns, target = _rows(runs, top_speed, dt, late)
        if len(target) < LEAST_WINDOWS:
            continue
        fit = least_squares(list(columns.T), target)
        if best is None or fit.residual < best[0].residual:
            best = fit, late, columns
    if best is None:
        refused.append("rotor and friction: the joint hardly moved: lead it to and fro")
        return 0
    fit, late, columns = best
    direction, load = columns[:, 1], columns[:, 2]
    names = list(MOTOR)
    swing = 2.0 * float(np.abs(load).std())
    if (
        swing < LEAST_LOAD * torque
    ):  # what moves with the link would pass for friction, or the other way round
        refused.append(
            f"load_friction: what it acts on varied by {swing:.3g} of {torque:g}; it takes {LEAST_LOAD:.0%}"
        )
        names.remove("load_friction")
        _, target = _rows(runs, top_speed, dt, late)
        fit = least_squares([columns[:, k] for k in (0, 1, 3, 5)], target)
    if min(np.mean(direction > 0.0), np.mean(direction < 0.0)) < LEAST_SHARE:
        refused.append("rotor and friction: the joint moved in one direction only: lead it to and fro")
        return late
    residual["motor"] = fit.residual
    m = len(names)
    estimates = dict(zip(names, zip(fit.values[:m], fit.errors[:m], strict=True), strict=True))
    taken = 2.0 * float((columns[:, 0] * fit.values[0]).std())
    if taken < LEAST_INERTIAL * torque:
        del estimates["rotor_inertia"]
        least = f"it takes {LEAST_INERTIAL:.0%}"
        refused.append(f"rotor_inertia: what it acts on varied by {taken:.3g} of {torque:g}; {least}")
    at = {"coulomb": 1.0, "load_friction": torque, "viscous": top_speed}
    for name in [name for name in at if name in estimates]:
        value, error = estimates[name]
        if not error * at[name] <= KNOWN * torque:
            refused.append(f"{name}: {value:.4g} +- {error:.2g} is too uncertain: record more of it")
            del estimates[name]
    _keep(found, refused, estimates, {"rotor_inertia"})
    return late


def _rows(runs: Sequence[Recorded], top_speed: float, dt: float, late: int) -> tuple[Array, Array]:
    """Of windows in which a joint moves in one direction: what the unknowns multiply (w, 6), torque (w,)."""
    rows, targets = [], []
    for run in runs:
        begin, end = MOST_LATE - 1, len(run.load) - 1  # the same windows, however late
        if end - begin < WINDOW:
            continue
        windows = (end - begin) // WINDOW
        at = begin + WINDOW * np.arange(windows + 1)
        told = _means(run.told, begin - late + 1, begin - late + 1 + windows * WINDOW)
        between = 0.5 * (run.load[:-1] + run.load[1:])  # a command acts from one measurement to the next
        load, speed = _means(between, begin, at[-1]), _means(run.speed, begin, at[-1])
        faster = np.diff(run.speed[at]) / (WINDOW * dt)
        pieces = run.speed[begin : at[-1]].reshape(windows, WINDOW)
        moving = np.abs(pieces).min(axis=1) > MOVING * top_speed
        moving &= (pieces > 0.0).all(axis=1) | (pieces < 0.0).all(axis=1)
        sign = np.sign(speed)
        columns = np.column_stack([faster, sign, np.abs(load) * sign, speed, load, np.ones(windows)])
        rows.append(columns[moving])
        targets.append((told - load)[moving])
    if not rows:
        return np.zeros((0, 6)), np.zeros(0)
    return np.concatenate(rows), np.concatenate(targets)


def _keep(
    found: dict[str, Estimate],
    refused: list[str],
    estimates: Mapping[str, tuple[float, float]],
    essential: set[str],
) -> None:
    for name, (value, error) in estimates.items():
        if name in essential and not error <= TRUSTED * value:
            refused.append(f"{name}: {value:.4g} +- {error:.2g} is too uncertain: record more of it")
        else:
            found[name] = Estimate(float(value), float(error))
