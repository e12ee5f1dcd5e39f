"""The essentials of a session in a terminal, from the frames that its recorder publishes."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, inf, isfinite

from ..runtime.core.machine import near
from ..runtime.live.screen import fit
from ..runtime.recording.channels import FORCE, Channel, Group
from ..runtime.recording.frames import Frame, Said

BAR = 24
"""Columns of a limit's bar."""
ROWS_AROUND = 9
"""Rows of the screen that are no limits."""


def rows(
    frame: Frame, name: str, channels: Sequence[Channel], said: Sequence[Said], rate: float, high: int
) -> list[str]:
    """The screen, row by row.

    Args:
        frame: the newest.
        name: of the configuration.
        channels: of the machine.
        said: events so far, the newest last.
        rate: of the loop [Hz].
        high: rows of the screen.
    """
    found = [f"{name}  {frame.tick / rate:.1f} s  {frame.mode}{f'  ({frame.stop})' if frame.stop else ''}"]
    if frame.pressed is not None:
        switches = [f"dead-man {'pressed' if frame.pressed else 'open'}"]
        switches += [] if frame.e_stop_closed else ["EMERGENCY STOP PRESSED"]
        found.append("  ".join(switches))
    if frame.mean:
        found += [_timing(frame, channels), _hand(frame, channels), ""]
        limits = [
            _limit(channel, frame, k) for k, channel in enumerate(channels) if channel.group is Group.LIMITS
        ]
        room = max(0, high - ROWS_AROUND)
        found += (
            limits
            if len(limits) <= room
            else [*limits[: max(0, room - 1)], f"and {len(limits) - room + 1} more"]
        )
        found.append("")
    found.append(
        "  ".join(f"{what} {count}" for what, count in frame.counts.items() if count) or "nothing lost"
    )
    found += [f"{each.tick / rate:9.3f} s  {each.text}" for each in said[-3:]]
    return found


def _timing(frame: Frame, channels: Sequence[Channel]) -> str:
    words = []
    for k, channel in enumerate(channels):
        if channel.group is Group.PUNCTUALITY:
            words.append(f"{channel.name} {frame.mean[k]:.0f} us, at most {frame.high[k]:.0f} us")
    return "  ".join(words)


def _hand(frame: Frame, channels: Sequence[Channel]) -> str:
    """Force of the hand, where the machine has one, and what the machine counts as figures."""
    force = [frame.mean[k] for k, channel in enumerate(channels) if channel.name in FORCE]
    words = [f"hand {hypot(*force):.1f} N"] if force else []
    for k, channel in enumerate(channels):
        if channel.group is Group.FIGURES:
            words.append(f"{channel.name} {frame.mean[k]:.3g} {channel.unit}".rstrip())
    return "  ".join(words)


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
