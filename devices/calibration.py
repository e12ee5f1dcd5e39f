"""The file that a calibration of a force-torque sensor is kept in, and whose it is."""

from __future__ import annotations

import hashlib
from typing import Annotated

from msgspec import Meta

from ..configs.quantities import (
    Forces3,
    HandleMass,
    LengthErrors3,
    Lengths3,
    MassError,
    Torques3,
)
from ..configs.strict import Strict
from .device import Serial

Date = Annotated[str, Meta(pattern=r"^\d{4}-\d{2}-\d{2}$", description='write e.g. "2026-11-22"')]
Digest = Annotated[str, Meta(pattern=r"^[0-9a-f]{64}$", description="SHA-256, 64 hexadecimal digits")]


class Calibration(Strict, frozen=True, kw_only=True):
    """What hangs on a sensor, what it reads without that, and how well both are known.

    Attributes:
        sensor, serial: name of the device, and its serial number (1018h:04).
        date: of the calibration.
        mass, centre: of what hangs on it, in its frame [kg, m].
        force_bias, torque_bias: what it reads when nothing does [N, N m].
        mass_error, centre_error, force_bias_error, torque_bias_error: standard errors.
        poses, condition: that it was taken from, and condition number of the equations.
        sha256: of all of this but itself.
    """

    sensor: Annotated[str, Meta(min_length=1, max_length=100)]
    serial: Serial
    date: Date
    mass: HandleMass
    centre: Lengths3
    force_bias: Forces3
    torque_bias: Torques3
    mass_error: MassError
    centre_error: LengthErrors3
    force_bias_error: Forces3
    torque_bias_error: Torques3
    poses: Annotated[int, Meta(ge=1, le=10_000, description="of a calibration")]
    condition: Annotated[float, Meta(ge=1.0, le=1e6, description="of equations")]
    sha256: Digest

    @property
    def digest(self) -> str:
        """What ``sha256`` must be."""
        said = "\n".join(f"{key} = {getattr(self, key)!r}" for key in _SAID)
        return hashlib.sha256(said.encode()).hexdigest()

    def text(self, heading: str) -> str:
        """The file, below a line of comment."""
        lines = [f"# {heading}"]
        for key in self.__struct_fields__:
            value = getattr(self, key)
            if unit := _UNITS.get(key):
                numbers = value if isinstance(value, tuple) else (value,)
                lines.append(f'{key} = "{" ".join(repr(float(x)) for x in numbers)} {unit}"')
            else:
                lines.append(f'{key} = "{value}"' if isinstance(value, str) else f"{key} = {value!r}")
        return "\n".join(lines) + "\n"


_UNITS = {
    **dict.fromkeys(("mass", "mass_error"), "kg"),
    **dict.fromkeys(("centre", "centre_error"), "m"),
    **dict.fromkeys(("force_bias", "force_bias_error"), "N"),
    **dict.fromkeys(("torque_bias", "torque_bias_error"), "N m"),
}
_SAID = tuple(key for key in Calibration.__struct_fields__ if key != "sha256")
