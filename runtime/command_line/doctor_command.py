"""``hapticd doctor``: is this host fit for real time."""

from __future__ import annotations

import argparse

from .arguments import Commands, name


def add_doctor(commands: Commands) -> None:
    """Add `hapticd doctor`."""
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
    doctor.set_defaults(handler=run)


def run(options: argparse.Namespace) -> int:
    """Look at the host; the exit status."""
    from ..configuration import config
    from ..doctor.libraries import installed
    from ..doctor.report import as_json, as_text, examine, fit
    from ..timing.host import Host

    machine = config.load(options.config).config if options.config else None
    lines = examine(Host(), installed(), machine)
    print(as_json(lines) if options.json else as_text(lines))
    return 0 if fit(lines) else 1
