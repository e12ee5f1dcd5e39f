"""Arms in lockstep: they engage, follow a hand, hold their limits while it pulls beyond, and replay."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from hapticd.machines.arm.config import ArmSimulation, RevolutePlant
from hapticd.machines.arm.init import init
from hapticd.machines.arm.machine import SerialArm
from hapticd.machines.arm.plant import ArmPlant
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.session import build
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.live import lockstep_run
from hapticd.runtime.live.lockstep import Lockstep
from hapticd.runtime.live.promise import verdict
from hapticd.runtime.recording.log import open_log
from hapticd.runtime.recording.replay import replay

from .arms import joint, limit, link, random_arm, robot, scara


def loaded(text: str, *changes: tuple[str, str]) -> config.Loaded:
    made = init(text, "x.urdf", None, "x.toml", "x.clean.urdf")
    toml = made.toml
    for old, new in changes:
        toml, count = re.subn(old, new, toml, flags=re.DOTALL)
        assert count, old
    return config.Loaded("x", config.parse(toml, "x.toml"), toml, "x.toml", made.urdf, "x.clean.urdf")


class Running:
    """A session, and how far its measured state was from its limits while it was active."""

    def __init__(self, machine: config.Loaded) -> None:
        session = build(machine)
        self.lockstep = Lockstep(session)
        self.limits = session.system.limits(session.config)
        self.machine = session.cycle.machine
        self._state = np.zeros(1, self.machine.state)
        self.machine.bind_state(self._state)
        self.low = np.full(len(self.limits.specs), np.inf)
        self.high = -self.low

    def run(self, seconds: float) -> None:
        for _ in range(round(1000 * seconds)):
            self.lockstep.tick()
            if self.lockstep.mode is Mode.ACTIVE:
                self.machine.fill()
                values = self.limits.values(self._state[0])
                np.minimum(self.low, values, out=self.low)
                np.maximum(self.high, values, out=self.high)

    @property
    def excess(self) -> dict[str, float]:
        rows = zip(self.limits.specs, self.low, self.high, strict=True)
        return {spec.name: max(spec.lower - low, high - spec.upper) for spec, low, high in rows}


def test_a_scara_feels_the_hand_and_stays_in_its_box() -> None:
    running = Running(loaded(scara()))
    running.run(4.0)  # on its way
    machine, plant = running.machine, running.lockstep.plant
    assert isinstance(machine, SerialArm) and isinstance(plant, ArmPlant)
    errors = []
    machine._estimator._drift.bias = [0.0] * 6  # while the hand hardly pulled, it looked like drift
    machine._estimator._drift.steady = 0.0
    for _ in range(100):
        hand = plant.wrench.copy()
        running.run(2e-3)
        errors.append(machine._estimator.wrench - hand)
    assert np.linalg.norm(plant.wrench[:3]) > 2.0
    assert np.abs(np.mean(errors, axis=0))[:3].max() < 0.2  # without an accelerometer
    running.run(1.0)
    assert running.lockstep.mode is Mode.ACTIVE
    assert abs(running.excess["handle x"]) < 5e-4  # the hand pulls 60 mm further
    assert max(running.excess.values()) < 5e-4


def test_a_joint_holds_its_limit_against_a_pull() -> None:
    text = random_arm(0)
    open_box = (r"\[\[arm\.boxes\]\].*?\n\n|\[simulation\.touches\].*?\n\n", "\n")
    simulation = loaded(text, open_box).config.simulation
    assert isinstance(simulation, ArmSimulation)
    narrow = [
        (
            rf'(\[arm\.joints\.{name}\]\n.*?range = )"[^"]*"',
            rf'\1"{joint.start - 0.03:.5f} {joint.start + 0.03:.5f} rad"',
        )
        for name, joint in simulation.arm.joints.items()
        if isinstance(joint, RevolutePlant)
    ]
    running = Running(loaded(text, open_box, *narrow))
    running.run(4.8)
    assert running.lockstep.mode is Mode.ACTIVE
    assert max(running.excess.values()) < 2e-3
    assert sum(value > -1e-3 for value in running.excess.values()) >= 2  # they were met


def small() -> str:
    """Three joints of a hand's size motors as weak, and a hand that pulls with a fraction of a newton."""
    parts, before = ['<link name="base"/>'], "base"
    for i, (way, axis) in enumerate((("0 0 0.06", "0 0 1"), ("0 0 0.04", "0 1 0"), ("0.12 0 0", "0 1 0"))):
        parts.append(link(f"l{i}", 0.06, "0.05 0 0", 0.02))
        parts.append(joint(f"q{i}", "revolute", (before, f"l{i}"), way, axis, limit(-2, 2, 0.25)))
        before = f"l{i}"
    return robot(*parts)


def test_a_small_weak_arm_keeps_to_its_box_and_the_verdict_says_so(tmp_path: Path) -> None:
    made = loaded(small())
    simulation = made.config.simulation
    assert isinstance(simulation, ArmSimulation) and 0.1 <= simulation.hand.force < 0.6
    outcome = lockstep_run.run(made, tmp_path / "small.mcap", None, False)
    assert outcome.report is not None and outcome.report.stop == ""
    for side in outcome.report.limits:
        if side.name.startswith("handle"):
            assert side.excess is not None and side.lower is not None and side.upper is not None
            assert side.excess < 0.01 * (side.upper - side.lower), side
    shown, line = verdict(made, outcome.report, lockstep=True)
    assert shown and "3 of 3 limits touched, none passed" in line


def test_the_panda_meets_its_box_and_replays(tmp_path: Path) -> None:
    path = tmp_path / "panda.mcap"
    outcome = lockstep_run.run(config.load("panda"), path, 5.8, False)
    assert outcome.status == 0 and outcome.report is not None and outcome.report.stop == ""
    limits = {found.name: found for found in outcome.report.limits}
    assert limits["handle x"].touched in ("upper", "both")
    assert max(found.excess or 0.0 for found in limits.values()) < 3e-3
    assert "link 4 z" in limits and "link 4 x" not in limits  # open on both sides
    assert replay(open_log(str(path))).differing_ticks == 0
