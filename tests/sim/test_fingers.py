"""Simulated fingers give no energy away, raise their currents in contact, and hold a person's by brakes."""

from __future__ import annotations

import numpy as np
import pytest
from hapticd.control.hands import Brakes, Drive, HandMap
from hapticd.devices.cia301 import AlState
from hapticd.devices.network import Network
from hapticd.devices.robot_hand import ENABLED, HandStatus
from hapticd.devices.sense_glove import GLOVE_JOINTS, SenseGlove
from hapticd.devices.svh_hand import SvhHand
from hapticd.sim.fingers import CLOSED, Fingers, GlovedFingers, Grasped, Servo
from hapticd.sim.nodes import SimNodes

DT = 1e-3
OPEN, FIST = np.zeros(5), np.full(5, 1.5)


def hand(at: float = np.inf) -> Fingers:
    fingers = Fingers(OPEN, FIST, Servo())
    fingers.grasped = Grasped(np.full(5, at))
    return fingers


def test_a_free_finger_arrives_without_a_lasting_current_and_one_in_contact_does_not() -> None:
    free, held = hand(), hand(at=0.6)
    for fingers in (free, held):
        for _ in range(1500):
            fingers.step(np.full(5, 1.0), True, DT)
    np.testing.assert_allclose(free.position, 1.0, atol=1e-3)
    assert np.abs(free.current).max() < 0.01
    # equilibrium of both springs: 2 (1 - q) = 20 (q - 0.6) where the current does not saturate
    s = Servo()
    q = min((2.0 * 1.0 + 20.0 * 0.6) / 22.0, 0.6 + s.torque * s.current / 20.0)
    np.testing.assert_allclose(held.position, q, atol=1e-3)
    assert held.current.min() > 0.35


def test_harder_squeezing_takes_more_current_up_to_its_limit() -> None:
    currents = []
    for target in (0.65, 0.7, 0.8, 1.4):
        fingers = hand(at=0.6)
        for _ in range(1500):
            fingers.step(np.full(5, target), True, DT)
        currents.append(fingers.current[0])
    assert currents == sorted(currents)
    assert currents[-1] == Servo().current


@pytest.mark.parametrize("seed", range(5))
def test_without_current_energy_only_falls(seed: int) -> None:
    rng = np.random.default_rng(seed)
    fingers = hand(at=0.6)
    fingers.position[:], fingers.velocity[:] = rng.uniform(0.2, 0.7, 5), rng.uniform(-8.0, 8.0, 5)
    before, most = fingers.energy, 0.0
    begin = before
    for _ in range(2000):
        fingers.step(np.zeros(5), False, DT)
        most = max(most, fingers.energy - before)
        before = fingers.energy
    assert most < 0.02 * begin  # semi-implicit steps swing by a little about the true energy
    assert fingers.energy < 0.05 * begin
    assert (fingers.current == 0.0).all()


@pytest.mark.parametrize("seed", range(5))
def test_random_targets_never_pass_the_stops_or_the_current(seed: int) -> None:
    rng = np.random.default_rng(seed)
    fingers = hand(at=float(rng.uniform(0.2, 1.2)))
    for target in np.repeat(rng.uniform(-2.0, 4.0, (30, 5)), 50, axis=0):
        fingers.step(target, bool(rng.uniform() > 0.05), DT)
        assert (fingers.position >= OPEN).all() and (fingers.position <= FIST).all()
        assert (np.abs(fingers.current) <= Servo().current).all()
        assert (fingers.contact <= 0.0).all()


def test_a_brake_holds_a_finger_against_closing_and_lets_it_open() -> None:
    fingers = GlovedFingers()
    for _ in range(500):
        fingers.step([0.4] * 5, [False] * 5, DT)
    held = [True, False, False, False, False]
    for _ in range(500):
        fingers.step([1.0] * 5, held, DT)
    assert fingers.closed[0] < 0.5 and fingers.closed[1] > 0.95
    for _ in range(500):
        fingers.step([0.1] * 5, held, DT)
    np.testing.assert_allclose(fingers.closed, 0.1, atol=1e-3)
    np.testing.assert_allclose(fingers.angle, (0.1 * CLOSED).reshape(-1), atol=2e-3)


def test_without_valid_outputs_no_brake_holds_and_no_drive_pushes() -> None:
    nodes = SimNodes(Network([SenseGlove(name="glove", node=1), SvhHand(name="hand", node=2)]))
    glove, svh = nodes["glove"], nodes["hand"]
    glove.brakes, svh.enable = 0b10001, ENABLED  # type: ignore[attr-defined]
    fingers = Fingers(np.zeros(9), np.ones(9), Servo())
    svh.fields["target"][:] = 0.5
    for state in (AlState.SAFEOP, AlState.OP):
        glove.al_state = svh.al_state = state
        svh.advance(fingers, DT)  # type: ignore[attr-defined]
        on = state is AlState.OP
        assert glove.braked == (on, False, False, False, on)  # type: ignore[attr-defined]
        assert bool(svh.status & HandStatus.ENABLED) == on  # type: ignore[attr-defined]
        assert bool(fingers.current.any()) == on
    assert svh.position == tuple(fingers.position)  # type: ignore[attr-defined]


def test_who_grasps_something_feels_it_and_who_does_not_does_not() -> None:
    """Glove, map, hand, currents and brakes together: the index finger meets something, the others do not."""
    for at, felt in ((0.5, True), (np.inf, False)):
        glove, fingers = GlovedFingers(), hand()
        grasped = np.full(5, np.inf)
        grasped[1] = at
        fingers.grasped = Grasped(grasped)
        names = [f"{finger}_proximal" for finger in ("thumb", "index", "middle", "ring", "little")]
        mapped = HandMap(GLOVE_JOINTS, [Drive({name: 1.0}, 0.0, 0.0, 1.5) for name in names])
        brakes, turns, before = Brakes([[i] for i in range(5)], DT), 0, False
        for k in range(4000):
            wanted = min(1.0, k * DT / 1.5) if k < 2500 else 0.0
            glove.step([wanted] * 5, brakes.closed.tolist(), DT)
            fingers.step(mapped.update(glove.angle), True, DT)
            brakes.update(fingers.current)
            turns += int(brakes.closed[1] != before)
            before = bool(brakes.closed[1])
            assert not brakes.closed[[0, 2, 3, 4]].any()
            if k == 2400:
                assert brakes.closed[1] == felt
                # held, the finger stops where the hand's stopped; free, it makes a fist
                assert (glove.closed[1] < 0.7) == felt
        assert turns == (2 if felt else 0)
