"""`hapticd init`: an arm's configuration from its URDF."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

from ...configs.printable import printable
from ...runtime.command_line.arguments import Commands, file, new_configuration
from ...runtime.invocation import program
from .errors import InitError

DESCRIPTION = """Write a complete, commented, simulated configuration for the arm that a URDF describes.

It takes the chain of joints from the root to the tip, 3 to 7 of them that turn or slide. Whatever else is
there is frozen: other branches, fingers, joints that follow others. Shapes and meshes are left out, links
without mass merged, inertias that no body has mended, and a handle is put on the tip, on a force-torque
sensor. Drives, gains and the twin are guessed in proportion to masses and efforts. It asks nothing, says what
it guessed, and overwrites nothing."""

EPILOG = """two files are written, OUT.toml and the URDF that it uses, OUT.clean.urdf

examples:
  {program} init ur5.urdf
      writes ur5.toml; the tip is where the chain ends
  {program} init robot.urdf --tip left_gripper --out left.toml
  {program} check left.toml
  {program} run left.toml --lockstep
"""


def add_init(commands: Commands) -> None:
    """Add the command to the command line."""
    init = commands.add_parser(
        "init",
        help="write a configuration for an arm from its URDF",
        description=DESCRIPTION,
        epilog=EPILOG.format(program=program()),
    )
    init.add_argument(
        "robot", metavar="ROBOT.urdf", type=file, help="the arm; a xacro must be expanded first"
    )
    init.add_argument(
        "--tip", metavar="LINK", help="link that the handle is put on; default: the chain's end"
    )
    init.add_argument(
        "--out", metavar="FILE.toml", type=new_configuration, help="default: ROBOT.toml in this folder"
    )
    init.add_argument(
        "--json", action="store_true", help="print files, joints and guesses as one JSON object"
    )
    init.set_defaults(handler=run)


def run(options: argparse.Namespace) -> int:
    """Write the files; the exit status.

    Raises:
        InitError: the URDF holds no arm, or a file is there already or cannot be written.
        ModelError: the text is no XML, or too much of it.
    """
    import msgspec

    from .init import init

    source: Path = options.robot
    out: Path = options.out or Path(f"{source.stem}.toml")
    model = out.with_suffix(".clean.urdf")
    text = _read(source)
    for path in (out, model):
        if path.exists():
            raise _taken(path)
    made = init(text, source.name, options.tip, out.name, model.name)
    _write({model: made.urdf, out: made.toml})
    if options.json:
        content = {
            "config": str(out),
            "model": str(model),
            "joints": made.joints,
            "directions": made.directions,
        }
        print(msgspec.json.encode(content | {"remarks": made.remarks}).decode())
        return 0
    for remark in made.remarks:
        print(f"* {printable(remark)}")
    print(f"{out} and {model} are written: {len(made.joints)} joints, {', '.join(made.directions)}")
    print(f"run: {program()} run {out}")
    return 0


def _write(texts: Mapping[Path, str]) -> None:
    """All of the files, or none."""
    begun: list[Path] = []
    try:
        for path, text in texts.items():
            with path.open("x", encoding="utf-8") as file:
                begun.append(path)
                file.write(text)
    except BaseException as error:
        for done in begun:
            done.unlink(missing_ok=True)
        if isinstance(error, FileExistsError):
            raise _taken(path) from error
        if isinstance(error, OSError):
            why = error.strerror
            raise InitError(f"{path} cannot be written: {why}; name another with --out FILE.toml") from error
        raise


def _taken(path: Path) -> InitError:
    return InitError(f"{path} exists already; name another with --out FILE.toml")


def _read(source: Path) -> str:
    from ...models.xml_tree import MAX_BYTES

    if not source.is_file():
        what = "is a folder" if source.is_dir() else "is no file"
        raise InitError(f"{source} {what}; give the robot's URDF")
    with source.open("rb") as file:
        content = file.read(MAX_BYTES + 1)
    if len(content) > MAX_BYTES:
        raise InitError(f"{source} is larger than {MAX_BYTES} bytes: this is no URDF")
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InitError(f"{source} is not UTF-8 text; save it as UTF-8") from error
