"""Rows held by next to nothing: the optimum is known by construction, and nothing else is solved.

Feet that stand nearly in line: forces f >= 0 (level 1) with levers e around it, e as small as 1e-8, turn the
body by m = e . f + d . g, where g >= 0 are forces beside the line (level 2). The body is to turn the other
way, m = -c (level 3): the best is m = 0, with every force zero, though those in line are held there by c e
alone. That they are to be large (level 4) changes nothing.
"""

import numpy as np
import pytest
from hapticd.hqp import Level, Solver, Status, solve
from hapticd.hqp.certificate import slack_norms

IN_LINE, BESIDE, OTHERS = 4, 3, 5
N = 1 + IN_LINE + BESIDE + OTHERS


def standing(rng, lever):
    """The problem in coordinates turned at random, and its optimum; levers up to so much."""
    turn, _ = np.linalg.qr(rng.normal(size=(N, N)))
    one = np.eye(N)
    force, task = slice(1, 1 + IN_LINE + BESIDE), slice(N - OTHERS, N)
    levers = np.concatenate([lever * rng.uniform(0.2, 1.0, IN_LINE), rng.uniform(0.1, 0.3, BESIDE)])
    moment = one[0].copy()
    moment[force] = -levers
    wish, target = rng.uniform(0.1, 10.0), rng.normal(size=OTHERS)
    optimum = np.zeros(N)
    optimum[task] = target
    levels = [
        Level(C=one[force] @ turn, lb=np.zeros(IN_LINE + BESIDE), ub=np.full(IN_LINE + BESIDE, np.inf)),
        Level(A=moment[None] @ turn, b=np.zeros(1)),
        Level(A=np.vstack([one[0], one[task]]) @ turn, b=np.concatenate([[-wish], target])),
        Level(A=one[force][:IN_LINE] @ turn, b=rng.uniform(50.0, 300.0, IN_LINE)),
    ]
    return levels, turn.T @ optimum


@pytest.mark.parametrize("lever", [1e-2, 1e-5, 1e-6, 1e-7, 1e-8])
def test_what_is_held_by_next_to_nothing_is_held(lever):
    rng = np.random.default_rng(6)
    warm = Solver(N, [level.rows for level in standing(rng, lever)[0]])
    for _ in range(20):
        levels, optimum = standing(rng, lever)
        for solution in (solve(levels), warm.solve(levels)):
            assert solution.status is Status.SOLVED
            assert solution.x == pytest.approx(optimum, abs=1e-5)


@pytest.mark.parametrize("lever", [1e-9, 1e-10, 1e-12, 1e-14, 0.0])
def test_rows_that_are_one_row_by_their_rank_may_be_left_and_cost_next_to_nothing(lever):
    rng = np.random.default_rng(7)
    for _ in range(20):
        levels, optimum = standing(rng, lever)
        solution = solve(levels)
        assert solution.status is Status.SOLVED
        found, best = slack_norms(levels, solution.x), slack_norms(levels, optimum)
        loss = 1e-9 + lever * levels[3].b.sum()
        assert (found[:3] <= best[:3] + loss).all() and found[3] <= best[3] + 1e-6
