"""Studies of what people do: what trials are judged by, what is asked, and what is written down."""

from __future__ import annotations

import json
import os
import pty
import threading
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import msgspec
import numpy as np
import pytest
from hapticd.experiments.study import tasks, workload
from hapticd.experiments.study.built_in import built_in
from hapticd.experiments.study.giant_tasks import Door, Motion, Way, motion_of, simulated
from hapticd.experiments.study.keys import Keys
from hapticd.experiments.study.protocol import Observer, SimulatedHand, Stimulus
from hapticd.experiments.study.rendering import SAFETY, SessionError
from hapticd.experiments.study.settings import StudyError
from hapticd.experiments.study.sitting import Sitting
from hapticd.experiments.study.study_file import read_design
from hapticd.experiments.study.tasks import Doing, TasksDesign
from hapticd.runtime.command_line.cli import main
from hapticd.runtime.configuration.config import load
from hapticd.runtime.live import lockstep_run
from hapticd.runtime.live.interrupts import Interrupted, held

T = np.arange(0.0, 6.0, 0.01)
STUDY = Path("usability")
TEXT, DESIGN = read_design(STUDY)
assert isinstance(DESIGN, TasksDesign)
DOOR = next(task for task in DESIGN.tasks if isinstance(task, Door))
WAY = next(task for task in DESIGN.tasks if isinstance(task, Way))
GROUND = [(*checkpoint.at, float(checkpoint.pointing)) for checkpoint in WAY.checkpoints]


def moved(place: np.ndarray, yaw: np.ndarray, hinge: np.ndarray | None = None) -> Motion:
    return Motion(T, place, yaw, np.full(len(T), 3.0), hinge)


def turned(hinge: np.ndarray) -> Motion:
    return moved(np.zeros((len(T), 3)), 0.0 * T, hinge)


def over(points: list[tuple[float, ...]]) -> Motion:
    knots = np.linspace(0.0, 5.0, len(points))
    x, y, yaw = (np.interp(T, knots, [point[i] for point in points]) for i in range(3))
    return moved(np.stack([x, y, np.full(len(T), -1.0)], axis=1), yaw)


def test_a_door_counts_when_it_is_wide_enough_to_walk_through() -> None:
    wide, ajar = DOOR.judge(turned(0.3 * T)), DOOR.judge(turned(np.minimum(0.3 * T, 0.9)))
    assert wide["opened"] == pytest.approx(0.34) and wide["through"] == pytest.approx(3.34)
    assert wide["done"] == 1 and ajar["done"] == 0 and ajar["through"] is None


def test_checkpoints_count_in_their_order_and_where_the_handle_points_as_they_do() -> None:
    found = WAY.judge(over(GROUND))
    times = [found[f"checkpoint_{k}"] for k in range(1, 7)]
    assert found["done"] == 1 and found["checkpoints"] == 6 and times == sorted(times)
    assert times[2] == pytest.approx(2.0, abs=0.2)
    length = np.linalg.norm(np.diff(np.array(GROUND)[:, :2], axis=0), axis=1).sum()
    assert found["way"] == pytest.approx(length, rel=1e-2)
    past = WAY.judge(over([*GROUND[:3], *GROUND[4:]]))
    assert past["done"] == 0 and past["checkpoints"] == 3 and "checkpoint_4" not in past
    askew = WAY.judge(over([*GROUND[:3], (*GROUND[3][:2], GROUND[3][2] + 0.6), *GROUND[4:]]))
    assert askew["checkpoints"] == 3
    round_about = WAY.judge(over([(x, y, yaw - 2.0 * np.pi) for x, y, yaw in GROUND]))
    assert round_about["done"] == 1


def test_checkpoints_lie_within_the_machines_box_and_turn_the_handle() -> None:
    box: Any = load("giant").config.giant.box  # type: ignore[attr-defined]
    for x, y, _ in GROUND:
        assert box.lower[0] < x < box.upper[0] and box.lower[1] < y < box.upper[1]
    x, y, yaw = np.array(GROUND).T
    assert np.ptp(x) > 0.7 * (box.upper[0] - box.lower[0]) and np.ptp(yaw) > np.pi
    assert len(GROUND) == 6


def test_simulated_participants_differ_and_each_is_the_same_again() -> None:
    config = load("giant").config

    def hand(person: str, trial: int) -> Any:
        return simulated(config, WAY, Random(person), Random(f"{person} {trial}")).simulation.hand

    assert hand("a", 1) == hand("a", 1)
    assert hand("a", 1).stiffness == hand("a", 2).stiffness != hand("b", 1).stiffness
    assert hand("a", 1).path != hand("a", 2).path
    door = [simulated(load("giant with door").config, DOOR, Random("a"), Random(k)) for k in (1, 2)]
    assert door[0].simulation.hand.path != door[1].simulation.hand.path
    assert all(1.0 < each.simulation.hand.away[0].at < 20.0 for each in door)
    places = [pose.position[:2] for pose in hand("a", 1).path[3:-1]]
    for place, (x, y, _) in zip(places, GROUND, strict=True):
        assert 0.0 < np.hypot(place[0] - x, place[1] - y) < WAY.near


def test_each_task_is_done_three_times_in_an_order_that_the_participant_draws() -> None:
    orders = set()
    for seed in range(8):
        course = DESIGN.course(seed)
        rows, asked = [], []
        while (trial := course.next()) is not None:
            asked.append(len(trial.questions))
            rows.append(course.take({question.name: "20" for question in trial.questions}))
        assert asked == [0, 0, 6] * 2  # each task is rated once, after its last trial
        assert [row["repetition"] for row in rows] == [1, 2, 3] * 2
        orders.add(tuple(row["task"] for row in rows))
    assert orders == {("door",) * 3 + ("path",) * 3, ("path",) * 3 + ("door",) * 3}


@pytest.mark.parametrize(("machine", "hinged"), [("giant", False), ("giant with door", True)])
def test_a_recording_says_where_the_handle_was_and_of_a_door_how_far_it_was_open(
    machine: str, hinged: bool, tmp_path: Path
) -> None:
    loaded, log = load(machine), tmp_path / "it.mcap"
    hand: Any = loaded.config.simulation.hand  # type: ignore[union-attr]
    lockstep_run.run(loaded, log, 0.6, False, quiet=True)
    motion = motion_of(log)
    at, (yaw, *_) = hand.path[0].position, hand.path[0].angles
    np.testing.assert_allclose(motion.place[0], at, atol=2e-3)
    assert abs(np.remainder(motion.yaw[0] - yaw + np.pi, 2.0 * np.pi) - np.pi) < 0.01
    assert motion.t[0] == 0.0 and 0.1 < motion.t[-1] < 0.4
    assert (motion.hinge is not None and abs(motion.hinge).max() < 1e-3) if hinged else motion.hinge is None


# a sitting ----------------------------------------------------------------------------------------------


class Person:
    """Agrees, begins each trial, and rates from 5 on in steps of 5, until it is interrupted."""

    def __init__(self, trials: int) -> None:
        self.left, self.rating = trials, 0

    def ask(self, answers: tuple[str, ...], wrong: Callable[[str], None]) -> str:
        if answers == ("\n",):
            if not self.left:
                raise Interrupted(2)
            self.left -= 1
        if answers != workload.ANSWERS:
            return answers[0]
        self.rating += workload.STEP
        return str(self.rating)


def sit(
    out: Path, trials: int, rendered: list[str], observer: Observer | None = None, stops: int = 0
) -> Sitting:
    """So many trials, of which safety stops some; nothing is simulated."""
    course = DESIGN.course(7, "", observer)
    sitting = Sitting(DESIGN, {"study": TEXT}, out, "01", course, observer is not None)
    said: list[str] = []

    def render(stimulus: Stimulus, log: Path) -> None:
        assert isinstance(stimulus, Doing)
        rendered.append(f"{stimulus.task.kind} {stimulus.k}")
        log.write_text("a session")
        if len(rendered) <= stops:
            raise SessionError(SAFETY, "stopped by safety: the switch")

    person = Person(trials)
    try:
        assert sitting.consent(person.ask, said.append)
        sitting.run(render, None if observer else person.ask, said.append)
    except Interrupted:
        pass
    finally:
        sitting.close()
    return sitting


@pytest.fixture
def unmoved(monkeypatch: pytest.MonkeyPatch) -> None:
    """Recordings in which the door opens and the handle is led over the checkpoints."""
    motion = over(GROUND)
    whole = Motion(motion.t, motion.place, motion.yaw, motion.force, 0.3 * T)
    monkeypatch.setattr(tasks, "motion_of", lambda path: whole)


def table(out: Path) -> list[dict[str, str]]:
    (path,) = out.glob("sub-01/beh/*_beh.tsv")
    head, *rows = (line.split("\t") for line in path.read_text().splitlines())
    return [dict(zip(head, row, strict=True)) for row in rows]


@pytest.mark.usefixtures("unmoved")
def test_a_person_who_breaks_off_goes_on_and_rates_each_task(tmp_path: Path) -> None:
    whole: list[str] = []
    sit(tmp_path / "whole", 6, whole)
    parts: list[str] = []
    sit(tmp_path / "parts", 2, parts)
    last = sit(tmp_path / "parts", 9, parts)
    assert parts == whole and len(parts) == 6 and last.course.next() is None
    rows = table(tmp_path / "whole")
    assert [row["mental_demand"] for row in rows] == ["n/a", "n/a", "5", "n/a", "n/a", "35"]
    assert [row["frustration"] for row in rows] == ["n/a", "n/a", "30", "n/a", "n/a", "60"]
    assert all(row["done"] == "1" and row["simulated"] == row["stopped"] == "0" for row in rows)
    found = last.course.found()
    first, second = rows[0]["task"], rows[-1]["task"]
    assert found[f"{first}_workload"] == 17.5 and found[f"{second}_workload"] == 47.5
    assert found["door_done"] == found["path_done"] == 3 and found["path_checkpoints"] == 6
    meaning = json.loads(next((tmp_path / "whole").glob("sub-01/beh/*_beh.json")).read_text())
    assert meaning["checkpoint_6"]["Units"] == "s" and "0 very low" in meaning["effort"]["Description"]


@pytest.mark.usefixtures("unmoved")
def test_a_simulated_participant_is_labelled_and_rates_nothing(tmp_path: Path) -> None:
    sitting = sit(tmp_path, 0, [], SimulatedHand())
    rows = table(tmp_path)
    assert len(rows) == 6 and all(row["simulated"] == "1" for row in rows)
    assert all(row[name] == "n/a" for row in rows for name in workload.SCALES)
    assert sitting.course.found()["door_workload"] is None
    journal = next(tmp_path.glob("sub-01/beh/*.jsonl")).read_text()
    assert msgspec.json.decode(journal.splitlines()[0])["consent"] == "simulated"
    again: list[str] = []
    assert sit(tmp_path, 0, again, SimulatedHand()).done == 6 and not again  # it was complete
    with pytest.raises(StudyError, match="begun simulated, not by a person"):
        sit(tmp_path, 6, [])


@pytest.mark.usefixtures("unmoved")
def test_a_session_that_safety_stops_is_a_trial_too(tmp_path: Path) -> None:
    sit(tmp_path, 6, [], stops=1)
    assert [row["stopped"] for row in table(tmp_path)] == ["1", "0", "0", "0", "0", "0"]


@pytest.mark.parametrize("by", ["a pipe", "a terminal"])
def test_numbers_are_typed_and_ended_by_enter(by: str) -> None:
    there, here = pty.openpty() if by == "a terminal" else os.pipe()[::-1]
    wrong: list[str] = []
    typed = threading.Timer(0.2, lambda: os.write(there, b"7\n\n101\n -5\n15\n"))
    with held():
        typed.start()
        assert Keys(here).ask(workload.ANSWERS, wrong.append) == "15"
    typed.join()
    assert wrong == ["7", "101", "-5"]
    os.close(there)
    os.close(here)


# the command ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("study", "words", "problem"),
    [
        ("usability", [], "add --live; --observer hand"),
        ("usability", ["--live", "--observer", "hand"], "leave --live out"),
        ("usability", ["--observer", "threshold=1,scale=1"], "done, not answered"),
        ("usability", ["--observer", "hand", "--runs", "3"], "tried with --observer hand"),
        ("usabillity", ["--observer", "hand"], "did you mean 'usability'?"),
    ],
)
def test_who_cannot_take_part_is_told_why(
    study: str, words: list[str], problem: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "data"
    assert main(["study", study, "--participant", "01", "--out", str(out), *words]) == 2
    assert problem in capsys.readouterr().err and not out.exists()


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ('"giant"', '"panda"', "is no giant"),
        ('kind = "path"', 'kind = "door"', "unknown field"),
        ('at = "1.5 1.2 m"', 'at = "1.5 m"', "tasks"),
        ('near = "150 mm"', "near = 0.15", "has no unit"),
        ('kind = "path"', 'kind = "walk"', "Invalid value 'walk'"),
    ],
)
def test_what_is_wrong_with_a_study_of_tasks_is_said(
    old: str, new: str, problem: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert old in TEXT
    study, out = tmp_path / "study.toml", tmp_path / "data"
    study.write_text(TEXT.replace(old, new))
    words = ["--participant", "01", "--observer", "hand"]
    assert main(["study", str(study), "--out", str(out), *words]) == 2
    assert problem in capsys.readouterr().err and not out.exists()


def test_help_lists_the_studies_that_come_with_the_program(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["study", "--help"])
    said = " ".join(capsys.readouterr().out.split())  # lines are as long as the terminal
    assert built_in() and all(f" {name}: {title}" in said for name, title in built_in().items())


@pytest.mark.slow
def test_a_simulated_hand_opens_the_door_and_the_recording_says_so(tmp_path: Path) -> None:
    study = tmp_path / "study.toml"
    door, _, _ = TEXT.partition('[[tasks]]\nkind = "path"')
    study.write_text(door.replace("trials = 3", "trials = 1"))
    out = tmp_path / "data"
    words = ["--participant", "01", "--out", str(out), "--observer", "hand"]
    assert main(["study", str(study), *words]) == 0
    (trial,) = table(out)
    assert trial["done"] == "1" and 0.0 < float(trial["opened"]) < float(trial["through"])
    assert float(trial["through"]) < float(trial["duration"]) < DOOR.seconds
    assert 10.0 < float(trial["peak_force"]) < 150.0 and trial["stopped"] == "0"
