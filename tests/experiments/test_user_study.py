"""The user study's protocol: what trials are judged by, what is asked, and what is written down."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pytest
from hapticd.experiments import user_study
from hapticd.experiments.user_study import CHECKPOINTS, Motion, UserStudyError, followed, main, opened
from hapticd.runtime.configuration.config import load

T = np.arange(0.0, 6.0, 0.01)


def moved(place: np.ndarray, hinge: np.ndarray | None = None) -> Motion:
    return Motion(T, place, np.full(len(T), 3.0), hinge)


def over(points: list[tuple[float, float]]) -> np.ndarray:
    knots = np.linspace(0.0, 5.0, len(points))
    x, y = (np.interp(T, knots, [point[i] for point in points]) for i in range(2))
    return np.stack([x, y, np.full(len(T), -1.0)], axis=1)


def test_a_door_counts_when_it_is_wide_enough_to_walk_through() -> None:
    still = np.zeros((len(T), 3))
    wide, ajar = opened(moved(still, 0.3 * T)), opened(moved(still, np.minimum(0.3 * T, 0.9)))
    assert wide["opened_s"] == pytest.approx(0.34) and wide["through_s"] == pytest.approx(3.34)
    assert wide["done"] and not ajar["done"] and ajar["through_s"] is None


def test_checkpoints_count_in_their_order() -> None:
    ground = [(x, y) for x, y, _ in CHECKPOINTS]
    found = followed(moved(over(ground)))
    assert found["done"] and found["checkpoints_s"] == sorted(found["checkpoints_s"])
    assert found["checkpoints_s"][2] == pytest.approx(2.0, abs=0.1)
    length = np.linalg.norm(np.diff(np.array(ground), axis=0), axis=1).sum()
    assert found["path_m"] == pytest.approx(length, rel=1e-2)
    short = followed(moved(over([*ground[:3], *ground[4:]])))  # past the fourth
    assert not short["done"] and [t is None for t in short["checkpoints_s"]] == [False] * 3 + [True] * 3


def test_checkpoints_lie_within_the_machines_box_and_turn_the_handle() -> None:
    box: Any = load("giant").config.giant.box  # type: ignore[attr-defined]
    for x, y, _ in CHECKPOINTS:
        assert box.lower[0] < x < box.upper[0] and box.lower[1] < y < box.upper[1]
    x, y, yaw = np.array(CHECKPOINTS).T
    assert np.ptp(x) > 0.7 * (box.upper[0] - box.lower[0]) and np.ptp(yaw) > 180.0
    assert len(CHECKPOINTS) == 6


def answering(answers: list[str]) -> Callable[[str], str]:
    left: Iterator[str] = iter(answers)

    def ask(question: str) -> str:
        try:
            return next(left)
        except StopIteration:
            raise EOFError from None

    return ask


def test_the_questionnaire_asks_again_until_it_has_steps_of_five_and_is_nothing_when_it_is_broken_off() -> (
    None
):
    said: list[str] = []
    answers = ["10", "7", "-5", "a", "105", "15", "20", "25", "30", "35"]
    found = user_study.rate(answering(answers), said.append)
    assert found == dict(zip(user_study.SCALES, (10, 15, 20, 25, 30, 35), strict=True))
    assert len(said) == 4
    with pytest.raises(UserStudyError, match="broken off"):
        user_study.rate(answering(["10", "15"]), said.append)


@pytest.fixture
def rehearsed(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, float]]:
    """Sessions that last no time; which were asked for."""
    ran: list[tuple[str, float]] = []

    def session(kind: str) -> Callable[..., Any]:
        def run(loaded: Any, log: Path, seconds: float, live: bool) -> Any:
            ran.append((kind, seconds))
            log.touch()
            return SimpleNamespace(status=0, message="")

        return run

    monkeypatch.setattr(user_study.daemon, "run", session("live"))
    monkeypatch.setattr(user_study.lockstep_run, "run", session("lockstep"))
    monkeypatch.setattr(user_study, "motion_of", lambda path: moved(np.zeros((len(T), 3)), 0.3 * T))
    return ran


def lines(folder: Path) -> list[dict[str, Any]]:
    return [msgspec.json.decode(line) for line in (folder / "data.jsonl").read_bytes().splitlines()]


def test_a_person_does_three_trials_and_rates_them(
    tmp_path: Path, rehearsed: list[tuple[str, float]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("builtins.input", answering(["", "", "", *["20"] * 6]))
    assert main(["door", "--participant", "P1", "--out", str(tmp_path)]) == 0
    assert rehearsed == [("live", 24.0)] * 3
    *trials, ratings = lines(tmp_path)
    assert [line["trial"] for line in trials] == [1, 2, 3]
    assert all(line["done"] and not line["simulated"] for line in trials)
    assert ratings["tlx"] == dict.fromkeys(user_study.SCALES, 20)
    assert main(["door", "--participant", "P1", "--out", str(tmp_path)]) == 2  # nothing is written over
    assert len(lines(tmp_path)) == 4


def test_a_simulated_participant_is_labelled_and_rates_nothing(
    tmp_path: Path, rehearsed: list[tuple[str, float]], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["path", "--participant", "S1", "--out", str(tmp_path), "--simulated"]) == 0
    assert rehearsed == [("lockstep", 45.0)] * 3
    assert all(line["simulated"] for line in lines(tmp_path)) and lines(tmp_path)[-1]["tlx"] is None
    assert '"overall":null' in capsys.readouterr().out


def test_simulated_participants_differ_and_each_is_the_same_again() -> None:
    machine = load("giant")

    def hand(participant: str, trial: int) -> Any:
        changed: Any = user_study.simulated(machine, "path", participant, trial).config
        return changed.simulation.hand

    assert hand("S1", 1) == hand("S1", 1)
    assert hand("S1", 1).stiffness == hand("S1", 2).stiffness != hand("S2", 1).stiffness
    assert hand("S1", 1).path != hand("S1", 2).path
    places = [(*pose.position[:2],) for pose in hand("S1", 1).path[2:]]
    for place, (x, y, _) in zip(places, CHECKPOINTS, strict=True):
        assert np.hypot(place[0] - x, place[1] - y) < user_study.NEAR


@pytest.mark.slow
def test_a_simulated_hand_opens_the_door_and_the_recording_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(user_study, "TRIALS", 1)
    assert main(["door", "--participant", "S1", "--out", str(tmp_path), "--simulated"]) == 0
    trial = lines(tmp_path)[0]
    assert trial["done"] and 0.0 < trial["opened_s"] < trial["through_s"] < trial["seconds"]
    assert 10.0 < trial["peak_force_n"] < 150.0
