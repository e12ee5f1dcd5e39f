"""What a dashboard costs the session that it shows: live sessions with and without it, in alternating rounds.

A viewed session has its pages from the start; one of them never reads, and in the middle the view is killed.
The spread of the bare rounds says what a ratio is worth.
"""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from statistics import median
from typing import Any
from urllib.parse import urlsplit

import msgspec

from ..runtime.live.children import tied
from ..runtime.live.interrupts import heard, interrupt
from ..runtime.recording.published import SUFFIX, run_folder
from .recorded import BenchError

PROGRAM = (sys.executable, "-m", "hapticd.runtime")
PATIENCE_S = 60.0
FIGURES = {"lateness p99": ("lateness_us", "p99"), "compute mean": ("compute_us", "mean")}
LONG_MESSAGE = 16 << 20
SHORTEST_S = 5.0
"""Of a round: plant, daemon and view take seconds to begin, and half of it is watched."""
MOST_PAGES = 200


class Session(msgspec.Struct):
    """One live session.

    Attributes:
        summary: as `run --json` prints it.
        frames: that the pages got, all together.
        pages: that were open when the view was killed.
    """

    summary: dict[str, Any]
    frames: int = 0
    pages: int = 0

    def figure(self, name: str) -> float:
        """One of ``FIGURES`` [us]."""
        of, which = FIGURES[name]
        return float(self.summary[of][which])


@contextmanager
def begun(*arguments: str, error: int | None = None) -> Iterator[subprocess.Popen[str]]:
    """A command of the program that does not outlive this."""
    child = subprocess.Popen(
        [*PROGRAM, *arguments],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=error,
        text=True,
        preexec_fn=tied(signal.SIGTERM),
    )
    try:
        yield child
    finally:
        if child.poll() is None:
            child.kill()
        child.communicate()


def session(config: str, seconds: float, pages: int, log: Path) -> Session:
    """A session of so many seconds and its recording, with so many pages; with none there is no view.

    Raises:
        BenchError: it did not end as it should, or records were lost.
    """
    with ExitStack() as stack:
        options = ("--duration", str(seconds), "--log", str(log), "--json")
        daemon = stack.enter_context(begun("run", config, *options, error=subprocess.PIPE))
        found = _viewed(daemon, stack, seconds, pages) if pages else Session({})
        printed, told = daemon.communicate(timeout=seconds + PATIENCE_S)
        if daemon.returncode:
            raise BenchError(f"the session ended with {daemon.returncode}:\n{told}")
        found.summary = json.loads(printed)
        if found.summary["shed"]:
            raise BenchError(f"{found.summary['shed']} records were lost")
        return found


def _viewed(daemon: subprocess.Popen[str], stack: ExitStack, seconds: float, pages: int) -> Session:
    frames = run_folder() / f"{daemon.pid}{SUFFIX}"
    until = time.monotonic() + PATIENCE_S
    while not frames.exists():
        if daemon.poll() is not None or time.monotonic() > until:
            raise BenchError("the session shows no frames")
        time.sleep(0.02)
    view = stack.enter_context(begun("view", "--port", "0", "--session", str(daemon.pid)))
    assert view.stdout
    url = next((said[1] for line in view.stdout if (said := re.search(r"view: (http://\S+)", line))), "")
    if not url:
        raise BenchError("the view did not start")
    return _read(url, pages, time.monotonic() + 0.5 * seconds, view)


def _read(url: str, pages: int, until: float, view: subprocess.Popen[str]) -> Session:
    """Read all pages but the first until a time, then kill the view."""
    from websockets.exceptions import ConnectionClosed
    from websockets.sync.client import connect

    where = urlsplit(url)
    socket = f"ws://{where.netloc}/session?{where.query}"
    origin: Any = f"http://{where.netloc}"
    found = Session({}, pages=pages)
    with ExitStack() as stack:
        clients = [
            stack.enter_context(connect(socket, origin=origin, max_size=LONG_MESSAGE)) for _ in range(pages)
        ]
        try:
            while time.monotonic() < until:
                for client in clients[1:] or clients:
                    try:
                        message = client.recv(timeout=0.0)
                    except TimeoutError:
                        continue
                    found.frames += len(json.loads(message).get("frames", ()))
                time.sleep(0.01)
        except ConnectionClosed as error:
            raise BenchError(f"the view let go of a page: {error}") from error
        view.kill()
    return found


def summarise(bare: Sequence[Session], viewed: Sequence[Session]) -> dict[str, Any]:
    """Ratio of the medians, and the spread of the bare rounds beside it."""
    found: dict[str, Any] = {}
    for name in FIGURES:
        without, by = [[each.figure(name) for each in sessions] for sessions in (bare, viewed)]
        found[name] = {
            "bare_us": median(without),
            "viewed_us": median(by),
            "ratio": median(by) / median(without),
            "bare_spread": max(without) / min(without),
        }
    found["pages"] = viewed[0].pages
    found["frames"] = sum(each.frames for each in viewed)
    return found


def table(found: dict[str, Any]) -> str:
    """The same for people."""
    lines = [f"{'us':16}{'bare':>9}{'viewed':>9}{'ratio':>8}{'spread of bare':>17}"]
    for name in FIGURES:
        row = found[name]
        lines.append(
            f"{name:16}{row['bare_us']:9.1f}{row['viewed_us']:9.1f}{row['ratio']:8.2f}{row['bare_spread']:17.2f}"
        )
    return "\n".join(
        [*lines, f"{found['pages']} pages read {found['frames']} frames; every session ended well"]
    )


def run(config: str, pages: int, rounds: int, seconds: float, as_json: bool) -> None:
    """Measure and print.

    Raises:
        BenchError: a round is too short for a view to begin in it, or there are more pages than a host reads.
    """
    if seconds < SHORTEST_S:
        raise BenchError(f"in {seconds:g} s no view begins; give more --seconds, at least {SHORTEST_S:g}")
    if pages > MOST_PAGES:
        raise BenchError(f"nobody reads {pages} pages; give --pages up to {MOST_PAGES}")
    bare, viewed = [], []
    with heard(interrupt), tempfile.TemporaryDirectory() as folder:
        for k in range(rounds):
            print(f"round {k + 1} of {rounds}", file=sys.stderr)
            bare.append(session(config, seconds, 0, Path(folder, f"bare-{k}.mcap")))
            viewed.append(session(config, seconds, pages, Path(folder, f"viewed-{k}.mcap")))
    found = summarise(bare, viewed)
    print(json.dumps(found) if as_json else table(found))
