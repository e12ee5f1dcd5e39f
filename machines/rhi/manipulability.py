"""Force and velocity ellipsoids, and the Stein divergence that compares them (ContactAware, III-A).

Everything takes stacks: J is (..., m, n), the results have the same leading dimensions. ``csrc/nullspace.c``
computes the same for one posture a tick.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...models import Array


def velocity_ellipsoid(J: Array, limit: Array) -> Array:
    """A = J W^2 J^T with W = diag(1/limit), (..., m, m): the inverse of the force ellipsoid (9).

    Args:
        J: (..., m, n).
        limit: largest torques, (n,) [N m].
    """
    weighted = J / limit
    A: Array = weighted @ np.swapaxes(weighted, -1, -2)
    return A


def force_ellipsoid(J: Array, limit: Array) -> Array:
    """M = (J W W J^T)^-1, (..., m, m), ContactAware, (9).

    Raises:
        numpy.linalg.LinAlgError: J has not full rank.
    """
    M: Array = np.asarray(np.linalg.inv(velocity_ellipsoid(J, limit)), float)
    return M


def stein(A: Array, B: Array) -> Array:
    """Divergence v = logdet((A + B)/2) - logdet(A B)/2 of positive definite matrices, ContactAware, (10).

    It does not change when both are inverted, so velocity ellipsoids may stand for force ellipsoids.
    """
    v: Array = _logdet((A + B) / 2.0) - 0.5 * (_logdet(A) + _logdet(B))
    return v


def stein_gradient(J: Array, dJ: Array, limit: Array, B: Array) -> Array:
    """Derivative of ``stein(velocity_ellipsoid(J), B)`` by each q_k, (..., n).

    dv/dq_k = tr(G dA_k), G = (A + B)^-1 - A^-1 / 2, dA_k = dJ_k W^2 J^T + J W^2 dJ_k^T.

    Args:
        J: (..., m, n).
        dJ: its derivatives by q_k, (..., n, m, n).
        limit: (n,) [N m].
        B: inverse of the desired force ellipsoid, (m, m).
    """
    A = velocity_ellipsoid(J, limit)
    G = np.linalg.inv(A + B) - 0.5 * np.linalg.inv(A)
    gradient: Array = 2.0 * np.einsum("...ai,...kai->...k", G @ J / limit**2, dJ)
    return gradient


def _logdet(A: Array) -> Array:
    value: Array = np.linalg.slogdet(A)[1]
    return value


@dataclass(frozen=True, slots=True)
class Shape:
    """Eigenvalues of the desired force ellipsoids (12), (13).

    Attributes:
        major: K; minor: zeta [1/m^2].
    """

    major: float
    minor: float

    @classmethod
    def of_home(cls, M0: Array, mu: float) -> Shape:
        """K = mu lambda_max, zeta = lambda_min / mu of the force ellipsoid M0 (m, m) in the home posture."""
        eigenvalues = np.linalg.eigvalsh(M0)
        return cls(float(mu * eigenvalues[-1]), float(eigenvalues[0] / mu))

    def free(self, motion: Array) -> Array:
        """D_free, (m, m), for u u^T of the direction of motion: (12), U diag(zeta, K, ...) U^T."""
        D: Array = self.major * np.eye(len(motion)) - (self.major - self.minor) * motion
        return D

    def stiff(self, contact: Array) -> Array:
        """D_stiff, (m, m), for u u^T of the environment's force: (13), U diag(K, zeta, ...) U^T."""
        D: Array = self.minor * np.eye(len(contact)) + (self.major - self.minor) * contact
        return D


def direction(u: Array) -> Array:
    """The projector u u^T, (m, m), on a direction (m,) of any length but zero."""
    unit = np.asarray(u, float) / np.linalg.norm(u)
    return np.outer(unit, unit)
