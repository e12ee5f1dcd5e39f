"""What is measured of the simulated giant: arithmetic against closed forms, sessions against physics."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hapticd.experiments import (
    giant_fig5,
    giant_fig6,
    giant_forces,
    giant_table1,
    giant_table3,
    giant_timing,
    haptify,
)
from hapticd.experiments.giant_reach import workspace
from hapticd.experiments.haptify import Felt
from hapticd.experiments.own_plant import Doubt
from hapticd.machines.giant.config import GiantConfig
from hapticd.machines.giant.kinematics import DH, DROP, FOREARM, HANDLE, T_BASE_DH
from hapticd.machines.giant.prepositioning import Q2_REFERENCE, Q3_REFERENCE
from hapticd.machines.rendering.sections import ChainTwin
from hapticd.machines.rendering.twin import chain_twin
from hapticd.models.dh import forward
from hapticd.runtime.configuration.config import load

GIANT = load("giant")
PAGE = (Path(__file__).parents[2] / "docs" / "fidelity.md").read_text()


def quiet(_: str) -> None: ...


def test_a_spectrum_shows_the_rms_of_sines_and_weighs_frequencies_by_amplitude() -> None:
    t = np.arange(8000) / 1000.0
    shaking = np.stack(
        [
            3.0 * np.sin(2 * np.pi * 2.0 * t),  # a hand that moves on purpose
            0.4 * np.sin(2 * np.pi * 50.0 * t),
            0.4 * np.sin(2 * np.pi * 150.0 * t),
        ],
        axis=1,
    )
    found = haptify.vibration(shaking, 1000.0, 10.0)
    assert found.rms == pytest.approx(0.4, rel=1e-3)  # two of 0.4 / sqrt(2) each
    assert found.centroid == pytest.approx(100.0, rel=1e-2)
    with pytest.raises(ValueError, match="2000 samples"):
        haptify.vibration(shaking[:100], 1000.0, 10.0)


def test_inertia_and_damping_are_told_from_a_motion_and_from_a_bias() -> None:
    t = np.arange(2000) / 1000.0
    v, a = np.cos(3 * t) + 0.2 * np.cos(9 * t), -3 * np.sin(3 * t) - 1.8 * np.sin(9 * t)
    inertia, damping, rest = haptify.inertia_and_damping(4.0 * a + 8.0 * v + 0.7, a, v)
    assert (inertia, damping, rest) == pytest.approx((4.0, 8.0, 0.0), abs=1e-9)


def still(force: np.ndarray, position: np.ndarray) -> Felt:
    zero = np.zeros_like(force)
    return Felt(np.arange(len(force)) / 1000.0, position, zero, zero, zero, zero, force, zero, zero, "")


def test_the_peak_ends_where_the_spring_gives_way() -> None:
    depth = np.linspace(0.0, 0.1, 1001)
    push = np.minimum(1000.0 * depth, 80.0)  # 1000 N/m, and no more than 80 N
    force, position = np.zeros((1001, 3)), np.zeros((1001, 3))
    force[:, 2], position[:, 2] = -push, -depth
    pressed = still(force, position)
    assert giant_table3.peak(pressed, 1000.0) == 80.0
    assert giant_table3.peak(still(0.8 * force, position), 1000.0) < 31.0  # 20 % too soft from the beginning
    half = still(force[:600], position[:600])
    assert giant_table3.accuracy(half, 1000.0) == pytest.approx(100.0)
    assert giant_table3.accuracy(half, 500.0) == pytest.approx(200.0)


def test_the_sliding_twin_weighs_the_same_in_all_directions_where_it_begins() -> None:
    config = haptify.with_slider(GIANT, 700.0).config
    assert isinstance(config, GiantConfig) and isinstance(config.giant.twin, ChainTwin)
    twin = chain_twin(config.giant.twin)
    twin.place()
    twin.update(np.zeros(6))
    weight = np.linalg.inv(twin.J @ np.linalg.solve(twin.M, twin.J.T))
    np.testing.assert_allclose(weight, np.diag([4.0] * 3 + [0.06] * 3), atol=1e-9)
    twin.q[0] = -0.01  # down by 10 mm
    twin.place()
    twin.update(np.zeros(6))
    push = twin.J @ np.linalg.solve(twin.M, twin.force)
    np.testing.assert_allclose(push, [0.0, 0.0, 700.0 * 0.01 / 4.0, 0.0, 0.0, 0.0], atol=1e-9)


def test_a_hand_feels_mass_and_damping_of_the_free_twin_and_the_stiffness_of_a_spring() -> None:
    start = haptify.first_place(GIANT)
    believed = Doubt()
    there = [(0.0, start), (0.5, [start[0], start[1] + 0.1, *start[2:]])]
    free = haptify.felt(GIANT, there, 1, believed, quiet, 150.0)
    assert free.stop == "" and len(free.t) == 500
    own = giant_table3.own(free, GIANT)
    assert haptify.size(free.force - own).mean() < 0.1 * haptify.size(own).mean()
    way = giant_table3.pressing(start, 1000.0, 900.0, 40.0, 0.8)
    pressed = haptify.felt(haptify.with_slider(GIANT, 1000.0), way, 1, believed, quiet, 150.0)
    assert pressed.stop == ""
    assert giant_table3.accuracy(pressed, 1000.0) == pytest.approx(100.0, abs=9.0)


def test_the_ways_of_the_hand_begin_where_the_handle_is_and_keep_to_their_speed() -> None:
    start = haptify.first_place(GIANT)
    for way in (
        giant_table3.wandering(start, 3),
        giant_table3.sliding(start, 900.0),
        giant_table3.shaking(start),
    ):
        times = [t for t, _ in way]
        assert times == sorted(set(times)) and times[0] == 0.0
        np.testing.assert_array_equal(way[0][1], start)
    way = giant_table3.wandering(start, 3)
    places = np.array([place for _, place in way])[:, :3]
    length = np.linalg.norm(np.diff(places, axis=0), axis=1).sum()
    assert way[-1][0] == pytest.approx(giant_table3.FREE_S)
    assert length == pytest.approx(giant_table3.FREE_S * giant_table3.FREE_SPEED)


def test_the_workspace_is_as_high_as_joint_4_and_tilt_let_it_be_and_as_wide_as_its_box() -> None:
    config = GIANT.config
    assert isinstance(config, GiantConfig)
    m = config.giant.manipulator
    space = workspace(config, 200_000)
    low, high = (-DROP - FOREARM * np.cos(m_) for m_ in (m.lower[3], m.upper[3]))
    height = high - HANDLE * np.cos(m.tilt[1]) - (low - HANDLE * np.cos(m.tilt[0]))
    np.testing.assert_allclose(space.extent, [4.4, 5.2, height], atol=0.02)
    assert 0.5 * space.extent.prod() < space.volume < 1.03 * space.extent.prod()
    assert space.slices[1].sum() * 0.01 == pytest.approx(space.volume)


def test_no_force_and_torque_that_a_search_finds_needs_more_of_a_motor_than_is_said() -> None:
    rng = np.random.default_rng(5)
    J, gravity, limit = rng.normal(size=(3, 6, 6)), 4.0 * rng.normal(size=(3, 6)), rng.uniform(300, 400, 6)
    found = giant_forces.strength(J, gravity, limit)
    u, w = (x / np.linalg.norm(x, axis=1, keepdims=True) for x in rng.normal(size=(2, 40_000, 3)))
    for k in range(3):
        push = giant_forces.FORCE * u @ J[k, :3] + giant_forces.TORQUE * w @ J[k, 3:]
        need = (np.abs(np.abs(push) + np.abs(gravity[k])) / limit).max(1)
        assert 0.93 * found.both[k] < need.max() <= found.both[k] + 1e-12
        alone = np.abs(found.force[k] * u @ J[k, :3]) + np.abs(gravity[k])
        assert 0.99 < (alone / limit).max() <= 1.0 + 1e-12
        worst = np.abs(found.force[k] * found.direction[k] @ J[k, :3]) + np.abs(gravity[k])
        assert (worst / limit).max() == pytest.approx(1.0)


@pytest.mark.parametrize("row", range(8))
def test_a_wrong_entry_of_table_i_is_found(row: int, monkeypatch: pytest.MonkeyPatch) -> None:
    paper = list(giant_table1.PAPER)
    name, kind, theta, d, a, alpha = paper[row]
    paper[row] = name, kind, theta, d + (0.0 if kind == "prismatic" else 0.01), a + 0.01, alpha
    monkeypatch.setattr(giant_table1, "PAPER", tuple(paper))
    monkeypatch.setattr(giant_table1, "POSTURES", 5)
    assert giant_table1.run(quiet).figures["distance"] > 1e-3


def test_the_printed_table_is_the_urdf(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(giant_table1, "POSTURES", 50)
    figures = giant_table1.run(quiet).figures
    assert figures["distance"] < 1e-12 and figures["angle"] < 1e-7 and figures["inverse"] < 1e-12


@pytest.mark.parametrize("beyond", [None, "joint 4", "tilt", "joint 5", "joint 6"])
def test_poses_that_joints_lead_to_are_reached_and_those_behind_a_limit_are_not(
    beyond: str | None,
) -> None:
    config = GIANT.config
    assert isinstance(config, GiantConfig)
    m, rng = config.giant.manipulator, np.random.default_rng(2)
    poses = []
    while len(poses) < 40:
        q4, tilt, q6 = (rng.uniform(low, high) for low, high in ((0.1, 1.15), m.tilt, (-1.2, 1.2)))
        if beyond == "joint 4":
            q4 = m.upper[3] + rng.uniform(0.01, 0.3)
        elif beyond == "joint 6":
            q6 = m.lower[5] - rng.uniform(0.01, 0.5)
        elif beyond == "tilt":
            tilt = m.tilt[0] - rng.uniform(0.01, 0.5)
        q5 = m.upper[4] + rng.uniform(0.01, 0.2) if beyond == "joint 5" else tilt - q4
        bent, tilted = m.lower[4] <= q5 <= m.upper[4], m.tilt[0] <= q4 + q5 <= m.tilt[1]
        if tilted == (beyond != "tilt") and (bent == (beyond != "joint 5") or beyond == "tilt"):
            q = [0.0, 0.0, rng.uniform(-3, 3), Q2_REFERENCE, Q3_REFERENCE, q4, q5, q6]
            poses.append(forward(T_BASE_DH, DH, np.array(q))[-1])
    T = np.array(poses)
    found = giant_fig5.reach(config, T[:, :3, 3], T[:, :3, :3])
    assert found.reached.all() == (beyond is None) == found.reached.any()
    if beyond:
        assert found.beyond[giant_fig5.CAUSES.index(beyond)].all()


def test_periods_are_counted_with_those_that_were_missed() -> None:
    stages = {"solve": {"mean": 30.0}, "log": {"mean": 10.0}}
    compute = {"mean": 120.0, "p999": 200.0, "max": 300.0}
    summary = {"ticks": 980, "shed": 10, "skipped": 10, "rate_hz": 500.0}
    found = giant_timing.figures({**summary, "stages_us": stages, "compute_us": compute})
    assert found["period"] == pytest.approx(2000.0 * 1000 / 990)
    assert found["solve"] == 25.0 and found["missed"] == 1.0 and found["p999"] == 200.0


def straight_walk() -> giant_fig6.Walk:
    """Every value crosses its range in its own second, as the paper's walk does."""
    t = np.arange(0.0, 10.0, 0.01)

    def ramp(begin: float, low: float, high: float) -> np.ndarray:
        return low + (high - low) * np.clip(t - begin, 0.0, 1.0)

    values = {
        "joint 1": ramp(0.0, 0.3, 7.0),
        "elbow x": ramp(1.0, 0.0, 2.2),
        "tilt (singularity)": ramp(2.0, 1.0, 0.6),
        "joint 6": ramp(3.0, 0.0, -1.2),
        "joint 4": ramp(4.0, 0.5, 1.15),
        "PPU y": ramp(5.0, 0.0, 1.9),
        "PPU x": ramp(5.0, 0.0, 1.0),
        "joint 2": ramp(7.0, 1.5, 2.4),
    }
    limits = {
        "joint 1": (-np.inf, np.inf),
        "elbow x": (-2.2, 2.2),
        "tilt (singularity)": (0.6, 2.5),
        "joint 6": (-1.2, 1.2),
        "joint 4": (0.1, 1.15),
        "PPU y": (-1.9, 1.9),
        "PPU x": (-1.6, 1.6),
        "joint 2": (0.45, 2.4),
    }
    gantry = np.stack([(t < 7.0) * 1.0, (t < 6.0) * 1.0], axis=1)
    return giant_fig6.Walk(t, values, limits, t * 2.0, t, gantry, "")


def test_the_moments_of_the_walk_are_found_in_the_papers_order_and_only_in_it() -> None:
    walk = straight_walk()
    found = giant_fig6.moments(walk)
    assert list(found) == [f"t_{letter}" for letter in "abcdefg"]
    times = [t for t in found.values() if t is not None]
    np.testing.assert_allclose(times, [0.94, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0], atol=0.02)
    before, after = giant_fig6.before_and_after(walk, walk.force, 5.0)
    assert before == pytest.approx(9.1, abs=0.05) and after == pytest.approx(11.2, abs=0.05)
    assert walk.excess("joint 4") == pytest.approx(0.0)
    walk.values["joint 4"][:] = 0.5  # never lifted: what would come after it did not come after it
    assert [t is None for t in giant_fig6.moments(walk).values()] == [False] * 4 + [True] * 3


@pytest.mark.slow
def test_the_default_walk_keeps_every_limit_and_shows_what_the_paper_claims() -> None:
    figures = giant_fig6.run(quiet).figures
    times = list(figures["moments"].values())
    assert None not in times and times == sorted(times)
    for name, (before, after) in figures["compared"].items():
        assert after > 5.0 * before, name
    assert figures["worst"] < 1e-3 and figures["stop"] == ""


def section(name: str) -> list[list[str]]:
    """Cells of the rows of an experiment in the document."""
    text = PAGE.partition(f"\n## {name}: ")[2].partition("\n## ")[0]
    lines = [line for line in text.splitlines() if line[:1] == "|"]
    return [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines]


def papers_of_table3() -> list[str]:
    return [giant_table3._row("", key, "", "").paper for key in giant_table3.PAPER]


@pytest.mark.parametrize(
    ("name", "papers"),
    [
        ("giant_table3", papers_of_table3),
        ("giant_table1", lambda: ["2.5", "36.8", "4.7 x 5.5, outer size"]),
        ("giant_forces", lambda: ["50", "10"]),
    ],
)
def test_the_document_has_the_papers_numbers_as_the_data_has_them(
    name: str, papers: Callable[[], list[str]]
) -> None:
    cells = [row[1] for row in section(name)]
    for paper in papers():
        assert paper in cells
