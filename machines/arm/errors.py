"""What goes wrong while an arm is taken out of a URDF."""

from __future__ import annotations

from ...runtime.errors import HapticdError


class InitError(HapticdError):
    """A URDF in which there is no arm, or files that would be overwritten or cannot be written."""

    code = "init"
    exit_status = 2
