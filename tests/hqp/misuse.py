"""Random calls of the solver's Python interface, right and wrong ones, in a process that may crash.

    python misuse.py SEED CALLS

Ends with status 1 where a call raises anything but HqpError or the caller's own exception, or where what is
SOLVED is not the problem that was asked.
"""

import copy
import sys

import numpy as np
from hapticd.hqp import HqpError, Level, Solver, Status, solve
from hapticd.hqp.certificate import slack_norms

ODD_NUMBERS = (np.nan, np.inf, -np.inf, 1e200, -1e200, 1e-320, 0.0, 1e9)
ODD_INDICES = (-1, 99, 2**40, -(2**70), 1.5, None, "x")
PARTS = ("A", "b", "C", "lb", "ub")


class OfCallerError(Exception):
    """Raised inside an iterable: must come back as it is."""


def level(rng, n, rows):
    lb = rng.normal(size=rows[1]) - 1.0
    return Level(
        A=rng.normal(size=(rows[0], n)),
        b=rng.normal(size=rows[0]),
        C=rng.normal(size=(rows[1], n)),
        lb=lb,
        ub=lb + rng.exponential(size=rows[1]),
    )


def some_rows(rng):
    return [tuple(map(int, rng.integers(0, 4, size=2))) for _ in range(rng.integers(1, 5))]


def spoil_data(rng, levels):
    target = getattr(levels[rng.integers(len(levels))], PARTS[rng.integers(5)])
    if target.size:
        target.flat[rng.integers(target.size)] = ODD_NUMBERS[rng.integers(len(ODD_NUMBERS))]


def draw_data(rng, levels):
    for own in levels:
        own.A[:], own.b[:], own.C[:] = (rng.normal(size=a.shape) for a in (own.A, own.b, own.C))
        own.lb[:] = rng.normal(size=own.lb.shape)
        own.ub[:] = own.lb + rng.exponential(size=own.lb.shape)


def exchange(rng, levels):
    p = int(rng.integers(len(levels)))
    levels[p] = level(rng, levels[p].n, levels[p].rows)


def wrong_levels(rng, levels):
    """Something that is not a list of these levels."""
    broken = list(levels)
    p = int(rng.integers(len(levels)))
    n, rows = levels[p].n, levels[p].rows
    choice = int(rng.integers(7))
    if choice == 0:
        broken.append(levels[p])
    elif choice == 1:
        broken.pop()
    elif choice == 2:
        broken[p] = level(rng, n + 1, rows)
    elif choice == 3:
        broken[p] = level(rng, n, (rows[0] + 1, rows[1]))
    elif choice == 4:
        broken[p] = [None, 3, "level", np.eye(2)][rng.integers(4)]
    elif choice == 5:
        return [None, 5, "levels", {}, object()][rng.integers(5)]
    else:
        broken[p] = level(rng, n, rows)
        broken[p].b.dtype = np.int64
    return broken


def wrapped(rng, levels):
    """The levels in another iterable."""
    return [levels, tuple(levels), iter(levels), (own for own in levels), map(copy.copy, levels)][
        rng.integers(5)
    ]


def failing(levels):
    yield from levels[:-1]
    raise OfCallerError


def misbuild(rng):
    """A Level or a Solver of odd things."""
    odd = ODD_INDICES[rng.integers(len(ODD_INDICES))]
    A = rng.normal(size=(3, 3))
    arrays = (A.T, A[::2], A.astype(">f8"), A.astype(int), A.tolist(), A[0], np.ma.array(A, mask=A > 0), odd)
    if rng.random() < 0.5:
        Level(A=arrays[rng.integers(len(arrays))], b=np.zeros(3))
        raise AssertionError("an odd array was taken")
    wrong = ((odd, [(1, 0)]), (2, [(odd, 0)]), (2, odd), (2, [odd]), (1024, [(4096, 4096)] * 20))
    Solver(*wrong[rng.integers(len(wrong))])
    if odd != 99:
        raise AssertionError("an odd size was taken")


def judge(levels, solution):
    """What is SOLVED has the slack of the same problem solved on its own."""
    if solution.status is not Status.SOLVED:
        finite = all(np.isfinite(getattr(own, part)).all() for own in levels for part in PARTS)
        large = any(np.abs(getattr(own, part)).max(initial=0.0) > 1e8 for own in levels for part in PARTS)
        ordered = all((own.lb <= own.ub).all() for own in levels)
        assert not finite or large or not ordered, solution
        return
    assert not any(np.isnan(getattr(own, part)).any() for own in levels for part in PARTS)
    alone = solve([copy.deepcopy(own) for own in levels])
    norms, expected = slack_norms(levels, solution.x), slack_norms(levels, alone.x)
    if np.isfinite(expected).all():
        row = max(np.linalg.norm(np.vstack([own.A, own.C]), axis=1).max(initial=1.0) for own in levels)
        rounding = 1e-12 * row * (np.linalg.norm(solution.x) + np.linalg.norm(alone.x))
        assert np.all(np.abs(norms - expected) <= 1e-6 * (1.0 + expected) + rounding), (norms, expected)


def call(rng, solver, levels):
    """One call, mostly a right one."""
    choice = int(rng.integers(12))
    if choice == 0:
        solver.solve(wrong_levels(rng, levels))
        raise AssertionError("wrong levels were taken")
    if choice == 1:
        solver.resolve(levels, ODD_INDICES[rng.integers(len(ODD_INDICES))])
        raise AssertionError("an odd index was taken")
    if choice == 2:
        solver.solve(failing(levels))
    if choice == 3:
        (copy.copy, copy.deepcopy)[rng.integers(2)](solver)
        raise AssertionError("a solver was copied")
    if choice == 4:
        misbuild(rng)
        return
    if choice == 5:
        solver.reset()
        return
    if choice == 6:
        spoil_data(rng, levels)
    if choice in (7, 8):
        exchange(rng, levels)
    first = int(rng.integers(len(levels) + 1)) if choice == 8 else 0
    judge(levels, solver.resolve(wrapped(rng, levels), first))


def main(seed, calls):
    rng = np.random.default_rng(seed)
    done = refused = 0
    while done < calls:
        n, rows = int(rng.integers(1, 7)), some_rows(rng)
        solver, levels = Solver(n, rows), [level(rng, n, own) for own in rows]
        for _ in range(20):
            done += 1
            try:
                call(rng, solver, levels)
            except HqpError:
                refused += 1
            except OfCallerError:
                pass
            if rng.random() < 0.3:
                draw_data(rng, levels)
                solver.solve(levels)
    print(f"{done} calls, {refused} refused")


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
