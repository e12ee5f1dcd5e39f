"""Ordinary least squares with standard errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np

from ..models import Array


@dataclass(frozen=True, slots=True)
class Estimate:
    """A number with its standard error."""

    value: float
    error: float


@dataclass(frozen=True, slots=True)
class Fit:
    """Ordinary least squares: estimates, their standard errors, standard deviation of what is left."""

    values: Array
    errors: Array
    residual: float


def least_squares(columns: Sequence[Array], target: Array) -> Fit:
    """Of columns (k,) each to a target (k,).

    What is left of neighbouring samples is alike: errors count with as many as are independent.
    """
    A = np.column_stack(columns)
    scale = np.linalg.norm(A, axis=0)
    scale[scale == 0.0] = 1.0
    scaled, *_ = np.linalg.lstsq(A / scale, target, rcond=None)
    left = target - A / scale @ scaled
    free = len(target) - A.shape[1]
    variance = float(left @ left) / free
    alike = float(left[1:] @ left[:-1]) / max(float(left @ left), 1e-300)
    alike = min(max(alike, 0.0), 0.99)
    covariance = np.linalg.pinv((A / scale).T @ (A / scale)) * variance * (1.0 + alike) / (1.0 - alike)
    return Fit(scaled / scale, np.sqrt(np.diag(covariance)) / scale, sqrt(variance))
