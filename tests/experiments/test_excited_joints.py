"""Joints led on purpose tell what a plant of its own has, and links theirs; poor excitation is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hapticd.configs import read_text
from hapticd.control import excitation
from hapticd.experiments import excited_joints
from hapticd.experiments.excited_joints import excite, links_of
from hapticd.experiments.identification import identify
from hapticd.experiments.link_parameters import Links, fit_links
from hapticd.experiments.own_plant import BEARING, GEAR, LOAD, Doubt
from hapticd.experiments.recorded_joints import IdentifyError
from hapticd.machines.giant.names import PPU_JOINTS
from hapticd.models import Robot
from hapticd.runtime.command_line.cli import main
from hapticd.runtime.configuration.config import load

DT = 1e-3


@pytest.fixture(scope="module")
def arm() -> Robot:
    return Robot.from_urdf(read_text("giant.urdf"), "giant.urdf").without(PPU_JOINTS)


def test_base_parameters_give_the_torques_of_inverse_dynamics(arm: Robot) -> None:
    """Those of a chain of revolute joints are fewer than ten a link, and lose nothing."""
    links, rng = Links(arm), np.random.default_rng(2)
    q, qd, qdd = rng.uniform(-1.0, 1.0, (3, 20, arm.nv))
    torques = [
        pin.rnea(arm.model, arm.data, arm.configuration(a), b, c) for a, b, c in zip(q, qd, qdd, strict=True)
    ]
    rows = links.rows(q, qd, qdd)
    assert rows.shape[1] == len(links.names) < 10 * arm.nv
    np.testing.assert_allclose(rows @ links.believed, np.concatenate(torques), atol=1e-9)
    assert np.linalg.matrix_rank(rows) == rows.shape[1]


def test_links_and_friction_behind_the_springs_come_out_of_loads_with_noise(arm: Robot) -> None:
    links, rng = Links(arm), np.random.default_rng(4)
    t = np.arange(0.0, 20.0, 0.02)[:, None]
    w = 2.0 * np.pi * rng.uniform(0.2, 1.0, arm.nv)
    q, qd, qdd = 0.5 * np.sin(w * t), 0.5 * w * np.cos(w * t), -0.5 * w * w * np.sin(w * t)
    truth = links.believed * rng.uniform(0.8, 1.2, len(links.believed))
    load = (links.rows(q, qd, qdd) @ truth).reshape(-1, arm.nv) + 2.0 * qd + 0.5 * np.sign(qd) + 0.3
    noisy = load + 0.05 * rng.standard_normal(load.shape)
    fit = fit_links(links, q, qd, qdd, noisy, np.full(arm.nv, 0.01), np.arange(len(t)))
    off = (fit.values - truth) / fit.errors
    assert np.sqrt(np.mean(off**2)) < 2.0
    np.testing.assert_allclose(fit.damping, 2.0, atol=0.1)
    np.testing.assert_allclose(fit.dry, 0.5, atol=0.1)
    assert (fit.after < 0.1).all()
    assert (fit.before[:2] > fit.after[:2]).all()


def test_a_giant_of_its_own_is_identified_within_a_few_per_cent_by_a_course(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(excitation, "DRAWS", 8)  # a good course will do
    monkeypatch.setattr(excitation, "REFINEMENTS", 4)
    seed, doubt = 11, Doubt(True, True)
    loaded = load("giant")
    excited = excite(loaded, 12.0, seed, doubt)
    plant = doubt.vary(loaded.config, seed).simulation.plant
    found = [identify(runs, joint.torque, joint.speed, DT) for joint, runs in excited.joints]
    for i, (joint, _) in enumerate(excited.joints[:4]):
        told = found[i].found
        assert told["stiffness"].value == pytest.approx(plant.stiffness[i] * joint.stiffness, rel=0.04)
        assert told["coulomb"].value == pytest.approx(GEAR * joint.torque, rel=0.08)
        assert told["load_friction"].value == pytest.approx(LOAD, abs=0.01)
    for i in (2, 3, 4, 5):  # a gain error of a torque sensor takes or gives a part of the whole arm's
        joint = excited.joints[i][0]
        truth = plant.rotor_inertia[i] * joint.rotor_inertia
        assert found[i].found["rotor_inertia"].value == pytest.approx(truth, rel=0.06)
    fit = links_of(excited, DT)
    assert (fit.after[:2] < 0.5 * fit.before[:2]).all()
    bearing = BEARING * np.array([joint.torque for joint, _ in excited.joints])
    np.testing.assert_allclose(fit.dry[:2], bearing[:2], rtol=0.3)
    assert excited.condition < 120.0


def test_a_course_between_limits_that_leave_none_is_refused_with_its_condition(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(excited_joints, "design", lambda *_: (None, 500.0))
    with pytest.raises(IdentifyError, match="condition number of 500, above 400"):
        excite(load("giant"), 12.0, 1, Doubt())
    monkeypatch.setattr(excited_joints, "design", lambda *_: None)
    with pytest.raises(IdentifyError, match="no course fits"):
        excite(load("giant"), 12.0, 1, Doubt())


@pytest.mark.slow
def test_the_command_prints_json_and_writes_what_a_configuration_takes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "found.toml"
    status = main(["identify", "panda", "--seconds", "12", "--json", "--out", str(out)])
    said = json.loads(capsys.readouterr().out)
    assert status == 1  # the last joint carries too little to tell its spring
    assert set(said) == {"joints", "course", "links"}
    assert said["joints"]["joint_2"]["identified"]["stiffness"]["value"] == pytest.approx(12000.0, rel=0.01)
    assert len(said["links"]["parameters"]) == 43
    assert said["course"]["condition"] > 1.0
    assert "[arm.joints.joint_2]" in out.read_text()
