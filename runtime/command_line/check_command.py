"""``hapticd check``: a configuration and its model, without moving anything."""

from __future__ import annotations

import argparse
from pathlib import Path

from ..errors import ConfigError
from .arguments import Commands, add_twin, chosen, name


def add_check(commands: Commands) -> None:
    """Add `hapticd check`."""
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
    check.set_defaults(handler=run)


def run(options: argparse.Namespace) -> int:
    """Print what is found; the exit status.

    Raises:
        ConfigError, ModelError: there is something to mend; with --json that is printed instead.
    """
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
