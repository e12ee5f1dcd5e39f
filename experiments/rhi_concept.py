"""ContactAware, figs 2, 5 and 8: desired ellipsoids of a task, the whole controller, and the device."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..machines.rhi import planar
from ..machines.rhi.contact_aware import ContactAware
from ..machines.rhi.environment import Environment
from ..machines.rhi.manipulability import direction, force_ellipsoid, velocity_ellipsoid
from ..machines.rhi.redundant import RedundantArm
from ..models import Array
from . import block_diagram
from .block_diagram import Arrow, Block
from .outcome import ExperimentError, Outcome, Progress, Row
from .palpation import Device

TITLE = "desired ellipsoids, controller and device (figs 2, 5 and 8)"
SCAN = 4000
"""Configurations of the scan for the postures, as many as the built-in controller takes."""
NAMES = ("home", "free", "stiff")
LENGTHS = (0.254, 0.141, 0.21, 0.181)
"""d of (20), as printed [m]."""
LONGEST, PATH = 0.035, (0.17, 0.09, 0.0)
"""Longest half axis as drawn, and how far in front of the wall ellipsoids are drawn [m]."""
AT = np.linspace(0.0, 2.0 * np.pi, 121)

COLUMNS, LINES = (0.09, 0.295, 0.5, 0.705, 0.91), (0.12, 0.37, 0.62, 0.87)
BLOCKS = (
    Block("", (COLUMNS[0], LINES[0]), "motors and\nforce sensor"),
    Block("controller.arm", (COLUMNS[0], LINES[2]), "kinematics,\ninertia (1), (20)"),
    Block("environment", (COLUMNS[1], LINES[3]), "what is\nrendered (21)"),
    Block("controller.tank", (COLUMNS[2], LINES[3]), "keeps it\npassive"),
    Block("controller.space.reserve", (COLUMNS[1], LINES[2]), "actuator satura-\ntion observer (14)"),
    Block("controller.transition", (COLUMNS[2], LINES[2]), "free or stiff\n(15)-(19)"),
    Block("controller.headroom", (COLUMNS[3], LINES[2]), "torque left\nto the posture"),
    Block("controller.motion", (COLUMNS[1], LINES[1]), "of the hand's\nmotion (12)"),
    Block("controller.contact", (COLUMNS[1], LINES[0]), "of its contact\n(13)"),
    Block("controller.places", (COLUMNS[3], LINES[0]), "postures that\nsuit a surface"),
    Block("controller.space", (COLUMNS[3], LINES[1]), "secondary torque\n(3), (6), (10)"),
    Block("controller.space.guard", (COLUMNS[4], LINES[1]), "joint limits"),
    Block("controller.resolution", (COLUMNS[4], LINES[2]), "force first,\nthen posture (2)"),
    Block("", (COLUMNS[4], LINES[3]), "motors"),
)
SENSORS, ARM, WORLD, TANK, OBSERVER, TRANSITION, HEADROOM = range(7)
MOTION, CONTACT, PLACES, SPACE, GUARD, RESOLUTION, MOTORS = range(7, 14)
ARROWS = (
    Arrow(SENSORS, ARM, "controller.arm.q"),
    Arrow(SENSORS, CONTACT, "controller.contact.follow", "force"),
    Arrow(ARM, WORLD, "controller.arm.position", "x"),
    Arrow(ARM, OBSERVER, "controller.arm.J"),
    Arrow(ARM, MOTION, "controller.arm.velocity"),
    Arrow(WORLD, TANK, "environment.energy", "U"),
    Arrow(TANK, OBSERVER, "controller.space.wanted", "$J^T F$"),
    Arrow(TANK, RESOLUTION, "controller.tank.share"),
    Arrow(OBSERVER, TRANSITION, "controller.reserve", "V"),
    Arrow(TRANSITION, HEADROOM, "controller.transition.turning"),
    Arrow(TRANSITION, SPACE, "controller.transition.omega", r"$\Omega$"),
    Arrow(MOTION, SPACE, "controller.space.motion", "$uu^T$", 0.4),
    Arrow(CONTACT, SPACE, "controller.space.contact", "$uu^T$", 0.4),
    Arrow(PLACES, SPACE, "controller.space.stiff", "posture"),
    Arrow(GUARD, SPACE, "controller.space.guard.floor"),
    Arrow(SPACE, HEADROOM, "controller.space.drive"),
    Arrow(SPACE, RESOLUTION, "controller.space.null", r"$\tau_N$"),
    Arrow(HEADROOM, RESOLUTION, "controller.headroom.part"),
    Arrow(RESOLUTION, TANK, "controller.alpha", r"$\alpha$", bend=0.13),
    Arrow(RESOLUTION, MOTORS, "controller.torque", r"$\tau$"),
)


@dataclass(frozen=True, slots=True)
class Interface:
    """What the block diagram shows: a controller and what it renders."""

    controller: ContactAware
    environment: Environment


@dataclass(frozen=True, slots=True)
class Posture:
    """The device in a posture.

    Attributes:
        q: of the motors, (n,) [rad].
        nodes: of the chain from its base to the handle, (n + 1, 2) [m].
        J: of the motors, (2, n); M: force ellipsoid, A: velocity ellipsoid, (2, 2).
    """

    q: Array
    nodes: Array
    J: Array
    M: Array
    A: Array


def postures(device: Device) -> dict[str, Posture]:
    """The device at home, and in the best postures for free motion and for contact at X0, by NAMES."""
    frames = [f"link_{i}" for i in range(1, device.arm.n + 1)]
    arms = [_arm(device, frame) for frame in (*frames, planar.HANDLE)]
    home = np.array(device.config.rhi.task.home)
    found = {}
    for name, q in zip(NAMES, (home, *(device.posture(stiff, SCAN) for stiff in (False, True))), strict=True):
        nodes = np.array([arm.at(q).position for arm in arms])
        J = device.arm.at(q).J.copy()
        M, A = (of(J, device.limit) for of in (force_ellipsoid, velocity_ellipsoid))
        found[name] = Posture(q, nodes, J, M, A)
    return found


def inverse(E: Array) -> Array:
    """Of an ellipsoid of forces the one of velocities, and the other way round, (m, m)."""
    return np.asarray(np.linalg.inv(E), float)


def half_axis(E: Array, u: Array) -> float:
    """Of an ellipsoid x^T E^-1 x = 1 with E (m, m), along one of its principal axes (m,)."""
    return float(np.sqrt(u @ E @ u))


def interface(device: Device) -> Interface:
    """The controller of a device, all of whose parts the block diagram shows.

    Raises:
        ExperimentError: it has a part that the diagram lacks.
    """
    found = Interface(*device.controller())
    if left := block_diagram.undrawn(found.controller, "controller", BLOCKS):
        raise ExperimentError(f"the block diagram lacks the controller's {', '.join(left)}; add to BLOCKS")
    return found


def run(progress: Progress) -> Outcome:
    """Compute what the three figures show."""
    progress("postures")
    device = Device()
    found, whole = postures(device), interface(device)
    rows = [*_task_rows(device, found), *_controller_rows(whole), *_device_rows(device, found)]
    figures = {
        "eigenvalues": {name: np.linalg.eigvalsh(each.M).tolist() for name, each in found.items()},
        "desired": [device.shape.minor, device.shape.major],
        "links_m": _lengths(found["home"].nodes).tolist(),
        "blocks": [block_diagram.name(whole, block) for block in BLOCKS if block.part],
        "signals": [block_diagram.text(whole, arrow) for arrow in ARROWS],
    }

    def draw(figure: Any) -> None:
        above, below = figure.subfigures(2, 1, height_ratios=(1.0, 1.0))
        left, right = above.subplots(1, 2)
        _draw_task(left, device)
        _draw_device(right, device, found)
        below.text(0.5, 0.97, "controller (fig. 5)", ha="center", fontsize="large")
        block_diagram.draw(below, whole, BLOCKS, ARROWS)

    return Outcome(rows, figures, draw, (9.0, 8.6))


def _task_rows(device: Device, found: dict[str, Posture]) -> list[Row]:
    u, across = _axes(device)
    rows = []
    for name, D in _desired(device).items():
        paper = "1.8 / 11.1" if name == "free" else "11.1 / 1.8"
        here = f"{half_axis(D, u):.1f} / {half_axis(D, across):.1f}"
        quantity = f"fig. 2: half axes of the desired force ellipsoid along / across u, {name} [N]"
        rows.append(Row(quantity, paper, here, "roots of 3.3 and 123"))
    products = [
        half_axis(D, e) * half_axis(inverse(D), e) for D in _desired(device).values() for e in (u, across)
    ]
    least, most = min(products), max(products)
    quantity = "fig. 2: half axis of force times that of velocity, same direction"
    rows.append(Row(quantity, "1", f"{least:.3f} to {most:.3f}", "inverse dimension of length"))
    for name in NAMES:
        low, high = np.sqrt(np.linalg.eigvalsh(found[name].M))
        along = 1.0 / np.sqrt(u @ found[name].A @ u)
        quantity = f"force ellipsoid of the device, {name}: half axes; its reach along u [N]"
        rows.append(Row(quantity, "-", f"{low:.2f}, {high:.2f}; {along:.2f}"))
    return rows


def _controller_rows(whole: Interface) -> list[Row]:
    parts = [block_diagram.name(whole, block) for block in BLOCKS if block.part]
    note = "drawn from the controller's attributes"
    return [Row("fig. 5: blocks / signals", "-", f"{len(parts)} / {len(ARROWS)}", note)]


def _device_rows(device: Device, found: dict[str, Posture]) -> list[Row]:
    arm, nodes = device.arm, found["home"].nodes
    hands = [found[name].nodes[-1] for name in NAMES[1:]]
    return [
        Row("fig. 8: motors / directions of the hand", "4 / 2", f"{arm.n} / {arm.m}"),
        Row("fig. 8: links [m]", _listed(LENGTHS), _listed(_lengths(nodes))),
        Row("fig. 8: torques of the motors [N m]", "3, 3, 1, 1", _listed(device.limit)),
        Row("fig. 8: hand in the postures free; stiff [m]", "0.5, 0.1", "; ".join(map(_listed, hands))),
    ]


def _arm(device: Device, frame: str) -> RedundantArm:
    motors = device.config.rhi.motors
    transmission, rotor = np.array(motors.transmission), np.array(motors.rotor_inertia)
    return RedundantArm(device.robot, frame, device.config.rhi.task.directions, transmission, rotor)


def _axes(device: Device) -> tuple[Array, Array]:
    """Along the task's direction, and across."""
    return device.u, np.array([-device.u[1], device.u[0]])


def _desired(device: Device) -> dict[str, Array]:
    uu = direction(device.u)
    return {"free": device.shape.free(uu), "stiff": device.shape.stiff(uu)}


def _lengths(nodes: Array) -> Array:
    lengths: Array = np.linalg.norm(np.diff(nodes, axis=0), axis=1)
    return lengths


def _listed(values: Sequence[float] | Array) -> str:
    return ", ".join(f"{value:.3f}".rstrip("0").rstrip(".") for value in values)


def _outline(centre: Array, E: Array, scale: float) -> Array:
    """Points of an ellipsoid x^T E^-1 x = 1 about a centre, (2, k) [m]."""
    values, vectors = np.linalg.eigh(E)
    circle = np.stack([np.cos(AT), np.sin(AT)])
    points: Array = centre[:, None] + scale * vectors @ (np.sqrt(values)[:, None] * circle)
    return points


def _draw_task(axes: Any, device: Device) -> None:
    """Fig. 2: a hand on its way to a wall, and what is asked of the ellipsoids there."""
    u, _ = _axes(device)
    desired = _desired(device)
    _draw_wall(axes, device, 0.12)
    start = device.centre - 1.3 * PATH[0] * u
    axes.annotate("", device.centre, start, arrowprops={"arrowstyle": "-|>", "color": "0.5"})
    largest = np.sqrt([device.shape.major, 1.0 / device.shape.minor])
    force, velocity = LONGEST / largest
    for k, before in enumerate(PATH):
        D = desired["free" if before else "stiff"]
        centre = device.centre - before * u
        names = ("desired force ellipsoid", "desired velocity ellipsoid") if k == 0 else ("_", "_")
        axes.plot(*_outline(centre, D, force), "-", color="tab:blue", label=names[0])
        axes.plot(*_outline(centre, inverse(D), velocity), "--", color="tab:orange", label=names[1])
    axes.set(title="task (fig. 2)", xlabel="x [m]", ylabel="y [m]", aspect="equal")
    axes.legend(fontsize=7, loc="lower left")


def _draw_device(axes: Any, device: Device, found: dict[str, Posture]) -> None:
    """Fig. 8: the device at home and in its two postures at the wall, with its force ellipsoids."""
    _draw_wall(axes, device, 0.25)
    largest = max(float(np.linalg.eigvalsh(each.M)[-1]) for each in found.values())
    for (name, each), line, colour in zip(
        found.items(), (":", "-", "--"), ("0.4", "tab:blue", "tab:red"), strict=True
    ):
        axes.plot(*each.nodes.T, line, marker="o", ms=3, color=colour, label=name)
        axes.plot(
            *_outline(each.nodes[-1], each.M, 2.0 * LONGEST / np.sqrt(largest)), line, lw=0.9, color=colour
        )
    for k, node in enumerate(found["free"].nodes[:-1], 1):
        axes.annotate(f"joint {k}", node, (4, 5), textcoords="offset points", fontsize=7)
    axes.set(title="device and its force ellipsoids (fig. 8)", xlabel="x [m]", ylabel="y [m]", aspect="equal")
    axes.legend(fontsize=7)


def _draw_wall(axes: Any, device: Device, reach: float) -> None:
    _, across = _axes(device)
    ends = np.array([device.centre - reach * across, device.centre + reach * across])
    axes.fill(*np.vstack([ends, ends[::-1] + 0.02 * device.u]).T, color="0.85")
    axes.text(*(ends[0] + 0.01 * device.u), "wall ", fontsize=7, ha="right", va="center")
