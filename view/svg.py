"""Plots as SVG: a band from lowest to highest, a line through the means; words around them are HTML.

The drawing is stretched to whatever width there is, on a phone, a screen or paper, and lines keep their
width; its labels stand beside it, because they must not be stretched.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from math import ceil, floor, isfinite, log10

import numpy as np

from ..models import Array

WIDTH, HEIGHT = 720, 100
"""Of the drawing, in its own units."""
ROOM = 0.94
"""Share of the abscissa that its numbers may use: the unit stands at the end."""


@dataclass(frozen=True, slots=True)
class Series:
    """One line of a plot.

    Attributes:
        name: for people.
        low, high, mean: (columns,).
        colour: number of its colour in the page's palette, from 1.
    """

    name: str
    low: Array
    high: Array
    mean: Array
    colour: int = 1


@dataclass(frozen=True, slots=True)
class Plot:
    """Series over time.

    Attributes:
        title, unit: for people.
        time: of each column, (columns,) [s].
        end: of the session [s].
        series: the lines.
        lower, upper: limits, drawn as the ends of a band; infinite where there is none.
        note: besides the title.
    """

    title: str
    unit: str
    time: Array
    end: float
    series: Sequence[Series]
    lower: float = -np.inf
    upper: float = np.inf
    note: str = ""

    @property
    def html(self) -> str:
        """A figure."""
        bottom, top = self._range()
        scale = _Scale(0.0, max(self.end, 1e-9), bottom, top)
        ticks = [value for value in nice(bottom, top, 4) if bottom <= value <= top]
        times = [value for value in nice(0.0, self.end, 6) if value <= ROOM * self.end]
        marks = "".join(f'<i style="bottom:{100 * scale.share(v):.2f}%">{number(v)}</i>' for v in ticks)
        below = "".join(f'<i style="left:{100 * v / scale.end:.2f}%">{number(v)}</i>' for v in times)
        key = "".join(f'<b class="c{s.colour}">{escape(s.name)}</b>' for s in self.series)
        unit = f"<span>{escape(self.unit)}</span>" if self.unit else ""
        return (
            f'<figure class="plot" data-end="{scale.end:.9g}" data-bottom="{bottom:.9g}" '
            f'data-top="{top:.9g}">'
            f"<figcaption><strong>{escape(self.title)}</strong>{unit}"
            f"{key if len(self.series) > 1 else ''}<small>{escape(self.note)}</small><output></output>"
            f'</figcaption><div class="y">{marks}</div><div class="area">{self._drawing(scale, ticks)}</div>'
            f'<div class="x">{below}<i class="unit">s</i></div></figure>'
        )

    def _range(self) -> tuple[float, float]:
        """Ends of the ordinate: everything drawn, limits that are not far off, and some air."""
        low = min(float(np.min(s.low, initial=np.inf)) for s in self.series)
        high = max(float(np.max(s.high, initial=-np.inf)) for s in self.series)
        if not (isfinite(low) and isfinite(high)):
            low, high = 0.0, 1.0
        low = min([low, *(v for v in (self.lower, self.upper) if isfinite(v))])
        high = max([high, *(v for v in (self.lower, self.upper) if isfinite(v))])
        air = 0.06 * (high - low) or 0.1 * abs(high) or 1.0
        return low - air, high + air

    def _drawing(self, scale: _Scale, ticks: Sequence[float]) -> str:
        grid = "".join(f"M0 {scale.y(v):.1f}H{WIDTH}" for v in ticks)
        parts = [f'<path class="grid" d="{grid}"/>']
        parts += self._limits(scale)
        for series in self.series:
            parts += _line(series, [scale.x(t) for t in self.time], scale)
        return (
            f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" preserveAspectRatio="none" role="img" '
            f'aria-label="{escape(self.title, quote=True)} over time">{"".join(parts)}</svg>'
        )

    def _limits(self, scale: _Scale) -> Iterator[str]:
        """What is allowed as a band, and its ends."""
        if not (isfinite(self.lower) or isfinite(self.upper)):
            return
        upper = scale.y(self.upper) if isfinite(self.upper) else 0.0
        lower = scale.y(self.lower) if isfinite(self.lower) else float(HEIGHT)
        yield f'<rect class="band" y="{upper:.1f}" width="{WIDTH}" height="{lower - upper:.1f}"/>'
        ends = [scale.y(v) for v in (self.lower, self.upper) if isfinite(v)]
        yield f'<path class="limit" d="{"".join(f"M0 {y:.1f}H{WIDTH}" for y in ends)}"/>'


@dataclass(frozen=True, slots=True)
class _Scale:
    """From seconds and values to the drawing."""

    begin: float
    end: float
    bottom: float
    top: float

    def x(self, t: float) -> float:
        return WIDTH * (t - self.begin) / (self.end - self.begin)

    def y(self, value: float) -> float:
        return HEIGHT * (1.0 - self.share(value))

    def share(self, value: float) -> float:
        return (value - self.bottom) / (self.top - self.bottom)


def _line(series: Series, x: Sequence[float], scale: _Scale) -> Iterator[str]:
    """The band from lowest to highest where it is wider than a line, and the means."""
    low, high, mean = ([scale.y(v) for v in row] for row in (series.low, series.high, series.mean))
    if any(a - b > 1.0 for a, b in zip(low, high, strict=True)):
        there = "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(x, high, strict=True))
        back = "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(reversed(x), reversed(low), strict=True))
        yield f'<path class="spread c{series.colour}" d="M{there}L{back}Z"/>'
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, mean, strict=True))
    name = escape(series.name, quote=True)
    yield f'<polyline class="mean c{series.colour}" data-name="{name}" points="{points}"/>'


def nice(low: float, high: float, count: int) -> list[float]:
    """Round numbers from ``low`` to ``high``, about ``count`` of them."""
    span = high - low
    if not (isfinite(span) and span > 0.0):
        return [low] if isfinite(low) else []
    rough = span / count
    power = 10.0 ** floor(log10(rough))
    step = next(m * power for m in (1.0, 2.0, 2.5, 5.0, 10.0) if m * power >= rough * (1.0 - 1e-9))
    first = ceil(low / step - 1e-9)
    return [k * step for k in range(first, floor(high / step + 1e-9) + 1)]


def number(value: float) -> str:
    """As people read it."""
    return "0" if abs(value) < 1e-12 else f"{value:.4g}"


def histogram(edges: Sequence[float], counts: Sequence[int], title: str, unit: str, note: str) -> str:
    """Bars whose height is the logarithm of the count, because the rare ones matter.

    Args:
        edges: of the bars, positive, ascending, one more than there are counts; powers of ten are named.
        counts: in each bar.
        title: for people.
        unit: of the edges.
        note: besides the title.
    """
    most = max(counts, default=0)
    top = log10(most) + 0.3 if most else 1.0
    wide = WIDTH / max(1, len(counts))
    bars = "".join(
        f'<rect x="{k * wide + 0.5:.1f}" width="{wide - 1:.1f}" '
        f'y="{HEIGHT * (1 - (log10(n) + 0.3) / top):.1f}" height="{HEIGHT * (log10(n) + 0.3) / top:.1f}">'
        f"<title>{number(edges[k])} to {number(edges[k + 1])} {escape(unit)}: {n}</title></rect>"
        for k, n in enumerate(counts)
        if n
    )
    decades = (k for k, edge in enumerate(edges) if abs(log10(edge) - round(log10(edge))) < 1e-9)
    below = "".join(
        f'<i style="left:{100 * k / (len(edges) - 1):.2f}%">{number(edges[k])}</i>' for k in decades
    )
    return (
        f'<figure class="plot"><figcaption><strong>{escape(title)}</strong><span>{escape(unit)}</span>'
        f'<small>{escape(note)}</small></figcaption><div class="y"></div><div class="area">'
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" preserveAspectRatio="none" role="img" '
        f'aria-label="{escape(title, quote=True)}" class="bars">{bars}</svg></div>'
        f'<div class="x">{below}</div></figure>'
    )
