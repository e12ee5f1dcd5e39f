"""``hapticd identify``: springs, rotors and friction of a machine's joints from a recording."""

from __future__ import annotations

import argparse

from ..runtime.command_line.arguments import Commands, name, new_configuration
from ..runtime.invocation import program

DESCRIPTION = """Identify the stiffness of each joint's spring, the inertia of its rotor, and the viscous,
Coulomb and load-dependent friction of its gear from a recorded session: least squares, standard errors.

The recording needs motion to and fro at some speed and loads that change: lead the handle through the whole
workspace, quickly and slowly, and pull. What a recording does not tell is refused, with what it lacks.
Errors are those of the fit: where a torque sensor's gain is off, stiffness, inertia and friction are off by
as much. Friction behind the spring, and masses, are not identified."""

EPILOG = """examples:
  {program} run giant --lockstep --log walk.mcap
  {program} identify walk.mcap
  {program} identify walk.mcap --out identified.toml
      writes lines to paste into the configuration; what was refused stays as it is

exit status: 0 every stiffness and inertia was identified, 1 some were refused, 2 nothing to identify from"""


def add_identify(commands: Commands) -> None:
    """Add `hapticd identify`."""
    command = commands.add_parser(
        "identify",
        help="identify springs, rotors and friction from a recording",
        description=DESCRIPTION,
        epilog=EPILOG.format(program=program()),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    command.add_argument("log", type=name, metavar="LOG", help="a recording that `hapticd run` wrote")
    command.add_argument(
        "--out", type=new_configuration, metavar="FILE.toml", help="write what was identified as TOML"
    )
    command.add_argument(
        "--json",
        action="store_true",
        help="print {joints: {NAME: {believed, identified: {KEY: {value, error}}, residual, late, refused}}}"
        " as JSON",
    )
    command.set_defaults(handler=_run)


def _run(options: argparse.Namespace) -> int:
    from .identify import run

    return run(options)
