"""Quantiles of the C histogram against numpy, and the bare C loop."""

import numpy as np
import pytest
from hapticd.runtime.timing.histogram import Histogram, Histograms, nanosleep_loop


@pytest.mark.parametrize("scale", [50.0, 5e3, 5e5, 5e8])
def test_quantiles_are_right_within_a_bucket(scale: float) -> None:
    rng = np.random.default_rng(3)
    values = np.round(rng.lognormal(0.0, 1.0, 20_000) * scale).astype(int)
    histogram = Histogram()
    for value in values:
        histogram.add(int(value))
    assert histogram.count == len(values)
    for q in (0.01, 0.5, 0.9, 0.99, 0.999):
        exact = np.sort(values)[int(np.ceil(q * len(values))) - 1] / 1e3
        assert exact <= histogram.quantile(q) * (1 + 1e-12)
        assert histogram.quantile(q) <= exact * 1.033 + 1e-3
    summary = histogram.summary()
    assert summary["max"] == values.max() / 1e3
    assert summary["mean"] == pytest.approx(values.mean() / 1e3, abs=0.1)


def test_an_empty_histogram_is_all_zero_and_negative_values_count_as_zero() -> None:
    histogram = Histogram()
    assert set(histogram.summary().values()) == {0.0}
    histogram.add(-5)
    assert histogram.count == 1
    assert histogram.quantile(0.5) == 0.0
    histogram.add(2**62)
    assert histogram.summary()["max"] == 2**62 / 1e3


def test_durations_that_come_together_go_to_a_histogram_each() -> None:
    rng = np.random.default_rng(4)
    rows = rng.integers(0, 2**32, (500, 5), dtype=np.uint32)
    together, alone = Histograms(5), [Histogram() for _ in range(5)]
    for row in rows:
        together.add(row.astype("<u4").tobytes())
        for histogram, ns in zip(alone, row.tolist(), strict=True):
            histogram.add(ns)
    assert [each.cells() for each in together.each] == [each.cells() for each in alone]
    assert [each.summary() for each in together.each] == [each.summary() for each in alone]
    for wrong in (b"", bytes(16), bytes(24)):
        with pytest.raises(ValueError, match="5 durations have 20"):
            together.add(wrong)


def test_the_bare_c_loop_counts_every_deadline() -> None:
    for period_ns in (1_000_000, 10_000, 100):  # the last cannot be held: nearly all are missed
        histogram, missed = nanosleep_loop(period_ns, 50)
        assert histogram.count + missed == 50
