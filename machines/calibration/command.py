"""``hapticd calibrate ft``: bias, mass and centre of what hangs on a force-torque sensor."""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path

from ...runtime.command_line.arguments import Commands, count, file, name
from ...runtime.configuration.known import built_in
from ...runtime.invocation import program

DESCRIPTION = """Lead a simulated machine through poses in which gravity comes from all around its
force-torque sensor, take a hundred readings at rest in each, and find the sensor's bias and the mass and
centre of what hangs on it by least squares. Nobody holds the handle. Everything that stops the machine
otherwise stops it here.

It refuses poses that do not tell bias and weight apart, readings that moved while they were taken, and
what remains unexplained by noise, drift and gravity that is wrong by 2 degrees: exit status 1, with the
reason; 2 is bad usage or configuration. Errors are standard errors: by what remained, and by theory where
the base is half a degree out of level."""

EPILOG = """examples:
  {program} calibrate ft panda
  {program} calibrate ft my_arm.toml --out my_tool.toml --date 2026-11-22
      then, in my_arm.toml, instead of mass and centre in [arm.handle]:
      [devices.force_torque]
      serial = 1234
      calibration = "my_tool.toml"
"""
POSES, SEED = 20, 1
BAR = 30


def add_calibrate(commands: Commands) -> None:
    """Add the command to the command line."""
    calibrate = commands.add_parser(
        "calibrate",
        help="calibrate a force-torque sensor and what hangs on it",
        description=DESCRIPTION,
        epilog=EPILOG.format(program=program()),
    )
    calibrate.add_argument("what", choices=("ft",), help="force-torque sensors")
    known = ", ".join(built_in())
    calibrate.add_argument("config", type=name, metavar="CONFIG", help=f"a TOML file, or built in: {known}")
    calibrate.add_argument("--poses", type=count, default=POSES, metavar="N", help=f"default: {POSES}")
    calibrate.add_argument("--seed", type=count, default=SEED, metavar="S", help="of the poses; default: 1")
    calibrate.add_argument("--sensor", metavar="NAME", help="device, where the machine has several sensors")
    calibrate.add_argument(
        "--out", type=file, metavar="FILE.toml", help="write the calibration; needs --date"
    )
    calibrate.add_argument("--date", type=date, metavar="YYYY-MM-DD", help="that the file says")
    calibrate.add_argument("--json", action="store_true", help="print everything that was found as JSON")
    calibrate.set_defaults(handler=run)


def date(text: str) -> str:
    """A day."""
    if not re.fullmatch(r"\d{4}-(0[1-9]|1[0-2])-(0[1-9]|[12]\d|3[01])", text):
        raise argparse.ArgumentTypeError(f"'{text}' is not a day; write e.g. 2026-11-22")
    return text


def run(options: argparse.Namespace) -> int:
    """Calibrate; the exit status.

    Raises:
        CalibrateError: nothing can be calibrated as asked.
        RefusedError: the samples are refused, or the machine stopped.
    """
    import msgspec

    from ...control.ft_calibration import CalibrationError
    from ...runtime.configuration.config import load
    from . import report, session
    from .errors import CalibrateError, RefusedError

    show = sys.stderr.isatty() and not options.json

    def progress(done: int, of: int, what: str) -> None:
        if show:
            bar = BAR * done // max(of, 1)
            sys.stderr.write(f"\r[{'#' * bar}{'.' * (BAR - bar)}] {done}/{of} {what}\x1b[K")
            sys.stderr.flush()

    if wrong := _wrong_place(options):
        raise CalibrateError(wrong)
    loaded = load(options.config)
    mounts = session.rig_of(loaded).mounts
    if options.out and options.sensor is None and len(mounts) > 1:
        sensors = ", ".join(mount.device for mount in mounts)
        raise CalibrateError(f"a file is of one sensor; name it with --sensor: {sensors}")
    try:
        taken = session.run(loaded, options.poses, options.seed, options.sensor, progress)
    except CalibrationError as error:
        raise RefusedError("\n  ".join(["refused:", *error.reasons])) from error
    finally:
        _clear(show)
    if options.out:
        (one,) = taken
        heading = f"{one.mount.device} of {Path(loaded.source).name}, by hapticd calibrate ft"
        options.out.write_text(report.file_of(one, options.date).text(heading), encoding="utf-8")
    if options.json:
        print(msgspec.json.encode([report.as_json(each) for each in taken]).decode())
    else:
        print("\n\n".join("\n".join(report.table(each)) for each in taken))
        if options.out:
            print(f"\n{options.out} is written")
    return 0


def _clear(show: bool) -> None:
    """Take the progress off the terminal."""
    if show:
        sys.stderr.write("\r\x1b[K")


def _wrong_place(options: argparse.Namespace) -> str:
    """Why a result could not be written where it should be; "" where it can."""
    if options.out is None:
        return ""
    if options.date is None:
        return "a calibration file says of which day it is; add --date YYYY-MM-DD"
    if options.out.suffix != ".toml":
        return f"{options.out} does not end in .toml"
    if not options.out.parent.is_dir():
        return f"there is no folder {options.out.parent}"
    if options.out.exists():
        return f"{options.out} exists already; name another with --out FILE.toml"
    return ""
