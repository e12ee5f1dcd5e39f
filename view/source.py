"""What a dashboard shows: frames of a running session, or of a recording, and the machine that they move."""

from __future__ import annotations

import os
import socket
import sys
from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from time import monotonic, sleep
from typing import Any, Protocol

import msgspec

from ..runtime.configuration.config import Loaded, parse
from ..runtime.configuration.known import example
from ..runtime.configuration.session import Session, build
from ..runtime.core.machine import Solving, near
from ..runtime.core.scene import MachineScene
from ..runtime.invocation import program
from ..runtime.recording.channels import Channels
from ..runtime.recording.frames import BARS_PER_OCTAVE, LEAST_US, Frame, FrameMaker, Said
from ..runtime.recording.log import Log
from ..runtime.recording.published import (
    ORDERS,
    SUFFIX,
    About,
    SessionError,
    Subscriber,
    alive,
    run_folder,
    running,
    unseen,
)
from ..runtime.recording.summary import Summary
from .geometry import Geometry, drawn
from .strength import Pressing

MOST_FRAMES, LEAST_TICKS = 3000, 20
"""Frames of a recording at most, and ticks of one at least."""
START_S = 60.0
"""How long a process may take until its session begins."""
MOST_SAID = 20
"""Events that are kept for a terminal."""
MOST_TOLD = 200
"""Events that are kept for pages that come later."""
DIGITS = 6
"""Of numbers on the way to a page."""


class Source(Protocol):
    """Where frames come from.

    Attributes:
        name: of the configuration.
        hello: what a page must know first.
        live: whether more frames come.
        over: whether the session that they came from has ended.
    """

    name: str
    hello: bytes
    live: bool
    over: bool

    def take(self) -> list[bytes]:
        """Frames since the last time, as a page reads them."""

    def say(self, word: str) -> bool:
        """What a person asks for; whether it went out."""


class Drawn:
    """Puts frames into the form that a page reads: the posture becomes poses of the joints."""

    def __init__(self, session: Session) -> None:
        system = session.system
        self.session, self.channels = session, Channels(session)
        self.scene = system.scene(session.config) if system.scene else None
        self._remarks = _remarks(session)
        self._geometry = _geometry(session, self.scene) if self.scene else None
        self._pressing = _pressing(session, self.scene) if self.scene else None

    def hello(self, name: str, live: bool, words: list[str]) -> bytes:
        """What a page must know before the first frame."""
        scene = self.scene
        bound = _bound
        return msgspec.json.encode(
            {
                "type": "hello",
                "name": name,
                "live": live,
                "words": words,
                "remarks": {str(status): words for status, words in self._remarks.items()},
                "rate": float(self.session.config.loop.rate),
                "bars": {"least": LEAST_US, "per_octave": BARS_PER_OCTAVE},
                "channels": [
                    {
                        **{"name": spec.name, "unit": spec.unit, "group": spec.group},
                        **{"lower": bound(spec.lower), "upper": bound(spec.upper)},
                        "near": near(spec.lower, spec.upper),
                    }
                    for spec in self.channels.specs
                ],
                "grips": [grip.name for grip in scene.grips] if scene else [],
                "shapes": self._geometry.shapes if self._geometry else [],
                "boxes": [
                    {
                        "name": box.name,
                        "lower": list(map(bound, box.lower)),
                        "upper": list(map(bound, box.upper)),
                    }
                    for box in (scene.boxes if scene else ())
                ],
                "planes": [
                    {"name": plane.name, "point": plane.point, "normal": plane.normal}
                    for plane in (scene.planes if scene else ())
                ],
            }
        )

    def frame(self, frame: Frame) -> bytes:
        """A frame with poses; numbers lose digits that nobody sees."""
        said: dict[str, Any] = msgspec.to_builtins(frame)
        del said["posture"], said["published_ns"], said["demand"]
        for name in ("low", "high", "mean", "wrench"):
            said[name] = [_short(value) for value in said[name]]
        if self._geometry and len(frame.posture):
            said["joints"], said["grips"], wrenches = self._geometry.place(frame.posture, frame.wrench)
            said["wrench"] = [_short(value) for value in wrenches]
            if self._pressing:
                axes = self._pressing.axes(frame.posture)
                reachable = self._pressing.reachable(frame.posture, frame.demand)
                said["strength"] = [_short(value) for value in axes]
                said["reachable"] = [_short(value) for value in reachable]
        return msgspec.json.encode(said)


def _remarks(session: Session) -> Mapping[int, str]:
    machine = session.cycle.machine
    return machine.remarks if isinstance(machine, Solving) else {}


def _geometry(session: Session, scene: MachineScene) -> Geometry:
    return Geometry(drawn(session.robot, scene), session.loaded.model_text, scene.grips)


def _pressing(session: Session, scene: MachineScene) -> Pressing | None:
    strength = scene.strength
    return Pressing(drawn(session.robot, scene), scene.grips[0], strength) if strength else None


def _bound(value: float) -> float | None:
    return value if isfinite(value) else None


def _short(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


class LiveSource:
    """A running session. Whatever happens here, the session does not notice."""

    live = True

    def __init__(self, path: Path) -> None:
        """By the file of its frames.

        Raises:
            SessionError: it is over.
            ConfigError, ModelError: its machine cannot be built here.
        """
        self._frames = Subscriber(path)
        about = self._frames.about
        self._orders, self._pid = path.with_suffix(ORDERS), about.pid
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
        self._drawn = Drawn(build(_loaded(about), runs=False))
        self._words = [*about.words, *(("hold", "lead") if "press" in about.words else ())]
        self.name = os.path.basename(about.config)
        self.hello = self._drawn.hello(self.name, True, self._words)
        self.age_ns = 0
        self._said: list[Said] = []

    @property
    def over(self) -> bool:
        """Whether the session has ended."""
        return self._frames.over

    @property
    def missed(self) -> int:
        """Frames that came while nobody here looked."""
        return self._frames.missed

    @property
    def unseen(self) -> bool:
        """Whether the session goes on although nobody shows it any more: its recorder has died."""
        return self.over and self._orders.exists() and alive(self._pid)

    @property
    def earlier(self) -> list[bytes]:
        """What was said since the session is looked at, for a page that comes later."""
        return [msgspec.json.encode({"type": "said", "events": self._said})] if self._said else []

    def take(self) -> list[bytes]:
        """Frames since the last time."""
        frames = self._frames.take()
        if frames:
            self.age_ns = frames[-1].published_ns
        for frame in frames:
            self._said = [*self._said, *frame.events][-MOST_TOLD:]
        return [self._drawn.frame(frame) for frame in frames]

    def say(self, word: str) -> bool:
        """Ask the session for something; what does not fit is lost."""
        if word.partition(" ")[0] not in self._words and word not in self._words:
            return False
        try:
            self._socket.sendto(word.encode("ascii", "replace"), os.fspath(self._orders))
        except OSError:
            return False
        return True

    def close(self) -> None:
        """Look no more."""
        self._frames.close()
        self._socket.close()


class SessionWatch:
    """The newest frame of a running session, and what was said since somebody looks.

    Attributes:
        name: of its configuration.
        rate: of its loop [Hz].
        channels: of its machine.
        remarks: what each status of its solver but 0 means.
        newest: frame, None before the first.
        said: events, the newest last.
    """

    def __init__(self, path: Path) -> None:
        """By the file of its frames.

        Raises:
            SessionError: it is over.
            ConfigError, ModelError: its machine cannot be built here.
        """
        self._frames = Subscriber(path)
        about = self._frames.about
        self.name, self.rate = os.path.basename(about.config), about.rate
        session = build(_loaded(about), runs=False)
        self.channels, self.remarks = Channels(session).specs, _remarks(session)
        self.newest: Frame | None = None
        self.said: list[Said] = []

    @classmethod
    def of(cls, pid: int | None) -> SessionWatch:
        """The session of a process, or the newest.

        Raises:
            SessionError: none runs.
        """
        return cls(awaited(pid) if pid else require_newest())

    @property
    def over(self) -> bool:
        """Whether the session has ended."""
        return self._frames.over

    def look(self) -> bool:
        """Whether there is news."""
        frames = self._frames.take()
        for frame in frames:
            self.newest = frame
            self.said = [*self.said, *frame.events][-MOST_SAID:]
        return bool(frames)


class Recording:
    """A recording: all of its frames at once."""

    live = over = unseen = False
    missed = 0
    earlier: tuple[bytes, ...] = ()

    def __init__(self, log: Log) -> None:
        """Read it.

        Raises:
            LogError: it is damaged.
        """
        session = build(log.loaded, runs=False)
        drawn = Drawn(session)
        self.name = str(log.session["config_name"])
        self.hello = drawn.hello(self.name, False, [])
        self._frames = [drawn.frame(frame) for frame in frames_of(log, session)]

    def take(self) -> list[bytes]:
        """Every frame."""
        return self._frames

    def say(self, word: str) -> bool:
        """Nobody listens."""
        return False

    def close(self) -> None:
        """Nothing is open."""


def frames_of(log: Log, session: Session) -> list[Frame]:
    """Frames of a recording, each of as many ticks that there are not too many.

    Args:
        log: the recording.
        session: its machine.
    """
    ticks = sum(1 for _ in log.records())
    each = max(LEAST_TICKS, -(-ticks // MOST_FRAMES))
    maker, summary = FrameMaker(session), Summary.of(session)
    events = sorted(log.events(), key=lambda event: event.tick)
    frames: list[Frame] = []
    next_event = 0
    for count, record in enumerate(log.records(), 1):
        fixed = record.fixed
        maker.tick(fixed)
        summary.add(fixed)
        tick = int(fixed["tick"])
        while next_event < len(events) and events[next_event].tick <= tick:
            event = events[next_event]
            maker.event(event.tick, str(event.severity or "note"), event.text)
            next_event += 1
        if count % each == 0 or count == ticks:
            counts = {
                "ticks skipped": summary.skipped,
                "frames discarded": summary.discarded,
                "answers missing": summary.missing,
                "commands put right": summary.put_right,
            }
            seldom = len(frames) % 50 == 0 or count == ticks
            frame = maker.take(counts, (summary.lateness, summary.compute) if seldom else None)
            if frame:
                frames.append(frame)
    return frames


def newest() -> Path | None:
    """The session that was started last and still runs."""
    found = running()
    return found[-1] if found else None


def require_newest() -> Path:
    """As ``newest``.

    Raises:
        SessionError: no session runs.
    """
    path = newest()
    if path is None:
        if lost := unseen():
            numbers = ", ".join(map(str, lost))
            raise SessionError(
                f"nothing shows the session of process {numbers} any more: its recorder has ended, and the"
                " machine may still move; stop it where it was begun, or with its own switches"
            )
        raise SessionError(f"no session runs; {_begin()}")
    return path


def _begin() -> str:
    """How there will be a session, for people."""
    return f"begin one: {program()} run {example()} --view"


def awaited(pid: int) -> Path:
    """Where the frames of a session are, by the number of its process, which may still be on its way.

    Raises:
        SessionError: there is no such process, or it publishes nothing.
    """
    path, began, waits = run_folder() / f"{pid}{SUFFIX}", monotonic(), True
    while path not in running():
        try:
            os.kill(pid, 0)
        except OSError as error:
            others = ", ".join(each.stem for each in running())
            mend = f"running: {others}" if others else _begin()
            raise SessionError(f"there is no session {pid}; {mend}") from error
        if monotonic() > began + START_S:
            raise SessionError(f"process {pid} shows no session that can be watched")
        if waits and monotonic() > began + 1.0:
            waits = False
            told = f"hapticd: waiting for the session of process {pid}, at most {START_S:g} s"
            print(told, file=sys.stderr, flush=True)
        sleep(0.1)
    return path


def _loaded(about: About) -> Loaded:
    """The configuration of a session, from the texts that it publishes."""
    parsed = parse(about.text, about.source)
    return Loaded(about.config, parsed, about.text, about.source, about.model_text, about.model_source)
