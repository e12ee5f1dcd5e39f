"""The exact force polytope as a criterion for postures, with a cone of directions around the wanted one.

The ellipsoid (9) is inscribed in the polytope of forces that the motors can hold and touches it only here and
there; f = min_i limit_i / |J^T u|_i is exact. It is also fragile: a posture may be strong along u and weak a
few degrees beside it, so what counts is the least f over a cone.
"""

from __future__ import annotations

import numpy as np

from ...models import Array
from .manipulability import velocity_ellipsoid
from .saturation import force_limit


def cone(u: Array, half_angle: float, count: int = 5) -> Array:
    """Directions of the plane, (count, 2), spread evenly over a cone around u (2,); half angle [rad]."""
    angles = np.linspace(-half_angle, half_angle, count)
    c, s = np.cos(angles), np.sin(angles)
    x, y = np.asarray(u, float) / np.linalg.norm(u)
    return np.stack([c * x - s * y, s * x + c * y], axis=1)


def worst_force(J: Array, limit: Array, directions: Array) -> Array:
    """Least force limit over directions (d, m), (...,) [N], for J (..., m, n)."""
    worst: Array = np.min([force_limit(J, limit, u) for u in directions], axis=0)
    return worst


class Polytope:
    """Cost log(1/f) of the least force over some directions, smoothed, with a bound on the conditioning.

    With rho_iu = |J^T u|_i / limit_i, 1/f is the largest rho; the p-norm over motors and directions stands
    for it. Beyond a condition number of A = J W^2 J^T the square of its excess (logarithmic) is added:
    without it the strongest posture is singular.
    """

    def __init__(
        self,
        limit: Array,
        directions: Array,
        worst_condition: float | Array = np.inf,
        sharpness: float = 24.0,
    ) -> None:
        """Limits (n,) [N m], directions (d, m), largest condition number (one for all, or (...,)), p."""
        self._limit, self._directions = limit, directions
        self._log_condition, self._p = np.log(worst_condition), sharpness

    def cost(self, J: Array) -> Array:
        """Cost (...,) of J (..., m, n)."""
        cost: Array = np.log(np.sum(np.abs(self._loads(J)) ** self._p, axis=(-1, -2))) / self._p
        excess, _ = self._excess(J)
        return cost + excess**2

    def gradient(self, J: Array, dJ: Array) -> Array:
        """Its derivative by q, (..., n), for dJ (..., n, m, n)."""
        load = self._loads(J)
        power = np.abs(load) ** self._p
        share = power / np.sum(power, axis=(-1, -2), keepdims=True)
        pull = share / np.where(load == 0.0, np.inf, load) / self._limit  # (..., d, n)
        weight = np.einsum("...di,da->...ai", pull, self._directions)
        excess, condition_slope = self._excess(J)
        weight += 2.0 * excess[..., None, None] * condition_slope
        gradient: Array = np.einsum("...ai,...kai->...k", weight, dJ)
        return gradient

    def _loads(self, J: Array) -> Array:
        """Signed rho, (..., d, n)."""
        loads: Array = np.einsum("da,...ai->...di", self._directions, J) / self._limit
        return loads

    def _excess(self, J: Array) -> tuple[Array, Array]:
        """Log of the condition number beyond its bound, (...,), and its derivative by J, (..., m, n)."""
        values, vectors = np.linalg.eigh(velocity_ellipsoid(J, self._limit))
        low, high = np.maximum(values[..., 0], 1e-300), values[..., -1]
        excess = np.maximum(np.log(high / low) - self._log_condition, 0.0)
        weighted = J / self._limit**2
        v_low, v_high = vectors[..., 0], vectors[..., -1]

        def slope(v: Array, value: Array) -> Array:
            row = np.einsum("...a,...ai->...i", v, weighted)
            return np.asarray(2.0 * v[..., :, None] * row[..., None, :] / value[..., None, None])

        return excess, slope(v_high, high) - slope(v_low, low)
