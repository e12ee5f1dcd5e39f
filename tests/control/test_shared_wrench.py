"""Shares of the operator's wrench."""

import numpy as np
from hapticd.control.shared_wrench import SharedWrench


def test_both_shares_are_products_to_the_bit() -> None:
    shared, rng = SharedWrench(), np.random.default_rng(2)
    for wrench in (rng.standard_normal(6), np.array([np.inf, -0.0, 0.0, 1e-310, np.nan, 3.0])):
        for felt, held in ((0.3, 1.0), (1.0, 0.7), (0.0, 0.0)):
            shared.take(wrench, felt, held)
            with np.errstate(invalid="ignore"):
                expected = felt * wrench, held * wrench
            np.testing.assert_array_equal(shared.felt, expected[0])
            np.testing.assert_array_equal(shared.held, expected[1])
