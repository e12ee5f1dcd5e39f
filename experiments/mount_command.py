"""``hapticd mount``: where to mount an operator arm, in simulation."""

from __future__ import annotations

import argparse
import os

from ..runtime.command_line.arguments import Commands, count, seed
from ..runtime.command_line.outputs import picture
from .hands_command import workers

MOST_POSES = 100_000


def add_mount(commands: Commands) -> None:
    """Add `hapticd mount`."""
    mount = commands.add_parser(
        "mount",
        help="where to mount an operator arm",
        description="Look for the pose of a Panda's base from which it reaches most poses of the left hand"
        " of a seated person, who is simulated. Prints what is reached before and after beside Table I of"
        " Bimanual, and what of other poses that the search has not seen. Exit status 1 where that is less"
        " than 96 %.",
    )
    mount.add_argument(
        "--poses", type=poses, metavar="N", help="of the hand; default: as many as in the paper"
    )
    mount.add_argument("--seed", type=seed, default=1, metavar="S", help="of poses and search; default: 1")
    mount.add_argument(
        "--workers",
        type=workers,
        default=os.cpu_count() or 1,
        metavar="W",
        help="processes that share the work; default: all processors",
    )
    mount.add_argument("--picture", type=picture, metavar="FILE", help="draw it in 3D, as SVG, PNG or PDF")
    mount.add_argument("--json", action="store_true", help="print the figures as JSON")
    mount.set_defaults(handler=_run)


def poses(text: str) -> int:
    """How many poses: enough to say something."""
    value = count(text)
    if not 100 <= value <= MOST_POSES:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number of poses from 100 to {MOST_POSES}")
    return value


def _run(options: argparse.Namespace) -> int:
    from .mount import run

    return run(options)
