"""``hapticd study``: what people can tell of what a machine renders, and what they do with it."""

from __future__ import annotations

import argparse
import sys
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...runtime.command_line.arguments import Commands, count, file
from ...runtime.command_line.outputs import folder
from ...runtime.invocation import program

if TYPE_CHECKING:
    from .protocol import Design, Machines, Observer, Stimulus
    from .study_text import StudyText

DESCRIPTION = """Measure what people can tell of what a machine renders: constant stimuli, weighted up-down
staircases, or QUEST+, over any number in the machine's configuration. Or let them do tasks with it, and rate
how demanding they were (NASA TLX).

The study's file names machine, what is rendered or done, questions and consent. Each trial has sessions of
its own, in an order that the participant's label draws; the screen does not tell which stimulus it is.
Every trial is on the disk before the next one: after Ctrl-C or a crash the same command goes on."""

EPILOG = """built-in studies: {studies}

a study, stiffness.toml:
  protocol = "threshold"
  name = "stiffness"
  machine = "rhi"                               # or a file
  parameter = "rhi.bodies.wall.stiffness"       # a line of its configuration
  task = "greater"      # which of two is greater; or "forced": level added to
                        # the reference; or "detect": one
  reference = 1000      # in the unit of that line
  seconds = 14          # of each session; this hand is at the wall at 8.5 s
  question = "Which wall was stiffer, the first or the second?"
  consent = "I take part of my own free will and may stop at any time."
  method = {{ kind = "constant", levels = [700, 850, 1150], repeats = 10 }}
  # method = {{ kind = "staircase", start = 400, step = 50, lower = 0,
  #            upper = 800 }}
  # method = {{ kind = "quest", lower = 0, upper = 800, trials = 40 }}

examples:
  {program} study stiffness.toml --participant 01
  {program} study stiffness.toml --participant sim1 --observer threshold=1050,scale=60
      a simulated observer answers; the machine is recorded all the same
  {program} study stiffness.toml --observer threshold=1050,scale=60,lapse=0.02 --runs 200
      rehearse: how well would this design find it? Renders and writes nothing
  {program} study usability --participant 01 --live
  {program} study usability --participant sim1 --observer hand
      a simulated hand does the tasks, and rates nothing

exit status: 0 complete, 1 broken off, no consent, or a session failed, 2 bad usage or study, 3 by safety,
130 by Ctrl-C"""
OBSERVER = ("threshold", "scale", "guess", "lapse")
HAND = "hand"
"""The observer that does things."""


def add_study(commands: Commands) -> None:
    """Add `hapticd study`."""
    study = commands.add_parser(
        "study",
        help="what people can tell of what a machine renders, and what they do with it",
        description=DESCRIPTION,
        epilog=EPILOG.format(program=program(), studies=_listed()),
    )
    study.add_argument("study", type=file, metavar="STUDY", help="a TOML file, or the name of a built-in one")
    study.add_argument(
        "--participant", type=label, metavar="LABEL", help="letters and digits; the data are sub-LABEL"
    )
    study.add_argument(
        "--out", type=folder, default=Path("data"), metavar="DIR", help="folder of the data; default: data"
    )
    study.add_argument(
        "--observer",
        type=observer,
        metavar="WHO",
        help="a simulated participant: threshold=T,scale=S and, if any, guess=G,lapse=L answers; 'hand' does"
        " the tasks",
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


def _listed() -> str:
    """Built-in studies, and what each says of itself."""
    from .built_in import built_in

    return "; ".join(f"{name}: {title}" for name, title in built_in().items())


def observer(text: str) -> Observer:
    """NAME=VALUE,... of a psychometric function, or a hand."""
    from .protocol import SimulatedHand
    from .psychometric import Psychometric

    if text == HAND:
        return SimulatedHand()
    values: dict[str, float] = {}
    for part in text.split(","):
        key, _, number = part.partition("=")
        try:
            values[key.strip()] = float(number)
        except ValueError:
            raise argparse.ArgumentTypeError(f"'{part}' is not NAME=NUMBER, nor '{HAND}'") from None
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
    from .settings import StudyError
    from .study_file import read_design
    from .study_text import StudyText
    from .trying_out import try_out

    text, design = read_design(options.study)
    written = StudyText(str(options.study), text)
    if options.runs and not options.observer:
        raise StudyError("--runs rehearses with simulated observers; give one with --observer")
    if not (options.runs or options.participant):
        raise StudyError("whose answers are they? give --participant, or rehearse with --runs")
    machines = _machines(design, options.study)
    if sys.stderr.isatty():
        print("asks the machine for all that may be shown ...", file=sys.stderr, flush=True)
    if options.runs:
        return _rehearse(design, written, machines, options)
    if refusal := design.refusal(options.observer, options.live):
        raise StudyError(refusal)
    unit = try_out(design, written, machines, not options.live)
    return _sit(design, text, machines, unit, options)


def _machines(design: Design, study: Path) -> Machines:
    """The machine that a study names, built in or a file beside the study's: with any twin."""
    from ...runtime.configuration import config
    from ...runtime.configuration.known import BETWEEN

    beside = study.parent / design.machine
    name = str(beside) if beside.suffix == ".toml" else design.machine
    return cache(lambda twin: config.load(f"{name}{BETWEEN}{twin}" if twin else name))


def _sit(design: Design, text: str, machines: Machines, unit: str, options: argparse.Namespace) -> int:
    import zlib

    from ...runtime.command_line.paragraphs import tell
    from ...runtime.live.interrupts import Interrupted, held
    from .keys import Keys
    from .rendering import SessionError
    from .sitting import Sitting

    seed = zlib.crc32(f"{design.name} {options.participant}".encode())
    course = design.course(seed, unit, options.observer)
    say = partial(tell, stream=sys.stderr)
    machine = machines("")
    texts = {"study": text, "machine": machine.text + machine.model_text}
    with held():
        simulated = options.observer is not None
        sitting = Sitting(design, texts, options.out, options.participant, course, simulated)
        try:
            ask = None if options.observer else Keys(sys.stdin.fileno()).ask
            if not sitting.consent(ask or _nobody, say):
                say("no consent: nothing was rendered")
                return 1
            if sitting.done:
                say(f"goes on after trial {sitting.done}")
            sitting.run(partial(_rendered, machines, options.live), ask, say)
        except (Interrupted, EOFError) as error:
            say(f"broken off after {sitting.done} trials; the same command goes on")
            return error.status if isinstance(error, Interrupted) else 1
        except SessionError as error:
            say(f"broken off after {sitting.done} trials: {error}")
            return error.status
        finally:
            sitting.write()
            sitting.close()
    _tell(course.found(), unit, simulated, options.json)
    return 0


def _rendered(machines: Machines, live: bool, stimulus: Stimulus, log: Path) -> None:
    from .rendering import render

    render(stimulus.machine(machines), stimulus.seconds, log, live)


def _nobody(keys: tuple[str, ...], wrong: object) -> str:
    return keys[0]


def _tell(found: dict[str, Any], unit: str, simulated: bool, as_json: bool) -> None:
    import msgspec

    if as_json:
        print(msgspec.json.encode({**found, "unit": unit, "simulated": simulated}).decode())
        return
    if simulated:
        print("of a simulated participant")
    for key, value in found.items():
        shown = "n/a" if value is None else f"{value:.6g}"
        print(f"{key.replace('_', ' ')}: {shown}{f' {unit}' if unit and key != 'trials' else ''}")


def _rehearse(design: Design, text: StudyText, machines: Machines, options: argparse.Namespace) -> int:
    """What the real study would refuse is refused here: a machine that can only be live is no reason to."""
    import msgspec

    from .psychometric import Psychometric
    from .rehearsal import rehearse
    from .settings import StudyError
    from .threshold import ThresholdDesign
    from .trying_out import try_out

    if not (isinstance(design, ThresholdDesign) and isinstance(options.observer, Psychometric)):
        raise StudyError("--runs rehearses the search for a threshold; tasks are tried with --observer hand")
    try_out(design, text, machines, False if options.live else None)
    found = rehearse(design, options.observer, options.runs)
    if options.json:
        print(msgspec.json.encode(found).decode())
        return 0
    print(f"{options.runs} simulated observers with threshold {options.observer.threshold:g}")
    for key, value in found.items():
        print(f"{key.replace('_', ' ')}: {value:.6g}")
    return 0
