"""Springs, rotors and friction of a machine's joints, from a recording or from motion of their own."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from ..configs.printable import printable
from ..runtime.command_line.paragraphs import DEEPER, tell
from ..runtime.configuration import config
from ..runtime.configuration.config import Loaded
from ..runtime.configuration.system import find_system
from ..runtime.invocation import install
from ..runtime.recording.log import open_log
from . import identify_handle
from .excited_joints import Excited, excite, links_of
from .identification import Identified, identify
from .least_squares import Estimate
from .link_parameters import LinkFit
from .own_plant import Doubt
from .recorded_joints import Believed, IdentifyError, recorded

UNITS = {
    "stiffness": ("N m/rad", "N/m"),
    "rotor_inertia": ("kg m^2", "kg"),
    "coulomb": ("N m", "N"),
    "viscous": ("N m s/rad", "N s/m"),
    "load_friction": ("of the load", "of the load"),
}
"""Of what is identified, where a joint turns and where it slides."""
KEYS = {"coulomb": "gear_friction", "viscous": "gear_damping"}
"""What a configuration calls what it is told under another name."""
WRITTEN = {
    "stiffness": UNITS["stiffness"],
    "rotor_inertia": UNITS["rotor_inertia"],
    "gear_friction": UNITS["coulomb"],
    "gear_damping": UNITS["viscous"],
    "load_friction": ("", ""),
    "bearing_friction": UNITS["coulomb"],
}
"""Keys of a configuration, with their units."""
WANTED = ("stiffness", "rotor_inertia")
"""Without these a joint is not identified."""


def run(options: argparse.Namespace) -> int:
    """Print, and write, what was identified; 1 where a stiffness or an inertia was refused, else 0."""
    if options.plot and not find_spec("matplotlib"):
        raise IdentifyError(f"--plot needs matplotlib; type: {install('matplotlib')}")
    if options.out and options.out.exists():  # rather than after a minute of motion
        raise IdentifyError(f"{options.out} is there already; name another file")
    if of_a_machine(options.what):
        loaded = config.load(options.what)
        if options.handle or not find_system(str(type(loaded.config).__struct_config__.tag)).rig:
            return _handle(options, loaded)
        if options.along or options.at:
            raise IdentifyError("--along and --at are of --handle; the joints of this machine are led")
        found, tag, led = _excited(options, loaded)
    else:
        for option in ("plot", "wrong_model", "errors", "handle", "along", "at"):
            if getattr(options, option):
                raise IdentifyError(f"--{option.replace('_', '-')} needs a machine, not a recording")
        log = open_log(options.what)
        dt, tag, led = 1.0 / log.loaded.config.loop.rate, str(log.loaded.config.__struct_config__.tag), None
        found = [(joint, identify(runs, joint.torque, joint.speed, dt)) for joint, runs in recorded(log)]
    if options.json:
        print(as_json(found, led))
    else:
        for line in (*table(found), *(_led_table(found, *led) if led else [])):
            tell(line, indent=DEEPER)
    if options.out:
        write(options.out, "\n".join(toml(found, tag, led[1] if led else None)))
    return int(any(key not in seen.found for _, seen in found for key in WANTED))


Found = Sequence[tuple[Believed, Identified]]
BAR = 30


def of_a_machine(what: str) -> bool:
    """Whether a word names a configuration; a recording otherwise."""
    return what.endswith(".toml") or not (what.endswith(".mcap") or Path(what).exists())


def _excited(options: argparse.Namespace, loaded: Loaded) -> tuple[Found, str, tuple[Excited, LinkFit]]:
    """Lead the joints of a simulated machine, and identify what was measured."""
    dt = 1.0 / loaded.config.loop.rate
    doubt = Doubt(options.wrong_model, options.errors)
    with _bar(options) as progress:
        excited = excite(loaded, options.seconds, options.seed, doubt, progress)
    found = [(joint, identify(runs, joint.torque, joint.speed, dt)) for joint, runs in excited.joints]
    fit = links_of(excited, dt)
    if options.plot:
        _draw(options.plot, found, excited, fit, dt)
    return found, str(loaded.config.__struct_config__.tag), (excited, fit)


def _handle(options: argparse.Namespace, loaded: Loaded) -> int:
    """Push the handle; 1 where something was refused, else 0."""
    if options.out:
        raise IdentifyError("--out: what a hand feels of a handle is no part of a configuration; see --json")
    doubt = Doubt(options.wrong_model, options.errors)
    with _bar(options) as progress:
        told = identify_handle.push(loaded, options.along or [], options.at, doubt, options.seed, progress)
    if options.json:
        print(identify_handle.as_json(told))
    else:
        for line in identify_handle.table(told):
            tell(line, indent=DEEPER)
    if options.plot:
        identify_handle.draw(options.plot, told)
    return int(any(each.seen is None for each in told))


@contextmanager
def _bar(options: argparse.Namespace) -> Iterator[Callable[[float, str], None]]:
    """What is told the share that is done; on a terminal people see it."""
    show = sys.stderr.isatty() and not options.json

    def progress(share: float, what: str) -> None:
        if show:
            bar = round(BAR * share)
            sys.stderr.write(f"\r[{'#' * bar}{'.' * (BAR - bar)}] {what}\x1b[K")
            sys.stderr.flush()

    try:
        yield progress
    finally:
        if show:
            sys.stderr.write("\r\x1b[K")
            sys.stderr.flush()


def _led_table(found: Found, excited: Excited, fit: LinkFit) -> list[str]:
    """The course, and what the loads say of the links."""
    lines = [
        f"course of {excited.course.seconds:g} s, condition number {excited.condition:.0f}; as measured"
        f" {fit.condition:.0f}",
        f"links: {len(fit.values)} base parameters; of each load the believed and the identified ones leave:",
    ]
    rows = zip(found, fit.before, fit.after, fit.damping, fit.dry, strict=True)
    for (joint, _), before, after, damping, dry in rows:
        unit, viscous = UNITS["coulomb"][joint.slides], UNITS["viscous"][joint.slides]
        lines.append(
            f"  {printable(joint.name):16}{before:8.3g} {after:8.3g} {unit} (RMS); behind the spring:"
            f" {damping:.3g} {viscous}, {dry:.3g} {unit}"
        )
    return lines


def _draw(path: Path, found: Found, excited: Excited, fit: LinkFit, dt: float) -> None:
    """Loads along the course, and what is left of them."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 1.5 * len(found)), layout="constrained")
    axes = figure.subplots(len(found), 1, sharex=True, squeeze=False)[:, 0]
    t = dt * np.arange(len(excited.load))
    for i, ((joint, _), panel) in enumerate(zip(found, axes, strict=True)):
        panel.plot(t, excited.load[:, i], linewidth=0.7, label="load")
        panel.plot(t[fit.at], fit.left[:, i], linewidth=0.7, label="left by the identified model")
        panel.set_ylabel(f"{joint.name}\n[{UNITS['coulomb'][joint.slides]}]", fontsize=8)
    axes[0].legend(loc="upper right", fontsize=8)
    axes[-1].set_xlabel("time along the course [s]")
    try:
        figure.savefig(path)
    except OSError as error:
        raise IdentifyError(f"cannot write {path}: {error.strerror}") from error


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
            believed = getattr(joint, key, None) or joint.friction.get(KEYS.get(key, key))
            beside = f"  believed {believed:g}: {value / believed - 1:+.1%}" if believed else ""
            lines.append(f"  {key:16}{value:10.4g} +- {error:<8.2g} {units[joint.slides]}{beside}")
        lines += [
            f"  left over, {key}: {value:.2g} {UNITS['coulomb'][joint.slides]} (standard deviation)"
            for key, value in seen.residual.items()
        ]
        lines += [f"  not identified: {reason}" for reason in seen.refused]
    return lines


def as_json(found: Found, led: tuple[Excited, LinkFit] | None = None) -> str:
    """The same as one JSON object; with the course that was led, and the links."""
    joints: dict[str, Any] = {}
    for joint, seen in found:
        believed = {**{key: getattr(joint, key) for key in WANTED}, **_fed(joint)}
        joints[joint.name] = {
            **{"believed": believed, "identified": seen.found, "residual": seen.residual},
            **{"late": seen.late, "refused": seen.refused},
        }
    if led is None:
        return msgspec.json.encode({"joints": joints}).decode()
    excited, fit = led
    rows = zip(excited.links.names, excited.links.believed, fit.values, fit.errors, strict=True)
    parameters = {name: {"believed": b, "value": v, "error": e} for name, b, v, e in rows}
    sides = zip(found, fit.before, fit.after, fit.damping, fit.dry, strict=True)
    residual = {
        joint.name: {"believed": before, "identified": after, "viscous": damping, "coulomb": dry}
        for (joint, _), before, after, damping, dry in sides
    }
    course = {"seconds": excited.course.seconds, "condition": excited.condition}
    links = {"condition": fit.condition, "parameters": parameters, "residual": residual}
    whole = {"joints": joints, "course": course, "links": links}
    return msgspec.json.encode(whole, enc_hook=float).decode()


def _fed(joint: Believed) -> dict[str, float]:
    """Friction that is fed forward."""
    return {key: value for key, value in joint.friction.items() if value}


def toml(found: Found, system: str, fit: LinkFit | None = None) -> list[str]:
    """Lines for the configuration of a system; where something was refused, what is believed.

    Dry friction behind the springs is that of ``fit``, where the joints were led.
    """
    known = known_of(found, fit)
    if system == "giant":
        lines = ["[giant.tracking]"]
        for key, (unit, _) in WRITTEN.items():
            numbers = [f"{values[key]:.6g}" for values in known]
            lines.append(
                f"{key} = " + (f'"{" ".join(numbers)} {unit}"' if unit else f"[{', '.join(numbers)}]")
            )
    else:
        lines = []
        for (joint, _), values in zip(found, known, strict=True):
            lines.append(f"[arm.joints.{joint.name}]")
            for key, units in WRITTEN.items():
                number, unit = f"{values[key]:.6g}", units[joint.slides]
                lines.append(f"{key} = " + (f'"{number} {unit}"' if unit else number))
    for joint, seen in found:
        lines += [f"# {joint.name} {key}: {e.value:.4g} +- {e.error:.2g}" for key, e in seen.found.items()]
        lines += [f"# {joint.name}, not identified: {reason}" for reason in seen.refused]
    return lines


def known_of(found: Found, fit: LinkFit | None) -> list[dict[str, float]]:
    """Of each joint, by the keys of a configuration: ``WRITTEN``."""
    known = [_known(joint, seen) for joint, seen in found]
    if fit is not None:
        for values, dry in zip(known, fit.dry.tolist(), strict=True):
            values["bearing_friction"] = max(0.0, dry)
    return known


def _known(joint: Believed, seen: Identified) -> dict[str, float]:
    """Of a joint, by the keys of a configuration: what was identified, or else what is believed.

    What is not above its standard error is nothing.
    """
    believed = {key: getattr(joint, key) for key in WANTED}
    told = {KEYS.get(name, name): _above_error(estimate) for name, estimate in seen.found.items()}
    return {**believed, **joint.friction, **told}


def _above_error(estimate: Estimate) -> float:
    return estimate.value if estimate.value > estimate.error else 0.0


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
