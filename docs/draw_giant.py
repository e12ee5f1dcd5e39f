"""Draws docs/giant.png: the simulated giant and the walk of the default run, from its URDF and configuration.

./setup.sh plot && .venv/bin/python docs/draw_giant.py
"""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import pinocchio as pin
from hapticd.models import Robot
from hapticd.runtime.configuration import config
from hapticd.sim.hand import Path as HandPath
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

LIGHT = np.array([0.35, -0.5, 0.8]) / np.linalg.norm([0.35, -0.5, 0.8])
FLOOR = -2.05


def box(size: np.ndarray) -> list[np.ndarray]:
    """Faces of a box about the origin."""
    corner = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * size / 2
    return [
        corner[list(face)]
        for face in ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    ]


def cylinder(radius: float, half: float, sides: int = 28) -> list[np.ndarray]:
    """Faces of a cylinder about the origin, along z."""
    angle = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    ring = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(sides)])
    shift = np.array([0, 0, half])
    low, high = ring - shift, ring + shift
    sides_faces = [np.array([low[i], low[i - 1], high[i - 1], high[i]]) for i in range(sides)]
    return [*sides_faces, low[::-1], high]


def main() -> None:
    """Write the picture beside this file."""
    loaded = config.load("giant")
    robot = Robot.from_urdf(loaded.model_text, loaded.model_source)
    simulation = loaded.config.simulation
    assert simulation is not None
    q = np.array([*simulation.giant.ppu, *simulation.giant.posture])
    geometry = pin.buildGeomFromUrdfString(robot.model, loaded.model_text, pin.GeometryType.VISUAL, None)
    data = pin.GeometryData(geometry)
    pin.updateGeometryPlacements(robot.model, robot.data, geometry, data, robot.configuration(q))

    figure = plt.figure(figsize=(9, 5.4))
    axes = figure.add_axes((-0.3, -0.5, 1.6, 2.0), projection="3d", computed_zorder=False)
    faces, colours = [], []
    for shape, placement in zip(geometry.geometryObjects, data.oMg, strict=True):
        form = shape.geometry
        polygons = (
            box(2 * form.halfSide) if hasattr(form, "halfSide") else cylinder(form.radius, form.halfLength)
        )
        for polygon in polygons:
            points = polygon @ placement.rotation.T + placement.translation
            normal = np.cross(points[1] - points[0], points[2] - points[1])
            shade = 0.55 + 0.45 * abs(normal @ LIGHT) / (np.linalg.norm(normal) + 1e-12)
            faces.append(points)
            colours.append([*(shade * np.array(shape.meshColor[:3])), 1.0])
    axes.add_collection3d(Poly3DCollection(faces, facecolors=colours, edgecolors="none", zorder=2))

    hand = simulation.hand.path
    path = HandPath([p.at for p in hand], np.array([[*p.position, *p.angles] for p in hand]))
    walk = np.array([path.at(t)[0][:3] for t in np.linspace(0, hand[-1].at, 900)])
    axes.plot(*walk.T, color="#1f77b4", lw=1.6, zorder=3)
    axes.plot(walk[:, 0], walk[:, 1], FLOOR, color="#1f77b4", lw=0.8, alpha=0.5, zorder=1)
    x, y = 2.35, 2.75
    floor = np.array([[-x, -y, FLOOR], [x, -y, FLOOR], [x, y, FLOOR], [-x, y, FLOOR]])
    axes.add_collection3d(Poly3DCollection([floor], facecolors=[(0.95, 0.95, 0.96, 1.0)], zorder=0))

    axes.set_box_aspect((2 * x, 2 * y, 2.8), zoom=0.78)
    axes.set_xlim(-x, x), axes.set_ylim(-y, y), axes.set_zlim(FLOOR, 0.75)
    axes.view_init(elev=15, azim=-72)
    axes.set_axis_off()
    figure.savefig(Path(__file__).with_name("giant.png"), dpi=110)


if __name__ == "__main__":
    main()
