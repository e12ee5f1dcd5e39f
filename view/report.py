"""A session as one page of HTML that needs nothing else: no network, no scripts to be read."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from html import escape
from importlib import resources
from itertools import pairwise
from math import ceil, log10

import numpy as np

from ..runtime.core.events import Severity
from ..runtime.core.modes import Mode
from ..runtime.recording.channels import MET, SLACK, Group, slacks
from ..runtime.recording.summary import Report
from .session import Recorded, group
from .svg import Plot, Series, histogram, number

MOST_EVENTS, MOST_LATE = 300, 100
"""Rows of the tables; the rest is counted."""
BARS_PER_DECADE = 10
POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'"
"""What the page may load: nothing."""


def page(found: Recorded) -> str:
    """The whole page.

    Args:
        found: the session.
    """
    name = escape(found.log.session["config_name"])
    sections = (
        _head(found),
        _section("What happened", _modes(found) + _events(found)),
        _section("Limits", _active(found) + _grid(_limits(found))),
        _section("The hand", _grid(_hand(found))),
        _section("Punctuality", _punctuality(found)),
        _section("Solver and figures", _levels(found) + _grid(_figures(found, Group.FIGURES, Group.SOLVER))),
        _section("Bus, trust and losses", _grid(_figures(found, Group.BUS, Group.SAFETY))),
        _foot(found),
    )
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width,initial-scale=1">'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}"><title>{name}: session report</title>'
        f"<style>{part('colours.css')}{part('report.css')}</style></head>"
        f"<body><main>{''.join(sections)}</main><script>{part('report.js')}</script></body></html>\n"
    )


def part(name: str) -> str:
    """Text of a file that pages are made of."""
    return (resources.files(__package__) / "page" / name).read_text(encoding="utf-8")


def _section(title: str, content: str) -> str:
    return f"<section><h2>{title}</h2>{content}</section>" if content else ""


def _grid(plots: Iterator[Plot]) -> str:
    drawn = "".join(plot.html for plot in plots)
    return f'<div class="plots">{drawn}</div>' if drawn else ""


def _head(found: Recorded) -> str:
    report = _report(found)
    first = next((e for e in found.events if e.severity in (Severity.STOP, Severity.FAILURE)), None)
    stop = report.stop or (first.text if first else "")
    measured = bool(report.compute_us["max"])
    pills = [
        ("", f"{found.seconds:.1f} s", "duration"),
        ("", f"{report.rate_hz:g} Hz", f"{report.ticks} ticks"),
        ("bad" if stop else "good", escape(stop) or "none", "stops by safety"),
        ("warn" if report.skipped else "good", str(report.skipped), "ticks skipped"),
        ("warn" if report.frames_missing else "good", str(report.frames_missing), "answers missing"),
    ]
    if measured:
        pills += [
            ("", f"{report.lateness_us['p99']:.0f} us", "late by (p99)"),
            ("", f"{report.compute_us['p99']:.0f} us", "tick takes (p99)"),
        ]
    worst = max((limit for limit in report.limits if limit.excess is not None), default=None, key=_excess)
    if worst is not None:
        words = f"{1e3 * _excess(worst):+.1f} m{worst.unit}"
        state = "warn" if _excess(worst) > 5e-3 else "good"
        pills.append((state, escape(words), f"furthest past a limit: {escape(worst.name)}"))
    items = "".join(
        f'<li class="{state}"><b>{value}</b><span>{what}</span></li>' for state, value, what in pills
    )
    return (
        f"<h1>{escape(found.log.session['config_name'])}</h1>"
        f'<p class="soft">A session of hapticd, recorded in {escape(found.log.path)}</p>'
        f'<ul class="pills">{items}</ul>'
    )


def _excess(limit: object) -> float:
    return float(getattr(limit, "excess", None) or 0.0)


def _report(found: Recorded) -> Report:
    assert found.summary is not None
    return found.summary


def _modes(found: Recorded) -> str:
    """The modes as a strip, and their colours."""
    end = max(1, found.modes[-1][2] if found.modes else 1)
    runs = "".join(
        f'<i class="{mode.name}" style="left:{100 * begin / end:.3f}%;'
        f'width:{100 * (stop - begin) / end:.3f}%" title="{mode.name}, '
        f'{begin / found.rate:.2f} to {stop / found.rate:.2f} s"></i>'
        for mode, begin, stop in found.modes
    )
    seconds = {mode: 0.0 for mode in Mode}
    for mode, begin, stop in found.modes:
        seconds[mode] += (stop - begin) / found.rate
    key = "".join(
        f'<span><i class="{mode.name}"></i>{mode.name} {span:.3g} s</span>'
        for mode, span in seconds.items()
        if span
    )
    return f'<div class="card"><div class="lane modes">{runs}</div><div class="key">{key}</div></div>'


def _events(found: Recorded) -> str:
    """What people were told, with its reason."""
    rows = [
        f'<tr><td class="time">{event.tick / found.rate:.3f} s</td>'
        f'<td class="text {escape(str(event.severity or "note"))}">{escape(event.text)}</td></tr>'
        for event in found.events[:MOST_EVENTS]
    ]
    if not rows:
        return ""
    more = len(found.events) - MOST_EVENTS
    rest = f'<p class="soft">and {more} more in the recording</p>' if more > 0 else ""
    return (
        f'<div class="card" style="margin-top:12px"><table><tbody>{"".join(rows)}</tbody></table>{rest}</div>'
    )


def _active(found: Recorded) -> str:
    """Which limits were touched, and when."""
    ticks = found.columns.ticks
    if not len(ticks):
        return ""
    ends = np.append(ticks[1:], found.seconds * found.rate)
    last = max(1.0, found.seconds * found.rate)
    lanes = []
    for channel in group(found, Group.LIMITS):
        touched = found.touched(channel)
        if not touched.any():
            continue
        edges = np.flatnonzero(np.diff(touched, prepend=0, append=0))
        runs = "".join(
            f'<i class="{"upper" if touched[a] > 0 else "lower"}" style="left:{100 * ticks[a] / last:.2f}%;'
            f'width:{100 * (ends[b - 1] - ticks[a]) / last:.2f}%"></i>'
            for a, b in pairwise(edges.tolist())
            if touched[a]
        )
        name = escape(found.channels.specs[channel].name)
        lanes.append(f'<span class="name">{name}</span><div class="lane">{runs}</div>')
    if not lanes:
        return '<p class="soft">No limit was touched.</p>'
    key = '<div class="key"><span><i class="lane" style="background:var(--c1)"></i>at its lower end</span>'
    key += '<span><i style="background:var(--c2)"></i>at its upper end</span></div>'
    return (
        f'<div class="card" style="margin-bottom:12px"><div class="lanes">{"".join(lanes)}</div>{key}</div>'
    )


def _limits(found: Recorded) -> Iterator[Plot]:
    for channel in group(found, Group.LIMITS):
        spec = found.channels.specs[channel]
        note = "no limit" if np.isinf(spec.lower) and np.isinf(spec.upper) else ""
        yield _plot(found, spec.name, spec.unit, [channel], spec.lower, spec.upper, note)


def _hand(found: Recorded) -> Iterator[Plot]:
    channels = group(found, Group.HAND)
    for unit in dict.fromkeys(found.channels.specs[c].unit for c in channels):
        same = [c for c in channels if found.channels.specs[c].unit == unit]
        title = found.channels.specs[same[0]].name.rpartition(" ")[0]
        yield _plot(found, f"{title} of the hand on the machine", unit, same)
    if found.worked:
        work = len(found.channels.specs)
        note = "positive: the hand put it into the machine"
        yield _plot(found, "work of the hand", "J", [work], note=note, names=["work"])


def _levels(found: Recorded) -> str:
    """Whether each level of the solver was met throughout, or by how much and how often it had to yield."""
    levels = slacks(found.channels.specs)
    if not levels or not len(found.columns.ticks):
        return ""
    rows = []
    for place, (channel, name, unit) in enumerate(levels, 1):
        high = found.columns.high[:, channel]
        yielded = high > MET
        words = "met throughout"
        if yielded.any():
            most, share = number(high.max()), 100.0 * yielded.mean()
            words = f"by {most} {pretty(unit)} at most, during {share:.3g} % of the time"
        rows.append(
            f"<tr><td>{place}</td><td class=text>{escape(name)}</td><td class=text>{escape(words)}</td></tr>"
        )
    head = "<th>level</th><th class=text>name</th><th class=text>yields to those above it</th>"
    return (
        '<div class="card" style="margin-bottom:12px"><table>'
        f"<thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table></div>"
    )


def pretty(unit: str) -> str:
    """A unit for people: without carets and names of roots."""
    return re.sub(r"sqrt\((.*?)\)", r"√\1", unit).replace("^2", "²")


def _figures(found: Recorded, *which: Group) -> Iterator[Plot]:
    for channel in (each for one in which for each in group(found, one)):
        spec = found.channels.specs[channel]
        least = MET if spec.name.startswith(SLACK) else 0.0
        high, low = found.columns.high[:, channel], found.columns.low[:, channel]
        if max(high.max(initial=0.0), -low.min(initial=0.0)) > least:
            yield _plot(found, spec.name, pretty(spec.unit), [channel])


def _plot(
    found: Recorded,
    title: str,
    unit: str,
    channels: Sequence[int],
    lower: float = -np.inf,
    upper: float = np.inf,
    note: str = "",
    names: Sequence[str] = (),
) -> Plot:
    columns = found.columns
    names = names or [found.channels.specs[c].name for c in channels]
    there = np.isfinite(columns.mean[:, channels]).all(axis=1)  # a twin that is not rendered has no joints
    series = [
        Series(name, columns.low[there, c], columns.high[there, c], columns.mean[there, c], 1 + k % 6)
        for k, (c, name) in enumerate(zip(channels, names, strict=True))
    ]
    time = columns.ticks[there] / found.rate
    return Plot(title, unit, time, found.seconds, series, lower, upper, note)


def _punctuality(found: Recorded) -> str:
    report = _report(found)
    if not report.compute_us["max"]:
        return '<p class="soft">Virtual time: it has neither lateness nor cost.</p>'
    names = {found.channels.specs[c].name: c for c in group(found, Group.PUNCTUALITY)}
    plots = "".join(_plot(found, title, "us", [channel]).html for title, channel in names.items())
    bars = "".join(
        _bars(cells, title, report_us)
        for title, cells, report_us in (
            ("lateness, distribution", found.lateness, report.lateness_us),
            ("compute, distribution", found.compute, report.compute_us),
        )
    )
    rows = [("late by", report.lateness_us), ("takes", report.compute_us), *report.stages_us.items()]
    head = "".join(f"<th>{name}</th>" for name in ("us", "mean", "p50", "p99", "p99.9", "max"))
    body = "".join(
        f"<tr><td>{escape(name)}</td>"
        + "".join(f"<td>{row[key]:.1f}</td>" for key in ("mean", "p50", "p99", "p999", "max"))
        + "</tr>"
        for name, row in rows
    )
    table = f'<div class="card tall"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'
    return f'<div class="plots">{plots}{table}{bars}{_stages(found).html}</div>{_late(found)}'


def _stages(found: Recorded) -> Plot:
    """Where the time of a tick goes; the peaks of the whole would hide it."""
    plot = _plot(found, "stages of a tick", "us", _heaviest(found), note="the six heaviest, means")
    means = [replace(series, low=series.mean, high=series.mean) for series in plot.series]
    return replace(plot, series=means)


def _heaviest(found: Recorded) -> Sequence[int]:
    """Channels of the six stages that take most."""
    stages = group(found, Group.STAGES)
    mean = found.columns.mean
    return sorted(sorted(stages, key=lambda c: -float(mean[:, c].sum()))[:6])


def _bars(cells: Sequence[tuple[float, int]], title: str, figures: dict[str, float]) -> str:
    """A histogram with bars of equal width on a logarithmic scale."""
    top = max(1, ceil(log10(max(1.0, cells[-1][0] if cells else 1.0)) * BARS_PER_DECADE))
    counts = [0] * top
    for edge, count in cells:
        counts[min(top - 1, max(0, int(log10(max(edge, 1.0)) * BARS_PER_DECADE)))] += count
    edges = [10 ** (k / BARS_PER_DECADE) for k in range(top + 1)]
    note = ", ".join(f"{name} {number(figures[key])}" for name, key in (("p50", "p50"), ("p99.9", "p999")))
    return histogram(edges, counts, title, "us", note)


def _late(found: Recorded) -> str:
    """Ticks that were late, and the most likely cause of each."""
    if not found.late:
        return '<p class="soft" style="margin-top:12px">No tick came or ended late.</p>'
    rows = "".join(
        f'<tr><td class="time">{late.tick / found.rate:.3f} s</td><td>{late.lateness_us:.0f}</td>'
        f"<td>{late.compute_us:.0f}</td><td>{late.skipped}</td><td class=text>{escape(late.cause)}</td></tr>"
        for late in found.late[:MOST_LATE]
    )
    more = len(found.late) - MOST_LATE
    rest = f'<p class="soft">and {more} more in the recording</p>' if more > 0 else ""
    head = (
        "<th>at</th><th>late [us]</th><th>took [us]</th><th>skipped</th><th class=text>most likely cause</th>"
    )
    return (
        f'<details class="card" style="margin-top:12px"{" open" if len(found.late) <= 12 else ""}>'
        f"<summary>{len(found.late)} ticks came or ended late</summary>"
        f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>{rest}</details>"
    )


def _foot(found: Recorded) -> str:
    known = found.log.session
    words = ", ".join(
        f"{escape(name)} {escape(known[name])}"
        for name in ("hapticd", "python", "numpy", "pin", "libc", "cpu")
        if known.get(name)
    )
    return (
        f"<footer>{words}. Bands between lowest and highest values of a column, lines through means.</footer>"
    )
