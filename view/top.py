"""The essentials of a session in a terminal, from the frames that its recorder publishes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import hypot, inf, isfinite
from typing import Protocol

from ..runtime.core.machine import near
from ..runtime.core.modes import Mode
from ..runtime.live.screen import fit
from ..runtime.recording.channels import FORCE, HEARD, MET, PROVEN, STATUS, Channel, Group, slacks
from ..runtime.recording.frames import Frame, Said

BAR = 24
"""Columns of a limit's bar."""
SILENT_S = 1.0
"""A session that shows nothing for so long is not as its last frame: fifty are due in that time."""


class Watched(Protocol):
    """What stays the same of a session.

    Attributes:
        name: of its configuration.
        rate: of its loop [Hz].
        remarks: what each status of its solver but 0 means.
    """

    name: str
    rate: float
    remarks: Mapping[int, str]

    @property
    def channels(self) -> Sequence[Channel]:
        """Of its machine."""


def rows(
    frame: Frame, session: Watched, said: Sequence[Said], size: tuple[int, int], age_s: float = 0.0
) -> list[str]:
    """The screen, row by row.

    Args:
        frame: the newest.
        session: what it is of.
        said: events so far, the newest last.
        size: columns and rows of the screen.
        age_s: of the frame; a session that is silent may do anything [s].
    """
    columns, high = size
    rate, channels = session.rate, session.channels
    stop = [f"({frame.stop})"] if frame.stop else []
    old = f"NOTHING HAS COME FOR {age_s:.0f} s: what stands here is old"
    found = packed([old], columns) if age_s > SILENT_S else []
    found += packed([session.name, f"{frame.tick / rate:.1f} s", frame.mode, *stop], columns)
    if frame.pressed is not None:
        found += packed(_switches(frame, session), columns)
    if frame.mean:
        for words in (_timing(frame, channels), _hand(frame, channels), solver(frame, session)):
            found += packed(words, columns)
    lost = [f"{what} {count}" for what, count in frame.counts.items() if count] or ["nothing lost"]
    end = [
        *packed([f"frames received {frame.received}", *_stored(frame), *lost], columns),
        *(f"{each.tick / rate:9.3f} s  {each.text}" for each in said[-3:]),
    ]
    if frame.mean:
        limits = [
            _limit(channel, frame, k)
            for k, channel in enumerate(channels)
            if channel.group is Group.LIMITS and isfinite(frame.mean[k])  # else of a twin not rendered
        ]
        room = max(0, high - len(found) - len(end) - 3)
        left = len(limits) - room + 1
        shown = limits if left <= 1 else [*limits[: max(0, room - 1)], f"and {left} more"]
        found += ["", *shown, ""]
    return found + end


def packed(words: Sequence[str], columns: int) -> list[str]:
    """Words side by side, in as many rows as they need; the last column stays empty."""
    found = [""]
    for word in words:
        longer = f"{found[-1]}  {word}" if found[-1] else word
        if found[-1] and len(longer) >= columns:
            found.append(f"  {word}")
        else:
            found[-1] = longer
    return [row for row in found if row]


def _switches(frame: Frame, session: Watched) -> list[str]:
    """The dead-man switch, for how long it is as it is, and how long ago that was heard at worst."""
    state = f"dead-man {'pressed' if frame.pressed else 'open'}"
    heard = [
        frame.high[k] for k, channel in enumerate(session.channels) if channel.name == HEARD and frame.high
    ]
    words = [f"{state} for {(frame.tick - frame.since) / session.rate:.1f} s"]
    words += [f"heard {heard[0]:.0f} ms ago" if heard[0] >= 1 else "heard in this tick"] if heard else []
    return words + ([] if frame.e_stop_closed else ["EMERGENCY STOP PRESSED"])


def _timing(frame: Frame, channels: Sequence[Channel]) -> list[str]:
    return [
        f"{channel.name} {frame.mean[k]:.0f} us, at most {frame.high[k]:.0f} us"
        for k, channel in enumerate(channels)
        if channel.group is Group.PUNCTUALITY
    ]


def _hand(frame: Frame, channels: Sequence[Channel]) -> list[str]:
    """Force of the hand, where the machine has one, what the machine counts, and what it says of itself."""
    force = [frame.mean[k] for k, channel in enumerate(channels) if channel.name in FORCE]
    words = [f"hand {hypot(*force):.1f} N"] if force else []
    for k, channel in enumerate(channels):
        if channel.group is Group.FIGURES:
            words.append(f"{channel.name} {frame.mean[k]:.3g} {channel.unit}".rstrip())
    return [*words, *(f"[{word}]" for word in frame.doing)]


def solver(frame: Frame, session: Watched) -> list[str]:
    """Whether it stands by its answer, how many levels are proven, and which had to yield by how much."""
    levels = slacks(session.channels)
    if not levels or frame.mode not in (Mode.ENGAGING.name, Mode.ACTIVE.name):
        return []
    at = {channel.name: k for k, channel in enumerate(session.channels)}
    status, proven = at[STATUS], at[PROVEN]
    remarks = [session.remarks.get(int(value)) for value in (frame.low[status], frame.high[status])]
    words = [f"solver: {remarks[0] or remarks[1] or 'solved'}"]
    words.append(f"{frame.low[proven]:.0f} of {len(levels)} levels proven")
    yielding = [(name, frame.high[k], unit) for k, name, unit in levels if frame.high[k] > MET]
    words += [f"{name} yields {slack:.3g} {unit}".rstrip() for name, slack, unit in yielding]
    return words if yielding else [*words, "all met"]


def _stored(frame: Frame) -> list[str]:
    """How the recording does."""
    stored = frame.stored
    if stored is None:
        return []
    waits = 100.0 * stored.waiting / stored.room
    return [
        f"recorded {stored.written / 1e6:.1f} MB",
        f"{stored.free / 1e9:.1f} GB free",
        f"buffer {waits:.1f} % full",
    ]


def _limit(channel: Channel, frame: Frame, k: int) -> str:
    value, lower, upper = frame.mean[k], channel.lower, channel.upper
    bar = " " * BAR
    if isfinite(lower) and isfinite(upper) and upper > lower:
        at = min(BAR - 1, max(0, int(BAR * (value - lower) / (upper - lower))))
        bar = "-" * at + "|" + "-" * (BAR - 1 - at)
    close = near(lower, upper)
    touched = "  at its lower end" if frame.low[k] <= lower + close and lower > -inf else ""
    touched = "  at its upper end" if frame.high[k] >= upper - close and upper < inf else touched
    return f"{channel.name:20.20}[{bar}] {value:8.3f} {channel.unit}{touched}"


def screen(lines: Sequence[str], columns: int, high: int) -> str:
    """What a terminal is sent: every row to its end, and nothing below the last."""
    shown = [fit([line], columns - 1) for line in lines[: high - 1]]
    return "\x1b[H" + "".join(f"{line}\x1b[K\r\n" for line in shown) + "\x1b[J"
