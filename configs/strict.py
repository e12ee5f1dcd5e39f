"""The base of all sections of a configuration."""

from __future__ import annotations

from msgspec import Struct


class Strict(Struct, frozen=True, forbid_unknown_fields=True):
    """A table whose unknown keys are errors."""
