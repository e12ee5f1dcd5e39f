"""Built-in machines: TOML, URDF models and the EDS files of their devices; what any such file may hold."""

from __future__ import annotations

from importlib import resources


def read_text(name: str) -> str:
    """Text of a built-in file, by its name."""
    return (resources.files(__name__) / name).read_text(encoding="utf-8")
