"""The command line.

What a command works with is imported when it runs: help, a wrong word and completion answer at once.
"""

from __future__ import annotations

import argparse
import os
import shlex
import sys
from datetime import datetime
from functools import partial
from importlib import import_module, metadata
from io import TextIOWrapper
from pathlib import Path
from typing import IO, TYPE_CHECKING

from ...configs import plugins
from ...configs.demonstrations import DEMONSTRATIONS
from ..configuration.known import built_in, demonstrations, example
from ..errors import ConfigError, HapticdError
from ..invocation import program
from ..live.interrupts import held
from .arguments import (
    MAX_SECONDS,
    Commands,
    Parser,
    add_twin,
    bit_rate,
    chosen,
    file,
    meant,
    name,
    number,
    setting,
)
from .outputs import folder

if TYPE_CHECKING:
    from ..configuration.config import Loaded

EPILOG = """examples:
  {program} run {machine}
      a built-in machine, simulated, in a scripted hand
  {program} run my_machine.toml --duration 600
  {program} run {machine} --twin door
      the same machine as a door with a handle; docs/twins.md: one of your own
  {program} run {machine} --twin mass,door,excavator
      begins with the first; the keys 1 to 3 exchange it while the machine runs
  {program} replay --verify
      the newest session again, every tick compared bit for bit
  {program} check my_machine.toml
  {program} doctor
  {program} bench solve --json

While a session runs, its terminal shows the keys that can be pressed: stop,
reset, quit, and those of the simulated person. Through a pipe, commands are
whole words, one a line; the word help lists them. Ctrl-C ends the session
after the machine has come to rest.

exit status: 0 done, 1 a check failed, or the machine never became active
             though there was time for it, 2 bad usage or configuration,
             3 stopped by safety; ended before anything moved, or at once
             because asked twice: 130 by Ctrl-C, 143 by SIGTERM, 129 by a
             terminal that closed

hapticd is not a certified safety device. Nobody may rely on it instead of STO,
brakes, dead-man switch and emergency stop."""


LOGS = Path("log")


def main(arguments: list[str] | None = None) -> int:
    """Run a command; returns the exit status."""
    # a path that a terminal cannot show is no reason to fail
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    closed = _require_streams()
    parser = commands()
    options = parser.parse_args(arguments)
    if options.json and sys.stdout in closed:
        parser.error("standard output is closed, and what --json prints goes there: give it a file or a pipe")
    from .execution import execute

    return execute(options)


def _require_streams() -> list[IO[str]]:
    """Where a standard stream was closed, nothing else may take its place: a log would be written to.

    Returns:
        what stands for those that were closed.
    """
    closed: list[IO[str]] = []
    for fd, stream, mode in ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w")):
        try:
            os.fstat(fd)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number, which is fd
            closed.append(open(fd, mode, closefd=False))
            setattr(sys, stream, closed[-1])
    return closed


def commands() -> argparse.ArgumentParser:
    """All that can be typed."""
    parser = Parser(
        prog="hapticd",
        description="Real-time daemon for kinesthetic haptic interfaces.",
        epilog=EPILOG.format(program=program(), machine=example()),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"hapticd {metadata.version('hapticd')}")
    added = parser.add_subparsers(required=True, metavar="COMMAND")

    for add in (_add_run, _add_demo, _add_replay, _add_check, _add_doctor, _add_plant):
        add(added)
    for command in plugins.names(plugins.COMMANDS):
        plugins.plugin(plugins.COMMANDS, command)(added)
    # by name: benchmarks build on the runtime, which must not import them
    import_module("hapticd.bench.command").add_benchmarks(added)
    _add_experiment(added)
    return parser


def _add_run(commands: Commands) -> None:
    run = commands.add_parser("run", help="run a machine", description="Run a machine, live or in lockstep.")
    known = ", ".join(built_in())
    run.add_argument(
        "config",
        type=name,
        metavar="CONFIG",
        help=f"a TOML file, or the name of a built-in machine: {known}",
    )
    add_twin(run)
    run.add_argument(
        "--duration",
        type=number(MAX_SECONDS),
        metavar="S",
        help="seconds; default: as the configuration says, but once a person at the keyboard has taken the"
        " simulated hand, until that person quits",
    )
    run.add_argument("--log", type=file, metavar="FILE", help="recording; default: log/CONFIG-DATE-TIME.mcap")
    run.add_argument(
        "--lockstep", action="store_true", help="virtual time, as fast as it goes, plant in-process"
    )
    run.add_argument(
        "--view", action="store_true", help="show it in the browser, too: prints the address of a dashboard"
    )
    run.add_argument("--json", action="store_true", help="print the summary as one JSON object")
    run.set_defaults(handler=_run, demo=False)


def _add_demo(commands: Commands) -> None:
    demo = commands.add_parser(
        "demo",
        help="a machine to play with in the browser",
        description="Run a simulated machine with its dashboard, and open that in this desktop's browser."
        " It goes on until Ctrl-C: lead the hand, press the emergency stop, reset, engage again.",
    )
    demo.add_argument(
        "config",
        type=name,
        metavar="DEMO",
        nargs="?",
        default=example(),
        help=f"{', '.join(demonstrations())}, or a TOML file; default: {example()}."
        " Of bimanual, both stations have a dashboard",
    )
    add_twin(demo)
    demo.add_argument("--log", type=file, metavar="FILE", help="recording; default: log/NAME-DATE-TIME.mcap")
    demo.set_defaults(handler=_demo, demo=True, view=True, json=False, lockstep=False, duration=None)


def _add_replay(commands: Commands) -> None:
    replay = commands.add_parser(
        "replay",
        help="re-run a recorded session",
        description="Re-run a recorded session through the same code and compare every tick.",
    )
    replay.add_argument(
        "log",
        type=name,
        metavar="LOG",
        nargs="?",
        help="a recording that `hapticd run` wrote; default: the newest in log/",
    )
    replay.add_argument(
        "--verify", action="store_true", help="exit with 1 unless every tick comes out bit for bit the same"
    )
    replay.add_argument(
        "--json",
        action="store_true",
        help="print ticks, differing_ticks, missing_ticks, first, speed_x as JSON",
    )
    replay.set_defaults(handler=_replay)


def _add_check(commands: Commands) -> None:
    check = commands.add_parser(
        "check",
        help="check a configuration and its model",
        description="Check a configuration, its model and its devices without moving anything.",
    )
    check.add_argument(
        "config",
        type=name,
        metavar="CONFIG",
        help="a TOML file, the name of a built-in machine, or a model: a URDF file",
    )
    add_twin(check)
    check.add_argument("--json", action="store_true", help="print the findings as JSON")
    check.set_defaults(handler=_check)


def _add_doctor(commands: Commands) -> None:
    doctor = commands.add_parser(
        "doctor",
        help="is this host fit for real time",
        description="Check kernel, permissions, CPUs, CAN interfaces and libraries; each line passes, or says"
        " why it matters and what to type. docs/rt-host.md goes through them one by one.",
    )
    doctor.add_argument(
        "config",
        type=name,
        metavar="CONFIG",
        nargs="?",
        help="check the processor and the CAN interface that it names",
    )
    doctor.add_argument("--json", action="store_true", help="print the lines as JSON")
    doctor.set_defaults(handler=_doctor)


def _add_plant(commands: Commands) -> None:
    plant = commands.add_parser(
        "plant",
        help="simulate a machine at the other end of a bus",
        description="Simulate a machine's devices on the bus that its configuration names under [bus], or on "
        "another one; never on a real machine's. A bus of python-can has a channel, SocketCAN has none.",
    )
    plant.add_argument(
        "config", type=name, metavar="CONFIG", help="a TOML file with [simulation], or a built-in machine"
    )
    add_twin(plant)
    plant.add_argument(
        "--interface", type=name, metavar="IF", help="e.g. vcan0, or of python-can: udp_multicast, pcan, ..."
    )
    plant.add_argument(
        "--channel", type=name, metavar="CH", help="of python-can, e.g. 239.74.163.2 or PCAN_USBBUS1"
    )
    plant.add_argument("--bitrate", type=bit_rate, metavar="RATE", help='e.g. "1 Mbit/s"')
    plant.add_argument("--data-bitrate", type=bit_rate, metavar="RATE", help='e.g. "5 Mbit/s"')
    plant.add_argument(
        "--set",
        type=setting,
        action="append",
        default=[],
        metavar="KEY=VALUE",
        dest="settings",
        help="a setting of python-can's interface; more than once where there are several",
    )
    plant.set_defaults(handler=_plant, json=False)


def _add_experiment(commands: Commands) -> None:
    experiment = commands.add_parser(
        "experiment",
        help="run the papers' figures and tables",
        description="Run figures and tables of the papers in simulation: their numbers beside ours.",
    )
    which = experiment.add_mutually_exclusive_group(required=True)
    which.add_argument(
        "name", type=name, nargs="?", metavar="NAME", help="a figure or a table; a wrong name lists them"
    )
    which.add_argument(
        "--all", action="store_true", help="every experiment, two at a time; takes some minutes"
    )
    experiment.add_argument(
        "--machine",
        type=name,
        metavar="MACHINE",
        help="with --all: those of one machine alone; a wrong name lists them",
    )
    experiment.add_argument(
        "--full",
        action="store_true",
        help="more trials where an experiment has a study of many; takes longer",
    )
    experiment.add_argument(
        "--out",
        type=folder,
        metavar="DIR",
        help="write each plot into DIR/figures, each table into DIR/fidelity.md; default: write nothing",
    )
    experiment.add_argument("--json", action="store_true", help="print the figures as JSON, one line each")
    experiment.set_defaults(handler=_experiment)


def _run(options: argparse.Namespace) -> int:
    from ..configuration import config
    from ..configuration.session import remarks
    from ..live import daemon, lockstep_run
    from ..live.never_active import never_active
    from ..live.promise import verdict
    from ..live.recorder import STDERR
    from ..live.screen import steerable
    from ..live.watching import watching
    from ..recording.summary import as_json, table
    from .paragraphs import tell

    loaded = config.load(chosen(options))
    if options.demo or (options.view and options.lockstep):
        _require_playable(options, loaded)
    live = steerable(STDERR) and not options.json
    run = partial(daemon.run, endless=options.demo) if not options.lockstep else lockstep_run.run
    with held(), watching(options.view, options.demo):
        log = _log_path(options.log, loaded)
        try:
            outcome = run(loaded, log, options.duration, live)
        finally:
            if log.exists() and log.stat().st_size == 0:  # nothing began
                log.unlink()
    status, last = outcome.status, ""
    idle = never_active(loaded.config, outcome)
    if outcome.report:
        shown, last = verdict(loaded, outcome.report, options.lockstep, idle)
        status = status or int(not shown)
    if outcome.report and options.json:
        speed = {} if outcome.speed_x is None else {"speed_x": outcome.speed_x}
        more = {"log": str(log), "status": status, "message": outcome.message, "verdict": last, **speed}
        more |= {"remarks": remarks(loaded), "never_active": idle.why if idle else ""}
        print(as_json(outcome.report, **more))
    elif outcome.report:
        print(table(outcome.report))
        if outcome.speed_x is not None:
            print(f"lockstep: {outcome.speed_x:g} times real time")
        for remark in remarks(loaded):
            tell(f"note: {remark}")
        print(f"log: {log}")
        print(f"replay: {program()} replay {shlex.quote(str(log))} --verify")
        tell(last)
    if outcome.message:
        tell(f"hapticd: {outcome.message}", sys.stderr)
    return status


def _demo(options: argparse.Namespace) -> int:
    """A scenario is another command; anything else is run as it stands."""
    asked = options.config
    if asked not in DEMONSTRATIONS:
        if asked not in demonstrations() and Path(asked).name == asked and not Path(asked).exists():
            raise ViewedError(f"there is no demonstration '{asked}'; {meant(asked, demonstrations())}")
        return _run(options)
    found = commands().parse_args(DEMONSTRATIONS[asked])
    found.demo = True
    for option in ("log", "twin"):
        given, stands = getattr(options, option), getattr(found, option, "none such")
        if given is not None and stands is not None:
            raise ViewedError(f"'{asked}' takes no --{option}; type: {program()} demo --help")
        if given is not None:
            setattr(found, option, given)
    return _run(found) if found.handler is _demo else int(found.handler(found))


def _require_playable(options: argparse.Namespace, loaded: Loaded) -> None:
    """A demonstration is of a simulated machine, and virtual time passes too fast to be watched."""
    from ..core.sections import SimulatedBus

    if options.lockstep:
        raise ViewedError("virtual time is over before it is seen; leave out --view, and view the log")
    if not isinstance(loaded.config.bus, SimulatedBus):
        why = f"{loaded.source} is on a real bus, and a demonstration would move it"
        raise ViewedError(f"{why}; type: {program()} run {shlex.quote(options.config)} --view")


class ViewedError(HapticdError):
    """A session that cannot be watched as asked."""

    code = "view"
    exit_status = 2


def _log_path(given: Path | None, loaded: Loaded) -> Path:
    """A new, empty file; recordings are never overwritten."""
    name = f"{Path(loaded.source).stem}-{datetime.now():%Y%m%d-%H%M%S-%f}"[:-3]
    path = given or LOGS / f"{name}.mcap"
    try:
        if given is None:
            LOGS.mkdir(exist_ok=True)
        path.touch(exist_ok=False)
    except FileNotFoundError as error:
        if path.parent.is_dir():  # such as /proc
            raise LogPathError(f"cannot write the log {path}: nothing can be made in that folder") from error
        make = f"mkdir -p {shlex.quote(str(path.parent))}"
        raise LogPathError(f"there is no folder {path.parent} for the log; type: {make}") from error
    except FileExistsError as error:
        if not os.path.lexists(path):
            raise LogPathError(f"cannot write the log {path}: {error.filename} is not a folder") from error
        what = "is a folder" if path.is_dir() else "exists already"
        raise LogPathError(f"{path} {what}; name a new file with --log FILE") from error
    except (OSError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) else str(error)
        raise LogPathError(f"cannot write the log {path}: {why}; name another with --log FILE") from error
    return path


class LogPathError(HapticdError):
    """The recording cannot be written, or there is none to read."""

    code = "log-path"
    exit_status = 2


def _replay(options: argparse.Namespace) -> int:
    import msgspec

    from ..recording.log import open_log
    from ..recording.replay import describe, replay

    show = sys.stderr.isatty() and not options.json

    def progress(ticks: int) -> None:
        if show and ticks % 1000 == 0:
            sys.stderr.write(f"\r{ticks} ticks")
            sys.stderr.flush()

    found = replay(open_log(newest_log() if options.log is None else options.log), progress)
    if show:
        sys.stderr.write("\r\x1b[K")
    print(msgspec.json.encode(found).decode() if options.json else describe(found))
    return 1 if options.verify and found.differing_ticks else 0


def newest_log() -> str:
    """The recording that was written last.

    Raises:
        LogPathError: there is none.
    """
    logs = sorted(LOGS.glob("*.mcap"), key=lambda path: path.stat().st_mtime)
    if not logs:
        make = f"{program()} run {example()}"
        raise LogPathError(f"there is no recording in {LOGS}/; name one, or make one: {make}")
    return str(logs[-1])


def _experiment(options: argparse.Namespace) -> int:
    # by name: experiments build on the runtime, which must not import them
    command = import_module("hapticd.experiments.command")
    return int(command.run(options.name, options.machine, options.out, options.json, options.full))


def _check(options: argparse.Namespace) -> int:
    import msgspec

    from ...models import ModelError
    from ..configuration import config
    from ..configuration.session import build, remarks
    from .paragraphs import tell

    try:
        if Path(options.config).suffix == ".urdf":
            return _check_model(options.config, options.json)
        session = build(config.load(chosen(options)))
    except ConfigError as error:
        if not options.json:
            raise
        print(msgspec.json.encode({"source": error.source, "findings": error.findings}).decode())
        return error.exit_status
    except ModelError as error:
        if not options.json:
            raise
        findings = [
            {"line": found.line, "key": "", "problem": found.problem, "fix": found.fix}
            for found in error.findings
        ]
        print(msgspec.json.encode({"source": error.source, "findings": findings}).decode())
        return 2
    network = session.network
    if options.json:
        found = {"source": session.loaded.source, "findings": [], "remarks": remarks(session.loaded)}
        print(msgspec.json.encode(found).decode())
    else:
        frames = len(network.devices) + len(network.output_frames)
        tell(
            f"{session.loaded.source}: no findings. {len(network.devices)} devices, {frames} frames a tick,"
            f" {session.robot.nv} joints, {session.config.loop.rate:g} Hz"
        )
        for remark in remarks(session.loaded):
            tell(remark)
    return 0


def _check_model(name: str, as_json: bool) -> int:
    """A robot description alone."""
    import msgspec

    from ...models import Robot
    from ..configuration import config

    robot = Robot.from_urdf(config.read_model(name), name)
    if as_json:
        print(msgspec.json.encode({"source": name, "findings": []}).decode())
    else:
        print(f"{name}: no findings. {robot.nv} joints")
    return 0


def _doctor(options: argparse.Namespace) -> int:
    from ..configuration import config
    from ..doctor.libraries import installed
    from ..doctor.report import as_json, as_text, examine, fit
    from ..timing.host import Host

    machine = config.load(options.config).config if options.config else None
    lines = examine(Host(), installed(), machine)
    print(as_json(lines) if options.json else as_text(lines))
    return 0 if fit(lines) else 1


def _plant(options: argparse.Namespace) -> int:
    from ..configuration import config
    from ..configuration.bus import chosen_bus
    from ..live.plant_process import serve_interface

    loaded = config.load(chosen(options))
    rates = {"bitrate": options.bitrate, "data_bitrate": options.data_bitrate}
    bus = chosen_bus(loaded, options.interface, options.channel, rates, dict(options.settings))
    return serve_interface(loaded, bus)
