"""What a person types where they stand: this program and pip, whether or not they are on the PATH."""

from __future__ import annotations

import re
import shlex
import shutil
import sys
from importlib import metadata
from pathlib import Path


def program() -> str:
    """This program, e.g. ``hapticd``, or ``.venv/bin/hapticd`` where the PATH does not lead to it."""
    script = script_path()
    return _typed(script) if script else f"{python()} -m hapticd.runtime"


def script_path() -> Path | None:
    """The program's absolute path, None where it was installed without its script."""
    script = Path(sys.prefix, "bin", "hapticd")
    return script if script.exists() else None


def python() -> str:
    """The interpreter that runs this program."""
    return _typed(Path(sys.executable))


def install(*packages: str) -> str:
    """The command that installs packages, in the versions that this program asks for."""
    found = {name_of(each): each.partition(";")[0].strip() for each in metadata.requires("hapticd") or []}
    wanted = (shlex.quote(found.get(package, package)) for package in packages)
    return " ".join((python(), "-m pip install", *wanted))


def name_of(requirement: str) -> str:
    """``numpy`` of ``numpy>=2; sys_platform == "linux"``."""
    return re.split(r"[^A-Za-z0-9._-]", requirement, maxsplit=1)[0]


def _typed(path: Path) -> str:
    on_path = shutil.which(path.name)
    if on_path and Path(on_path) == path:
        return path.name
    near = path.is_relative_to(Path.cwd())
    return shlex.quote(str(path.relative_to(Path.cwd()) if near else path))
