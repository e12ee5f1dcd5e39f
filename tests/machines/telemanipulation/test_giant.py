"""The giant as the operator's device: its twin is the avatar's arm, leads it, and feels what it feels."""

from __future__ import annotations

import functools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hapticd.control.lease import Standing
from hapticd.machines.giant.check import check_giant
from hapticd.machines.telemanipulation.arm import PALM, chain_of
from hapticd.machines.telemanipulation.pair import Pair, PairError
from hapticd.machines.telemanipulation.pair_run import pair_run
from hapticd.models import Robot
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.config import Loaded
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.recording.log import open_log
from hapticd.runtime.recording.replay import replay
from hapticd.sim.network_model import Conditions, NetworkModel
from hapticd.sim.wall import Wall, Walls
from hapticd.testing.copies import in_a_copy

from .pairs import Both, still

RIGHT = 1
LIMIT = 4
"""Joint 5, whose upper limit a palm that is turned down meets first."""


def stations() -> list[Loaded]:
    """The built-in ones, with hands that stay and no wall."""
    return [still(config.load(name)) for name in ("giant_operator", "giant_avatar")]


class Giants(Both):
    """A giant and an avatar."""

    @property
    def leading(self):
        return self.machines[0].leading

    @property
    def follower(self):
        return self.follows.arms[RIGHT].arm

    def error(self) -> float:
        """From the twin's palm to the avatar's, in its station [m]."""
        return float(np.linalg.norm(self.leading.palm.palm.position - self.follower.position))

    def pull(self, way: list[float], turn: list[float]) -> None:
        """The hand wants the handle so far from here, and so turned, from now on, in the avatar's axes."""
        base = self.machines[0].force_control.twin.base[:3, :3]
        arm, ppu = self.leads.arm, self.leads.ppu
        here = arm.position + np.array([*ppu.position, 0.0])
        rotation = pin.exp3(base @ np.array(turn)) @ arm.rotation
        hand = self.leads.hand
        hand.take()
        hand.lead((here + base @ way).tolist())
        hand._target[:] = rotation

    def cut(self) -> None:
        silent = Conditions(outages=[(0.0, 1e9)])
        self.network.there._conditions = self.network.back._conditions = silent


@functools.cache
def made() -> Giants:
    both = Giants(*stations(), NetworkModel(Conditions(), 1))
    both.go(3.5)
    both.leading.far.fader.share = both.machines[1]._laws[RIGHT]._core.share = 1.0  # faded in
    return both


@pytest.fixture(name="pair")
def follows() -> Giants:
    """An avatar that follows; each test moves a copy of it."""
    return made()


def model() -> tuple[Robot, list[float], list[float]]:
    """The avatar's right arm, from its own configuration, and its limits."""
    loaded = config.load("giant_avatar")
    chain = loaded.config.avatar.arms.right
    return chain_of(Robot.from_urdf(loaded.model_text, "x"), chain), list(chain.lower), list(chain.upper)


@in_a_copy
def test_the_arm_follows_the_twin_and_nobody_leads_the_other_one(pair: Giants) -> None:
    twin = pair.machines[0].force_control.twin
    left = pair.follows.arms[0].arm.position.copy()
    robot, *_ = model()
    q = robot.configuration(twin.q)
    pin.framesForwardKinematics(robot.model, robot.data, q)
    seen = robot.data.oMf[robot.frame(PALM)]
    assert np.allclose(seen.translation, pair.leading.palm.palm.position, atol=1e-9)
    begin = pair.leading.palm.palm.position.copy()
    pair.pull([0.06, 0.03, 0.04], [0.0, 0.0, 0.0])
    pair.go(1.4)
    went = pair.leading.palm.palm.position - begin
    assert np.linalg.norm(went - [0.06, 0.03, 0.04]) < 0.02
    assert pair.error() < 8e-3
    assert np.abs(twin.q - pair.follower.q).max() < 0.05, "elbow included"
    assert np.linalg.norm(pair.follows.arms[0].arm.position - left) < 1e-3
    leases = pair.machines[1].leases
    assert [lease.standing for lease in leases] == [Standing.IDLE, Standing.FOLLOWS]
    assert pair.operator.mode is pair.avatar.mode is Mode.ACTIVE, pair.said


@in_a_copy
def test_a_wall_that_the_avatar_meets_is_felt_at_the_handle_and_gone_50_ms_after_the_link(
    pair: Giants,
) -> None:
    wall = Wall(pair.follower.position + np.array([0.01, 0.0, 0.0]), np.array([-1.0, 0.0, 0.0]), 3000.0, 20.0)
    pair.follows.walls = Walls([wall])
    pair.pull([0.06, 0.0, 0.0], [0.0] * 3)
    pair.go(1.3)
    base = pair.machines[0].force_control.twin.base[:3, :3]
    hand = base.T @ pair.machines[0]._estimator.wrench[:3]
    wall_force = float(np.linalg.norm(pair.follower.hold.wrench[:3]))
    assert wall_force > 8.0 and hand[0] > 0.5 * wall_force, f"{hand} of {wall_force:.1f} N"
    assert np.abs(hand[1:]).max() < 0.35 * hand[0], "it pushes where the wall does"
    felt, place = pair.leading.far.felt, pair.follower.position.copy()
    assert felt[0] < -8.0
    pair.cut()
    pair.go(0.019)
    assert felt[0] < -8.0, "not late yet"
    pair.go(0.056)
    assert pair.leading.far.lease.standing is Standing.WAITS
    assert not felt.any()
    pair.go(0.06)
    assert pair.leading.far.lease.standing is Standing.SILENT
    assert np.linalg.norm(pair.follower.position - place) < 1e-3
    assert pair.operator.mode is pair.avatar.mode is Mode.ACTIVE
    assert any("right avatar arm holds: the link is silent" in said for said in pair.said)


@in_a_copy
def test_a_limit_of_the_avatar_stops_the_twin_and_so_the_handle(pair: Giants) -> None:
    _, _, upper = model()
    twin = pair.machines[0].force_control.twin
    most = there = 0.0
    pair.pull([0.0] * 3, [0.0, 1.2, 0.0])
    for _ in range(12):
        pair.go(0.1)
        most, there = max(most, float(twin.q[LIMIT])), max(there, float(pair.follower.q[LIMIT]))
    own = float(twin.limits.upper[LIMIT])
    assert own == pytest.approx(upper[LIMIT] - 0.05)
    assert own - 1e-3 < most < own + 1e-3, "reached, and not passed"
    assert there < upper[LIMIT]
    pressed = np.linalg.norm(pair.machines[0]._estimator.wrench[3:])
    assert pressed > 3.0, "felt by who holds the handle"
    assert np.linalg.norm(pair.machines[0].force_control.coupling_error[3:]) < 2e-3
    assert pair.operator.mode is pair.avatar.mode is Mode.ACTIVE


@in_a_copy
def test_a_wrench_that_no_palm_feels_drives_nothing(pair: Giants) -> None:
    sense = pair.machines[1].arms[RIGHT].force.wrench
    say = pair.machines[1]._say

    def lie() -> None:
        sense[:3] = [300.0, 0.0, 0.0]
        say()

    pair.machines[1]._say = lie
    most = 0.0
    for _ in range(12):
        pair.go(0.01)
        most = max(most, float(np.abs(pair.leading.far.felt[:3]).max()))
    assert most < 2.0
    assert pair.leading.far.lease.useless > 90
    assert pair.leading.far.lease.standing is Standing.SILENT


@in_a_copy
def test_the_wrench_drives_the_joints_with_the_power_that_it_has_at_the_palm(pair: Giants) -> None:
    """Virtual work: tau qd is what the force does along the palm's way, by differences of its model."""
    robot, *_ = model()
    leading, twin = pair.leading, pair.machines[0].force_control.twin
    leading.palm.posture[:] = twin.q  # nothing draws the elbow
    twin.qd[:] = 0.0
    leading.far.feel = lambda share: leading.far.felt.__setitem__(
        slice(None), [3.0, -2.0, 5.0, 0.4, 0.3, -0.6]
    )
    leading.drive(1.0)

    def palm(q: np.ndarray) -> pin.SE3:
        pin.framesForwardKinematics(robot.model, robot.data, robot.configuration(q))
        return robot.data.oMf[robot.frame(PALM)].copy()

    at, h = palm(twin.q), 1e-6
    for i in range(7):
        step = at.actInv(palm(twin.q + h * np.eye(7)[i]))
        work = np.r_[step.translation, pin.log3(step.rotation)] / h @ leading.far.felt
        assert leading.driving[i] == pytest.approx(work, abs=1e-4)


@in_a_copy
def test_engaged_where_the_avatar_is(pair: Giants) -> None:
    pair.pull([0.1, 0.1, 0.0], [0.0] * 3)
    pair.go(0.5)
    machine, there = pair.machines[0], pair.follower.q.copy()
    assert np.abs(there - pair.leading._home).max() > 0.05
    machine.engage()
    assert np.abs(machine.force_control.twin.q - there).max() < 5e-3
    assert (
        np.linalg.norm(
            machine.force_control.twin.position
            - machine.force_control.handle.position
            - [*machine._observer.q, 0.0]
        )
        < 1e-9
    )
    pair.cut()
    pair.go(0.05)
    machine.engage()
    assert (machine.force_control.twin.q == pair.leading._home).all()


def test_both_sessions_replay(tmp_path: Path) -> None:
    loaded = stations()
    logs = [tmp_path / f"{name}.mcap" for name in ("giant", "avatar")]
    network = NetworkModel(Conditions(0.004, 0.003, 0.05), 3)
    outcomes, _ = pair_run(Pair(*loaded, network), loaded, logs, 1.2, False)
    assert [outcome.status for outcome in outcomes] == [0, 0]
    for log in logs:
        found = replay(open_log(str(log)))
        assert found.ticks > 1200 and found.differing_ticks == 0


def test_what_does_not_fit_is_refused() -> None:
    giant = config.load("giant_operator")
    robot = Robot.from_urdf(giant.model_text, "giant.urdf")

    def found(old: str, new: str) -> str:
        assert giant.text.count(old) >= 1, old
        return str(check_giant(config.parse(giant.text.replace(old, new, 1), "x.toml"), robot))

    assert check_giant(giant.config, robot) == []
    assert "leaves the arm's -2.85 to 2.85" in found('range = "-2.80 2.80 rad"', 'range = "-2.88 2.80 rad"')
    assert "is not that of leads.right" in found(
        'arm = { prefix = "avatar_right_", palm = "0.085', 'arm = { prefix = "avatar_right_", palm = "0.08'
    )
    most = 'force = "60 N"\ntorque = "15 N m"'
    assert "no hand holds 300 N" in found(most, most.replace("60", "300"))
    assert "no hand holds 21 N m" in found(most, most.replace("15", "21"))
    assert "is not the home" in found('start = "0.275 rad"', 'start = "0.3 rad"')
    assert "faster than the arm's" in found('velocity = "2.1 rad/s"', 'velocity = "2.15 rad/s"')
    with pytest.raises(PairError, match="different models"):
        avatar = config.load("giant_avatar")
        Pair(giant, replace(avatar, model_text=avatar.model_text + "<!-- -->"), NetworkModel(Conditions(), 1))
