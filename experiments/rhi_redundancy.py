"""What redundancy is worth: the redundant interface beside itself with its base joints locked.

Locked, two motors are left for two directions of the hand: one posture wherever the hand is, the same for
free motion and for contact. Free, the posture follows what the hand does.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..machines.rhi.manipulability import direction
from ..machines.rhi.saturation import force_limit
from ..machines.rhi.self_motion import Ellipsoid, best_posture
from ..models import Array
from .outcome import Outcome, Progress, Row
from .palpation import Device
from .rhi_table1 import direct_inertia

TITLE = "what redundancy is worth, base joints free and locked"
LOCKED = 2
"""Motors of the base that are locked: as many as the interface has more than directions."""
DIRECTIONS = 12
"""Of the hand over half a turn; the opposite ones are the same."""
SCAN = 1500
NAMES = ("locked, free posture", "locked, stiff posture", "redundant")


def inertia(J: Array, M: Array, u: Array) -> float:
    """Mx = 1 / (u^T J M^-1 J^T u) of motors that move, along a unit vector (m,) [kg]."""
    return float(1.0 / (u @ J @ np.linalg.solve(M, J.T) @ u))


def manipulability(J: Array, limit: Array) -> float:
    """sqrt(det(J W^2 J^T)), W = diag(1 / limit): area of the velocity ellipse over pi."""
    scaled = J / limit
    return float(np.sqrt(np.linalg.det(scaled @ scaled.T)))


def worth(device: Device, u: Array) -> dict[str, Array]:
    """Inertia [kg], manipulability, and largest force [N] along u (m,) at X0, for each of NAMES.

    The base is locked in the best posture for free motion or for contact along the device's own direction;
    locked motors bear any torque.
    """
    uu = direction(u)
    own = [device.posture(stiff, SCAN) for stiff in (False, True)]
    wanted = [Ellipsoid(desired(uu), device.limit) for desired in (device.shape.free, device.shape.stiff)]
    best = [best_posture(device.arm, device.centre, device.bounds, goal, SCAN) for goal in wanted]
    found: dict[str, list[float]] = {"inertia": [], "manipulability": [], "force": []}
    for name, light, strong in zip(NAMES, (own[0], own[1], best[0]), (own[0], own[1], best[1]), strict=True):
        moving = slice(0 if name == "redundant" else LOCKED, None)
        arm, limit = device.arm.at(light), device.limit[moving]
        J, M = arm.J[:, moving].copy(), arm.M[moving, moving].copy()
        found["inertia"].append(inertia(J, M, u))
        found["manipulability"].append(manipulability(J, limit))
        J = device.arm.at(strong).J[:, moving]
        found["force"].append(float(force_limit(J[None], limit, u)[0]))
    return {quantity: np.array(values) for quantity, values in found.items()}


def run(progress: Progress) -> Outcome:
    """Every direction, and the paper's own."""
    device = Device()
    angles = np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    over = []
    for k, angle in enumerate(angles):
        progress(f"direction {k + 1} of {DIRECTIONS}")
        over.append(worth(device, np.array([np.cos(angle), np.sin(angle)])))
    along = worth(device, device.u)
    table = {quantity: np.array([found[quantity] for found in over]) for quantity in along}
    rows = []
    for quantity, unit in (("inertia", " [kg]"), ("manipulability", ""), ("force", " [N]")):
        for k, name in enumerate(NAMES):
            least, most = table[quantity][:, k].min(), table[quantity][:, k].max()
            note = f"over directions {least:.3f} to {most:.3f}"
            note += "; the lock bears the base's torque" if quantity == "force" and k < 2 else ""
            rows.append(Row(f"{quantity} along u, {name}{unit}", "-", f"{along[quantity][k]:.3f}", note))
    free, stiff = (direct_inertia(device, stiff) for stiff in (False, True))
    rows.append(
        Row("Table I's inertia, free / stiff [kg]", "0.036 / 0.125", f"{free:.3f} / {stiff:.3f}", PURSUED)
    )
    figures = {
        quantity: {"along": along[quantity].tolist(), "over": table[quantity].tolist()} for quantity in along
    }

    def draw(figure: Any) -> None:
        axes = figure.subplots(1, 2, sharex=True)
        for plot, quantity, unit in zip(axes, ("inertia", "force"), ("kg", "N"), strict=True):
            for k, (name, style) in enumerate(zip(NAMES, ("--", ":", "-"), strict=True)):
                plot.semilogy(np.degrees(angles), table[quantity][:, k], style, label=name)
            plot.set(xlabel="direction [deg]", ylabel=f"{quantity} [{unit}]")
        axes[0].legend(fontsize=7)

    return Outcome(rows, figures, draw, (8.0, 4.2))


PURSUED = "one device has both: light where the hand moves, strong where it presses"
