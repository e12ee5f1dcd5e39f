"""Psychometric functions, and what answers tell of one."""

from __future__ import annotations

from dataclasses import dataclass
from math import exp

import numpy as np

from ...models import Array

THRESHOLDS, SCALES, LAPSES = 81, 11, (0.0, 0.02, 0.05)
"""Sizes of the grid of hypotheses, and the lapse rates in it."""
NARROWEST, WIDEST = 1.0 / 100.0, 1.0 / 3.0
"""Scales of the grid over the range of levels."""


@dataclass(frozen=True, slots=True)
class Psychometric:
    """How likely "yes" is at a level: guess + (1 - guess - lapse) / (1 + exp(-(x - threshold) / scale)).

    Attributes:
        threshold: level halfway between guess and 1 - lapse; scale: of the logistic there.
        guess: how likely "yes" is far below; lapse: how likely "no" is far above.
    """

    threshold: float
    scale: float
    guess: float = 0.0
    lapse: float = 0.0

    def probability(self, level: float) -> float:
        """Of "yes" at a level."""
        z = max(-500.0, min(500.0, (level - self.threshold) / self.scale))
        return self.guess + (1.0 - self.guess - self.lapse) / (1.0 + exp(-z))


class Posterior:
    """Probabilities of threshold, scale and lapse rate after answers, on a grid, from a flat prior."""

    def __init__(self, lower: float, upper: float, guess: float) -> None:
        """Thresholds lie between ``lower`` and ``upper``; the guess rate is known."""
        span = upper - lower
        self._threshold = np.linspace(lower, upper, THRESHOLDS)
        self._scale = span * np.geomspace(NARROWEST, WIDEST, SCALES)
        self._lapse, self._guess = np.array(LAPSES), guess
        self._log = np.zeros((THRESHOLDS, SCALES, len(LAPSES)))

    def yes(self, level: float) -> Array:
        """Probability of "yes" at a level under each hypothesis, (thresholds, scales, lapses)."""
        z = (level - self._threshold[:, None]) / self._scale
        core = 1.0 / (1.0 + np.exp(-np.clip(z, -500.0, 500.0)))
        p: Array = self._guess + (1.0 - self._guess - self._lapse) * core[..., None]
        return p

    def observe(self, level: float, yes: bool) -> None:
        """Take an answer."""
        p = self.yes(level)
        self._log += np.log(np.maximum(p if yes else 1.0 - p, 1e-12))

    @property
    def probabilities(self) -> Array:
        """Of the hypotheses, which sum up to 1."""
        weights = np.exp(self._log - self._log.max())
        p: Array = weights / weights.sum()
        return p

    def threshold(self) -> tuple[float, float]:
        """Mean and standard deviation."""
        p = self.probabilities.sum(axis=(1, 2))
        mean = float(p @ self._threshold)
        return mean, float(np.sqrt(max(0.0, p @ (self._threshold - mean) ** 2)))

    def scale(self) -> float:
        """Mean."""
        return float(self.probabilities.sum(axis=(0, 2)) @ self._scale)

    def expected_entropy(self, level: float) -> float:
        """Entropy that is left after an answer at a level, in the mean (QUEST+, (5) and (6))."""
        return _expected_entropy(self.probabilities, self.yes(level))


def _expected_entropy(p: Array, yes: Array) -> float:
    total = 0.0
    for likelihood in (yes, 1.0 - yes):
        joint = p * likelihood
        share = float(joint.sum())
        if share > 0.0:
            after = joint[joint > 0.0] / share
            total -= share * float(np.sum(after * np.log(after)))
    return total
