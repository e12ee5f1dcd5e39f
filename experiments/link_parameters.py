"""Base parameters of a chain's links: the combinations of masses, centres and moments that joints feel.

What the springs carry is linear in the ten inertial parameters of each link, torque = Y(q, qd, qdd) pi. Some
of them have no effect, others only together: the base parameters are those that remain (Gautier).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ..models import Array, Robot

SAMPLES = 60
"""Random states that tell which parameters have an effect."""
NOTHING = 1e-8
"""Part of the largest column below which one adds nothing."""
KINDS = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
"""Of a link, in its joint's frame, in the order of pinocchio."""


class Links:
    """A chain's regressor in its base parameters.

    Attributes:
        names: of the base parameters, by the first of those that each combines, (p,).
        believed: their values by the model, (p,).
    """

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        rng, n = np.random.default_rng(0), robot.nv
        states = rng.uniform(-np.pi, np.pi, (3, SAMPLES, n))
        whole = self._whole(*states)
        R = np.linalg.qr(whole, mode="r")
        diagonal = np.abs(np.diag(R))
        base = diagonal > NOTHING * diagonal.max()
        self._base = np.flatnonzero(base)
        # regrouped: the columns of the rest are combinations of those of the base
        combine = np.linalg.lstsq(whole[:, base], whole, rcond=None)[0]
        known = np.concatenate([each.toDynamicParameters() for each in robot.model.inertias[1:]])
        self.believed: Array = combine @ known
        self.names = [f"{KINDS[k % 10]} of {robot.names[k // 10]}" for k in self._base.tolist()]

    def rows(self, q: Array, qd: Array, qdd: Array) -> Array:
        """The regressor at places, speeds and accelerations (k, m): (k m, p)."""
        return self._whole(q, qd, qdd)[:, self._base]

    def _whole(self, q: Array, qd: Array, qdd: Array) -> Array:
        model, data, place = self._robot.model, self._robot.data, self._robot.configuration
        rows = [
            pin.computeJointTorqueRegressor(model, data, place(a), b, c).copy()
            for a, b, c in zip(q, qd, qdd, strict=True)
        ]
        return np.concatenate(rows)


@dataclass(frozen=True, slots=True)
class LinkFit:
    """What loads say of the links.

    Attributes:
        values, errors: base parameters and their standard errors, (p,) each.
        damping, dry: viscous and Coulomb friction behind the springs, (m,) each [N m s/rad, N m].
        before, after: RMS of what the believed and the identified model leave of each load, (m,) [N m or N].
        condition: number of the regressor.
        left: what the identified model leaves of the loads, (k, m); at: which ticks those are, (k,).
    """

    values: Array
    errors: Array
    damping: Array
    dry: Array
    before: Array
    after: Array
    condition: float
    left: Array
    at: NDArray[np.intp]


def fit_links(
    links: Links, q: Array, qd: Array, qdd: Array, load: Array, moving: Array, at: NDArray[np.intp]
) -> LinkFit:
    """Least squares over states and loads (K, m), each joint weighed by what is left of its own.

    ``moving``: speeds below which a joint's dry friction has no direction, (m,) [rad/s or m/s]; ``at``: the
    states that take part, (k,).
    """
    q, qd, qdd, load = (part[at] for part in (q, qd, qdd, load))
    k, m = q.shape
    Y = links.rows(q, qd, qdd)
    p = Y.shape[1]
    own = np.zeros((k, m, 3 * m))
    for i in range(m):
        own[:, i, 3 * i] = qd[:, i]
        own[:, i, 3 * i + 1] = np.tanh(qd[:, i] / moving[i])
        own[:, i, 3 * i + 2] = 1.0
    A, b = np.column_stack([Y, own.reshape(k * m, 3 * m)]), load.reshape(-1)
    scale = np.linalg.norm(A, axis=0)
    scale[scale == 0.0] = 1.0
    weight = np.ones(m)
    for _ in range(3):
        w = np.tile(weight, k)
        x = np.linalg.lstsq(A / scale * w[:, None], b * w, rcond=None)[0]
        left = (b - A / scale @ x).reshape(k, m)
        after = np.sqrt(np.mean(left**2, axis=0))
        weight = 1.0 / np.maximum(after, 1e-9)
    w = np.tile(weight, k)
    information = (A / scale * w[:, None]).T @ (A / scale * w[:, None])
    whitened = left * weight
    alike = float(np.clip(np.mean(whitened[1:] * whitened[:-1]), 0.0, 0.99))
    covariance = np.linalg.pinv(information) * (1.0 + alike) / (1.0 - alike)
    values, errors = x / scale, np.sqrt(np.diag(covariance)) / scale
    offsets = values[p:].reshape(m, 3)
    start = np.concatenate([links.believed, values[p:]])
    before = np.sqrt(np.mean((b - A @ start).reshape(k, m) ** 2, axis=0))
    unit = Y / np.linalg.norm(Y, axis=0)
    singular = np.linalg.svd(unit, compute_uv=False)
    number = float(singular[0] / singular[-1])
    friction = offsets[:, 0], offsets[:, 1]
    return LinkFit(values[:p], errors[:p], *friction, before, after, number, left, at)
