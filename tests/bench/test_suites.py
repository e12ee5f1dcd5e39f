"""QPs in files, the simulated humanoid, and recordings with rows of length 1."""

import json
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from hapticd.bench import qps
from hapticd.bench.qps import Found, Qp, judge, load
from hapticd.bench.recorded import BenchError, normalised, shipped
from hapticd.bench.recorded import load as recording
from hapticd.hqp.certificate import certificate
from hapticd.runtime.command_line.cli import main
from scipy.io import savemat
from scipy.sparse import csc_matrix

BOX = {"P": np.eye(2), "q": np.array([-3.0, 1.0])}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    np.savez(
        tmp_path / "a.npz", **BOX, G=np.ones((1, 2)), h=np.ones(1), A=None, b=None, lb=np.zeros(2), ub=None
    )
    rows, bounds = csc_matrix(np.vstack([np.ones((1, 2)), np.eye(2)])), np.array([[1.0], [1e20], [1e20]])
    savemat(
        tmp_path / "b.mat",
        {**BOX, "P": csc_matrix(BOX["P"]), "A": rows, "l": bounds * [[-1e20], [0], [0]], "u": bounds},
    )
    np.savez(tmp_path / "other.npz", x=np.ones(3))
    return tmp_path


def test_both_kinds_of_files_are_the_same_qp(folder: Path) -> None:
    found = list(load(folder))
    assert [qp.name for qp in found] == ["a", "b"]
    for qp in found:
        assert qp.lb.tolist() == [0.0, 0.0] and len(qp.rows) == 1
        assert qps.hapticd(qp).x == pytest.approx([1.0, 0.0])
    with pytest.raises(BenchError, match=r"no \.npz or \.mat file"):
        list(load(folder / "nothing"))


def test_a_file_that_is_no_qp_is_named(folder: Path) -> None:
    for name, content in (("junk.npz", b"hello"), ("junk.mat", b"hello"), ("empty.npz", b"")):
        (folder / name).write_bytes(content)
        with pytest.raises(BenchError, match=f"{name} is no QP: .*; mend it, or take it out of the folder"):
            list(load(folder))
        (folder / name).unlink()
    np.savez(folder / "odd.npz", P=np.eye(2), q=np.zeros(2), G=np.ones((1, 3)), h=np.ones(1))
    with pytest.raises(BenchError, match=r"odd\.npz is no QP"):
        list(load(folder))


def test_the_command_prints_how_the_times_compare(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "solve", "--qp", str(folder), "--rounds", "1", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)[folder.name]
    assert found["qps"] == 2 and not any("wrong" in key or "unsolved" in key for key in found)
    if find_spec("daqp"):
        assert {"time over daqp's call", "time over daqp's own count"} <= set(found)


def test_a_judge_minds_constraints_and_the_best_objective() -> None:
    none = np.full(1, np.inf)
    qp = Qp("", np.eye(1), np.zeros(1), np.eye(1), np.ones(1), none, -none, none)
    points = {"best": 1.0, "worse": 1.1, "outside": 0.5}
    answers = {name: Found(0.0, np.array([x])) for name, x in points.items()}
    answers |= {"none": Found(0.0, None), "not mine": Found(0.0, None, refused=True)}
    assert judge(qp, answers) == {
        "best": "right",
        "worse": "wrong",
        "outside": "wrong",
        "none": "unsolved",
        "not mine": "refused",
    }


def test_a_qp_that_is_not_convex_is_refused_and_one_without_minimum_unsolved() -> None:
    none, bounds = np.full(1, np.inf), np.empty(0)
    constraints = (np.empty((0, 1)), bounds, bounds, -none, none)
    assert qps.hapticd(Qp("", -np.eye(1), np.ones(1), *constraints)).refused
    found = qps.hapticd(Qp("", np.zeros((1, 1)), np.ones(1), *constraints))
    assert found.x is None and not found.refused


def test_a_normalised_recording_has_rows_of_length_one_and_optimal_answers() -> None:
    same = normalised(recording(shipped()[3]))
    for tick, levels in same.replay():
        for level in levels:
            for rows in (level.A, level.C):
                lengths = np.linalg.norm(rows, axis=1)
                assert np.allclose(lengths[lengths > 0.0], 1.0)
        assert certificate(levels, same.x[tick]).max() < 1e-9


def test_the_humanoid_moves_by_problems_that_are_solved() -> None:
    humanoid = pytest.importorskip("hapticd.bench.humanoid")
    try:
        found = humanoid.humanoid(40, seed=4)
    except BenchError as error:
        pytest.skip(str(error))
    assert found.x.shape == (40, 62) and len(found.parts) == 8
    assert not np.array_equal(found.parts[0][0][0], found.parts[0][0][-1])
    again = humanoid.humanoid(3, seed=4)
    np.testing.assert_array_equal(again.x, found.x[:3])
    robot = humanoid.Humanoid(4)
    (dynamics, *_), forces = robot.levels(), 9.81 * robot.data.mass[0] / 8
    x = np.zeros(robot.n)
    x[robot.nv + 2 :: 3] = forces
    assert abs((dynamics.A @ x - dynamics.b)[2]) < 1e-6 * forces
