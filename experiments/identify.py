"""Springs, rotors and friction of a machine's joints from a recording."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec

from ..configs.printable import printable
from ..runtime.recording.log import open_log
from .identification import Identified, identify
from .recorded_joints import Believed, IdentifyError, recorded

UNITS = {
    "stiffness": ("N m/rad", "N/m"),
    "rotor_inertia": ("kg m^2", "kg"),
    "coulomb": ("N m", "N"),
    "viscous": ("N m s/rad", "N s/m"),
    "load_friction": ("of the load", "of the load"),
}
"""Of what is identified, where a joint turns and where it slides."""
WANTED = ("stiffness", "rotor_inertia")
"""What the controller is told."""


def run(options: argparse.Namespace) -> int:
    """Print, and write, what was identified; 1 where a stiffness or an inertia was refused, else 0."""
    log = open_log(options.log)
    dt = 1.0 / log.loaded.config.loop.rate
    found = [(joint, identify(runs, joint.torque, joint.speed, dt)) for joint, runs in recorded(log)]
    print(as_json(found) if options.json else "\n".join(table(found)))
    if options.out:
        write(options.out, "\n".join(toml(found, str(log.loaded.config.__struct_config__.tag))))
    return int(any(key not in seen.found for _, seen in found for key in WANTED))


Found = Sequence[tuple[Believed, Identified]]


def table(found: Found) -> list[str]:
    """For people: a line a number, believed ones beside."""
    lines = []
    for joint, seen in found:
        acts = f": what it is told is measured {seen.late} ticks later" if seen.late else ""
        lines.append(f"{printable(joint.name)}{acts}")
        for key, units in UNITS.items():
            if key not in seen.found:
                continue
            value, error = seen.found[key].value, seen.found[key].error
            believed = getattr(joint, key, None)
            beside = "" if believed is None else f"  believed {believed:g}: {value / believed - 1:+.1%}"
            lines.append(f"  {key:16}{value:10.4g} +- {error:<8.2g} {units[joint.slides]}{beside}")
        lines += [
            f"  left over, {key}: {value:.2g} {UNITS['coulomb'][joint.slides]} (standard deviation)"
            for key, value in seen.residual.items()
        ]
        lines += [f"  not identified: {reason}" for reason in seen.refused]
    return lines


def as_json(found: Found) -> str:
    """The same as one JSON object."""
    joints: dict[str, Any] = {}
    for joint, seen in found:
        believed = {key: getattr(joint, key) for key in WANTED}
        joints[joint.name] = {
            **{"believed": believed, "identified": seen.found, "residual": seen.residual},
            **{"late": seen.late, "refused": seen.refused},
        }
    return msgspec.json.encode({"joints": joints}).decode()


def toml(found: Found, system: str) -> list[str]:
    """Lines for the configuration of a system; where something was refused, what is believed."""

    def value(joint: Believed, seen: Identified, key: str) -> str:
        known = seen.found.get(key)
        return f"{known.value if known else getattr(joint, key):.6g}"

    if system == "giant":
        lines = ["[giant.tracking]"]
        for key in WANTED:
            numbers = " ".join(value(joint, seen, key) for joint, seen in found)
            lines.append(f'{key} = "{numbers} {UNITS[key][False]}"')
    else:
        lines = []
        for joint, seen in found:
            lines.append(f"[arm.joints.{joint.name}]")
            lines += [f'{key} = "{value(joint, seen, key)} {UNITS[key][joint.slides]}"' for key in WANTED]
    for joint, seen in found:
        lines += [f"# {joint.name} {key}: {e.value:.4g} +- {e.error:.2g}" for key, e in seen.found.items()]
        lines += [f"# {joint.name}, not identified: {reason}" for reason in seen.refused]
    return lines


def write(path: Path, text: str) -> None:
    """A new file.

    Raises:
        IdentifyError: it is there already, or cannot be written.
    """
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text + "\n")
    except FileExistsError as error:
        raise IdentifyError(f"{path} is there already; name another file") from error
    except OSError as error:
        raise IdentifyError(f"cannot write {path}: {error.strerror}") from error
