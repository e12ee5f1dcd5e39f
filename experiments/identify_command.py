"""``hapticd identify``: springs, rotors, friction and links of a machine, or what a hand feels of it."""

from __future__ import annotations

import argparse
from math import nan

from ..runtime.command_line.arguments import Commands, count, name, new_configuration, number
from ..runtime.command_line.outputs import picture
from ..runtime.invocation import program

DESCRIPTION = """Identify the stiffness of each joint's spring, the inertia of its rotor, and the viscous,
Coulomb and load-dependent friction of its gear: least squares, standard errors.

With a MACHINE, a simulated giant or an arm whose joints have springs, all joints are led in lockstep along
sums of sines inside limits, boxes and torques, chosen for the condition number of what they tell (seeded),
while nobody holds the handle. Everything that stops the machine otherwise stops it here. The base parameters
of the links and the friction behind the springs are identified as well. Limits that leave no good course are
refused with the condition number.

With --handle, or where a MACHINE's joints have no springs to be led by, its handle is pushed instead: with
ten constant forces from small to large, both ways along each direction that it moves in, from 5 cm before a
point to 2 cm behind it. Least squares over the samples within 1 cm of the point give the inertia and the
viscous friction that a hand feels there (ContactAware, Table I), with standard errors. A redundant interface
renders nothing meanwhile, and is pushed in its posture for free motion and in the one for contact; other
machines render their twin, which is then what is found. A direction in which the handle is held, hardly
moves, or moves by other laws is refused with the reason.

With a LOG, a recorded session: it needs motion to and fro at some speed and loads that change: lead the
handle through the whole workspace, quickly and slowly, and pull.

What was not excited is refused, with what it lacks; the stiffness of a light wrist needs a hand that pulls.
Errors are those of the fit: where a torque sensor's gain is off, the stiffness is off by as much. Where a
joint carries little, its rotor's inertia is off, too, by as much of what moves with the link."""

EPILOG = """examples:
  {program} identify panda --plot panda.svg
  {program} identify giant --wrong-model --errors --seed 3
      a giant of other masses, rotors and springs than its controller
      believes, with friction
  {program} identify rhi --plot rhi.svg
  {program} identify panda --handle --along z --at 0.45 0 0.45
  {program} run giant --lockstep --log walk.mcap
  {program} identify walk.mcap
  {program} identify walk.mcap --out identified.toml
      writes lines to paste into the configuration, friction to be fed
      forward among them; what was refused stays as it is

exit status: 0 every stiffness and inertia was identified, 1 some were refused, 2 nothing to identify from"""

AXES = ("x", "y", "z")
FARTHEST = 100.0
"""Places are no farther from the base [m]."""
SECONDS, LEAST_SECONDS, MOST_SECONDS = 30.0, 12.0, 600.0
"""Of a course."""


def add_identify(commands: Commands) -> None:
    """Add `hapticd identify`."""
    command = commands.add_parser(
        "identify",
        help="identify springs, rotors, friction and links of a machine",
        description=DESCRIPTION,
        epilog=EPILOG.format(program=program()),
    )
    command.add_argument(
        "what",
        type=name,
        metavar="MACHINE|LOG",
        help="a TOML file or the name of a built-in machine; or a recording that `hapticd run` wrote",
    )
    command.add_argument(
        "--seconds",
        type=seconds,
        default=SECONDS,
        metavar="S",
        help=f"of the course, {LEAST_SECONDS:g} to {MOST_SECONDS:g}; default: {SECONDS:g}",
    )
    command.add_argument("--seed", type=count, default=1, metavar="N", help="of the course; default: 1")
    command.add_argument(
        "--handle", action="store_true", help="push the handle, also where joints can be led"
    )
    command.add_argument(
        "--along",
        type=along,
        metavar="DIRECTION",
        help="of the pushes in the base frame: x, y or z, or several: x,z; default: all",
    )
    command.add_argument(
        "--at",
        type=coordinate,
        nargs=3,
        metavar=("X", "Y", "Z"),
        help="point that is passed, in the base frame [m]; default: where the handle is at the start",
    )
    command.add_argument(
        "--wrong-model", action="store_true", help="a machine of another model than its controller's"
    )
    command.add_argument(
        "--errors", action="store_true", help="sensors that err as is typical, and joints that rub"
    )
    command.add_argument(
        "--plot", type=picture, metavar="FILE", help="draw the loads and what is left of them"
    )
    command.add_argument(
        "--out", type=new_configuration, metavar="FILE.toml", help="write what was identified as TOML"
    )
    command.add_argument(
        "--json",
        action="store_true",
        help="print {joints: {NAME: {believed, identified: {KEY: {value, error}}, residual, late, refused}}}"
        " as JSON; of a machine also"
        " {course: {seconds, condition}, links: {condition, parameters, residual}}; of a handle"
        " {handle: [{state, along, at, inertia, friction, change, residual, condition, samples, refused}]}",
    )
    command.set_defaults(handler=_run)


def seconds(text: str) -> float:
    """Length of a course [s]."""
    value = number(MOST_SECONDS)(text)
    if value < LEAST_SECONDS:
        raise argparse.ArgumentTypeError(f"'{text}' is less than {LEAST_SECONDS:g} s, too short to tell much")
    return value


def along(text: str) -> list[str]:
    """Directions of the base, as they are typed: "x", or "x,z"."""
    found = text.split(",")
    for each in found:
        if each not in AXES:
            raise argparse.ArgumentTypeError(
                f"'{each}' is no direction of the base; type x, y or z, or several: x,z"
            )
    return list(dict.fromkeys(found))


def coordinate(text: str) -> float:
    """Of a place [m]."""
    try:
        value = float(text)
    except ValueError:
        value = nan
    if not abs(value) <= FARTHEST:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number of metres")
    return value


def _run(options: argparse.Namespace) -> int:
    from .identify import run

    return run(options)
