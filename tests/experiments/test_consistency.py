"""Commanded twins are the constrained multibody system, whatever kind of limit they meet."""

from typing import Any

import numpy as np
import pytest
from hapticd.configs import read_text
from hapticd.control.chain import FREE, Gains, Horizons, JointSum
from hapticd.control.force_control import Box, ForceControl
from hapticd.control.limits import Limits
from hapticd.experiments.consistency import TIGHT, Judge, Judgement
from hapticd.machines.rendering.twin import chain_twin, mechanism_of, robot_of
from hapticd.models import Robot
from hapticd.models.dh_robot import END
from hapticd.runtime.configuration import config

DT = 1e-3
GAINS = Gains(100.0, 100.0, 20.0, 20.0)
KINDS = ("joint", "tilt", "handle box", "elbow box", "twin", "coupling", "joint B", "twin B", "dynamics")
"""What the levels of the hierarchy limit, in their order."""
POSTURE = np.array([-0.9026, 1.5724, -0.6699, 0.9626, 0.0846, 0.0])
DEVIATION = 1e-3


class Rendered:
    """A force control with a built-in chain, and its judge."""

    def __init__(self, twin: str) -> None:
        settings: Any = config.load(f"giant with {twin}").config
        section, m = settings.giant.twin, settings.giant.manipulator
        robot = Robot.from_urdf(read_text("giant.urdf"), "giant.urdf").without(["ppu_x", "ppu_y"])
        at = robot.placement(POSTURE, "handle")[:3, 3]
        elbow = robot.placement(POSTURE, "joint_4")[:3, 3]
        low, high = np.minimum(at, elbow), np.maximum(at, elbow)
        low, high = low - np.array([0.04, 0.08, 0.1]), high + np.array([0.05, 0.06, 0.4])
        self.control = ForceControl(
            robot,
            Limits(*map(np.array, (m.lower, m.upper, m.velocity, m.acceleration))),
            chain_twin(section),
            [JointSum((0, 0, 0, 1, 1, 0), 0.75, 1.4)],
            [Box(frame, low.tolist(), high.tolist()) for frame in ("handle", "joint_4")],
            GAINS,
            "gauss",
            DT,
            Horizons(5e-3, 15e-3),
        )
        self.control.reset(POSTURE)
        chain = robot_of(section)
        mechanism = mechanism_of(section, chain)
        self.judge = Judge(self.control, robot, chain, section.end or END, mechanism, section.gravity, GAINS)

    def tick(self, wrench: np.ndarray) -> Judgement:
        control = self.control
        control.prepare(wrench)
        assert control.assemble() and control.optimise()
        judgement = self.judge.judge(wrench)
        control.advance()
        return judgement

    @property
    def tight(self) -> set[str]:
        """Kinds of limits that the last tick reached."""
        x, found = self.control.solution.x, set()
        for kind, level in zip(KINDS, self.control.levels, strict=True):
            if level.C.size:
                y = level.C @ x
                near = (y <= level.lb + TIGHT * (1 + np.abs(level.lb))) | (
                    y >= level.ub - TIGHT * (1 + np.abs(level.ub))
                )
                found |= {kind} if near.any() else set()
        held = self.control.twin.held
        return found | ({"lock"} if held is not None and held[0] != FREE else set())


@pytest.mark.parametrize(
    ("twin", "kinds"),
    [
        ("door", {"lock", "twin", "twin B", "joint B", "elbow box"}),
        ("excavator", {"joint", "joint B", "tilt", "handle box", "elbow box", "twin", "twin B"}),
        ("panda", {"joint", "joint B", "tilt", "handle box", "elbow box", "twin", "twin B"}),
    ],
)
def test_limits_of_every_kind_act_on_the_twin_as_constraints_of_mechanics(twin: str, kinds: set[str]) -> None:
    rendered = Rendered(twin)
    rng = np.random.default_rng(7)
    tones = rng.uniform(0.5, 4.0, (6, 3)), rng.uniform(0.0, 2.0 * np.pi, (6, 3))
    size = np.repeat([25.0, 3.0], 3)
    seen: set[str] = set()
    before, judged = b"", 0
    for k in range(4000):
        wrench = size * np.sin(tones[0] * k * DT + tones[1]).sum(1) / 1.5
        judgement = rendered.tick(wrench)
        seen |= rendered.tight
        active = rendered.control.active.tobytes()
        if active == before:
            judged += 1
            assert judgement.deviation <= DEVIATION, (k, rendered.tight)
            assert not judgement.pulling, (k, rendered.tight)
        before = active
    assert judged > 3600
    assert kinds <= seen


def test_a_wrong_mass_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    rendered = Rendered("excavator")
    twin, wrench = rendered.control.twin, np.array([5.0, 2.0, 1.0, 0.1, 0.2, 0.0])
    assert rendered.tick(wrench).deviation < 1e-9
    update = type(twin).update

    def heavier(self: Any, wrench: np.ndarray, share: float) -> None:
        update(self, wrench, share)
        self.M[1, 1] *= 1.02

    monkeypatch.setattr(type(twin), "update", heavier)
    assert rendered.tick(wrench).deviation > 2e-3
