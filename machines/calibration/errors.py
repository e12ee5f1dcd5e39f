"""Errors of a calibration."""

from __future__ import annotations

from ...runtime.errors import HapticdError


class CalibrateError(HapticdError):
    """Nothing that could be calibrated as asked; nothing has moved yet."""

    code = "calibrate"
    exit_status = 2


class RefusedError(HapticdError):
    """No calibration may be taken from what was measured, or the machine stopped."""

    code = "calibration"
