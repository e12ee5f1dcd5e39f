"""The user study of HapticGiant, VII-D: two tasks, three trials each, and the NASA TLX after each task.

``python -m hapticd.experiments.user_study door --participant P01 --out study`` leads a person through a task:
live sessions as `hapticd run` has them, each recorded, then the questionnaire at the terminal. With
``--simulated`` a hand that the participant's label draws does the task in lockstep and rates nothing.
"""

from __future__ import annotations

import argparse
import sys
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from random import Random
from statistics import fmean
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from ..machines.giant.config import GiantConfig
from ..machines.giant.kinematics import points
from ..models import Array
from ..runtime.configuration import config
from ..runtime.configuration.config import Loaded
from ..runtime.core.modes import RENDERING
from ..runtime.errors import HapticdError
from ..runtime.live import daemon, lockstep_run
from ..runtime.recording.log import open_log

TRIALS = 3
"""Of each task, as in the paper."""
OPEN, THROUGH = 0.1, 1.0
"""The door is open, and wide enough to walk through, from these angles of its hinge on [rad]."""
CHECKPOINTS = (
    (0.6, -0.8, 0.0),
    (1.9, -1.2, 45.0),
    (1.5, 1.2, 120.0),
    (-0.2, 1.9, 200.0),
    (-1.7, 0.6, 270.0),
    (-1.2, -1.4, 340.0),
)
"""On the ground of the room: x, y [m], and where the handle is to point [deg]; the simulated handle begins at
the first."""
NEAR, BESIDE = 0.15, 0.03
"""A checkpoint is reached within the first distance; simulated hands miss it by some of the second [m]."""
SCALES = {
    "mental demand": "How mentally demanding was the task? 0 very low, 100 very high",
    "physical demand": "How physically demanding was it? 0 very low, 100 very high",
    "temporal demand": "How hurried was the pace? 0 very low, 100 very high",
    "performance": "How successful were you in doing it? 0 perfect, 100 failure",
    "effort": "How hard did you have to work for that? 0 very low, 100 very high",
    "frustration": "How insecure, irritated or annoyed were you? 0 very low, 100 very high",
}
"""The NASA TLX without weights (Hart and Staveland 1988); answers in steps of 5."""
STEP = 5


class UserStudyError(HapticdError):
    """A study cannot go on."""

    code = "user-study"
    exit_status = 2


@dataclass(frozen=True, slots=True)
class Motion:
    """What a recording says of k ticks in which the machine rendered.

    Attributes:
        t: from the first of them, (k,) [s].
        place: of the handle in B, (k, 3) [m]; force: size of the person's, (k,) [N].
        hinge: of the door, (k,) [rad]; None where the twin has none.
    """

    t: Array
    place: Array
    force: Array
    hinge: Array | None


@dataclass(frozen=True, slots=True)
class Task:
    """What a participant does.

    Attributes:
        machine: a built-in twin of the giant, "" for a free mass; seconds: of a trial.
        says: to the participant.
        judge: what a trial's motion is worth, numbers by name.
    """

    machine: str
    seconds: float
    says: str
    judge: Callable[[Motion], dict[str, Any]]


def opened(motion: Motion) -> dict[str, Any]:
    """When the door was open and wide open [s], None where it never was."""
    assert motion.hinge is not None
    return {
        "opened_s": first(motion.t, motion.hinge >= OPEN),
        "through_s": first(motion.t, motion.hinge >= THROUGH),
        "done": bool((motion.hinge >= THROUGH).any()),
    }


def followed(motion: Motion) -> dict[str, Any]:
    """When each checkpoint was reached after the one before [s], and how long the path was [m]."""
    reached: list[float | None] = []
    begin = 0
    for x, y, _ in CHECKPOINTS:
        away = np.hypot(motion.place[begin:, 0] - x, motion.place[begin:, 1] - y)
        hits = np.flatnonzero(away <= NEAR)
        if not hits.size:
            break
        begin += int(hits[0])
        reached.append(float(motion.t[begin]))
    steps = np.linalg.norm(np.diff(motion.place[:, :2], axis=0), axis=1)
    missing = len(CHECKPOINTS) - len(reached)
    return {
        "checkpoints_s": [*reached, *[None] * missing],
        "path_m": float(steps.sum()),
        "done": missing == 0,
    }


TASKS = {
    "door": Task(
        "door",
        24.0,
        "Without looking: before you is a door. Take its handle, open the door and walk through it.",
        opened,
    ),
    "path": Task(
        "",
        45.0,
        "Six checkpoints are marked on the ground. Lead the handle over all of them, one after the other, and"
        " let it point where each of them points.",
        followed,
    ),
}


def first(times: Array, sign: NDArray[np.bool_]) -> float | None:
    """The first of the times at which something is so."""
    hits = np.flatnonzero(sign)
    return float(times[hits[0]]) if hits.size else None


def motion_of(path: Path) -> Motion:
    """What a recording of the giant says.

    Raises:
        UserStudyError: the machine never rendered in it.
        LogError: it is damaged.
    """
    log = open_log(str(path))
    rate = log.loaded.config.loop.rate
    rows = []
    for record in log.records():
        if int(record.fixed["mode"]) not in RENDERING:
            continue
        state = record.fixed["state"]
        handle, _ = points(state["link"].tolist(), state["axis"].tolist())
        names = state.dtype.names or ()
        angle = float(state["twin"]["hinge"]) if "twin" in names else np.nan
        push = float(np.linalg.norm(state["wrench"][:3]))
        rows.append([int(record.fixed["tick"]) / rate, *handle, push, angle])
    if not rows:
        raise UserStudyError(f"{path}: the machine was never engaged; nothing can be said of this trial")
    table = np.array(rows)
    hinge = None if np.isnan(table[:, 5]).any() else table[:, 5]
    return Motion(table[:, 0] - table[0, 0], table[:, 1:4], table[:, 4], hinge)


def judged(task: Task, motion: Motion) -> dict[str, Any]:
    """A trial in numbers."""
    forces = {"mean_force_n": float(motion.force.mean()), "peak_force_n": float(motion.force.max())}
    return {**task.judge(motion), **forces, "seconds": float(motion.t[-1])}


def rate(ask: Callable[[str], str], say: Callable[[str], None]) -> dict[str, int]:
    """Ask for the six scales; a wrong answer is asked again.

    Raises:
        UserStudyError: nobody answers any more.
    """
    found = {}
    for name, question in SCALES.items():
        while name not in found:
            try:
                answer = ask(f"{question}: ")
            except EOFError as error:
                raise UserStudyError(
                    "the questionnaire was broken off; its task is not in the data"
                ) from error
            if answer.strip().isdecimal() and int(answer) <= 100 and int(answer) % STEP == 0:
                found[name] = int(answer)
            else:
                say(f"a number from 0 to 100 in steps of {STEP}, please")
    return found


def simulated(loaded: Loaded, task: str, participant: str, trial: int) -> Loaded:
    """The machine in the hand of a simulated participant, whom the label draws; trials differ a little."""
    whole = loaded.config
    assert isinstance(whole, GiantConfig) and whole.simulation
    person = Random(f"{participant} {task}")
    hand = whole.simulation.hand
    grip = {"stiffness": person.uniform(400.0, 1200.0), "damping": person.uniform(25.0, 40.0)}
    pace = person.uniform(0.35, 0.6)
    again = Random(f"{participant} {task} {trial}")
    changes: dict[str, Any] = {key: type(getattr(hand, key))(value) for key, value in grip.items()}
    if task == "path":
        changes["path"] = _walk(hand.path[0], pace, again)
    seed = zlib.crc32(f"{participant} {task} {trial}".encode())
    changed = msgspec.structs.replace(
        whole.simulation, hand=msgspec.structs.replace(hand, **changes), seed=seed, touches={}
    )
    return replace(loaded, config=msgspec.structs.replace(whole, simulation=changed))


def _walk(start: Any, pace: float, random: Random) -> tuple[Any, ...]:
    """Over the checkpoints at a pace [m/s], a few centimetres beside them."""
    t = 4.0
    way, place = [(0.0, start), (t - 0.2, start), (t, start)], np.array(start.position[:2])
    for x, y, yaw in CHECKPOINTS[1:]:
        there = np.array([random.gauss(x, BESIDE), random.gauss(y, BESIDE)])
        t += max(float(np.linalg.norm(there - place)) / pace, 1.5)
        angles = (np.radians(yaw), *start.angles[1:])
        way.append(
            (t, msgspec.structs.replace(start, position=(*there.tolist(), start.position[2]), angles=angles))
        )
        place = there
    kind = type(start.at)
    return tuple(msgspec.structs.replace(pose, at=kind(at)) for at, pose in way)


def sit(options: argparse.Namespace, ask: Callable[[str], str], say: Callable[[str], None]) -> dict[str, Any]:
    """Lead a participant through a task; every trial is a line of the data at once, the ratings are the last.

    Returns:
        What became of the task.

    Raises:
        UserStudyError: a session failed, nobody answers, or the data cannot be written.
    """
    task = TASKS[options.task]
    loaded = config.load(f"{options.config} with {task.machine}" if task.machine else options.config)
    if not isinstance(loaded.config, GiantConfig):
        raise UserStudyError(f"{options.config} is no giant; the tasks are its own")
    head = {"task": options.task, "participant": options.participant, "simulated": options.simulated}
    done: list[dict[str, Any]] = []
    for trial in range(1, TRIALS + 1):
        log = options.out / f"{options.participant}-{options.task}-{trial}.mcap"
        if log.exists():
            raise UserStudyError(f"{log} is there already; give another --participant, or move it away")
        if options.simulated:
            outcome = lockstep_run.run(
                simulated(loaded, options.task, options.participant, trial), log, task.seconds, False
            )
        else:
            say(task.says)
            ask(f"trial {trial} of {TRIALS}; Enter begins it: ")
            outcome = daemon.run(loaded, log, task.seconds, sys.stderr.isatty())
        if outcome.status == 2 or not log.exists():
            raise UserStudyError(f"trial {trial} failed: {outcome.message}")
        done.append(judged(task, motion_of(log)))
        _add(options.out / "data.jsonl", {**head, "trial": trial, "status": outcome.status, **done[-1]})
        say(f"trial {trial}: {'done' if done[-1]['done'] else 'not done'} within {done[-1]['seconds']:.1f} s")
    ratings = None if options.simulated else rate(ask, say)
    _add(options.out / "data.jsonl", {**head, "tlx": ratings})
    overall = None if ratings is None else fmean(ratings.values())
    return {
        **head,
        "done": sum(each["done"] for each in done),
        "of": TRIALS,
        "tlx": ratings,
        "overall": overall,
    }


def _add(path: Path, line: dict[str, Any]) -> None:
    try:
        with path.open("ab") as file:
            file.write(msgspec.json.encode(line) + b"\n")
    except OSError as error:
        raise UserStudyError(f"cannot write {path}: {error.strerror}") from error


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a task; returns the exit status: 0 done, 2 it could not go on."""
    parser = argparse.ArgumentParser(
        prog="python -m hapticd.experiments.user_study",
        description="Lead a participant through a task of HapticGiant's user study (VII-D): three trials,"
        " then the NASA TLX. Trials and ratings are lines of DIR/data.jsonl, recordings lie beside them.",
    )
    parser.add_argument("task", choices=TASKS, help="what is to be done")
    parser.add_argument("--participant", required=True, metavar="LABEL", help="letters and digits, no name")
    parser.add_argument(
        "--config", default="giant", metavar="CONFIG", help="a giant; default: the simulated one"
    )
    parser.add_argument("--out", type=Path, default=Path("study"), metavar="DIR", help="default: study")
    parser.add_argument(
        "--simulated",
        action="store_true",
        help="a simulated hand does it; labelled, rates nothing",
    )
    options = parser.parse_args(arguments)
    if not (options.participant.isascii() and options.participant.isalnum()):
        parser.error(f"'{options.participant}' is no label: letters and digits alone")

    def say(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    try:
        options.out.mkdir(parents=True, exist_ok=True)
        found = sit(options, input, say)
    except (HapticdError, OSError) as error:
        say(f"error: {error}")
        return 2
    print(msgspec.json.encode(found).decode())
    return 0


if __name__ == "__main__":
    sys.exit(main())
