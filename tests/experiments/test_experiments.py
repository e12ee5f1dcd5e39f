"""The quick experiments against the papers' numbers, and how results are written down."""

import os
from collections.abc import Callable
from errno import ENOSPC
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hapticd.experiments import (
    bimanual_link,
    block_diagram,
    command,
    giant_redundancy,
    rhi_concept,
    rhi_fig3,
    rhi_fig6,
    rhi_fig7,
    rhi_fig9,
    rhi_fig11,
    rhi_hands,
    rhi_redundancy,
    rhi_table1,
    rhi_taps,
)
from hapticd.experiments.command import NAMES
from hapticd.experiments.hands import Session, session
from hapticd.experiments.outcome import ExperimentError, Outcome, Row, write_rows
from hapticd.experiments.palpation import HAND, Device, simulate
from hapticd.experiments.zero_phase import zero_phase
from hapticd.machines.rhi.machine import RedundantInterface
from hapticd.machines.rhi.passivity import Tank
from hapticd.models import Array
from hapticd.runtime.command_line.cli import main
from hapticd.runtime.configuration import config
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.live.lockstep import Lockstep
from hapticd.sim.hand import PointHand
from hapticd.sim.rigid import RigidArm

ROOT = Path(__file__).parents[2]


def quiet(_: str) -> None:
    pass


def test_the_example_renders_its_force_in_the_stiff_posture_alone() -> None:
    figures = rhi_fig3.run(quiet).figures
    np.testing.assert_allclose(figures["eigenvalues"], [2.58, 5.79], rtol=1e-2)
    np.testing.assert_allclose(list(figures["force_n"].values()), [2.83, 2.15, 6.61], rtol=1e-2)


def test_the_observer_is_full_at_rest_and_empty_at_the_border() -> None:
    assert rhi_fig6.run(quiet).figures == {"centre": 1.0, "border": 0.0}


def test_transitions_take_as_long_as_printed() -> None:
    figures = rhi_fig7.run(quiet).figures
    assert figures["K"] == pytest.approx(123.0, rel=1e-2)
    assert figures["zeta"] == pytest.approx(3.344, rel=1e-2)
    assert figures["duration_s"] == pytest.approx(0.508, rel=1e-2)
    assert figures["step"] < 0.01


@pytest.mark.parametrize("resolution", ["projection", "hqp"])
@pytest.mark.parametrize(("S", "depth"), [(1.0, 0.020), (5.0, 0.015)])
def test_palpation_renders_what_is_asked_for_or_statics_allow(
    resolution: str, S: float, depth: float
) -> None:
    device = Device(saturation={"steepness": S, "linger": 0.1}, null_space={"resolution": resolution})
    trace = device.palpate(depth, 0.25, 2.2)
    assert (np.abs(trace.torque) <= device.limit).all()
    possible = np.minimum(np.linalg.norm(trace.demand, axis=1), 6.0 / device.centre[0]).max()
    share = {"projection": 0.97, "hqp": 0.95}[resolution]
    assert rhi_fig9.peak(trace) > share * possible  # the moment about the base bounds the force by 12 N
    assert rhi_fig9.half_turns(trace) <= 2
    assert trace.omega[-1] > 0.0  # on its way back to free


@pytest.mark.parametrize(("resolution", "S", "least"), [("projection", 1.0, 0.93), ("hqp", 5.0, 0.9)])
def test_a_quick_palpation_finds_the_posture_for_contact_in_time(
    resolution: str, S: float, least: float
) -> None:
    device = Device(saturation={"steepness": S}, null_space={"resolution": resolution})
    trace = device.palpate(0.015, 0.5, 0.75)
    possible = np.minimum(np.linalg.norm(trace.demand, axis=1), 6.0 / device.centre[0]).max()
    assert rhi_fig9.peak(trace) > least * possible
    assert rhi_fig9.chatter(trace, device.limit) < 0.1


def test_a_sensor_in_the_handle_sees_the_rendered_force_and_what_the_device_itself_takes() -> None:
    device = Device()
    trace = device.palpate(0.004, 0.5, 0.6)
    assert (trace.force[50:] @ device.u).max() < -0.4  # pressed, along the wall's normal
    assert 0.001 < rhi_fig9.unfelt(trace, device.u) < 0.1
    np.testing.assert_allclose(
        (trace.sensed[1:] * np.diff(trace.position, axis=0)).sum(), -trace.work.sum(), rtol=0.05
    )


def test_taps_that_follow_each_other_find_the_posture_that_the_first_ones_turned() -> None:
    """They are over before the posture has turned, but it waits for the next one."""
    device = Device()
    trace = rhi_taps.touch(device, *rhi_taps.taps(0.3, 4))
    shares = []
    for k in range(4):
        tap = slice(500 + 300 * k, 800 + 300 * k)
        possible = min(np.linalg.norm(trace.demand[tap], axis=1).max(), 12.0)
        shares.append(np.linalg.norm(trace.force[tap], axis=1).max() / possible)
    assert shares[0] < 0.6 and min(shares[2:]) > 0.95
    assert rhi_fig9.given(trace) < 0.02
    assert rhi_fig9.chatter(trace, device.limit) < 0.1


def test_the_stiff_posture_renders_at_least_half_as_much_again_as_the_free_one() -> None:
    device = Device()
    forces = {mode: rhi_fig9.peak(device.palpate(0.03, 0.5, 0.6, mode)) for mode in ("free", "stiff")}
    assert forces["stiff"] > 1.5 * forces["free"]


def test_the_switching_palpation_renders_nearly_what_the_stiff_posture_does_as_docs_rhi_md_says() -> None:
    device = Device()
    traces = {mode: device.palpate(0.04, 0.25, 1.2, mode) for mode in ("stiff", "switching")}
    force = {mode: np.linalg.norm(trace.force, axis=1)[1000:] for mode, trace in traces.items()}
    assert force["stiff"].min() > 11.6
    assert force["switching"].max() < 12.0 + 1e-6
    assert force["switching"].mean() / force["stiff"].mean() == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("resolution", ["projection", "hqp"])
@pytest.mark.parametrize("depth", [0.010, 0.020, 0.040])
def test_a_closed_palpation_gives_the_hand_nothing(
    resolution: str, depth: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The work of the hand's force on the plant, substep by substep: nothing that the controller computed."""
    work: list[float] = []
    step = RigidArm.step

    def watched(arm: RigidArm, torque: Array, braked: list[bool], push: list[float], h: float) -> None:
        before = arm.position.copy()
        step(arm, torque, braked, push, h)
        work.append(float(np.dot(push, arm.position - before)))

    monkeypatch.setattr(RigidArm, "step", watched)
    device = Device(null_space={"resolution": resolution})
    trace = device.palpate(depth, 0.25, 2.3)
    steps = np.array(work)
    put_in = steps[steps > 0.0].sum()
    assert put_in > 0.02 and np.linalg.norm(trace.position[-1] - device.centre) < 0.02
    assert -steps.sum() < 0.02 * put_in
    assert trace.omega.min() < 0.5  # the posture has turned
    share = np.abs(np.diff(trace.torque, axis=0)) / device.limit
    assert share.max() < 0.1  # no motor chatters


class Press:
    """Into the wall within 0.4 s, and held there."""

    def __init__(self, device: Device, depth: float) -> None:
        self._place, self._along = (*device.centre, 0.0), (*device.u, 0.0)
        self._depth = depth

    def at(self, t: float) -> tuple[list[float], list[float]]:
        s = min(max(t / 0.4, 0.0), 1.0)
        depth, rate = self._depth * s * s * (3.0 - 2.0 * s), self._depth * 6.0 * s * (1.0 - s) / 0.4
        place = [x + depth * a for x, a in zip(self._place, self._along, strict=True)]
        return place, [rate * a for a in self._along]


@pytest.mark.parametrize("resolution", ["projection", "hqp"])
@pytest.mark.parametrize("depth", [0.012, 0.015, 0.030])
def test_the_force_of_a_press_that_is_held_stands(resolution: str, depth: float) -> None:
    device = Device(null_space={"resolution": resolution})
    controller, wall = device.controller()
    hand = PointHand(Press(device, depth), *HAND)
    trace = simulate(controller, device.plant(controller.space.free), hand, wall, 1.6)
    held = np.linalg.norm(trace.force, axis=1)[900:]  # 0.5 s after the hand stands
    assert np.ptp(held) < 0.03 * held.mean()
    assert held.mean() > 0.97 * min(12.0, np.linalg.norm(trace.demand[-1]))
    assert (np.abs(np.diff(trace.torque, axis=0)) / device.limit).max() < 0.1


def test_the_static_bound_is_the_moment_that_two_motors_carry() -> None:
    bound = rhi_fig9.Bound(Device(), 800)
    assert bound._force == pytest.approx(12.0, rel=5e-3)
    assert (bound._force <= 12.0 + 1e-6).all()


def test_a_transition_spares_torque_and_hand() -> None:
    for paper, moved in ((True, 0.25), (False, 1.0)):
        sudden, smooth = rhi_fig11.switched(0.0, paper), rhi_fig11.switched(0.003, paper)
        assert rhi_fig11.jump(smooth) < rhi_fig11.jump(sudden) / 50.0
        assert rhi_fig11.excursion(smooth) < moved * rhi_fig11.excursion(sudden)
    assert rhi_fig11.excursion(smooth) < 1e-4  # the built-in controller: less than 0.1 mm


def test_a_filter_without_phase_keeps_slow_signals_and_drops_fast_ones() -> None:
    t = np.arange(0.0, 1.0, 1e-3)
    slow, fast = 0.3 * t + 0.1 * np.sin(2 * np.pi * 2 * t), 0.05 * np.sin(2 * np.pi * 200 * t)
    smooth = zero_phase(slow + fast, 40.0, 1000.0)
    assert np.abs(smooth - slow)[50:-50].max() < 1e-3
    tone = np.sin(2 * np.pi * 40.0 * t)  # at the cut-off each pass leaves 1/sqrt(2)
    assert np.abs(zero_phase(tone, 40.0, 1000.0)[300:700]).max() == pytest.approx(0.5, rel=0.02)


def test_the_identified_inertia_is_the_apparent_one() -> None:
    device = Device(null_space={"stiffness": 1e-9})
    found = rhi_table1.identify(device, True).inertia.value
    assert found == pytest.approx(rhi_table1.direct_inertia(device, True), rel=0.03)


def test_a_redundant_device_is_light_and_strong_where_a_locked_one_is_either() -> None:
    """Locked motors against ones with a rotor of a million kg m^2; forces against their torques."""
    device = Device()
    found = rhi_redundancy.worth(device, device.u)
    for k, stiff in enumerate((False, True)):
        arm = device.arm.at(device.posture(stiff, rhi_redundancy.SCAN))
        heavy = arm.M + np.diag([1e6, 1e6, 0.0, 0.0])
        mass = 1.0 / (device.u @ arm.J @ np.linalg.solve(heavy, arm.J.T) @ device.u)
        assert found["inertia"][k] == pytest.approx(mass, rel=1e-3)
        asked = np.abs(arm.J.T @ device.u * found["force"][k])[2:] / device.limit[2:]
        assert asked.max() == pytest.approx(1.0)
    light, strong, both = range(3)
    assert found["inertia"][both] < found["inertia"][light] < 0.1 * found["inertia"][strong]
    assert found["force"][both] > 2.0 * found["force"][light]


def printed(q: Array) -> tuple[Array, Array]:
    """Nodes (5, 2) and Jacobian (20) of the paper's device, with its printed lengths."""
    d1, d2, d3, d4 = 0.254, 0.141, 0.21, 0.181
    angles = np.array([q[0], q[1], q[1] + q[2], q[1] + q[3]])
    (c1, c2, c3, c4), (s1, s2, s3, s4) = np.cos(angles), np.sin(angles)
    links = [[d1 * c1, d1 * s1], [d2 * s2, -d2 * c2], [d3 * c3, d3 * s3], [d4 * s4, -d4 * c4]]
    J = [
        [-d1 * s1, d2 * c2 - d3 * s3 + d4 * c4, -d3 * s3, d4 * c4],
        [d1 * c1, d2 * s2 + d3 * c3 + d4 * s4, d3 * c3, d4 * s4],
    ]
    return np.vstack([[0.0, 0.0], np.cumsum(links, axis=0)]), np.array(J)


def test_the_drawn_device_and_its_ellipsoids_are_those_of_the_printed_jacobian() -> None:
    """Half axes by singular values: forces are 1 / s where motors at their limits give velocities s."""
    found = rhi_concept.postures(Device())
    for each in found.values():
        nodes, J = printed(each.q)
        np.testing.assert_allclose(each.nodes, nodes, atol=1e-12)
        np.testing.assert_allclose(each.J, J, atol=1e-12)
        singular = np.linalg.svd(J / [3.0, 3.0, 1.0, 1.0], compute_uv=False)
        np.testing.assert_allclose(np.sqrt(np.linalg.eigvalsh(each.M)), 1.0 / singular)
        np.testing.assert_allclose(np.sqrt(np.linalg.eigvalsh(each.A)), singular[::-1])
    largest, least = (1.0 / np.linalg.svd(found["home"].J / [3.0, 3.0, 1.0, 1.0])[1][k] for k in (1, 0))
    rows = {row.quantity: row.here for row in rhi_concept.run(quiet).rows}
    along, across = np.sqrt(least**2 / 5.0), np.sqrt(5.0 * largest**2)  # zeta and K of the home posture
    desired = "fig. 2: half axes of the desired force ellipsoid along / across u"
    assert rows[f"{desired}, free [N]"] == f"{along:.1f} / {across:.1f}"
    assert rows[f"{desired}, stiff [N]"] == f"{across:.1f} / {along:.1f}"
    assert rows["fig. 8: links [m]"] == "0.254, 0.141, 0.21, 0.181"


def test_a_part_or_signal_that_the_block_diagram_names_and_nobody_has_is_noticed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    device = Device()
    whole = rhi_concept.interface(device)
    tank = rhi_concept.BLOCKS[rhi_concept.TANK]
    assert block_diagram.name(whole, tank) == "Tank"
    renamed = block_diagram.Arrow(0, 1, "controller.transition.activation")
    with pytest.raises(ExperimentError, match=r"no controller\.transition\.activation to draw"):
        block_diagram.text(whole, renamed)
    whole.controller.second = Tank(2)  # type: ignore[attr-defined]
    monkeypatch.setattr(Device, "controller", lambda self: (whole.controller, whole.environment))
    with pytest.raises(ExperimentError, match="lacks the controller's second"):
        rhi_concept.interface(device)
    del whole.controller.second, whole.controller.tank  # type: ignore[attr-defined]
    with pytest.raises(ExperimentError, match=r"no controller\.tank to draw"):
        rhi_concept.run(quiet)


def test_steps_of_torques_are_those_that_the_demand_does_not_explain() -> None:
    J, limit = np.array([[1.0, 0.0], [0.0, 2.0]]), np.array([2.0, 4.0])
    change = np.array([0.5, -1.0]), np.array([0.1, -0.3])
    assert rhi_hands.unexplained(*change, J, limit) == pytest.approx(max(0.4 / 2.0, 0.4 / 4.0))
    assert rhi_hands.unexplained(np.zeros(2), change[1], J, limit) == 0.0
    steps, rows = rhi_hands.Steps(), []

    def watch(lockstep: Lockstep) -> None:
        steps.add(lockstep)
        machine = lockstep.session.cycle.machine
        assert isinstance(machine, RedundantInterface)
        if lockstep.session.cycle.mode is Mode.ACTIVE:
            rows.append((machine.controller.torque.copy(), np.array(machine._demand), machine._arm.J.copy()))

    session(config.load("rhi"), rhi_hands.FIRST, 7.0, rhi_hands.TEMPER, watch)
    torque, demand, Js = (np.array(column) for column in zip(*rows, strict=True))
    explained = np.abs(np.einsum("ka,kai->ki", np.diff(demand, axis=0), Js[1:]))
    largest = ((np.abs(np.diff(torque, axis=0)) - explained) / [3.0, 3.0, 1.0, 1.0]).max(axis=1)
    assert steps.largest == pytest.approx(largest.max())
    assert steps.largest > 0.01
    np.testing.assert_array_equal(steps.counts, np.histogram(np.maximum(largest, 0.0), rhi_hands.STEPS)[0])


def test_rows_of_random_hands_name_the_worst_and_count_joint_limits_alone() -> None:
    excess = {"motor 1": -0.2, "motor 2": -0.07, "motor 2 torque": 0.0, "motor 2 velocity": 0.0}
    counts = np.zeros(len(rhi_hands.STEPS) - 1)
    sessions = [
        rhi_hands.Handled(Session(7, "", "", 0, 15.0, excess, 0.002), counts, 0.05),
        rhi_hands.Handled(Session(8, "torque", "", 2, 3.0, {"motor 1": -0.3}), counts, 0.12),
    ]
    assert sessions[0].room == {"motor 1": 0.2, "motor 2": 0.07}
    rows = [(row.here, row.note) for row in rhi_hands.outcome(sessions).rows]
    assert rows[1:] == [
        ("1", "seed 8: torque"),
        ("70", "motor 2, seed 7"),
        ("12.0 %", "tick to tick; seed 8"),
        ("2.0", "seed 7"),
    ]


def test_the_giants_postures_hold_its_handle() -> None:
    giant = giant_redundancy.Giant()
    T = giant_redundancy.handle_pose(0.4)
    ticks = np.linspace(-1.1, 1.1, 12)
    grid = np.stack(np.meshgrid(ticks, ticks), axis=-1).reshape(-1, 2)
    Q = giant.postures(T, grid)
    assert len(Q) > 10
    for q in Q:
        giant.jacobian(q)
        handle = giant._chain.frames[0]
        np.testing.assert_allclose(handle.rotation, T[:3, :3], atol=1e-9)
        assert handle.position[2] == pytest.approx(T[2, 3])
        assert np.abs(grid + handle.position[:2]).sum(axis=1).min() < 1e-9  # from one of the placements


def test_rows_replace_those_of_the_same_experiment_and_no_others(tmp_path: Path) -> None:
    page = tmp_path / "fidelity.md"
    write_rows(page, "a", "first", [Row("x", "1", "2")])
    write_rows(page, "b", "second", [Row("y", "3", "4", "why")])
    write_rows(page, "a", "first", [Row("x", "1", "2.5")])
    text = page.read_text()
    assert text.count("## a: first") == 1 and "| x | 1 | 2.5 |  |" in text and "| x | 1 | 2 |" not in text
    assert text.index("## a") < text.index("## b") and "| y | 3 | 4 | why |" in text


def test_every_experiment_has_its_section_and_its_plot_in_the_docs() -> None:
    page = (ROOT / "docs" / "fidelity.md").read_text()
    for name in NAMES:
        assert f"## {name}: " in page
        assert (ROOT / "docs" / "figures" / f"{name}.svg").exists()


def test_figures_of_every_kind_of_number_are_printed_as_json(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    counted = Outcome(
        [],
        {"touched": np.arange(3).sum(), "all": np.bool_(True), "least": np.float32(0.5)},
        lambda figure: None,
    )
    monkeypatch.setattr("hapticd.experiments.rhi_fig6.run", lambda progress: counted)
    assert main(["experiment", "rhi_fig6", "--json"]) == 0
    found = msgspec.json.decode(capsys.readouterr().out)
    assert found == {"experiment": "rhi_fig6", "touched": 3, "all": True, "least": 0.5}


def test_the_command_line_writes_plot_and_rows_where_it_is_told_and_nowhere_else(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("matplotlib")
    here, there = tmp_path / "here", tmp_path / "there"
    here.mkdir()
    monkeypatch.chdir(here)
    assert main(["experiment", "rhi_fig6", "--json"]) == 0
    out = capsys.readouterr()
    assert msgspec.json.decode(out.out)["centre"] == 1.0
    assert "--out DIR" in out.err
    assert main(["experiment", "rhi-fig6", "--out", str(there)]) == 0
    assert f"written: {there / 'fidelity.md'}" in capsys.readouterr().err
    assert "## rhi_fig6" in (there / "fidelity.md").read_text()
    first = (there / "figures" / "rhi_fig6.svg").read_bytes()
    assert main(["experiment", "rhi_fig6", "--out", str(there)]) == 0
    assert (there / "figures" / "rhi_fig6.svg").read_bytes() == first
    assert list(here.iterdir()) == []


def test_all_of_a_machine_several_at_a_time_are_what_each_is_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("matplotlib")
    names = ("rhi_fig3", "rhi_fig6", "rhi_fig7")
    monkeypatch.setattr(command, "NAMES", (*names, "bimanual_fig6"))
    together, alone = tmp_path / "together", tmp_path / "alone"
    assert main(["experiment", "--all", "--machine", "rhi", "--json", "--out", str(together)]) == 0
    out = capsys.readouterr()
    assert "3 of 3: " in out.err and "s of a processor" in out.err
    figures = ""
    for name in names:
        assert main(["experiment", name, "--json", "--out", str(alone)]) == 0
        figures += capsys.readouterr().out
    assert out.out == figures
    files = sorted(path.relative_to(together) for path in together.rglob("*.*"))
    assert len(files) == 1 + len(names)
    for file in files:
        assert (together / file).read_bytes() == (alone / file).read_bytes()


def test_a_machine_is_chosen_among_all_experiments_and_must_have_some(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["experiment", "rhi_fig6", "--machine", "rhi"]) == 2
    assert "leave it or 'rhi_fig6' out" in capsys.readouterr().err
    assert main(["experiment", "--all", "--machine", "gaint"]) == 2
    assert "did you mean 'giant'?" in capsys.readouterr().err
    assert set(command._of("bimanual")) == {name for name in NAMES if "bimanual" in name}
    assert set(command.MACHINES) == {"giant", "rhi", "bimanual"}
    assert set(command.ALONE) < set(NAMES)


def test_a_study_of_many_trials_runs_when_it_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    def study(progress: Callable[[str], None]) -> Outcome:
        return Outcome([], {"trials": 100}, lambda figure: None)

    monkeypatch.setattr(rhi_fig6, "study", study, raising=False)
    assert command.perform("rhi_fig6", None, True, quiet).figures == {"trials": 100}
    assert command.perform("rhi_fig6", None, False, quiet).figures != {"trials": 100}
    assert command.perform("rhi_fig7", None, True, quiet).figures["K"] > 0.0  # which has no study


def test_rows_of_timings_are_marked(tmp_path: Path) -> None:
    write_rows(tmp_path / "x.md", "a", "first", [Row("x", "1", "2", "why", timing=True), Row("y", "3", "4")])
    text = (tmp_path / "x.md").read_text()
    assert "| x | 1 | 2 | timing; why |" in text and "| y | 3 | 4 |  |" in text


def test_a_full_disk_is_told_with_the_file_that_found_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(path: Path, outcome: Outcome) -> None:
        path.write_text("<svg")
        raise OSError(ENOSPC, os.strerror(ENOSPC))  # as from a write, which knows no name

    monkeypatch.setattr(command, "write_plot", full)
    monkeypatch.setattr(rhi_fig6, "run", lambda progress: Outcome([], {}, lambda figure: None))
    with pytest.raises(command.ExperimentError, match=r"rhi_fig6\.svg: No space left"):
        command.perform("rhi_fig6", tmp_path, False, quiet)
    assert not list((tmp_path / "figures").iterdir())


def test_what_must_fail_fails_before_an_experiment_begins_and_leaves_nothing_behind(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def begin(progress: Callable[[str], None]) -> Outcome:
        raise AssertionError("it ran")

    monkeypatch.setattr(rhi_fig6, "run", begin)
    (tmp_path / "file").touch()
    for out in ("file", "file/x", "/proc/x"):
        with pytest.raises(SystemExit) as end:
            main(["experiment", "rhi_fig6", "--out", str(tmp_path / out)])
        assert end.value.code == 2
        assert "cannot write" in capsys.readouterr().err
    folder = tmp_path / "new"
    assert main(["experiment", "rhi_fig77", "--out", str(folder)]) == 2
    assert "did you mean 'rhi_fig7'?" in capsys.readouterr().err
    monkeypatch.setattr("hapticd.experiments.command.find_spec", lambda name: None)
    assert main(["experiment", "rhi_fig6", "--out", str(folder)]) == 2
    assert "pip install 'matplotlib" in capsys.readouterr().err
    assert not folder.exists()


def test_the_layer_makes_networks_stable_that_are_not_without_it() -> None:
    figures = bimanual_link.outcome((0.0, 0.12), (0.0, 0.2), lambda _: None).figures
    kept, bare = ([cell for row in each for cell in row] for each in figures["maps"].values())
    assert all(cell["swing"] < 1e-3 and cell["force"] < 30.0 and cell["given"] < 0.1 for cell in kept)
    assert all(cell["share"] > 0.5 for cell in kept)
    assert all(cell["swing"] > 0.1 and cell["force"] > 30.0 for cell in bare)
