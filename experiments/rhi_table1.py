"""ContactAware, Table I: inertia and friction at the hand, identified by the paper's procedure."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..models import Array
from .apparent import WINDOW, Apparent, Push, apparent
from .outcome import Outcome, Progress, Row
from .palpation import RATE, SUBSTEPS, Device

TITLE = "apparent inertia and friction, identified (Table I)"
TRIALS = 10
FORCES = np.linspace(0.5, 1.5, TRIALS)
START, POINT = 0.05, 0.1
"""Coordinate along u where a trial begins, and where inertia and friction are asked for [m]."""
PAPER = {"free": (0.036, 0.2953), "stiff": (0.125, 0.6325)}
SIDE = (2000.0, 20.0)
"""A guide keeps the hand on the line along u [N/m, N s/m]; the model (22) has one direction."""


def identify(device: Device, stiff: bool) -> Apparent:
    """Inertia and friction along u."""
    away = (START - POINT) * device.u
    centre, device.centre = device.centre, device.centre + away
    start = device.posture(stiff)
    device.centre = centre
    return apparent([_push(device, start, stiff, force) for force in FORCES], POINT, RATE)


def _push(device: Device, start: Array, stiff: bool, force: float) -> Push:
    """A constant force pushes the hand from START past POINT."""
    controller, _ = device.controller()
    controller.transition.freeze(1.0 if stiff else 0.0)
    plant = device.plant(start)
    arm, u = controller.arm, device.u
    side = np.array([-u[1], u[0]])
    arm.q[:], arm.qd[:] = plant.q, plant.qd
    controller.reset()
    track = []
    for _ in range(round(RATE)):
        arm.q[:], arm.qd[:] = plant.q, plant.qd
        arm.update()
        track.append(float(arm.position @ u))
        if track[-1] > POINT + 2 * WINDOW or not controller.update([0.0, 0.0], 1.0):
            break
        for _ in range(SUBSTEPS):
            aside = (plant.position[:2] - device.centre) @ side
            guide = -(SIDE[0] * aside + SIDE[1] * (plant.velocity[:2] @ side)) * side
            push = [*(force * u + guide), 0.0]
            plant.step(controller.torque, [False] * arm.n, push, 1.0 / RATE / SUBSTEPS)
    return Push(np.array(track), np.zeros((len(track), 2)), np.full(len(track), force))


def direct_inertia(device: Device, stiff: bool) -> float:
    """Mx = 1 / (u^T J M^-1 J^T u) at X0 [kg]."""
    arm = device.arm.at(device.posture(stiff))
    return float(1.0 / (device.u @ arm.J @ np.linalg.solve(arm.M, arm.J.T) @ device.u))


def run(progress: Progress) -> Outcome:
    """Ten trials in each posture."""
    device = Device(null_space={"stiffness": 1e-9})
    found, rows = {}, []
    for name in ("free", "stiff"):
        progress(name)
        stiff = name == "stiff"
        seen = identify(device, stiff)
        mass, friction = found[name] = seen.inertia.value, seen.friction.value
        direct = direct_inertia(device, stiff)
        rows += [
            Row(
                f"inertia, {name} [kg]",
                str(PAPER[name][0]),
                f"{mass:.3f}",
                f"1/(u^T J M^-1 J^T u) = {direct:.3f}",
            ),
            Row(f"friction, {name} [N s/m]", str(PAPER[name][1]), f"{friction:.3f}", FITTED),
        ]

    def draw(figure: Any) -> None:
        axes = figure.subplots(1, 2)
        for k, quantity in enumerate(("inertia along u [kg]", "friction along u [N s/m]")):
            for shift, (label, values, hatch) in enumerate((("paper", PAPER, ""), ("here", found, "//"))):
                heights = [values[name][k] for name in ("free", "stiff")]
                axes[k].bar(np.arange(2) + 0.3 * shift, heights, 0.28, label=label, hatch=hatch)
            axes[k].set(xticks=np.arange(2) + 0.15, xticklabels=("free", "stiff"), xlabel="posture")
            axes[k].set_ylabel(quantity)
        axes[0].legend()

    return Outcome(rows, {"identified": found}, draw, (7.0, 3.2))


FITTED = "an illustration: motor inertias and frictions are chosen so that the paper's values exist"
