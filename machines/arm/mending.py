"""Masses where joints move none, inertias that bodies can have, and a handle in proportion."""

from __future__ import annotations

import numpy as np

from .description import GRIP_LENGTH, GRIP_RADIUS, HANDLE, Body, Description, Primitive
from .errors import InitError

LEAST_GYRATION = 0.005
"""sqrt(moment / mass) that any part has [m]."""
UNKNOWN_MASS, UNKNOWN_RADIUS = 0.1, 0.03
"""What is guessed of a link that a joint moves and that has no mass [kg, m]."""


def mend(arm: Description) -> None:
    """Give the arm masses where joints move none, inertias that bodies can have, and a handle in proportion.

    Raises:
        InitError: nothing has a mass.
    """
    if not any(body for body in arm.links.values()):
        why = "forces cannot be computed without <inertial> elements"
        raise InitError(f"{arm.source}: no link that moves has a mass; {why}")
    rigid: dict[str, list[str]] = {name: [] for name in arm.links}
    for joint in arm.frozen:
        rigid[joint.parent].append(joint.child)

    def has_mass(link: str) -> bool:
        return link == HANDLE or arm.links[link] is not None or any(map(has_mass, rigid[link]))

    for joint in arm.joints.values():
        if not has_mass(joint.child):
            moment = 0.4 * UNKNOWN_MASS * UNKNOWN_RADIUS**2
            arm.links[joint.child] = Body(UNKNOWN_MASS, np.zeros(3), moment * np.eye(3))
            arm.remarks.append(
                f"'{joint.child}' has no mass, and a joint moves it: guessed {UNKNOWN_MASS:g} kg"
            )
    for name, body in arm.links.items():
        if body is not None and (better := _possible(body)) is not None:
            arm.links[name] = better
            arm.remarks.append(f"the inertia of '{name}' belongs to no rigid body: the nearest one is taken")
    total = sum(body.mass for body in arm.links.values() if body)
    arm.handle = float(f"{min(max(0.05 * total, 0.02), 0.5):.2g}")
    mass, r, h = arm.handle, GRIP_RADIUS, GRIP_LENGTH
    across = mass * (3.0 * r * r + h * h) / 12.0
    centre = np.array([0.0, 0.0, -0.3 * h])
    arm.links[HANDLE] = Body(mass, centre, np.diag([across, across, mass * r * r / 2.0]))
    grip: dict[str, tuple[float, ...]] = {"radius": (r,), "length": (h,)}
    arm.shapes[HANDLE] = [Primitive("cylinder", grip, tuple(centre.tolist()), (0.0, 0.0, 0.0))]
    arm.remarks.append(
        f"a handle of {mass:g} kg on a force-torque sensor is put on the tip, along its z axis"
    )


def _possible(body: Body) -> Body | None:
    """The body with moments that a rigid one can have; None where they are."""
    moments, axes = np.linalg.eigh(body.inertia)
    least = body.mass * LEAST_GYRATION**2
    mended = np.maximum(moments, least)
    short = mended[2] - mended[0] - mended[1]
    if short > 0.0:
        mended[:2] += 0.51 * short
    if np.array_equal(mended, moments):
        return None
    return Body(body.mass, body.centre, axes @ np.diag(mended) @ axes.T)
