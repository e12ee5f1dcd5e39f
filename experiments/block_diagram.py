"""Block diagrams whose blocks and signals are attributes of real objects: what is not there is not drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

from .outcome import ExperimentError

WIDTH, HEIGHT = 0.135, 0.15
"""Of a block, as parts of the drawing's."""

Ends = tuple[tuple[float, float], tuple[float, float]]
"""Middles of the blocks at an arrow's start and end."""


@dataclass(frozen=True, slots=True)
class Block:
    """A part of a system.

    Attributes:
        part: dotted path of an object or a method; "" for what is outside.
        at: middle of the block, parts of the drawing's width and height.
        does: what it does, below its name.
    """

    part: str
    at: tuple[float, float]
    does: str


@dataclass(frozen=True, slots=True)
class Arrow:
    """What a block tells another.

    Attributes:
        start, end: places of two blocks in their sequence.
        signal: dotted path of the attribute or method that tells it; symbol: how formulas call it, "" for
            none.
        label: where along the arrow its text is, 0 to 1.
        bend: how far its middle is to the right of its way, parts of its length.
    """

    start: int
    end: int
    signal: str
    symbol: str = ""
    label: float = 0.5
    bend: float = 0.0


def name(system: object, block: Block) -> str:
    """Of the class, or of the method with its class; of what is outside nothing.

    Raises:
        ExperimentError: the system has no such part.
    """
    if not block.part:
        return ""
    part = _found(system, block.part)
    return str(part.__qualname__ if callable(part) else type(part).__qualname__)


def text(system: object, arrow: Arrow) -> str:
    """Of an arrow: the attribute, and its symbol.

    Raises:
        ExperimentError: the system has no such attribute.
    """
    _found(system, arrow.signal)
    told = arrow.signal.rpartition(".")[2].replace("_", " ")
    return f"{told} {arrow.symbol}".rstrip()


def undrawn(owner: object, path: str, blocks: Sequence[Block]) -> list[str]:
    """Parts of an owner (public attributes of classes from its package) that no block shows."""
    package = type(owner).__module__.rpartition(".")[0]
    drawn = {block.part for block in blocks}
    names = [key for key, value in vars(owner).items() if type(value).__module__.startswith(f"{package}.")]
    return [key for key in names if not key.startswith("_") and f"{path}.{key}" not in drawn]


def draw(figure: Any, system: object, blocks: Sequence[Block], arrows: Sequence[Arrow]) -> None:
    """On an empty subfigure.

    Raises:
        ExperimentError: the system lacks a part or a signal.
    """
    boxes = [_box(figure, block, name(system, block)) for block in blocks]
    for arrow in arrows:
        ends = blocks[arrow.start].at, blocks[arrow.end].at
        _line(figure, arrow, ends, (boxes[arrow.start], boxes[arrow.end]))
        _label(figure, arrow, ends, text(system, arrow))


def _box(figure: Any, block: Block, title: str) -> Any:
    from matplotlib.patches import FancyBboxPatch

    x, y = block.at
    box = FancyBboxPatch(
        (x - WIDTH / 2, y - HEIGHT / 2),
        WIDTH,
        HEIGHT,
        "round,pad=0,rounding_size=0.01",
        transform=figure.transSubfigure,
        fc="white",
        ec="0.2",
        ls="-" if block.part else ":",
    )
    middle = {"ha": "center", "va": "center", "fontsize": 7}
    if title:
        figure.text(x, y + 0.04, title, weight="bold", **middle)
    figure.text(x, y - 0.025 if title else y, block.does, **middle)
    return figure.add_artist(box)


def _line(figure: Any, arrow: Arrow, ends: Ends, boxes: tuple[Any, Any]) -> None:
    from matplotlib.patches import FancyArrowPatch

    line = FancyArrowPatch(
        *ends,
        patchA=boxes[0],
        patchB=boxes[1],
        transform=figure.transSubfigure,
        arrowstyle="-|>",
        connectionstyle=f"arc3,rad={2.0 * arrow.bend}",
        mutation_scale=8,
        shrinkA=0,
        shrinkB=0,
        color="tab:blue",
    )
    figure.add_artist(line)


def _label(figure: Any, arrow: Arrow, ends: Ends, told: str) -> None:
    (x, y), (to_x, to_y) = ends
    right, up, slim = to_x - x, to_y - y, figure.bbox.width / figure.bbox.height
    x += arrow.label * right + arrow.bend * up / slim
    y += arrow.label * up - arrow.bend * right * slim
    paper = {"fc": "white", "ec": "none", "pad": 0.6}
    figure.text(x, y, told, ha="center", va="center", fontsize=6.5, bbox=paper)


def _found(system: object, path: str) -> Any:
    try:
        return attrgetter(path)(system)
    except AttributeError as error:
        raise ExperimentError(f"there is no {path} to draw: {error}") from error
