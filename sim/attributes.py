"""Attributes of simulated devices whose values the C core holds."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Generic, TypeVar

if TYPE_CHECKING:
    from .node import SimNode

T = TypeVar("T")


class Stored(Generic[T]):
    """A number in a struct of the core."""

    def __init__(self, kind: Callable[[int], T], part: str = "") -> None:
        """What it is to Python, and the struct in the device's own that holds it, "" for that itself."""
        self._kind, self._part, self._name = kind, part, ""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, node: SimNode, owner: type) -> T:
        return self._kind(getattr(self._struct(node), self._name))

    def __set__(self, node: SimNode, value: T) -> None:
        setattr(self._struct(node), self._name, value)

    def _struct(self, node: SimNode) -> Any:
        return getattr(node._core, self._part) if self._part else node._core


class TwoChannels:
    """A switch with two channels in a struct of the core."""

    def __init__(self, part: str) -> None:
        """The struct in the device's own that holds it."""
        self._part, self._name = part, ""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, node: SimNode, owner: type) -> tuple[bool, bool]:
        first, second = getattr(getattr(node._core, self._part), self._name)
        return bool(first), bool(second)

    def __set__(self, node: SimNode, value: tuple[bool, bool]) -> None:
        setattr(getattr(node._core, self._part), self._name, value)


class FieldValue:
    """A field of a device: a number, or a tuple where it has several components.

    Attributes:
        initial: what it is at first.
    """

    def __init__(self, name: str, initial: Any) -> None:
        self._name, self.initial = name, initial

    def __get__(self, node: SimNode, owner: type) -> Any:
        values = node.fields[self._name]
        return values.item() if len(values) == 1 else tuple(values.tolist())

    def __set__(self, node: SimNode, value: Any) -> None:
        node.fields[self._name][:] = value
