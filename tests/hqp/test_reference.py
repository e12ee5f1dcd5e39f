import numpy as np
import pytest
from hapticd.hqp import solve
from hapticd.hqp.certificate import slack_norms
from hapticd.hqp.generate import KINDS, OF_ROUNDING, problem
from hapticd.hqp.reference import QpError, first_mismatch, reference

# the cascade's own accuracy is too low for these
ROUNDED = {kind.__name__ for kind in OF_ROUNDING}
BEYOND = {"nearly_parallel", "badly_scaled", "rank_deficient", "boxes_meeting_cones", *ROUNDED}


def test_a_mismatch_is_absolute_for_small_norms_and_relative_for_large_ones():
    expected = np.array([0.0, 100.0])
    assert first_mismatch(np.array([1e-7, 100.0]), expected, 1e-6) is None
    assert first_mismatch(np.array([0.0, 100.0 + 1e-5]), expected, 1e-6) is None
    assert first_mismatch(np.array([1e-5, 200.0]), expected, 1e-6) == 0


@pytest.mark.parametrize("kind", sorted(KINDS.keys() - BEYOND))
def test_the_cascade_finds_the_same_slacks(kind):
    for seed in range(12):
        levels = problem(kind, seed, n=2 + seed, levels=1 + seed % 5)
        norms = slack_norms(levels, solve(levels).x)
        assert first_mismatch(norms, slack_norms(levels, reference(levels)), 1e-6) is None, seed


def test_the_cascade_agrees_where_quadprog_does_not_take_a_vertex_of_many_rows_for_inconsistent():
    agreed = 0
    for seed in range(12):
        levels = problem("boxes_meeting_cones", seed, n=10, levels=4)
        norms = slack_norms(levels, solve(levels).x)
        try:
            expected = slack_norms(levels, reference(levels))
        except QpError:
            continue
        assert first_mismatch(norms, expected, 1e-6) is None, seed
        agreed += 1
    assert agreed >= 5
