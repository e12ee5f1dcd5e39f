"""Courses that excite: within limits, from rest to rest, and better conditioned than what comes by chance."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from hapticd.control.excitation import DRAWS, HARMONICS, Excitation, Room, condition, design
from hapticd.models import Array

DT, SECONDS = 1e-3, 12.0
LOWER, UPPER = np.array([-1.0, -np.inf]), np.array([0.5, np.inf])
VELOCITY, ACCELERATION = np.array([1.0, 2.0]), np.array([6.0, 5.0])


def room(fits: bool = True, above: float = -10.0) -> Room:
    def within(q: Array, qd: Array, qdd: Array) -> bool:
        return fits and bool((q.sum(axis=1) >= above).all())

    return Room(LOWER, UPPER, VELOCITY, ACCELERATION, lambda q: True, within)


def pendulum(q: Array, qd: Array, qdd: Array) -> Array:
    """Two pendulums, each with inertia, weight and friction."""
    rows = np.zeros((len(q), 2, 6))
    for i in range(2):
        rows[:, i, 3 * i : 3 * i + 3] = np.column_stack([qdd[:, i], np.sin(q[:, i]), qd[:, i]])
    return rows.reshape(-1, 6)


@functools.cache
def course(seed: int = 3) -> Excitation:
    found = design(np.zeros(2), room(), pendulum, SECONDS, seed, DT)
    assert found is not None
    return found[0]


def test_speeds_and_accelerations_are_the_derivatives_of_the_places() -> None:
    t = np.arange(0.0, SECONDS + DT / 2, DT)
    q, qd, qdd = course().at(t)
    np.testing.assert_allclose(np.gradient(q, DT, axis=0)[1:-1], qd[1:-1], atol=2e-5)
    np.testing.assert_allclose(np.gradient(qd, DT, axis=0)[1:-1], qdd[1:-1], atol=1e-3)
    for end in (0, -1):
        np.testing.assert_allclose([qd[end], qdd[end]], 0.0, atol=1e-12)
    np.testing.assert_allclose(q[0], q[-1])


def test_a_course_keeps_to_all_limits_and_uses_them() -> None:
    q, qd, qdd = course().at(np.arange(0.0, SECONDS, 0.05))
    assert (q >= LOWER).all() and (q <= UPPER).all()
    speed, acceleration = np.abs(qd).max(axis=0) / VELOCITY, np.abs(qdd).max(axis=0) / ACCELERATION
    assert (speed <= 1.0).all() and (acceleration <= 1.0).all()
    assert (np.maximum(speed, acceleration) > 0.5).all()


def test_tick_by_tick_it_is_the_same_course_and_ends() -> None:
    led = Excitation(course().centre, course().waves, SECONDS, DT)
    for _ in range(1500):
        led.advance()
    q, qd, qdd = led.at(np.array([1.5]))
    np.testing.assert_array_equal([led.q, led.qd, led.qdd], [q[0], qd[0], qdd[0]])
    while not led.arrived:
        led.advance()
    led.advance()
    np.testing.assert_allclose(led.q, led.centre)


def test_the_chosen_course_is_better_conditioned_than_those_of_chance_and_of_its_seed() -> None:
    t = np.arange(0.0, SECONDS, 0.05)
    best = condition(pendulum(*course().at(t)))
    rng = np.random.default_rng(77)
    chance = [
        condition(pendulum(*Excitation(np.zeros(2), 0.1 * rng.standard_normal((2, len(HARMONICS), 2)),
                                       SECONDS, DT).at(t)))
        for _ in range(DRAWS)
    ]  # fmt: skip
    assert best < 0.7 * np.median(chance)
    assert best <= min(chance)
    again = design(np.zeros(2), room(), pendulum, SECONDS, 3, DT)
    assert again is not None
    np.testing.assert_array_equal(again[0].waves, course().waves)
    assert not np.array_equal(course().waves, course(6).waves)


def test_what_else_a_course_must_keep_to_makes_it_smaller_or_leaves_none() -> None:
    found = design(np.array([0.0, 0.0]), room(above=-0.3), pendulum, SECONDS, 3, DT)
    assert found is not None
    assert found[0].at(np.arange(0.0, SECONDS, 0.05))[0].sum(axis=1).min() >= -0.3
    assert design(np.zeros(2), room(False), pendulum, SECONDS, 3, DT) is None


def test_a_parameter_that_nothing_tells_has_an_infinite_condition() -> None:
    assert condition(np.array([[1.0, 0.0], [2.0, 0.0]])) == np.inf
    assert condition(np.eye(3) * [1.0, 5.0, 1e6]) == pytest.approx(1.0)  # units do not matter
