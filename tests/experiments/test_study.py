"""Studies: levels that follow the answers, observers that recover their threshold, sittings that go on."""

import json
import os
import pty
import select
import signal
import threading
from collections.abc import Callable
from math import log
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from hapticd.configs import read_text
from hapticd.experiments.study.keys import Keys
from hapticd.experiments.study.methods import Constant, QuestPlus, Staircase
from hapticd.experiments.study.protocol import Stimulus
from hapticd.experiments.study.psychometric import Posterior, Psychometric
from hapticd.experiments.study.rehearsal import rehearse
from hapticd.experiments.study.settings import StudyError, unit_of, with_values
from hapticd.experiments.study.sitting import WIDTH, Sitting
from hapticd.experiments.study.study_file import read_design
from hapticd.experiments.study.threshold import Shown
from hapticd.runtime.command_line.cli import main
from hapticd.runtime.configuration.config import load
from hapticd.runtime.configuration.toml_lines import key_lines
from hapticd.runtime.errors import ConfigError
from hapticd.runtime.live.interrupts import Interrupted, held

STUDY = """
protocol = "threshold"
name = "stiffness"
machine = "rhi"
parameter = "rhi.bodies.wall.stiffness"
task = "greater"
reference = 1000
seconds = 4
question = "Which wall was stiffer, the first or the second?"
consent = "I take part of my own free will and may stop at any time. My answers are kept without my name."
"""
CONSTANT = 'method = { kind = "constant", levels = [700, 800, 900, 1000, 1100, 1200, 1300], repeats = 8 }\n'
SHORT = 'method = { kind = "constant", levels = [800, 1200], repeats = 2 }\n'
STAIRCASE = (
    'method = { kind = "staircase", start = 1250, step = 25, lower = 600, upper = 1500, target = 0.5,'
    " reversals = 20 }\n"
)
QUEST = 'method = { kind = "quest", lower = 700, upper = 1300, trials = 30, levels = 13 }\n'
OBSERVER = Psychometric(1050.0, 60.0, 0.0, 0.02)


def written(folder: Path, method: str = SHORT, *changes: tuple[str, str]) -> Path:
    text = STUDY + method
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "study.toml"
    path.write_text(text)
    return path


@pytest.mark.parametrize(("method", "runs"), [(CONSTANT, 100), (STAIRCASE, 100), (QUEST, 15)])
def test_simulated_observers_recover_their_own_threshold(tmp_path: Path, method: str, runs: int) -> None:
    _, design = read_design(written(tmp_path, method))
    found = rehearse(design, OBSERVER, runs)
    assert abs(found["relative_bias"]) < 0.03
    assert found["spread"] < 40.0


def test_forced_choice_finds_the_increment(tmp_path: Path) -> None:
    constant = 'method = { kind = "constant", levels = [50, 100, 150, 200, 250, 300, 350], repeats = 10 }\n'
    _, design = read_design(written(tmp_path, constant, ('"greater"', '"forced"')))
    found = rehearse(design, Psychometric(200.0, 40.0, 0.5, 0.0), 60)
    assert abs(found["relative_bias"]) < 0.06


def test_constant_stimuli_come_equally_often_in_random_blocks() -> None:
    method = Constant((1.0, 2.0, 3.0), 40, Random(1))
    levels = []
    while (level := method.level()) is not None:
        levels.append(level)
        method.answer(True)
    blocks = np.array(levels).reshape(-1, 3)
    assert (np.sort(blocks, axis=1) == [1.0, 2.0, 3.0]).all()
    assert len({tuple(block) for block in blocks.tolist()}) == 6


@pytest.mark.parametrize("target", [0.5, 0.75, 0.85])
def test_a_weighted_staircase_gathers_where_yes_has_its_chance(target: float) -> None:
    truth, random = Psychometric(10.0, 1.0), Random(2)
    levels = []
    method = Staircase(14.0, 0.1, target, (0.0, 20.0), 10**6, 6000)
    while (level := method.level()) is not None:
        levels.append(level)
        method.answer(random.random() < truth.probability(level))
    there = 10.0 - log(1.0 / target - 1.0)
    assert np.mean(levels[500:]) == pytest.approx(there, abs=0.15)


def test_a_staircase_ends_after_its_reversals_and_stays_within_its_bounds() -> None:
    method = Staircase(1.0, 1.0, 0.5, (0.0, 2.0), 3, 100)
    seen = []
    for yes in (True, True, True, False, False, False, False, True, False):
        level = method.level()
        if level is None:
            break
        seen.append(level)
        method.answer(yes)
    assert seen == [1.0, 0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 2.0, 1.0] and method.turns == [0.0, 2.0, 1.0]
    assert method.level() is None


def test_quest_asks_where_an_answer_leaves_the_least_entropy() -> None:
    """Against the definition, written down in loops over every hypothesis."""
    posterior, random = Posterior(0.0, 10.0, 0.5), Random(3)
    levels = [0.0, 2.5, 5.0, 7.5, 10.0]
    quest = QuestPlus(levels, 12, posterior)
    for _ in range(12):
        p = posterior.probabilities.ravel()
        wanted = []
        for level in levels:
            yes, total = posterior.yes(level).ravel(), 0.0
            for outcome in (yes, 1.0 - yes):
                chance = sum(a * b for a, b in zip(p.tolist(), outcome.tolist(), strict=True))
                after = [a * b / chance for a, b in zip(p.tolist(), outcome.tolist(), strict=True)]
                total += chance * sum(-a * log(a) for a in after if a > 0.0)
            wanted.append(total)
        level = quest.level()
        assert level == levels[int(np.argmin(wanted))]
        answer = random.random() < 0.5 + 0.5 / (1.0 + np.exp(-(level - 4.0)))
        quest.answer(answer)
        posterior.observe(level, answer)
    assert quest.level() is None


def test_a_psychometric_function_runs_from_guess_to_lapse() -> None:
    truth = Psychometric(5.0, 0.5, 0.1, 0.04)
    assert truth.probability(-1e9) == pytest.approx(0.1) and truth.probability(1e9) == pytest.approx(0.96)
    assert truth.probability(5.0) == pytest.approx(0.53)


# a sitting ----------------------------------------------------------------------------------------------


class Person:
    """Agrees, and answers by keys in turn until it is interrupted."""

    def __init__(self, keys: str, breaks_off: bool = True) -> None:
        self.keys, self.breaks_off, self.asked = list(keys), breaks_off, 0

    def ask(self, keys: tuple[str, ...], wrong: Callable[[str], None]) -> str:
        self.asked += 1
        if keys == ("y", "n"):
            return "y"
        if not self.keys:
            raise Interrupted(signal.SIGINT)
        return self.keys.pop(0)


def sit(path: Path, out: Path, keys: str, rendered: list[float], said: list[str]) -> Sitting:
    """Until the keys are spent."""
    text, design = read_design(path)
    sitting = Sitting(design, {"study": text}, out, "01", design.course(7, "N/m"))

    def render(stimulus: Stimulus, log_file: Path) -> None:
        assert isinstance(stimulus, Shown)
        rendered.append(stimulus.value)
        log_file.write_text("a session")

    try:
        person = Person(keys)
        assert sitting.consent(person.ask, said.append)
        sitting.run(render, person.ask, said.append)
    except Interrupted:
        pass
    finally:
        sitting.close()
    return sitting


def table(out: Path) -> list[list[str]]:
    (path,) = out.glob("sub-01/beh/*_beh.tsv")
    return [line.split("\t") for line in path.read_text().splitlines()]


def test_a_sitting_that_was_broken_off_goes_on_as_if_it_had_not_been(tmp_path: Path) -> None:
    path = written(tmp_path)
    whole: list[float] = []
    sit(path, tmp_path / "whole", "1211", whole, [])
    said: list[str] = []
    parts: list[float] = []
    sit(path, tmp_path / "parts", "1", parts, said)
    sit(path, tmp_path / "parts", "21", parts, said)
    last = sit(path, tmp_path / "parts", "1", parts, said)
    assert last.done == 4 and last.course.next() is None
    # the trial that was not answered is rendered again
    assert parts == whole[:4] + whole[2:8] + whole[6:]
    assert [row[:5] for row in table(tmp_path / "parts")] == [row[:5] for row in table(tmp_path / "whole")]
    assert sum(line.startswith("I take part") for line in said) == 1  # consent is asked once
    assert all(len(line) <= WIDTH for text in said for line in text.splitlines())


def test_the_screen_does_not_tell_the_stimulus(tmp_path: Path) -> None:
    said: list[str] = []
    sit(written(tmp_path), tmp_path / "data", "1211", [], said)
    assert not any(number in line for line in said for number in ("800", "1000", "1200"))


@pytest.mark.parametrize("cut", [1, 10, 40, 75])
def test_a_crash_in_the_middle_of_an_answer_leaves_all_before_it(tmp_path: Path, cut: int) -> None:
    path, out = written(tmp_path), tmp_path / "data"
    sit(path, out, "121", [], [])
    (journal,) = out.glob("sub-01/beh/*.jsonl")
    data = journal.read_bytes()
    journal.write_bytes(data[:-cut])
    text, design = read_design(path)
    again = Sitting(design, {"study": text}, out, "01", design.course(7))
    assert again.done == 2
    again.close()
    assert data.startswith(journal.read_bytes())


def test_data_are_laid_out_as_bids_has_them(tmp_path: Path) -> None:
    out = tmp_path / "data"
    sit(written(tmp_path), out, "1211", [], [])
    assert json.loads((out / "dataset_description.json").read_text())["BIDSVersion"]
    assert (out / "participants.tsv").read_text() == "participant_id\nsub-01\n"
    head, *rows = table(out)
    meaning = json.loads((out / "sub-01/beh/sub-01_task-stiffness_beh.json").read_text())
    assert list(meaning) == head and meaning["level"]["Units"] == "N/m"
    assert len(rows) == 4 and all(len(row) == len(head) for row in rows)
    assert {row[head.index("level")] for row in rows} == {"800", "1200"}
    assert len(list((out / "sub-01/beh/logs").glob("*.mcap"))) == 8


@pytest.mark.parametrize(
    ("edit", "problem"),
    [
        (lambda text: text.replace('"key":"2"', '"key":"1"'), "differs"),
        (lambda text: text.replace('"key":"2"', '"key":"x"'), "does not fit"),
        (lambda text: text.replace('"study":"', '"study":"0'), "another text"),
        (lambda text: text.replace('{"trial":2', 'trial":2'), "no line of this program"),
    ],
)
def test_data_that_do_not_fit_are_not_gone_on_with(
    tmp_path: Path, edit: Callable[[str], str], problem: str
) -> None:
    path, out = written(tmp_path), tmp_path / "data"
    sit(path, out, "121", [], [])
    (journal,) = out.glob("sub-01/beh/*.jsonl")
    journal.write_text(edit(journal.read_text()))
    text, design = read_design(path)
    with pytest.raises(StudyError, match=problem):
        Sitting(design, {"study": text}, out, "01", design.course(7))


def test_two_sessions_do_not_write_one_journal(tmp_path: Path) -> None:
    text, design = read_design(written(tmp_path))
    first = Sitting(design, {"study": text}, tmp_path, "01", design.course(1))
    with pytest.raises(StudyError, match="being written by another session"):
        Sitting(design, {"study": text}, tmp_path, "01", design.course(1))
    first.close()
    Sitting(design, {"study": text}, tmp_path, "01", design.course(1)).close()


# keys ---------------------------------------------------------------------------------------------------


def test_single_keys_answer_and_the_terminal_is_left_as_it_was() -> None:
    import termios

    master, slave = pty.openpty()
    before = termios.tcgetattr(slave)
    wrong: list[str] = []
    os.write(master, b"1\n")  # before the question
    select.select([slave], [], [])  # what is written to a terminal arrives when a kernel thread has the time
    answered = threading.Event()

    def press() -> None:
        while not answered.wait(0.05):
            os.write(master, b"x2")

    presses = threading.Thread(target=press)
    with held():
        presses.start()
        assert Keys(slave).ask(("1", "2"), wrong.append) == "2"
        answered.set()
        presses.join()
        # a terminal that is emptied between two keys has only the second
        assert set(wrong) <= {"x"} and termios.tcgetattr(slave) == before
        signal.pthread_kill(threading.get_ident(), signal.SIGINT)  # waits until it is heard
        with pytest.raises(Interrupted):
            Keys(slave).ask(("1", "2"), wrong.append)
    assert termios.tcgetattr(slave) == before
    os.close(master)
    os.close(slave)


def test_a_pipe_that_ends_breaks_off() -> None:
    read, write = os.pipe()
    os.write(write, b"\nz1")
    wrong: list[str] = []
    assert Keys(read).ask(("1", "2"), wrong.append) == "1" and wrong == ["z"]
    os.close(write)
    with pytest.raises(EOFError):
        Keys(read).ask(("1", "2"), wrong.append)
    os.close(read)


# the machine and the file -------------------------------------------------------------------------------


def test_a_parameter_is_set_in_its_unit_in_values_and_text() -> None:
    rhi = load("rhi")
    assert unit_of(rhi, "rhi.bodies.wall.stiffness") == "N/m" and unit_of(rhi, "rhi.task.spread") == ""
    changed = with_values(rhi, {"rhi.bodies.wall.stiffness": 850.5, "rhi.task.spread": 4.0})
    assert changed.config.rhi.bodies["wall"].stiffness == 850.5  # type: ignore[attr-defined]
    assert changed.config.rhi.task.spread == 4.0  # type: ignore[attr-defined]
    differing = [b for a, b in zip(rhi.text.splitlines(), changed.text.splitlines(), strict=True) if a != b]
    assert len(differing) == 2 and 'stiffness = "850.5 N/m"' in differing[1]
    counted = with_values(rhi, {"rhi.null_space.scan": 500.0})
    assert counted.config.rhi.null_space.scan == 500  # type: ignore[attr-defined]
    giant = with_values(load("giant"), {"giant.twin.mass": 7.0})
    assert giant.config.giant.twin.mass == 7.0  # type: ignore[attr-defined]
    with pytest.raises(ConfigError, match="out of range"):
        with_values(rhi, {"rhi.bodies.wall.stiffness": 1e9})


LINES = key_lines(read_text("rhi.toml"))
WALL = "rhi.bodies.wall.stiffness"
LIMITS = f'machine refuses it: rhi.toml:{LINES[WALL]}: {WALL}: "{{}} N/m" is out of range'
WRONG: list[tuple[str, tuple[str, str], int, str]] = [
    (SHORT, ("wall.stiffness", "wall.softness"), 5, "parameter: rhi.toml has no line for"),
    (SHORT, ("wall.stiffness", "wall.stifness"), 5, "did you mean 'rhi.bodies.wall.stiffness'?"),
    (
        SHORT,
        ("bodies.wall.stiffness", "motors.torque"),
        5,
        f"rhi.toml:{LINES['rhi.motors.torque']}: 'rhi.motors.torque' is",
    ),
    (SHORT, ('"greater"', '"detect"'), 7, 'reference: is for task = "greater" and "forced"'),
    (SHORT, ("reference = 1000", ""), 1, "reference: is missing"),
    (SHORT, ("reference = 1000", "reference = -5"), 7, f"reference: -5: the {LIMITS.format('-5')}"),
    (SHORT, ('"greater"', '"smaller"'), 6, "task: Invalid enum value"),
    (SHORT, ("[800, 1200]", "[800, 800]"), 11, "method: its levels, 800 to 800, leave no range"),
    (SHORT, ("[800, 1200]", "[nan, 1200]"), 11, "method.levels[0]: Expected `float`"),
    (SHORT, ("[800, 1200]", "[-900, 800, 1200]"), 11, f"method.levels: -900: the {LIMITS.format('-900')}"),
    (SHORT, ("repeats", "repeat"), 11, "method.repeat: Object contains unknown field"),
    (SHORT, ("question", "wording"), 9, "wording: Object contains unknown field"),
    (
        SHORT,
        ('machine = "rhi"', 'machine = "rho"'),
        4,
        "machine: rho: no such file",
    ),
    (SHORT, ("seconds = 4", "seconds = 0.001"), 8, "give more than 3.3"),
    (SHORT, ("seconds = 4", "seconds = 3.3"), 8, "the hand presses at 0.3 s and its force fades in for 3 s"),
    (STAIRCASE, ("lower = 600", "lower = -600"), 11, f"method.lower: -600: the {LIMITS.format('-600')}"),
    (QUEST, ("upper = 1300", "upper = 1e8"), 11, f"method.upper: 1e+08: the {LIMITS.format('100000000')}"),
]


@pytest.mark.parametrize("how", [["--participant", "01"], ["--runs", "3"]], ids=["real", "rehearsal"])
@pytest.mark.parametrize(("method", "change", "line", "problem"), WRONG)
def test_what_is_wrong_with_a_study_is_said_at_its_start_with_its_line(
    tmp_path: Path,
    method: str,
    change: tuple[str, str],
    line: int,
    problem: str,
    how: list[str],
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = written(tmp_path, method, change)
    out = str(tmp_path / "data")
    assert main(["study", str(path), *how, "--out", out, "--observer", "threshold=1,scale=1"]) == 2
    said = capsys.readouterr()
    assert said.err.startswith(f"hapticd: error [study]: {path}:{line}: ") and problem in said.err
    assert said.out == "" and not (tmp_path / "data").exists()


@pytest.mark.parametrize(
    ("method", "values"),
    [
        (SHORT, {800.0, 1000.0, 1200.0}),
        (STAIRCASE, {600.0, 1000.0, 1250.0, 1500.0}),
        (QUEST, {1000.0, *(700.0 + 50.0 * k for k in range(13))}),
    ],
)
def test_all_that_can_be_shown_is_asked_of_the_machine(
    tmp_path: Path, method: str, values: set[float]
) -> None:
    _, design = read_design(written(tmp_path, method))
    assert {asked.stimulus.value for asked in design.asked} == values  # type: ignore[attr-defined]
    shown = {asked.stimulus.value for asked in design.asked if asked.outermost}  # type: ignore[attr-defined]
    assert shown >= {min(values), max(values)}


def test_increments_are_tried_on_top_of_their_reference(tmp_path: Path) -> None:
    _, design = read_design(written(tmp_path, SHORT, ('"greater"', '"forced"')))
    values = {asked.stimulus.value for asked in design.asked}  # type: ignore[attr-defined]
    assert values == {1000.0, 1800.0, 2200.0}


def machine_beside(folder: Path, *changes: tuple[str, str]) -> Path:
    """A short study of a changed machine in a file beside it."""
    text = read_text("rhi.toml").replace("scan = 4000 ", "scan = 0 ")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "mine.toml").write_text(text)
    (folder / "rhi.urdf").write_text(read_text("rhi.urdf"))
    return written(folder, SHORT, ('machine = "rhi"', 'machine = "mine.toml"'))


PRESS = 'dead_man = [{ at = "0.3 s", pressed = true }]'


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ((PRESS, "dead_man = []"), "nobody presses the dead-man switch in the simulation of"),
        (('rate = "1 kHz"', 'rate = "1 kg"'), "mine.toml:11: loop.rate"),
        (("leave = 0.7 ", "leave = 0.99 "), "mine.toml:"),
    ],
)
def test_a_machine_that_cannot_take_part_is_refused_by_its_line(
    tmp_path: Path, change: tuple[str, str], problem: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = machine_beside(tmp_path, change)
    assert main(["study", str(path), "--observer", "threshold=1000,scale=20", "--runs", "1"]) == 2
    assert problem in capsys.readouterr().err


def test_a_stimulus_that_was_never_rendered_breaks_the_study_off(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its hand pulls at a machine that stands elsewhere, which is not started therefore."""
    posture = "1.024066 -0.156786 0.230091 1.655231 rad"
    path = machine_beside(tmp_path, (posture, "1.9 2.5 1.7 2.1 rad"))
    words = ["study", str(path), "--participant", "01", "--out", str(tmp_path / "data")]
    assert main([*words, "--observer", "threshold=1000,scale=20"]) == 1
    said = capsys.readouterr().err
    assert "broken off after 0 trials: the machine never became active: not started: the handle" in said


def test_the_command_renders_each_stimulus_and_replays_to_the_same_bits(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from hapticd.runtime.recording.log import open_log
    from hapticd.runtime.recording.replay import replay

    path = machine_beside(tmp_path)
    path.write_text(path.read_text().replace("repeats = 2", "repeats = 1"))
    words = ["study", str(path), "--participant", "s1", "--out", str(tmp_path / "data")]
    assert main([*words, "--observer", "threshold=1000,scale=20", "--json"]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert found["trials"] == 2 and found["unit"] == "N/m" and 800 < found["threshold"] < 1200
    logs = sorted((tmp_path / "data/sub-s1/beh/logs").glob("*.mcap"))
    assert len(logs) == 4
    kept = open_log(str(logs[0]))
    assert kept.loaded.config.rhi.bodies["wall"].stiffness in (800.0, 1000.0, 1200.0)  # type: ignore[attr-defined]
    assert replay(kept).differing_ticks == 0
    # complete: the same command renders nothing more
    times = [path.stat().st_mtime_ns for path in logs]
    assert main([*words, "--observer", "threshold=1000,scale=20"]) == 0
    assert [path.stat().st_mtime_ns for path in logs] == times
    # with another machine in the same file it does not go on
    machine = path.with_name("mine.toml")
    machine.write_text(machine.read_text() + "# another\n")
    capsys.readouterr()
    assert main([*words, "--observer", "threshold=1000,scale=20"]) == 2
    assert "was begun with another text of the machine" in capsys.readouterr().err
