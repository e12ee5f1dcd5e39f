from itertools import pairwise

import numpy as np
import pytest
from hapticd.view.decimate import Decimator


@pytest.mark.parametrize("ticks", [1, 7, 8, 9, 63, 64, 1000, 4097])
def test_no_peak_is_lost_and_means_are_of_the_ticks_of_their_column(ticks: int) -> None:
    rows = np.random.default_rng(ticks).normal(size=(ticks, 3))
    found = Decimator(3, 8)
    for tick, row in enumerate(rows):
        found.add(100 + tick, row)
    assert found.count <= 8
    assert found.ticks[0] == 100
    bounds = [*(found.ticks.astype(int) - 100), ticks]
    for column, (begin, end) in enumerate(pairwise(bounds)):
        part = rows[begin:end]
        np.testing.assert_array_equal(found.low[column], part.min(axis=0))
        np.testing.assert_array_equal(found.high[column], part.max(axis=0))
        np.testing.assert_allclose(found.mean[column], part.mean(axis=0), rtol=0, atol=1e-12)


@pytest.mark.parametrize("columns", [0, 1, 7])
def test_columns_that_cannot_be_halved(columns: int) -> None:
    with pytest.raises(ValueError, match="even number"):
        Decimator(1, columns)
