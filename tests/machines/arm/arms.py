"""URDFs of arms: some by hand, with the oddities of files that people have, and random ones."""

from __future__ import annotations

import numpy as np

SPHERE = '<inertia ixx="{i:.6g}" ixy="0" ixz="0" iyy="{i:.6g}" iyz="0" izz="{i:.6g}"/>'


def link(name: str, mass: float, centre: str = "0 0 0", radius: float = 0.05) -> str:
    inertia = SPHERE.format(i=0.4 * mass * radius**2)
    return (
        f'<link name="{name}"><inertial><origin xyz="{centre}"/><mass value="{mass:.6g}"/>{inertia}'
        "</inertial>"
        f'<visual><geometry><mesh filename="package://arm/{name}.dae"/></geometry></visual></link>'
    )


def joint(
    name: str, kind: str, ends: tuple[str, str], xyz: str, axis: str, limit: str, rpy: str = "0 0 0"
) -> str:
    return (
        f'<joint name="{name}" type="{kind}"><origin xyz="{xyz}" rpy="{rpy}"/><parent link="{ends[0]}"/>'
        f'<child link="{ends[1]}"/><axis xyz="{axis}"/>{limit}</joint>'
    )


def robot(*parts: str, name: str = "an arm") -> str:
    return f'<?xml version="1.0"?>\n<robot name="{name}">{"".join(parts)}</robot>'


def limit(lower: float, upper: float, effort: float = 40.0, velocity: float = 3.0) -> str:
    return f'<limit lower="{lower:.6g}" upper="{upper:.6g}" effort="{effort:.6g}" velocity="{velocity:.6g}"/>'


def planar() -> str:
    """Three joints in a horizontal plane, the first without end and about -z."""
    return robot(
        '<link name="world"/>',
        link("base", 3.0),
        joint("mount", "fixed", ("world", "base"), "0 0 0.4", "1 0 0", ""),
        link("upper", 1.5, "0.2 0 0"),
        joint("q1", "continuous", ("base", "upper"), "0 0 0.1", "0 0 -1", limit(0, 0)),
        link("fore", 1.0, "0.15 0 0"),
        joint("q2", "revolute", ("upper", "fore"), "0.4 0 0", "0 0 1", limit(-2.6, 2.6)),
        link("hand", 0.4, "0.05 0 0"),
        joint("q3", "revolute", ("fore", "hand"), "0.3 0 0", "0 0 1", limit(-2.0, 2.0, 15.0)),
        '<link name="tcp"/>',
        joint("tool", "fixed", ("hand", "tcp"), "0.1 0 0", "1 0 0", ""),
    )


def scara() -> str:
    """Two turning joints, a sliding and a turning one."""
    return robot(
        '<link name="base"/>',
        link("inner", 6.0, "0.15 0 0"),
        joint("shoulder", "revolute", ("base", "inner"), "0 0 0.5", "0 0 1", limit(-2.4, 2.4, 120.0)),
        link("outer", 4.0, "0.12 0 0"),
        joint("elbow", "revolute", ("inner", "outer"), "0.35 0 0", "0 0 1", limit(-2.5, 2.5, 80.0)),
        link("quill", 1.5, "0 0 -0.1"),
        joint("lift", "prismatic", ("outer", "quill"), "0.3 0 0", "0 0 -1", limit(0.0, 0.3, 300.0, 1.0)),
        link("wrist", 0.5),
        joint("roll", "revolute", ("quill", "wrist"), "0 0 -0.2", "0 0 1", limit(-3.0, 3.0, 20.0)),
    )


def gripper() -> str:
    """Six joints; a gripper whose second finger follows the first, a massless flange, a camera."""
    reach = ("0 0 0.3", "0 0 0.1", "0.35 0 0", "0.3 0 0", "0 0 0.09", "0.08 0 0")
    axes = ("0 0 1", "0 1 0", "0 1 0", "0 1 0", "0 0 1", "1 0 0")
    parts = ['<link name="base"/>']
    before = "base"
    for i, (xyz, axis, mass) in enumerate(zip(reach, axes, (5, 6, 4, 2, 1.5, 0.8), strict=True), 1):
        parts.append(link(f"l{i}", mass, "0.03 0 0.02"))
        effort = 150.0 if i < 4 else 28.0
        parts.append(joint(f"l{i}", "revolute", (before, f"l{i}"), xyz, axis, limit(-2.9, 2.9, effort)))
        before = f"l{i}"
    parts += ['<link name="flange"/>', joint("f", "fixed", ("l6", "flange"), "0.05 0 0", "1 0 0", "")]
    parts += [link("camera", 0.2), joint("c", "fixed", ("l5", "camera"), "0 0.05 0", "1 0 0", "")]
    for side, way in (("left", 1), ("right", -1)):
        mimic = '<mimic joint="left"/>' if side == "right" else ""
        parts.append(link(f"{side}_finger", 0.05))
        ends = ("flange", f"{side}_finger")
        parts.append(joint(side, "prismatic", ends, "0.03 0 0", f"0 {way} 0", limit(0.01, 0.04, 10) + mimic))
    return robot(*parts)


def random_arm(seed: int) -> str:
    """Three to seven joints about or along any axes, with masses that get less and less."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 8))
    size, weight = rng.uniform(0.5, 1.5), rng.uniform(0.5, 2.0)
    parts, before = ['<link name="base"/>'], "base"
    slides = int(rng.integers(0, n)) if rng.random() < 0.3 else -1
    for i in range(n):
        share = 1.0 - i / (n + 1)
        axis = np.eye(3)[rng.integers(3)] * rng.choice([-1.0, 1.0])
        if rng.random() < 0.2:
            axis = rng.standard_normal(3)
            axis /= np.linalg.norm(axis)
        way = rng.standard_normal(3)
        way *= size * rng.uniform(0.15, 0.4) * share / np.linalg.norm(way)
        mass, middle = weight * 5.0 * share**2, 0.5 * way
        radius = rng.uniform(0.03, 0.08)
        parts.append(link(f"l{i}", mass, " ".join(map(repr, middle.tolist())), radius))
        kind, limits = "revolute", limit(*np.sort(rng.uniform((-3.0, 0.8), (-0.8, 3.0))), 0.0, 2.5)
        if i == slides:
            kind, limits = "prismatic", limit(-0.3, 0.3, 0.0, 1.0)
        rpy = " ".join(map(repr, rng.uniform(-np.pi, np.pi, 3).tolist()))
        place = " ".join(map(repr, (way if i else np.array([0.0, 0.0, 0.3])).tolist()))
        words = " ".join(map(repr, axis.tolist()))
        parts.append(joint(f"q{i}", kind, (before, f"l{i}"), place, words, limits, rpy))
        before = f"l{i}"
    return robot(*parts)
