"""Whether gains, springs and dampers are slow enough for the period at which they are computed."""

from __future__ import annotations

import numpy as np

from ...models import Array


def fastest(inverse_inertia: Array, gains: Array) -> float:
    """Largest eigenvalue of M^-1 K for a diagonal K: stiffness gives [1/s^2], damping [1/s].

    Args:
        inverse_inertia: symmetric, (n, n).
        gains: the diagonal, not negative, (n,).
    """
    root = np.sqrt(gains)
    return float(np.linalg.eigvalsh(root[:, None] * inverse_inertia * root)[-1])


def integrates(stiffness: float, damping: float, h: float) -> bool:
    """Whether symplectic Euler with steps h [s] is stable for the fastest mode.

    v += -h (k x + d v), x += h v has the characteristic polynomial z^2 - (2 - h d - h^2 k) z + 1 - h d, whose
    roots lie in the unit circle where h^2 k + 2 h d < 4 (Jury).

    Args:
        stiffness: k over inertia [1/s^2].
        damping: d over inertia [1/s].
        h: [s].
    """
    return h * h * stiffness + 2.0 * h * damping < 4.0


def controls(stiffness: float, damping: float, dt: float) -> bool:
    """Whether a sampled spring and damper act slower than the period dt [s] in which nothing reacts.

    A damper that reaches the machine one period late has z^2 - z + dt d = 0: stable where dt d < 1.

    Args:
        stiffness: k over inertia [1/s^2].
        damping: d over inertia [1/s].
        dt: [s].
    """
    return dt * damping < 1.0 and dt * dt * stiffness < 1.0


def steady(stiffness: float, damping: float, spring: float, dt: float) -> bool:
    """Whether a motor behind a spring comes to rest whose position and speed are held a period late.

    Until the next period x swings about u_k / K, with u_k = -k x_(k-1) - d v_(k-1). Of what rubs nothing is
    counted on.

    Args:
        stiffness: k over inertia [1/s^2].
        damping: d over inertia [1/s].
        spring: K over inertia, 0 for none [1/s^2].
        dt: [s].
    """
    turn = np.sqrt(spring) * dt
    fall = dt * np.sinc(turn / np.pi)  # sin(turn) / sqrt(K)
    free = [[np.cos(turn), fall], [-spring * fall, np.cos(turn)]]
    held = np.outer([0.5 * (dt * np.sinc(0.5 * turn / np.pi)) ** 2, fall], [-stiffness, -damping])
    period = np.block([[np.array(free), held], [np.eye(2), np.zeros((2, 2))]])
    return bool(np.abs(np.linalg.eigvals(period)).max() < 1.0)
