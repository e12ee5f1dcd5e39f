"""A calibration as a file, as JSON, and as a table for people."""

from __future__ import annotations

from math import radians

import msgspec
import numpy as np

from ...configs.quantities import Forces3, HandleMass, LengthErrors3, Lengths3, MassError, Torques3
from ...control.ft_calibration import Tool
from ...devices.calibration import Calibration
from .session import Taken

TILT = 0.5
"""How far a base may well be out of level [deg]."""
DIGITS = 6
"""Behind the point, in SI units: a micrometre."""


def file_of(taken: Taken, day: str) -> Calibration:
    """The calibration file of a sensor."""
    tool, error = (_rounded(each) for each in (taken.fit.tool, taken.fit.error))
    draft = Calibration(
        sensor=taken.mount.device,
        serial=taken.serial,
        date=day,
        mass=HandleMass(tool.mass),
        centre=Lengths3(tool.centre.tolist()),
        force_bias=Forces3(tool.bias[:3].tolist()),
        torque_bias=Torques3(tool.bias[3:].tolist()),
        mass_error=MassError(error.mass),
        centre_error=LengthErrors3(error.centre.tolist()),
        force_bias_error=Forces3(error.bias[:3].tolist()),
        torque_bias_error=Torques3(error.bias[3:].tolist()),
        poses=len(taken.samples),
        condition=round(taken.fit.condition, 3),
        sha256="0" * 64,
    )
    return msgspec.structs.replace(draft, sha256=draft.digest)


def _rounded(tool: Tool) -> Tool:
    return Tool(tool.bias.round(DIGITS), round(tool.mass, DIGITS), tool.centre.round(DIGITS))


def as_json(taken: Taken) -> dict[str, object]:
    """Everything that was found of a sensor, in SI units."""
    fit = taken.fit
    return {
        "sensor": taken.mount.device,
        "serial": taken.serial,
        **_plain(fit.tool),
        "error": _plain(fit.error),
        "error_tilted": _plain(taken.expected(radians(TILT))),
        "condition": fit.condition,
        "scatter": list(fit.scatter),
        "residuals": fit.residuals.tolist(),
    }


def _plain(tool: Tool) -> dict[str, object]:
    return {"bias": tool.bias.tolist(), "mass": tool.mass, "centre": tool.centre.tolist()}


def table(taken: Taken) -> list[str]:
    """What was found of a sensor, for people."""
    fit, tilted = taken.fit, taken.expected(radians(TILT))
    rows = [
        *_rows("force bias", "xyz", (fit.tool.bias[:3], fit.error.bias[:3], tilted.bias[:3]), "N"),
        *_rows("torque bias", "xyz", (fit.tool.bias[3:], fit.error.bias[3:], tilted.bias[3:]), "N m"),
        *_rows("mass", ("",), ([fit.tool.mass], [fit.error.mass], [tilted.mass]), "kg"),
        *_rows("centre", "xyz", (fit.tool.centre, fit.error.centre, tilted.centre), "m"),
    ]
    left = fit.residuals
    force, torque = np.linalg.norm(left[:, :3], axis=1), np.linalg.norm(left[:, 3:], axis=1)
    return [
        f"{taken.mount.device}, serial number {taken.serial}, simulated; {len(taken.samples)} poses",
        f"{'':15}{'found':>12}{'+-':>11}{f'+- at {TILT:g} deg':>15}",
        *rows,
        f"condition number {fit.condition:.2f}",
        f"residuals: {1e3 * fit.scatter[0]:.3g} mN and {1e3 * fit.scatter[1]:.3g} mN m of standard "
        f"deviation; the worst poses {force.argmax() + 1} with {1e3 * force.max():.3g} mN "
        f"and {torque.argmax() + 1} with {1e3 * torque.max():.3g} mN m",
    ]


def _rows(what: str, axes: str | tuple[str, ...], columns: tuple[object, ...], unit: str) -> list[str]:
    values = zip(*[np.asarray(column).tolist() for column in columns], strict=True)
    return [
        f"{f'{what} {axis}'.strip():15}{found:12.5f}{error:11.5f}{tilted:15.5f} {unit}"
        for axis, (found, error, tilted) in zip(axes, values, strict=True)
    ]
