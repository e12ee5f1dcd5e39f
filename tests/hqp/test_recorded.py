import numpy as np
import pytest
from hapticd.hqp import Solver, Status
from hapticd.hqp.certificate import certificate, slack_norms
from hapticd.hqp.reference import first_mismatch

# The recorded optimum of these ticks can be improved, at the second by less than the comparison minds.
IMPROVABLE = {("excavator", 416), ("excavator", 1024)}


def norms_of(solution):
    return np.array([np.sqrt(w @ w + v @ v) for w, v in zip(solution.w, solution.v, strict=True)])


@pytest.mark.parametrize("warm", [False, True], ids=["cold", "warm"])
@pytest.mark.parametrize("name", ["cartesian", "excavator", "door", "cycling"])
def test_every_recorded_tick_is_solved_to_its_optimum(recordings, name, warm):
    recording = recordings[name]
    solver = Solver(recording.x.shape[1], [level.rows for level in recording.levels(0)])
    for tick, levels in recording.replay():
        if not (warm and recording.follows(tick)):
            solver.reset()
        solution = solver.solve(levels)
        assert solution.status is Status.SOLVED and solution.unique
        if (name, tick) not in IMPROVABLE:
            assert first_mismatch(norms_of(solution), recording.norms[tick], 1e-6) is None, tick
            assert np.allclose(solution.x, recording.x[tick], rtol=1e-6, atol=1e-6), tick


@pytest.mark.parametrize(
    ("name", "mean", "most"),
    [("cartesian", 6.5, 50), ("excavator", 5.5, 30), ("door", 4.0, 25), ("cycling", 15, 20)],
)
def test_the_sweep_needs_few_working_sets_from_cold(recordings, name, mean, most):
    recording = recordings[name]
    solver = Solver(recording.x.shape[1], [level.rows for level in recording.levels(0)])
    iterations = []
    for _, levels in recording.replay():
        solver.reset()
        iterations.append(solver.solve(levels).iterations)
    assert np.mean(iterations) <= mean and max(iterations) <= most


@pytest.mark.parametrize(("name", "tick"), sorted(IMPROVABLE))
def test_where_we_differ_from_a_recorded_optimum_ours_is_better_and_proven(recordings, name, tick):
    recording = recordings[name]
    levels = recording.levels(tick)
    solution = Solver(recording.x.shape[1], [level.rows for level in levels]).solve(levels)
    norms, expected = slack_norms(levels, solution.x), slack_norms(levels, recording.x[tick])
    differs = first_mismatch(norms, expected, 1e-9)
    assert norms[differs] < expected[differs]
    assert certificate(levels, solution.x).max() < 1e-10 < certificate(levels, recording.x[tick]).max()


@pytest.mark.parametrize("name", ["cartesian", "excavator", "door", "cycling"])
def test_recorded_ticks_are_proven_by_certificate(recordings, name):
    recording = recordings[name]
    solver = Solver(recording.x.shape[1], [level.rows for level in recording.levels(0)])
    for _, levels in recording.replay(range(0, len(recording), 20)):
        assert certificate(levels, solver.solve(levels).x).max() < 1e-8


def test_resolving_the_last_two_levels_follows_the_ticks(recordings):
    recording = recordings["door"]
    solver = Solver(recording.x.shape[1], [level.rows for level in recording.levels(0)])
    levels = recording.levels(700)
    solver.solve(levels)
    for tick in range(701, 720):
        later = recording.levels(tick)
        for p in (9, 10):
            levels[p].lb[:], levels[p].ub[:] = later[p].lb, later[p].ub
        assert certificate(levels, solver.resolve(levels, 9).x).max() < 1e-8
