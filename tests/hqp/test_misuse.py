"""What a caller may get wrong: each mistake is a typed error or harmless, never a crash or another answer."""

import copy
import itertools
import pickle
import re
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from hapticd.binding.bind import BindError
from hapticd.hqp import (
    HqpError,
    Level,
    Solver,
    Status,
    UnboundedError,
    conflicts,
    multipliers,
    solve,
    solve_qp,
)
from hapticd.hqp.certificate import certificate
from hapticd.hqp.generate import problem
from scipy.sparse import csr_array

FUZZ = Path(__file__).with_name("misuse.py")


class Tagged(np.ndarray):
    """A subclass that adds nothing."""


def wish(*b):
    return Level(A=np.eye(len(b)), b=np.array(b, dtype=float))


def solver_of(*levels):
    return Solver(levels[0].n, [level.rows for level in levels])


def in_thread(work):
    """The exception that `work` ends with in another thread, or None."""
    found = []

    def run():
        try:
            found.append(work())
        except Exception as error:
            found.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    return found[0]


@pytest.mark.parametrize(
    "kind", [iter, tuple, list, lambda v: (level for level in v), lambda v: dict(enumerate(v)).values()]
)
def test_any_iterable_of_levels_is_solved_on_a_fresh_and_on_a_used_solver(kind):
    first, second = [wish(1.0, 2.0), wish(0.0, 0.0)], [wish(5.0, 6.0), wish(0.0, 0.0)]
    solver = solver_of(*first)
    assert np.allclose(solver.solve(kind(first)).x, [1.0, 2.0])
    assert np.allclose(solver.solve(kind(second)).x, [5.0, 6.0])
    assert np.allclose(solver.resolve(kind(first), 1).x, [1.0, 2.0])
    assert np.allclose(solve(kind(second)).x, [5.0, 6.0])


@pytest.mark.parametrize(
    "levels", [None, 3, "levels", [1, 2], [None, None], {"A": 1, "b": 2}, object(), np.eye(2)]
)
def test_what_are_no_levels_is_refused(levels):
    solver = solver_of(wish(1.0), wish(0.0))
    for ask in (solver.solve, solve, lambda v: solver.resolve(v, 1)):
        with pytest.raises(HqpError):
            ask(levels)


def test_an_endless_iterable_is_refused():
    level = wish(1.0)
    with pytest.raises(HqpError, match="made for"):
        solver_of(level).solve(itertools.repeat(level))
    with pytest.raises(HqpError):
        solve(itertools.repeat(level))
    with pytest.raises(HqpError):
        Solver(1, itertools.repeat((1, 0)))


def test_an_exception_on_the_way_leaves_the_solver_as_it_was():
    def half():
        yield wish(9.0)
        raise RuntimeError("lost")

    levels = [wish(1.0), wish(0.0)]
    solver = solver_of(*levels)
    solver.solve(levels)
    with pytest.raises(RuntimeError, match="lost"):
        solver.solve(half())
    with pytest.raises(HqpError, match="made for"):
        solver.solve([wish(9.0), wish(0.0, 0.0)])
    assert solver.solution.x == [1.0] and solver.resolve(levels, 2).x == [1.0]
    assert solver.solve(levels).x == [1.0]


def test_a_level_exchanged_in_the_list_of_the_last_call_is_noticed():
    levels = [wish(1.0, 1.0), wish(0.0, 0.0)]
    solver = solver_of(*levels)
    solver.solve(levels)
    levels[0] = wish(7.0, 7.0)
    assert np.allclose(solver.solve(levels).x, 7.0)
    levels[0] = wish(8.0, 8.0)
    assert np.allclose(solver.resolve(levels, 2).x, 8.0)
    levels.append(levels[0])
    with pytest.raises(HqpError, match="made for"):
        solver.solve(levels)
    levels[:] = levels[:1]
    with pytest.raises(HqpError, match="made for"):
        solver.solve(levels)


def test_a_list_filled_again_is_solved_again():
    levels = [wish(1.0)]
    solver = solver_of(*levels)
    for value in range(20):  # a Level that is gone may leave its address to the next
        levels.clear()
        levels.append(wish(float(value)))
        assert solver.solve(levels).x == [value]


@pytest.mark.parametrize("first", [-1, 3, 99, 2**40, -(2**70), 1.0, "1", None])
def test_a_first_changed_level_out_of_range_is_refused(first):
    levels = [wish(1.0), wish(0.0)]
    solver = solver_of(*levels)
    solver.solve(levels)
    with pytest.raises(HqpError, match="first_changed_level"):
        solver.resolve(levels, first)
    assert solver.resolve(levels, np.int64(2)).x == [1.0]


@pytest.mark.parametrize("duplicate", [copy.copy, copy.deepcopy, pickle.dumps])
def test_solvers_and_solutions_are_not_copied_and_levels_are(duplicate):
    levels = [wish(1.0)]
    solver = solver_of(*levels)
    solution = solver.solve(levels)
    for own in (solver, solution):
        with pytest.raises(HqpError, match=r"cannot be copied|a view"):
            duplicate(own)
    twin = copy.deepcopy(levels) if duplicate is not pickle.dumps else pickle.loads(pickle.dumps(levels))
    twin[0].b[0] = 4.0
    assert solver.solve(levels).x == [1.0] and solver.solve(twin).x == [4.0]


def test_an_error_comes_whole_out_of_another_process():
    with pytest.raises(HqpError) as refused:
        Level(A=np.eye(2))
    with pytest.raises(BindError) as unfit:
        raise BindError("solver.x", "has 2 entries", "3")
    with pytest.raises(UnboundedError) as unbounded:
        solve_qp(np.zeros((2, 2)), np.ones(2))
    for error in (refused.value, unfit.value, unbounded.value):
        again = pickle.loads(pickle.dumps(error))
        assert type(again) is type(error) and str(again) == str(error)
        assert again.__dict__.keys() == error.__dict__.keys()


def test_what_the_solver_owns_cannot_be_exchanged():
    levels = [wish(1.0, 2.0)]
    solver = solver_of(*levels)
    solution = solver.solve(levels)
    for owner, name in (
        (solution, "x"),
        (solution, "w"),
        (solution, "status"),
        (solver, "n"),
        (solver, "rows"),
    ):
        with pytest.raises(AttributeError):
            setattr(owner, name, None)
        with pytest.raises(AttributeError):
            delattr(owner, name)
    with pytest.raises(ValueError, match="resize"):
        solution.x.resize(1 << 20, refcheck=False)
    assert isinstance(solution.w, tuple)


def test_a_solver_belongs_to_the_thread_that_uses_it_until_it_is_handed_over():
    levels = [wish(1.0)]
    solver = solver_of(*levels)
    assert in_thread(lambda: solver.solve(levels).x.tolist()) == [1.0]
    # the identity of a thread that ended may come again, so keep one waiting
    done, go = threading.Event(), threading.Event()
    owner = threading.Thread(target=lambda: (solver.reset(), solver.solve(levels), done.set(), go.wait(10)))
    owner.start()
    done.wait(10)
    with pytest.raises(HqpError, match="another thread"):
        solver.solve(levels)
    with pytest.raises(HqpError, match="another thread"):
        solver.resolve(levels, 0)
    solver.reset()
    assert solver.solve(levels).x == [1.0]
    go.set()
    owner.join()


def test_two_threads_on_one_solver_get_right_answers_or_an_error():
    own = [problem("dense", seed, n=40, levels=5) for seed in (1, 1)]
    for level in own[1]:
        level.b[:] += 1.0
    expected = [solve(levels).x.copy() for levels in own]
    solver = solver_of(*own[0])
    refused, wrong, go = [0, 0], [0, 0], threading.Barrier(2)

    def work(k):
        go.wait(10)
        for _ in range(300):
            try:
                solver.reset()
                wrong[k] += not np.array_equal(solver.solve(own[k]).x.copy(), expected[k])
            except HqpError:
                refused[k] += 1

    threads = [threading.Thread(target=work, args=(k,)) for k in (0, 1)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sum(refused) > 0 and not any(wrong)


def test_a_solver_that_solves_within_its_own_iterable_is_refused():
    levels = [wish(1.0)]
    solver = solver_of(*levels)

    def nested():
        solver.solve(levels)
        yield levels[0]

    with pytest.raises(HqpError, match="middle of a call"):
        solver.solve(nested())
    assert solver.solve(levels).x == [1.0]


@pytest.mark.parametrize(
    "spoil",
    [
        lambda a: a.astype(np.float32),
        lambda a: a.astype(int),
        lambda a: a.astype(">f8"),
        lambda a: a.astype(complex),
        lambda a: a.astype(object),
        lambda a: a.tolist(),
        lambda a: np.asfortranarray(np.vstack([a, a]))[: len(a)],
        lambda a: np.repeat(a, 2, axis=-1)[..., ::2],
        lambda a: np.broadcast_to(a[:1, :1], a.shape),
        lambda a: np.ma.masked_array(a, mask=a == 1.0),
        lambda a: np.frombuffer(b"\0" + a.tobytes(), dtype="u1")[1:].view(float).reshape(a.shape),
    ],
)
def test_an_array_of_another_type_order_or_alignment_is_refused(spoil):
    with pytest.raises(HqpError, match="A "):
        Level(A=spoil(np.eye(3)), b=np.zeros(3))


def test_subclasses_and_read_only_arrays_are_read_as_they_are(tmp_path):
    A = np.memmap(tmp_path / "A", dtype=float, mode="w+", shape=(2, 2))
    A[:] = [[2.0, 0.0], [0.0, 4.0]]
    b = np.array([1.0, 2.0])
    b.flags.writeable = False
    levels = [Level(A=A, b=b), Level(A=np.eye(2).view(Tagged), b=np.zeros(2))]
    solver = solver_of(*levels)
    assert np.allclose(solver.solve(levels).x, 0.5)
    A *= 0.5
    assert np.allclose(solver.solve(levels).x, 1.0)


def test_an_array_reshaped_behind_its_level_is_refused_when_bound_and_cannot_be_resized_afterwards():
    level = wish(1.0, 2.0)
    solver = solver_of(level)
    level.A.shape = (1, 4)
    with pytest.raises(HqpError, match="2 columns and A has 4"):
        solver.solve([level])
    level.A.shape = (2, 2)
    level.b.dtype = np.complex128
    with pytest.raises(HqpError, match="complex"):
        solver.solve([level])
    level.b.dtype = np.float64
    view = Level(A=np.eye(4)[1:3], b=level.b)
    for held in (level, view):
        solver = solver_of(held)
        solver.solve([held])
        owner = held.A if held.A.base is None else held.A.base
        with pytest.raises(ValueError, match="resize"):
            owner.resize((1 << 12, 1 << 8), refcheck=False)


def test_arrays_that_nobody_else_keeps_stay_in_memory():
    solver = solver_of(wish(1.0, 2.0))
    solver.solve([wish(1.0, 2.0)])
    level = wish(3.0, 4.0)
    levels = [level]
    solver.solve(levels)
    object.__setattr__(level, "b", np.array([0.0, 0.0]))
    rubbish = [np.full(2, 7e7) for _ in range(1000)]
    assert np.allclose(solver.solve(levels).x, [3.0, 4.0]) and len(rubbish) == 1000


@pytest.mark.parametrize(
    "arguments",
    [
        (0, [(1, 0)]),
        (-1, [(1, 0)]),
        (2**31, [(1, 0)]),
        (2**70, [(1, 0)]),
        (2.0, [(1, 0)]),
        ("2", [(1, 0)]),
        (None, [(1, 0)]),
        (2, None),
        (2, 3),
        (2, [1, 2]),
        (2, [(1, 2, 3)]),
        (2, [(2**31, 0)]),
        (2, [(2**70, 0)]),
        (2, [(1.0, 0)]),
        (True, [(1, 0)]),
        (2, [("a", "b")]),
        (1024, [(4096, 4096)] * 256),
        (1024, [(4096, 4096)] * 9),
    ],
)
def test_a_size_of_another_type_or_beyond_memory_is_refused(arguments):
    with pytest.raises(HqpError, match="take n in"):
        Solver(*arguments)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ((2.0, [(1, 0)]), "n is 2.0, not"),
        ((True, [(1, 0)]), "n is True, not"),
        ((2, [(1, 0), (1.0, 0)]), "level 1: equalities is 1.0, not"),
        ((2, [(1, None)]), "level 0: inequalities is None, not"),
        ((2, [(1, 2, 3)]), "rows are not pairs"),
        ((2, 3), "rows are not pairs"),
    ],
)
def test_what_is_wrong_with_a_size_is_named(arguments, named):
    with pytest.raises(HqpError, match=f"^{named}"):
        Solver(*arguments)


@pytest.mark.parametrize(
    "setting",
    [
        {"feasibility": np.nan},
        {"rank": "1e-9"},
        {"rounding": None},
        {"rounding": np.inf},
        {"max_iterations": 2**40},
        {"max_iterations": 1.5},
        {"max_iterations": True},
        {"rank": True},
        {"max_iterations": -1},
        {"time_limit": -1.0},
        {"time_limit": np.nan},
        {"time_limit": "1"},
    ],
)
def test_a_setting_of_another_type_or_out_of_range_is_refused_by_its_name(setting):
    with pytest.raises(HqpError, match=f"^{next(iter(setting))} is "):
        Solver(2, [(1, 0)], **setting)


def test_the_largest_iteration_cap_is_one():
    levels = problem("degenerate_vertices", 2, n=20, levels=4)
    assert solve(levels, max_iterations=2**31 - 1).status is Status.SOLVED


def test_levels_without_rows_leave_x_alone():
    nothing = Level(A=np.zeros((0, 3)), b=np.zeros(0))
    assert solve([nothing]).x.tolist() == [0.0, 0.0, 0.0]
    assert np.allclose(solve([nothing, wish(1.0, 2.0, 3.0), nothing]).x, [1.0, 2.0, 3.0])


@pytest.mark.parametrize("seed", range(3))
def test_random_calls_never_crash_and_never_give_another_problems_answer(seed):
    done = subprocess.run(
        [sys.executable, FUZZ, str(seed), "1500"], capture_output=True, text=True, check=False, timeout=300
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("judge", [certificate, lambda v, x: conflicts(v, x, 1)])
@pytest.mark.parametrize(
    ("x", "says"),
    [
        (np.zeros(3), "x has shape (3,)"),
        (np.zeros((2, 1)), "x has shape (2, 1)"),
        (np.array([0.0, np.nan]), "x has entries that are not finite"),
        ([0.0, 0.0], "x is of type list"),
        (np.zeros(2, dtype=complex), "x is of type complex128"),
        (np.ma.masked_array([0.0, 0.0], [True, False]), "x is a masked array"),
    ],
)
def test_a_point_that_cannot_be_judged_is_refused(judge, x, says):
    with pytest.raises(HqpError, match=re.escape(says)):
        judge([wish(1.0, 2.0), wish(0.0, 0.0)], x)


def certified(levels, x, level, tolerance=1e-9):
    return certificate(levels, x, tolerance)


@pytest.mark.parametrize("ask", [certified, multipliers, conflicts])
@pytest.mark.parametrize(
    ("levels", "says"),
    [
        ([wish(1.0, np.nan), wish(0.0, 0.0)], "b of level 0 has the entry nan"),
        (
            [wish(1.0, 2.0), Level(lb=np.array([0.0, np.nan]), ub=np.ones(2))],
            "lb of level 1 has the entry nan",
        ),
        (
            [wish(1.0, 2.0), Level(lb=np.array([0.0, np.inf]), ub=np.ones(2))],
            "lb of level 1 has the entry inf",
        ),
        ([wish(1.0, 2.0), wish(1.0, 2.0, 3.0)], "levels have 2 and 3 columns"),
        ([wish(1.0, 2.0), wish(1e101, 0.0)], "b of level 1 has the entry 1e+101"),
        (
            [Level(A=np.diag([1.0, -1e101]), b=np.ones(2)), wish(1.0, 2.0)],
            "A of level 0 has the entry -1e+101",
        ),
        ([Level(C=np.diag([1e200, 1.0]), lb=np.zeros(2), ub=np.ones(2)), wish(1.0, 2.0)], "C of level 0 has"),
        *(
            (
                [wish(1.0, 2.0), Level(A=np.eye(2), b=np.ones(2), weights=np.array([1.0, weight]))],
                f"weights of level 1 has the entry {weight}; give one in (0, 1e100]",
            )
            for weight in (-1.0, 0.0, np.nan, np.inf)
        ),
        (
            [Level(lb=np.array([-np.inf, 1.0]), ub=np.array([np.inf, 0.5])), wish(1.0, 2.0)],
            "lb of level 0 is 1.0 in row 1, more than ub, 0.5; exchange them",
        ),
        ([Level(lb=np.full(2, 1e308), ub=np.full(2, -1e308)), wish(1.0, 2.0)], "lb of level 0 is 1e+308"),
    ],
)
def test_levels_that_cannot_be_judged_are_refused(ask, levels, says):
    with pytest.raises(HqpError, match=re.escape(says)):
        ask(levels, np.zeros(2), 1)


@pytest.mark.parametrize("ask", [multipliers, conflicts])
@pytest.mark.parametrize("level", [-1, 2])
def test_a_level_that_there_is_not_is_refused(ask, level):
    with pytest.raises(HqpError, match="number the levels from 0 to 1"):
        ask([wish(1.0, 2.0), wish(0.0, 0.0)], np.zeros(2), level)


@pytest.mark.parametrize("ask", [multipliers, conflicts])
def test_a_level_of_another_type_is_refused(ask):
    with pytest.raises(HqpError, match=r"^level is of type float; give its number"):
        ask([wish(1.0, 2.0), wish(0.0, 0.0)], np.zeros(2), 1.0)


@pytest.mark.parametrize("ask", [certified, multipliers, conflicts])
@pytest.mark.parametrize("tolerance", [-1.0, np.nan, 1.0, "1e-9", None])
def test_a_tolerance_out_of_range_is_refused(ask, tolerance):
    with pytest.raises(HqpError, match=r"^tolerance is "):
        ask([wish(1.0, 2.0), wish(0.0, 0.0)], np.zeros(2), 1, tolerance)


def test_a_message_does_not_list_ten_thousand_levels():
    with pytest.raises(HqpError, match="and more") as error:
        Solver(2, [(1, 0)] * 10_000)
    assert len(str(error.value)) < 300


def test_a_setting_that_there_is_not_is_named_with_those_that_there_are():
    with pytest.raises(HqpError, match=r"iterations is no setting; those are .*max_iterations"):
        solve([wish(1.0)], iterations=3)


def test_one_bound_without_the_other_is_named():
    with pytest.raises(HqpError, match="ub has 0 entries and lb has 2; give both"):
        Level(lb=np.zeros(2))
    with pytest.raises(HqpError, match="ub has 2 entries and lb has 0; give both"):
        Level(ub=np.zeros(2))


def test_numbers_that_are_not_real_are_not_to_be_converted():
    with pytest.raises(HqpError, match="complex128 array; its numbers must be real"):
        Level(A=1j * np.eye(2), b=np.zeros(2))


def test_a_sparse_matrix_is_to_be_made_dense():
    sparse = csr_array(np.eye(2))
    with pytest.raises(HqpError, match=r"pass np\.ascontiguousarray\(A\.toarray\(\)"):
        Level(A=sparse, b=np.zeros(2))
    with pytest.raises(HqpError, match=r"pass G\.toarray\(\)"):
        solve_qp(np.eye(2), np.zeros(2), sparse, np.zeros(2))
