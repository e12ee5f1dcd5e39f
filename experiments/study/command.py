"""``hapticd study``: psychophysics with any parameter that a machine renders."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...runtime.command_line.arguments import Commands, count, file
from ...runtime.command_line.outputs import folder
from ...runtime.invocation import program

if TYPE_CHECKING:
    from ...runtime.configuration.config import Loaded
    from .protocol import Design
    from .psychometric import Psychometric

DESCRIPTION = """Measure what people can tell of what a machine renders: constant stimuli, weighted up-down
staircases, or QUEST+, over any number in the machine's configuration.

The study's file names machine, parameter, task, method, question and consent. Each trial renders its stimuli
in sessions of their own, in random order, and asks for a single key; the screen does not tell which stimulus
it is. Every answer is on the disk before the next trial: after Ctrl-C or a crash the same command goes on."""

EPILOG = """a study, stiffness.toml:
  protocol = "threshold"
  name = "stiffness"
  machine = "rhi"                               # or a file
  parameter = "rhi.bodies.wall.stiffness"       # a line of its configuration
  task = "greater"      # which of two is greater; or "forced": level added to the reference; "detect": one
  reference = 1000      # in the unit of that line
  seconds = 8           # of each session
  question = "Which wall was stiffer, the first or the second?"
  consent = "I take part of my own free will and may stop at any time."
  method = {{ kind = "constant", levels = [700, 850, 1000, 1150, 1300], repeats = 10 }}
  # method = {{ kind = "staircase", start = 400, step = 50, lower = 0, upper = 800 }}
  # method = {{ kind = "quest", lower = 0, upper = 800, trials = 40 }}

examples:
  {program} study stiffness.toml --participant 01
  {program} study stiffness.toml --participant sim1 --observer threshold=1050,scale=60
      a simulated observer answers; the machine is simulated and recorded all the same
  {program} study stiffness.toml --observer threshold=1050,scale=60,lapse=0.02 --runs 200
      rehearse: how well would this design find that threshold? Renders and writes nothing

exit status: 0 complete, 1 broken off, no consent, or a session failed, 2 bad usage or study, 3 by safety"""
OBSERVER = ("threshold", "scale", "guess", "lapse")


def add_study(commands: Commands) -> None:
    """Add `hapticd study`."""
    study = commands.add_parser(
        "study",
        help="what people can tell of what a machine renders",
        description=DESCRIPTION,
        epilog=EPILOG.format(program=program()),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    study.add_argument("study", type=file, metavar="FILE.toml", help="the study")
    study.add_argument(
        "--participant", type=label, metavar="LABEL", help="letters and digits; the data are sub-LABEL"
    )
    study.add_argument(
        "--out", type=folder, default=Path("data"), metavar="DIR", help="folder of the data; default: data"
    )
    study.add_argument(
        "--observer",
        type=observer,
        metavar="NUMBERS",
        help="a simulated observer answers: threshold=T,scale=S and, if any, guess=G,lapse=L",
    )
    study.add_argument(
        "--runs", type=count, metavar="N", help="rehearse with so many observers: bias and spread, no files"
    )
    study.add_argument(
        "--live", action="store_true", help="in real time, on the machine's own bus; default: simulated"
    )
    study.add_argument("--json", action="store_true", help="print what was found as JSON")
    study.set_defaults(handler=run)


def label(text: str) -> str:
    """A participant's label."""
    if not (text.isascii() and text.isalnum() and len(text) <= 40):
        raise argparse.ArgumentTypeError(f"'{text}' is no label; letters and digits, up to 40")
    return text


def observer(text: str) -> Psychometric:
    """NAME=VALUE,... of a psychometric function."""
    from .psychometric import Psychometric

    values: dict[str, float] = {}
    for part in text.split(","):
        key, _, number = part.partition("=")
        try:
            values[key.strip()] = float(number)
        except ValueError:
            raise argparse.ArgumentTypeError(f"'{part}' is not NAME=NUMBER") from None
        if key.strip() not in OBSERVER:
            raise argparse.ArgumentTypeError(f"there is no '{key}'; known: {', '.join(OBSERVER)}")
    if not {"threshold", "scale"} <= values.keys():
        raise argparse.ArgumentTypeError("an observer needs threshold=T,scale=S")
    chances = values.get("guess", 0.0), values.get("lapse", 0.0)
    if not (values["scale"] > 0.0 and min(chances) >= 0.0 and sum(chances) < 1.0):
        raise argparse.ArgumentTypeError(
            "scale is above 0; guess and lapse are chances, less than 1 together"
        )
    return Psychometric(**values)


def run(options: argparse.Namespace) -> int:
    """Rehearse, or lead a participant through the study."""
    from ...runtime.configuration.session import build
    from .settings import StudyError, unit_of, with_values
    from .study_file import read_design

    text, design = read_design(options.study)
    if options.runs and not options.observer:
        raise StudyError("--runs rehearses with simulated observers; give one with --observer")
    if options.runs:
        return _rehearse(design, options)
    if not options.participant:
        raise StudyError("whose answers are they? give --participant, or rehearse with --runs")
    loaded = _machine(design, options.study)
    units = [unit_of(loaded, key) for key in design.ends[0]]
    for stimulus in design.ends:
        build(with_values(loaded, dict(stimulus)))
    return _sit(design, text, loaded, units, options)


def _machine(design: Design, study: Path) -> Loaded:
    """The machine that a study names: built in, or a file beside the study's."""
    from ...runtime.configuration import config

    beside = study.parent / design.machine
    return config.load(str(beside) if beside.suffix == ".toml" else design.machine)


def _sit(design: Design, text: str, loaded: Loaded, units: list[str], options: argparse.Namespace) -> int:
    import zlib

    from ...runtime.live.interrupts import Interrupted, held
    from .keys import Keys
    from .rendering import SessionError, render
    from .sitting import Sitting

    seed = zlib.crc32(f"{design.name} {options.participant}".encode())
    course = design.course(seed, units[0] if units else "", options.observer)
    say = partial(print, file=sys.stderr, flush=True)
    with held():
        sitting = Sitting(design, text, options.out, options.participant, course)
        try:
            ask = None if options.observer else Keys(sys.stdin.fileno()).ask
            if not sitting.consent(ask or _nobody, say, ask is None):
                say("no consent: nothing was rendered")
                return 1
            if sitting.done:
                say(f"goes on after trial {sitting.done}")
            sitting.run(partial(_rendered, render, loaded, design.seconds, options.live), ask, say)
        except (Interrupted, EOFError) as error:
            say(f"broken off after {sitting.done} answers; the same command goes on")
            return error.status if isinstance(error, Interrupted) else 1
        except SessionError as error:
            say(f"broken off after {sitting.done} answers: {error}")
            return error.status
        finally:
            sitting.write()
            sitting.close()
    _tell(course.found(), units, options.json)
    return 0


def _rendered(
    render: Any, loaded: Loaded, seconds: float, live: bool, values: Mapping[str, float], log: Path
) -> None:
    render(loaded, values, seconds, log, live)


def _nobody(keys: tuple[str, ...], wrong: object) -> str:
    return keys[0]


def _tell(found: dict[str, Any], units: list[str], as_json: bool) -> None:
    import msgspec

    if as_json:
        print(msgspec.json.encode({**found, "unit": units[0] if units else ""}).decode())
        return
    unit = f" {units[0]}" if units and units[0] else ""
    for key, value in found.items():
        plain = key == "trials"
        print(f"{key.replace('_', ' ')}: {value:.6g}{'' if plain else unit}")


def _rehearse(design: Design, options: argparse.Namespace) -> int:
    import msgspec

    from .rehearsal import rehearse

    found = rehearse(design, options.observer, options.runs)
    if options.json:
        print(msgspec.json.encode(found).decode())
        return 0
    print(f"{options.runs} simulated observers with threshold {options.observer.threshold:g}")
    for key, value in found.items():
        print(f"{key.replace('_', ' ')}: {value:.6g}")
    return 0
