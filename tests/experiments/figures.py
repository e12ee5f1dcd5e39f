"""What a reader needs of a plot, found by walking through the matplotlib figure."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any


def faults(figure: Any) -> Iterator[str]:
    """What is missing: labels of axes and colour bars, legends, a difference between lines besides colour."""
    if not figure.axes:
        yield "nothing is drawn"
    bars = [axes for axes in figure.axes if axes.get_label() == "<colorbar>"]
    for bar in bars:
        if not (bar.get_ylabel() or bar.get_xlabel()):
            yield "a colour bar without a label"
    plots = [axes for axes in figure.axes if axes not in bars]
    for k, axes in enumerate(plots):
        for name in axes._axis_names:
            shared = axes._shared_axes[name].get_siblings(axes)
            if not any(getattr(each, f"get_{name}label")() for each in shared):
                yield f"plot {k}: axis {name} without a label"
        lines = [line for line in axes.get_lines() if not line.get_label().startswith("_")]
        if len({look(line) for line in lines}) < len(lines):
            yield f"plot {k}: lines that only colour tells apart"
        named = {line.get_label() for line in lines}
        explained = {text for each in plots if (legend := each.get_legend()) for text in texts(legend)}
        explained |= {text for legend in figure.legends for text in texts(legend)}
        if len(named) > 1 and not named <= explained:
            yield f"plot {k}: lines without a legend: {sorted(named - explained)}"


def look(line: Any) -> tuple[Any, ...]:
    """How a line looks without colour."""
    return line.get_linestyle(), str(line._dash_pattern), line.get_marker()


def texts(legend: Any) -> list[str]:
    return [text.get_text() for text in legend.get_texts()]
