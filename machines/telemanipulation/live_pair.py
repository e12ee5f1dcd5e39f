"""Both stations live: two daemons and two plants in real time on this computer, over the sealed link."""

from __future__ import annotations

import socket
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from ...runtime.configuration import config
from ...runtime.live.interrupts import heard
from .pair import PairError, declared

NAMES = ("operator", "avatar")
HOST = "127.0.0.1"
HAPTICD = (sys.executable, "-m", "hapticd.runtime")
DELAY_S = 0.05
"""Longest delay that is no fault between two plants that share the processors of one host [s]."""


def live_pair(operator: str, avatar: str, duration: float | None, logs: Sequence[Path], as_json: bool) -> int:
    """Run both, each a `hapticd run` of its own with keys made for this session; the worse exit status.

    Raises:
        PairError: the package of the link is missing.
        ConfigError: a configuration is wrong.
    """
    try:
        from ...link.keygen import keygen
        from ...link.stations import Role, named
    except ImportError as error:
        raise PairError('the link needs the package cryptography: pip install "hapticd[link]"') from error
    with TemporaryDirectory(prefix="hapticd-") as name, heard(lambda _: None):
        folder = Path(name)
        keygen(folder, [named("operator", Role.OPERATOR), named("avatar", Role.AVATAR)], days=1)
        port = _free_port()
        running = []
        for station, source, log in zip(NAMES, (operator, avatar), logs, strict=True):
            loaded = declared(
                config.load(source),
                DELAY_S,
                f'address = "{HOST}"',
                f"port = {port}",
                f'keys = "{folder / station}"',
            )
            path = folder / f"{station}.toml"
            path.write_text(loaded.text, encoding="utf-8")
            (folder / loaded.config.model).write_text(loaded.model_text, encoding="utf-8")
            command = [*HAPTICD, "run", str(path), "--log", str(log)]
            command += ["--json"] if as_json else []
            command += ["--duration", f"{duration:g}"] if duration is not None else []
            running.append(
                subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True)
            )
        said = [process.communicate()[0] for process in running]
    for station, text in zip(NAMES, said, strict=True):
        print(text.rstrip() if as_json else f"--- {station}\n{text.rstrip()}")
    return max(process.returncode for process in running)


def _free_port() -> int:
    """A port of TCP that nobody uses now."""
    with socket.socket() as probe:
        probe.bind((HOST, 0))
        return int(probe.getsockname()[1])
