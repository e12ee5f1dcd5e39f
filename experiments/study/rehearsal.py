"""How well a design finds the threshold of an observer whose threshold is known."""

from __future__ import annotations

import numpy as np

from .protocol import Design
from .psychometric import Psychometric


def rehearse(design: Design, observer: Psychometric, runs: int) -> dict[str, float]:
    """Run the trials of so many participants with such an observer, without rendering anything.

    Returns mean, spread and bias of the thresholds found, the bias also over the threshold, and the mean
    number of trials.
    """
    thresholds, trials = [], []
    for seed in range(runs):
        course = design.course(seed, observer=observer)
        while course.next() is not None:
            course.take(course.simulate())
        found = course.found()
        thresholds.append(found["threshold"])
        trials.append(found["trials"])
    mean, spread = float(np.mean(thresholds)), float(np.std(thresholds))
    bias = mean - observer.threshold
    relative = {"relative_bias": bias / abs(observer.threshold)} if observer.threshold else {}
    return {"mean": mean, "spread": spread, "bias": bias, **relative, "trials": float(np.mean(trials))}
