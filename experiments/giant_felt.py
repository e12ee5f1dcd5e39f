"""Beyond the paper: what a hand feels of the giant's free mass in free space, 0.5 to 30 Hz along three axes.

Laws were tuned in the default posture; the others judge them. The gantry brings joints 2 and 3 to the same
angles before anything is measured, so these differ in the height and the direction of the handle.
"""

from __future__ import annotations

from math import pi
from typing import Any

import msgspec
import numpy as np

from ..machines.giant.config import GiantConfig
from ..runtime.configuration import config
from .felt import AXES, Felt, felt
from .outcome import COLOURS, LINES, Outcome, Progress, Row
from .own_plant import believed

TITLE = "the giant: felt acceleration over force in free space"
LOW = (-0.45, 1.2, -0.67, 0.3, 0.9, -0.6)
HIGH = (-1.2, 1.9, -0.4, 1.1, -0.2, 0.6)
"""Joints [rad]."""
PASSIVE = 8.0
"""Up to this frequency the resistance is judged [Hz]."""


def _posed(settings: GiantConfig, posture: tuple[float, ...] | None) -> GiantConfig:
    simulation = settings.simulation
    assert simulation is not None
    if posture is None:
        return settings
    own = msgspec.structs.replace(simulation.giant, posture=posture)
    return msgspec.structs.replace(settings, simulation=msgspec.structs.replace(simulation, giant=own))


def run(progress: Progress) -> Outcome:
    """The default posture of the plant as believed, and of its own; two other postures."""
    loaded = config.load("giant")
    settings = loaded.config
    assert isinstance(settings, GiantConfig)
    cases = {
        "as believed": believed(loaded).config,
        "default": settings,
        "low": _posed(settings, LOW),
        "high": _posed(settings, HIGH),
    }
    found: dict[str, list[Felt]] = {}
    for name, case in cases.items():
        progress(name)
        assert isinstance(case, GiantConfig)
        found[name] = felt(loaded, case)
    rows = [_row(name, along) for name, along in found.items()]
    figures = {
        name: {
            axis: {
                "frequency": each.frequency.tolist(),
                "gain_db": each.gain.tolist(),
                "phase_deg": each.phase.tolist(),
                "resistance": each.resistance.tolist(),
            }
            for axis, each in zip(AXES, along, strict=True)
        }
        for name, along in found.items()
    }

    def draw(figure: Any) -> None:
        plots = figure.subplots(2, 3, sharex=True, sharey="row")
        for column, axis in enumerate(AXES):
            gain, phase = plots[:, column]
            for (name, along), colour, line in zip(found.items(), COLOURS, LINES, strict=True):
                each = along[column]
                a = each.admittance * 2j * pi * each.frequency
                gain.semilogx(each.frequency, 20 * np.log10(abs(a)), color=colour, ls=line, label=name)
                phase.semilogx(each.frequency, np.degrees(np.angle(a)), color=colour, ls=line)
            twin = each.twin * 2j * pi * each.frequency
            gain.semilogx(
                each.frequency,
                20 * np.log10(abs(twin)),
                color="black",
                ls="",
                marker=".",
                ms=4,
                label="the twin",
            )
            phase.semilogx(each.frequency, np.degrees(np.angle(twin)), color="black", ls="", marker=".", ms=4)
            gain.set_title(axis)
            phase.set_xlabel("frequency [Hz]")
        plots[0, 0].set_ylabel("acceleration over force [dB of 1/kg]")
        plots[1, 0].set_ylabel("phase [deg]")
        figure.legend(
            *plots[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=5, fontsize=7
        )

    return Outcome(rows, figures, draw, (9.0, 5.0))


def _row(name: str, along: list[Felt]) -> Row:
    true, passive = (" / ".join(f"{f:g}" for f in values) for values in zip(*map(_reach, along), strict=True))
    least = min(float(each.resistance[each.frequency <= PASSIVE].min()) for each in along)
    return Row(
        f"{name}: within 1 dB and 10 degrees of the twin up to, x / y / z [Hz]",
        "-",
        true,
        f"Re(F/v) > -10 N s/m up to {passive} Hz; least up to {PASSIVE:g} Hz: {least:.1f} N s/m",
    )


def _reach(each: Felt) -> tuple[float, float]:
    return each.true_up_to(), each.passive_up_to()
