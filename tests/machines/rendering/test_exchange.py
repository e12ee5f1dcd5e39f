"""Sessions in which the twin is exchanged: nothing jumps at the plant's handle, what is logged replays."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from math import hypot
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from hapticd.control.chain import FREE
from hapticd.experiments.hands import Kept, Work
from hapticd.experiments.random_hand import Temper, stranger
from hapticd.machines.giant.system import GIANT
from hapticd.models import Robot
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.session import build
from hapticd.runtime.core.modes import Command, Mode, exchange
from hapticd.runtime.live import lockstep_run
from hapticd.runtime.live.lockstep import Lockstep
from hapticd.runtime.recording.log import open_log
from hapticd.runtime.recording.replay import replay
from hapticd.runtime.recording.summary import Summary
from hapticd.sim import faults
from hapticd.testing.bench import Bench

GIANT_S = "giant with mass,door,excavator"
MASS, DOOR, EXCAVATOR = (exchange(number) for number in (1, 2, 3))
MOST_JUMP = 0.1, 0.5
"""Of the acceleration that the handle is told, in the tick of an exchange [m/s^2], [rad/s^2]."""
MOST_FORCE, AROUND = 1.0, 200
"""Of the hand's force from tick to tick [N], so many ticks around an exchange: a hand feels no step."""
WHEN = "that takes READY, HOLDING or ACTIVE"
EXCESS = 1e-2
"""Most that a joint of a twin may pass its limits by [rad]."""


@dataclass
class Commanded:
    """A session with commands at ticks, and what its handle does."""

    loaded: config.Loaded
    commands: dict[int, Command]
    told: list[np.ndarray] = field(default_factory=list)
    speed: list[np.ndarray] = field(default_factory=list)
    force: list[np.ndarray] = field(default_factory=list)
    rendered: list[int] = field(default_factory=list)

    def lockstep(self, session: Any) -> Lockstep:
        """One that gives the commands, and watches."""
        found, tick = Lockstep(session), Lockstep.tick
        control, plant = session.cycle.machine.force_control, found.plant

        def commanded(commands: Command = Command.NONE, skipped: int = 0) -> None:
            tick(found, commands | self.commands.get(found._next, Command.NONE), skipped)
            self.told.append(control.handle.J @ control.qdd)
            self.speed.append(plant.arm.twist.copy())  # type: ignore[attr-defined]
            self.force.append(plant.arm.hold.wrench[:3].copy())  # type: ignore[attr-defined]
            self.rendered.append(control.rendered)

        found.tick = commanded  # type: ignore[method-assign]
        return found

    def run(self, log: Path, seconds: float, monkeypatch: pytest.MonkeyPatch) -> Any:
        """The report, once the log has been replayed without a difference."""
        monkeypatch.setattr(lockstep_run, "Lockstep", self.lockstep)
        report = lockstep_run.run(self.loaded, log, seconds, live=False, quiet=True).report
        assert report is not None and not report.stop
        found = replay(open_log(str(log)))
        assert found.differing_ticks == 0 and found.ticks >= 1000 * seconds
        return report

    def judge(self, begin: int) -> list[int]:
        """At which ticks another twin was there, after the machine was ACTIVE; none of them jumped.

        A hand that has been held back pulls in quickly changing directions at other times, too.
        """
        at = [k for k in (np.flatnonzero(np.diff(self.rendered)) + 1).tolist() if k > begin]
        jumps = np.abs(np.diff(self.told, axis=0))
        for k in at:
            around = jumps[k - 3 : k + 3]
            assert around[:, :3].max() < MOST_JUMP[0] and around[:, 3:].max() < MOST_JUMP[1], k
            force = np.array(self.force)[k - AROUND : k + AROUND]
            assert np.linalg.norm(np.diff(force, axis=0), axis=1).max() < MOST_FORCE, k
        speed = np.array(self.speed)[begin:]
        assert np.linalg.norm(np.diff(speed[:, :3], axis=0), axis=1).max() < 0.05
        return at


def test_a_twin_is_exchanged_in_ready_and_on_the_move(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun = {200: DOOR, 3400: EXCAVATOR, 4200: MASS}  # the last while the excavator still fades in
    session = Commanded(config.load(GIANT_S), begun)
    report = session.run(tmp_path / "log.mcap", 5.0, monkeypatch)
    assert session.rendered[199:201] == [0, 1]
    first, second = session.judge(3300)
    assert 3400 + 500 < first < 3400 + 900 and 4200 + 500 < second < 4200 + 900
    log = open_log(str(tmp_path / "log.mcap"))
    texts = [event.text for event in log.events() if "twin" in event.text]
    assert texts == [
        "twin door: it is rendered from now on",
        "twin excavator: the machine comes to rest for it",
        "twin excavator: it is rendered from now on",
        "twin mass: the machine comes to rest for it",
        "twin mass: it is rendered from now on",
    ]
    states = {
        k: record.fixed["state"].copy() for k, record in enumerate(log.records()) if k in (100, 250, first)
    }
    assert states[100]["rendered"].tolist() == (1, 0, 0) and states[100]["twin_share"] == 1.0
    assert np.isnan(states[100]["twin"].tolist()).all()
    assert states[250]["rendered"].tolist() == (0, 1, 0) and states[250]["held"].tolist()[0] != FREE
    assert states[250]["twin"]["door_handle"] == -0.05 and np.isnan(states[250]["twin"]["excavator_boom"])
    assert states[first]["rendered"].tolist() == (0, 0, 1) and states[first]["twin_share"] == 0.0
    rows = {row.name: row for row in report.limits}
    assert rows["twin excavator bucket"].excess < 0.0 and rows["twin door hinge"].touched == "lower"


@pytest.fixture(scope="module")
def live() -> Iterator[tuple[Bench, np.void]]:
    """Just ACTIVE, in a scripted hand."""
    bench = Bench(config.load(GIANT_S))
    machine = bench.cycle.machine
    state = np.zeros(1, machine.state)
    machine.bind_state(state)
    bench.until(Mode.ACTIVE, limit=4000)
    yield bench, state[0]


def test_what_cannot_be_is_refused_and_a_stop_ends_a_fade(live: tuple[Bench, np.void]) -> None:
    """One session after the other: the refusals of each mode, HOLDING, and what the live line shows."""
    bench, state = live
    figures = bench.lockstep.session.system.figures(bench.lockstep.session.config)

    def told(command: Command, ticks: int = 1) -> str:
        bench.events.clear()
        bench.run(ticks, command)
        return "; ".join(said for said in bench.said if said.startswith("twin"))

    def line() -> list[str]:
        bench.cycle.machine.fill()
        return [word for word in figures.live(Mode.ACTIVE, state) if word.startswith("twin")]

    assert told(exchange(4)) == "twin 4: not exchanged: there are mass, door, excavator"
    assert told(MASS) == "twin mass: not exchanged: it is rendered already"
    assert line() == ["twin mass"]
    assert told(DOOR) == "twin door: the machine comes to rest for it"
    assert told(EXCAVATOR) == "twin excavator: not exchanged: the exchange for door is under way"
    assert line() == ["twin mass at 100 %"]
    assert figures.live(Mode.READY, state) == ["twin mass"]
    bench.run(100)
    bench.last_drive.tamper = faults.drop(6)  # holds: a drive is silent for six ticks
    bench.events.clear()
    bench.until(Mode.STOPPING)
    assert "twin door: not exchanged: the machine stops" in bench.said
    assert told(DOOR) == f"twin door: not exchanged: {WHEN}"
    bench.until(Mode.HOLDING)
    bench.cycle.machine.fill()
    place = state["twin_position"].copy()
    assert told(DOOR) == "twin door: it is rendered from now on"
    bench.cycle.machine.fill()
    assert state["rendered"].tolist() == (0, 1, 0)
    assert hypot(*(state["twin_position"] - place)) < 1e-3
    bench.run(100)
    assert bench.mode is Mode.HOLDING and hypot(*(state["twin_position"] - place)) < 1e-3
    assert told(EXCAVATOR | Command.STOP).endswith("excavator: not exchanged: " + WHEN)


def test_a_session_with_one_twin_refuses_and_has_no_such_orders() -> None:
    bench = Bench(config.load("giant"))
    bench.until(Mode.READY)
    bench.run(1, DOOR)
    assert "twin 2: not exchanged: this session has one twin" in bench.said


def test_limits_of_twins_that_are_not_rendered_are_not_touched() -> None:
    session = build(config.load(GIANT_S))
    state = np.zeros(1, session.cycle.machine.state)
    session.cycle.machine.bind_state(state)
    session.cycle.machine.fill()
    values = session.system.limits(session.config).values(state[0])
    summary = Summary.of(session)
    for extent, value in zip(summary.extents, values, strict=True):
        extent.add(value)
    twins = [extent for extent in summary.extents if extent.spec.name.startswith("twin")]
    assert len(twins) == 6 and not any(extent.touching or extent.touched for extent in twins)


@pytest.mark.slow
@pytest.mark.parametrize("machine", ["giant", "panda"])
def test_every_twin_is_exchanged_for_every_other(
    machine: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    orders = [DOOR, EXCAVATOR, MASS, EXCAVATOR, DOOR, MASS]
    loaded = config.load(f"{machine} with mass,door,excavator")
    session = Commanded(loaded, {4000 + 1500 * k: order for k, order in enumerate(orders)})
    report = session.run(tmp_path / "log.mcap", 4.0 + 1.5 * len(orders) + 0.5, monkeypatch)
    assert len(session.judge(3400)) == len(orders)
    assert all(row.excess is None or row.excess < EXCESS for row in report.limits if "twin" in row.name)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [11, 12, 13, 14])
def test_random_hands_whose_twin_is_exchanged_at_random(seed: int) -> None:
    loaded = config.load(GIANT_S)
    robot = Robot.from_urdf(loaded.model_text, loaded.model_source)
    hand = stranger(loaded.config, GIANT, robot, seed, 15.0, Temper())
    lockstep = Lockstep(build(replace(loaded, config=hand)))
    kept, work, random = Kept(lockstep), Work(lockstep), Random(seed)
    cycle, due, count = lockstep.session.cycle, 3500, 0
    machine: Any = cycle.machine
    for k in range(15000):
        asked = k == due
        lockstep.tick(random.choice((MASS, DOOR, EXCAVATOR)) if asked else Command.NONE)
        due += random.randrange(200, 2500) if asked else 0
        count += any(event.code == "exchanged" for event in lockstep.outputs.events)
        kept.add()
        work.add()
        assert cycle.stops.last is None, str(cycle.stops.last)
    assert count >= 3 and machine.rendered < 3
    worst = max(kept.excess.items(), key=lambda item: item[1])
    assert worst[1] < EXCESS, worst
    assert work.returned < 1.0  # what the springs of the joints hold, and no more [J]
