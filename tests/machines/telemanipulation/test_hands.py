"""Gloves and hands in the stations: what is grasped is felt, and what a hand holds it keeps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hapticd.devices.robot_hand import HandStatus
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.session import build
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.errors import ConfigError
from hapticd.runtime.live.lockstep import Lockstep
from hapticd.safety import Reaction, Verdict
from hapticd.sim.fingers import Grasped
from hapticd.sim.network_model import Conditions
from hapticd.testing.copies import in_a_copy

from .pairs import Both, following


class Fingers:
    """Of both hands of the person, from a time on closed within a second, or opened."""

    def __init__(self, begin: float, closed: float) -> None:
        self._begin, self._closed = begin, closed

    def at(self, time: float) -> list[float]:
        share = min(1.0, max(0.0, time - self._begin)) if self._closed else 1.0
        return [share * self._closed] * 2


@pytest.fixture(name="pair")
def follows() -> Both:
    return following()


def grasp(pair: Both) -> None:
    """Both hands close around something that lies in the left one alone."""
    _, fingers = pair.follows.hands[0]
    thing = Grasped(fingers.lower + 0.5 * (fingers.upper - fingers.lower))
    pair.follows._things = [(0, 0.0, 1e9, thing)]
    pair.leads._closing = Fingers(pair.leads.time, 0.9)
    pair.go(1.2)


@in_a_copy
def test_what_the_left_hand_grasps_holds_the_fingers_of_the_left_glove_alone(pair: Both) -> None:
    grasp(pair)
    (left, right), gloves = pair.follows.hands, pair.leads.gloves
    assert left[1].current.max() > 0.35 and right[1].current.max() < 0.1
    assert gloves[0][0].brakes and not gloves[1][0].brakes
    assert gloves[0][1].closed[1:].max() < 0.75 and gloves[1][1].closed.min() > 0.85
    assert any("left hand grasps: " in said for said in pair.said), pair.said
    assert pair.avatar.session.cycle.set_points.clamps == 0
    assert pair.avatar.mode is Mode.ACTIVE
    pair.leads._closing = Fingers(0.0, 0.0)
    pair.go(0.8)
    assert not gloves[0][0].brakes and left[1].position.max() < 0.1


@in_a_copy
def test_without_a_link_a_hand_keeps_what_it_holds_and_no_finger_is_held(pair: Both) -> None:
    grasp(pair)
    pair.network.there._conditions = pair.network.back._conditions = Conditions(outages=[(0.0, 1e9)])
    pair.go(0.05)
    assert not pair.leads.gloves[0][0].brakes, "whoever is held by a hand far away must know that it is there"
    pair.leads._closing = Fingers(0.0, 0.0)
    before = pair.follows.hands[0][1].position.copy()
    pair.go(2.2)
    device, fingers = pair.follows.hands[0]
    np.testing.assert_allclose(fingers.position, before, atol=2e-3)
    assert fingers.current.max() > 0.35 and device.status & HandStatus.ENABLED


@in_a_copy
@pytest.mark.parametrize(
    ("reaction", "holds"), [(Reaction.HOLD, True), (Reaction.RAMP, False), (Reaction.OFF, False)]
)
def test_in_a_stop_a_hand_has_power_as_long_as_the_arms(pair: Both, reaction: Reaction, holds: bool) -> None:
    grasp(pair)
    cycle = pair.avatar.session.cycle
    cycle.stops.take(Verdict(reaction, "operator", "a test"), cycle.counter)
    pair.go(0.6)
    assert pair.avatar.mode is (Mode.HOLDING if holds else Mode.STOPPED)
    device, fingers = pair.follows.hands[0]
    assert (fingers.current.max() > 0.35) == bool(device.status & HandStatus.ENABLED) == holds
    assert not pair.leads.gloves[0][0].brakes


@in_a_copy
def test_an_operator_who_stops_is_held_by_nothing(pair: Both) -> None:
    grasp(pair)
    pair.leads._plc.dead_man = (False, False)
    pair.go(0.01)
    assert not pair.leads.gloves[0][0].brakes
    pair.go(0.3)
    assert pair.follows.hands[0][1].current.max() > 0.35, "what it holds, it keeps"


def test_both_stations_must_mean_the_same_hands() -> None:
    operator, avatar = (Lockstep(build(config.load(name))).plant for name in ("operator", "avatar"))
    assert operator.identity() == avatar.identity()
    assert operator.link.sizes == avatar.link.sizes[::-1]
    left = avatar.identity()["hands"].replace("ring_little", "ring")
    assert left != operator.identity()["hands"]


@pytest.mark.parametrize(
    ("old", "new", "wanted"),
    [
        ("index_middle = 0.4,", "index_midle = 0.4,", 'did you mean "index_middle"'),
        ("[avatar.hands.left.drives.index]", "[avatar.hands.left.drives.indx]", "one table for each drive"),
        ('lower = "0 rad"\nupper = "1.3 rad"', 'lower = "2 rad"\nupper = "1.3 rad"', "2 is not below 1.3"),
    ],
)
def test_a_map_that_cannot_be_is_refused_with_its_line(old: str, new: str, wanted: str) -> None:
    loaded = config.load("avatar")
    assert old in loaded.text
    text = loaded.text.replace(old, new, 1)
    with pytest.raises(ConfigError, match=wanted):
        build(replace(loaded, config=config.parse(text, loaded.source), text=text))
