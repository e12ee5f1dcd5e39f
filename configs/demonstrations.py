"""What `hapticd demo` shows beside the built-in machines: a name, and the command that it stands for."""

from __future__ import annotations

DEMONSTRATIONS: dict[str, tuple[str, ...]] = {
    "walk": ("demo", "giant"),
    "door": ("demo", "giant", "--twin", "door"),
    "excavator": ("demo", "giant", "--twin", "excavator"),
    "palpation": ("demo", "rhi"),
    "bimanual": ("bimanual", "--live", "--view"),
}
