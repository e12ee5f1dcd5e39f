"""Built-in machines: TOML configurations, URDF models and the EDS files of their devices."""

from __future__ import annotations

from importlib import resources


def read_text(name: str) -> str:
    """Text of a built-in file, by its name."""
    return (resources.files(__name__) / name).read_text(encoding="utf-8")
