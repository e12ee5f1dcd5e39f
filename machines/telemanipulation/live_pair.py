"""Both stations live: two daemons and two plants in real time on this computer, over the sealed link."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from ...runtime.configuration import config
from ...runtime.configuration.session import build
from ...runtime.live.children import tied
from ...runtime.live.interrupts import exit_status, heard, interrupt
from .pair import PairError, declared

NAMES = ("operator", "avatar")
HOST = "127.0.0.1"
HAPTICD = (sys.executable, "-m", "hapticd.runtime")
DELAY_S = 0.05
"""Longest delay that is no fault between two plants that share the processors of one host [s]."""
LOOK_S = 0.1
"""Between two looks whether a station has ended."""


def live_pair(
    operator: str,
    avatar: str,
    duration: float | None,
    logs: Sequence[Path],
    as_json: bool,
    command: Sequence[str] = ("run",),
) -> int:
    """Run both, each a session of its own with keys made for it; the worse exit status.

    A station that does not begin, which leaves no log, or that is killed ends the other one, and its exit
    status counts.

    Args:
        operator: configuration of the one station.
        avatar: of the other.
        duration: None: as each configuration says [s].
        logs: a file for each.
        as_json: whether each prints one JSON object.
        command: of hapticd, and its options; `demo` goes on until it is asked to end.

    Raises:
        PairError: the package of the link is missing.
        ConfigError: a configuration is wrong.
        Interrupted: by a signal before the stations began; later ones are theirs to follow.
    """
    running: list[subprocess.Popen[str]] = []

    def pass_on(number: int) -> None:
        """A signal is each station's, once, whoever sent it: a terminal, or another program."""
        if not running:
            interrupt(number)
        for process in running:
            process.send_signal(number)

    try:
        from ...link.keygen import keygen
        from ...link.stations import Role, named
    except ImportError as error:
        raise PairError('the link needs the package cryptography: pip install "hapticd[link]"') from error
    stations = [config.load(each) for each in (operator, avatar)]
    for loaded in stations:
        build(loaded)  # what is refused is refused before the other one begins, by its own file and line
    with TemporaryDirectory(prefix="hapticd-") as name, heard(pass_on):
        folder = Path(name)
        keygen(folder, [named("operator", Role.OPERATOR), named("avatar", Role.AVATAR)], days=1)
        port = _free_port()
        for station, loaded, log in zip(NAMES, stations, logs, strict=True):
            arguments = [*command, str(_written(folder, station, loaded, port)), "--log", str(log)]
            arguments += ["--json"] if as_json else []
            arguments += ["--duration", f"{duration:g}"] if duration is not None else []
            running.append(
                subprocess.Popen(
                    [*HAPTICD, *arguments],
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.PIPE,
                    text=True,
                    preexec_fn=tied(signal.SIGTERM),
                    process_group=0,
                )
            )
        said, status = _ended(running, logs)
    for station, text in zip(NAMES, said, strict=True):
        print(text.rstrip() if as_json else f"--- {station}\n{text.rstrip()}")
    return status


def _ended(running: Sequence[subprocess.Popen[str]], logs: Sequence[Path]) -> tuple[list[str], int]:
    """What each station printed, once both have ended, and the exit status of both together."""
    said: dict[int, str] = {}
    alone = 0
    while len(said) < len(running):
        for i, (process, log) in enumerate(zip(running, logs, strict=True)):
            if i in said:
                continue
            try:
                said[i] = process.communicate(timeout=LOOK_S)[0]
            except subprocess.TimeoutExpired:
                continue
            if process.returncode < 0 or not log.exists():
                alone = alone or _status(process)
                for other in running:
                    other.terminate()
    return [said[i] for i in range(len(running))], alone or max(map(_status, running))


def _status(process: subprocess.Popen[str]) -> int:
    """As a shell has it."""
    return exit_status(-process.returncode) if process.returncode < 0 else process.returncode


def _written(folder: Path, station: str, source: config.Loaded, port: int) -> Path:
    """The configuration of a station whose link leads to the other one, with its model beside it."""
    keys = folder / station
    link = (f'address = "{HOST}"', f"port = {port}", f'keys = "{keys}"')
    loaded = declared(source, DELAY_S, *link)
    path = folder / f"{station}.toml"
    path.write_text(loaded.text, encoding="utf-8")
    (folder / loaded.config.model).write_text(loaded.model_text, encoding="utf-8")
    return path


def _free_port() -> int:
    """A port of TCP that nobody uses now."""
    with socket.socket() as probe:
        probe.bind((HOST, 0))
        return int(probe.getsockname()[1])
