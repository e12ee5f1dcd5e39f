"""The judge of answers to quadratic programs refutes what is wrong, and C's proof does as well."""

import numpy as np
import pytest
from hapticd.hqp import UnboundedError, solve_qp
from hapticd.hqp._qp import is_proven
from hapticd.hqp.certificate_qp import contradiction, faults, ray_faults
from hapticd.hqp.generate_qp import infeasible_qp, qp_of, unbounded_qp

SEEDS = range(30)
NAMES = ("P", "q", "G", "h", "A", "b", "lb", "ub")


def proven(qp, found):
    return is_proven(*(qp[name] for name in NAMES), found.x, found._multipliers)


@pytest.mark.parametrize("kind", ["plain", "singular", "linear", "scaled", "degenerate"])
def test_an_answer_is_proven_and_no_answer_beside_it(kind):
    changed = 0
    for seed in SEEDS:
        qp = qp_of(kind, seed)
        found = solve_qp(**qp)
        assert max(faults(qp, found).values()) < 1e-8 and proven(qp, found), seed
        for i in np.flatnonzero(found._multipliers):
            multiplier = found._multipliers[i]
            for wrong in (-multiplier, 0.0, 1.001 * multiplier):
                found._multipliers[i] = wrong
                assert max(faults(qp, found).values()) > 1e-8 and not proven(qp, found), (seed, i)
                changed += 1
            found._multipliers[i] = multiplier
    assert changed > 100


def test_an_x_that_is_not_the_best_is_refuted():
    for seed in SEEDS:
        qp = qp_of("plain", seed)
        found = solve_qp(**qp)
        found.x = found.x + 1e-5 * np.random.default_rng(seed).normal(size=len(found.x))
        assert max(faults(qp, found).values()) > 1e-8 and not proven(qp, found), seed


def test_a_conflict_without_one_of_its_rows_is_none():
    for seed in SEEDS:
        qp = infeasible_qp(seed)
        conflict = solve_qp(**qp).conflict
        assert contradiction(qp, conflict)[0] < 1e-9
        for k in range(len(conflict)):
            left, bound = contradiction(qp, conflict[:k] + conflict[k + 1 :])
            assert left > 1e-9 or bound >= 0.0, (seed, k)


def test_a_ray_the_other_way_falls_nowhere():
    for seed in SEEDS:
        qp = unbounded_qp(seed)
        with pytest.raises(UnboundedError) as caught:
            solve_qp(**qp)
        assert ray_faults(qp, caught.value.ray)["slope"] < 0.0 < ray_faults(qp, -caught.value.ray)["slope"]


def test_a_proof_of_another_size_is_an_error():
    qp = qp_of("plain", 1)
    found = solve_qp(**qp)
    data = [qp[name] for name in NAMES]
    for x, multipliers in (
        (found.x[:-1], found._multipliers),
        (found.x, found._multipliers[1:]),
        (None, found.x),
    ):
        with pytest.raises(ValueError, match="sizes do not fit"):
            is_proven(*data, x, multipliers)
