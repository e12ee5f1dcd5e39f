"""Trials of the bimanual task: the person succeeds by what a person has; leaving buses out changes little."""

import os

import numpy as np
import pytest
from hapticd.experiments.lean_pair import FollowingPair
from hapticd.experiments.peg_trial import Mode, Trial, peg_trial
from hapticd.machines.telemanipulation.pair import Pair
from hapticd.machines.telemanipulation.peg import set_task
from hapticd.runtime.configuration import config
from hapticd.sim.network_model import Conditions, NetworkModel
from hapticd.sim.peg_person import Person
from hapticd.sim.peg_task import PegTask, Sight

pytest.importorskip("mujoco", reason="the extra `scene` is not installed")
TRIALS = int(os.environ.get("HAPTICD_TRIALS", "0"))
"""Trials of each mode; a trial takes five to ten seconds."""
many = pytest.mark.skipif(not TRIALS, reason="HAPTICD_TRIALS=10 runs ten trials of each mode, five minutes")


def test_with_feedback_the_bar_comes_into_the_part_gently() -> None:
    seen = peg_trial(Mode.FEEDBACK, 8)
    assert seen.success, seen.why
    assert 10.0 < seen.time < 60.0 and seen.peak < 20.0


@many
@pytest.mark.slow
@pytest.mark.parametrize("mode", Mode)
def test_nearly_every_trial_succeeds(mode: Mode) -> None:
    seen = [peg_trial(mode, seed) for seed in range(100, 100 + TRIALS)]
    assert sum(trial.success for trial in seen) >= 0.9 * TRIALS, seen


@many
@pytest.mark.slow
def test_a_trial_of_the_whole_stations_goes_as_one_without_their_buses() -> None:
    stations = [config.load(name) for name in ("operator", "avatar")]
    pair = Pair(stations[0], stations[1], NetworkModel(Conditions(), 1))
    task, palms = set_task(pair, 2), []
    while not task.success and task.seconds < 60.0:
        pair.tick()
        if task.seconds:
            palms.append(task.scene.position("right"))
    lean: list[np.ndarray] = []

    def watch(task: PegTask, person: Person) -> None:
        lean.append(task.scene.position("right"))

    seen: Trial = peg_trial(Mode.FEEDBACK, 2, watch=watch)
    assert task.success and seen.success
    assert task.took == pytest.approx(seen.time, rel=0.1)
    assert task.scene.peak == pytest.approx(seen.peak, rel=0.3)
    k = min(len(palms), len(lean), 14000)  # until the bar is above the part
    apart = np.linalg.norm(np.array(palms[:k]) - np.array(lean[:k]), axis=1)
    assert np.sqrt(np.mean(apart**2)) < 4e-3


def test_the_avatars_sensor_feels_what_presses_on_the_table() -> None:
    task = PegTask()
    pair = FollowingPair(task.scene, 1)
    arm = pair.arms[0]
    arm.position[:] = 0.6, 0.3, 0.85
    forces, touches = [], []
    for k in range(2200):
        pair.step([None, None])
        if k > 1800:
            forces.append(arm.own.task.palm.rotation @ arm.own.force.wrench[:3])
            touches.append(task.scene.touch("world", "left"))
    felt, pressed = np.mean(forces, axis=0), np.mean(touches, axis=0)
    assert 5.0 < pressed[2] < 20.0
    np.testing.assert_allclose(felt, pressed, atol=0.05 * pressed[2])


def test_eyes_err_by_3_mm_and_hands_feel_nothing_but_what_they_are_given() -> None:
    still = Sight(np.array([[0.45, 0.25, 1.0], [0.45, -0.25, 1.0]]), np.zeros(3), np.zeros(3), [0.09, 0.09])

    def look() -> Sight:
        return Sight(still.palms, np.array((0.52, -0.2, 0.85)), np.array((0.52, 0.2, 0.89)), [0.09, 0.09])

    def wishes(seed: int, force: float | None) -> np.ndarray:
        feel = None if force is None else lambda i: np.array((0.0, 0.0, force))
        person = Person(look, feel, still.palms, seed, tremor=0.0)
        return np.array([[person.wish(i, t)[0][:3] for i in range(2)] for t in np.arange(0.0, 1.8, 0.01)])

    ends = np.array([wishes(seed, None)[-1] for seed in range(40)])
    assert 2e-3 < ends.std(axis=0).mean() < 4.5e-3
    np.testing.assert_array_equal(wishes(1, None), wishes(1, None))
    np.testing.assert_array_equal(wishes(1, None), wishes(1, 5.0))  # on the way a force changes nothing
