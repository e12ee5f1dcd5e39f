"""Walls push and never pull; a sensor that smooths has the lag of its low-pass."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from hapticd.sim.hold import Hold
from hapticd.sim.smoothed import Smoothed
from hapticd.sim.wall import Wall, Walls

WALL = Wall(np.array([0.5, 0.0, 0.0]), np.array([-2.0, 0.0, 0.0]), 3000.0, 20.0)
STILL = np.zeros(3)


def pressed(walls: Walls, place: list[float], velocity: list[float] | None = None) -> Hold:
    hold = Hold()
    walls.press(hold, np.array(place), np.array(velocity or STILL))
    return hold


def test_in_front_of_it_nothing_acts() -> None:
    assert not pressed(Walls([WALL]), [0.49, 3.0, 0.0]).strength.any()
    assert not pressed(Walls([]), [0.0, 0.0, 0.0]).strength.any()


def test_inside_it_pushes_back_along_its_normal() -> None:
    hold = pressed(Walls([WALL]), [0.51, 1.0, 2.0])
    assert hold.strength[0] > 1e3 and hold.strength[1] == 0.0
    assert hold.stiffness[0] * hold.error[:3] == pytest.approx([-30.0, 0.0, 0.0])


def test_it_lets_go_of_what_leaves_faster_than_it_springs_back() -> None:
    assert pressed(Walls([WALL]), [0.51, 0.0, 0.0], [-1.4, 0.0, 0.0]).strength[0] > 0.0
    assert pressed(Walls([WALL]), [0.51, 0.0, 0.0], [-1.6, 0.0, 0.0]).strength[0] == 0.0


def test_of_several_the_deepest_counts() -> None:
    floor = Wall(np.zeros(3), np.array([0.0, 0.0, 1.0]), 1000.0, 5.0)
    hold = pressed(Walls([WALL, floor]), [0.51, 0.0, -0.02])
    assert hold.stiffness[0] == 1000.0 and hold.error[2] == pytest.approx(0.02)


def test_a_smoothed_sensor_has_its_cutoff_and_samples_every_other_period() -> None:
    dt, cutoff = 1e-3, 15.0
    sensor = Smoothed(1, cutoff, 2)
    t = np.arange(4000) * dt
    seen = np.array([sensor.take(np.array([np.sin(2 * pi * cutoff * x)]), dt)[0] for x in t])
    assert np.abs(seen[2000:]).max() == pytest.approx(0.5**0.5, rel=0.05)
    assert (seen[0::2] == seen[1::2]).all() and (np.diff(seen[2000::2]) != 0.0).all()


def test_a_smoothed_sensor_begins_with_what_it_feels() -> None:
    assert Smoothed(2, 15.0, 2).take(np.array([3.0, -1.0]), 0.0).tolist() == [3.0, -1.0]
