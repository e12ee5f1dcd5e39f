"""What the measurements of a machine must pass, from the limits of its axes and the scales of its sensors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, inf

import numpy as np
from numpy.typing import NDArray

from ...devices.device import Quantity
from ...devices.image import ProcessImage
from ...safety import Axes, Course, Motion, Thresholds, Values
from ...safety.plausibility import FROZEN_TICKS

Array = NDArray[np.float64]

JUMP_MARGIN = 1.5
"""Largest speed, in multiples of the allowed one, at which a position is believed by itself (row 10)."""
RUNAWAY_MARGIN = 4.0
"""The same where the measured velocity confirms it: whoever throws an axis is not a wrong encoder, and its
motor must brake."""
TOP_SPEED_S = 2e-3
"""Nothing gets from standstill to its top speed faster. The fastest here, the redundant interface under a
hand that pulls with 150 N, takes 4 ms."""
FULL_SCALE_S = 4e-3
"""No force or acceleration gets from nothing to its sensor's full scale faster; what an impact adds beyond
counts as invalid for a tick or two."""
QUANTUM = 1e-3
"""Part of the way at top speed in a tick that counts as motion: an increment or two of the encoders here."""
ACTING = 0.1
"""Part of an axis' largest command that no friction withstands: either it moves, or its encoder is frozen
(row 9)."""
REACH = 0.1
"""Way by the measured velocity, in ticks at top speed, that an encoder must have seen (row 9)."""
GRAINS = 2.0
"""Increments of an encoder that its axis may go unseen, or seems to go: it rounds at both ends of a way."""
FROZEN_S = 20e-3
"""A sensor whose values stand still for so long, to the last bit, while the machine moves is frozen (row
12)."""
STILL_SHARE = 0.02
"""Measured speed, as a share of the largest allowed one, at which a handle moves so little that a sensor
on it may show the same all the time."""
WINDOW_S, WINDOW_TICKS = 10e-3, 10
"""For so long position and velocity are compared, and at least for so many ticks (row 9)."""
CONTRADICTED = 0.1
"""Part of the way at top speed in that time by which they may contradict each other: what a drive's filter
of 1 ms delays while an axis brakes at twice its rated acceleration, and a brake that closes within a tick."""


def axes(
    image: ProcessImage,
    group: str,
    speed: Sequence[float],
    encoders: Mapping[str, Sequence[float]],
    command: tuple[Array, Sequence[float], Array | None],
    dt: float,
    spring: tuple[str, Array, Sequence[float]] | None = None,
    acceleration: Sequence[float] | None = None,
) -> Axes:
    """The checks of a group of drives, n axes.

    Args:
        image: the process image.
        group: its name.
        speed: largest of each axis, (n,) [rad/s or m/s].
        encoders: names of the positions, each with how far they may lag behind the axis' way, (n,).
        command: what the drives are told, its largest magnitudes, and what balances it, if measured; (n,).
        dt: of a tick [s].
        spring: the encoder behind it, torque in it (n,), and compliance (n,).
        acceleration: that the largest commands give, or more, (n,); None: far more than an increment of any
            encoder within FROZEN_TICKS.
    """
    fresh, devices, velocity = image.fresh, image.network.groups[group], image[f"{group}.velocity"]
    way = dt * np.array(speed)
    told, most, opposing = command
    acting, quantum = ACTING * np.array(most), QUANTUM * way
    nowhere = np.full(len(way), inf)
    fastest = [RUNAWAY_MARGIN * v for v in speed]
    rate = Values(velocity, devices, fresh, fastest, (way / TOP_SPEED_S).tolist())
    window = max(WINDOW_TICKS, round(WINDOW_S / dt))
    values, motions, courses = [rate], [], []
    for name, slack in encoders.items():
        position, unseen = image[f"{group}.{name}"], GRAINS * grains(image, group, name)
        believed = np.maximum(JUMP_MARGIN * way, unseen)
        place = Values(position, devices, fresh, nowhere.tolist(), believed.tolist(), rate, dt)
        values.append(place)
        # behind a spring an encoder goes its own way; the other encoder and the torque sensor judge that
        tolerance = np.where(np.array(slack) > 0.0, inf, np.maximum(CONTRADICTED * window * way, unseen))
        courses.append(Course(place, rate, tolerance.tolist(), window, dt))
        reach = np.maximum(REACH * way, unseen) + slack
        motions.append(
            Motion(
                *(position, velocity, told, opposing),
                *(acting.tolist(), quantum.tolist(), reach.tolist(), dt),
                spring[1:] if spring and spring[0] == name else None,
                _patience(unseen, acceleration, dt),
            )
        )
    return Axes(values, motions, courses)


def grains(image: ProcessImage, group: str, name: str) -> Array:
    """Least change that each device of a group can tell of a quantity, (n,)."""
    devices = [image.network.devices[i] for i in image.network.groups[group]]
    fields = [field for device in devices for field in device.inputs().values() if field.field == name]
    return np.array([abs(field.scale) for field in fields if isinstance(field, Quantity)])


def _patience(unseen: Array, acceleration: Sequence[float] | None, dt: float) -> list[int] | None:
    """Ticks in which a command of ACTING moves an axis there and back within what its encoder may not see."""
    if acceleration is None:
        return None
    times = 2.0 * np.sqrt(2.0 * unseen / (ACTING * np.array(acceleration)))
    return [max(FROZEN_TICKS, ceil(t / dt)) for t in times.tolist()]


def alive(sensor: Values, velocity: Sequence[float], limits: Thresholds) -> bool:
    """Whether a sensor on a machine that moves, with these measured velocities, measures at all (row 12)."""
    if not sensor.current:
        return False
    still = sensor.still
    if not still or still < limits.ticks(FROZEN_S):
        return True
    return all(abs(v) <= STILL_SHARE * most for v, most in zip(velocity, limits.speed, strict=True))


def sensor(
    image: ProcessImage, group: str, i: int, values: Array, scale: Sequence[float], dt: float
) -> Values:
    """The checks of what the i-th sensor of a group measures, (n,), with its full scales."""
    device = image.network.groups[group][i]
    step = [full * dt / FULL_SCALE_S for full in scale]
    return Values(values, [device] * len(scale), image.fresh, scale, step)
