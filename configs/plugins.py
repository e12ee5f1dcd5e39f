"""What the installed packages bring along: kinds of machines and devices, by entry points."""

from __future__ import annotations

from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any, Final

COMMANDS: Final = "hapticd.commands"
"""Group of the entry points that name a function that adds a command to the command line."""
MACHINES: Final = "hapticd.machines"
"""Group of the entry points that name a ``hapticd.runtime.configuration.system.System``."""
DEVICES: Final = "hapticd.devices"
"""Group of those that name a subclass of ``hapticd.devices.device.Device``."""
SIMULATED_DEVICES: Final = "hapticd.simulated_devices"
"""Group of those that name the subclass of ``hapticd.sim.node.SimNode`` for the device of the same name."""


class PluginError(Exception):
    """An installed package promises what cannot be loaded, or two promise the same.

    Attributes:
        name: of the entry point.
        problem, fix: what is wrong, and how to mend it.
    """

    def __init__(self, name: str, problem: str, fix: str) -> None:
        self.name, self.problem, self.fix = name, problem, fix
        super().__init__(f"{name}: {problem}; {fix}")


def names(group: str) -> list[str]:
    """Names of what is installed, sorted."""
    return sorted({point.name for point in _points(group)})


def folder(group: str, name: str) -> str:
    """The package that an entry point names an object of.

    Raises:
        KeyError: nothing of that name is installed.
        PluginError: two packages bring the name along.
    """
    module = _point(group, name).module
    return module.rpartition(".")[0] or module


@cache
def plugin(group: str, name: str) -> Any:
    """The object that an entry point names.

    Raises:
        KeyError: nothing of that name is installed.
        PluginError: it cannot be loaded, or two packages bring it along.
    """
    point = _point(group, name)
    try:
        return point.load()
    except Exception as error:  # whatever the import of somebody's package raises
        problem = f"'{point.value}' cannot be loaded: {type(error).__name__}: {error}"
        raise PluginError(name, problem, f"mend the package that names it under [{group}]") from error


@cache
def _points(group: str) -> tuple[EntryPoint, ...]:
    """Entry points of a group, read once: it takes a look into every installed package."""
    return tuple(entry_points(group=group))


def _point(group: str, name: str) -> EntryPoint:
    found = {point.value: point for point in _points(group) if point.name == name}
    if not found:
        raise KeyError(name)
    if len(found) > 1:
        raise PluginError(name, f"named by several packages: {', '.join(found)}", "uninstall all but one")
    return next(iter(found.values()))
