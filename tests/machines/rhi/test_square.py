"""Interfaces with as many directions as motors: no posture to turn, and the same law."""

import numpy as np
import pytest
from hapticd.experiments.random_interface import random_interface
from hapticd.machines.rhi.bodies import surroundings
from hapticd.machines.rhi.config import RhiConfig
from hapticd.machines.rhi.contact_aware import ContactAware
from hapticd.machines.rhi.hierarchy import Hierarchy
from hapticd.machines.rhi.machine import contact_aware, redundant_arm
from hapticd.machines.rhi.redundant import AXES
from hapticd.models import Array, Robot
from hapticd.runtime.configuration.config import Loaded

DT = 1e-3
SEEDS = {2: 105, 3: 103, 6: 100}


def law(n: int, resolution: str) -> ContactAware:
    config = random_interface(SEEDS[n], n, n)
    made = controller(config)
    made.resolution = Hierarchy(made.space) if resolution == "hqp" else made.resolution
    return made


def controller(loaded: Loaded) -> ContactAware:
    config = loaded.config
    assert isinstance(config, RhiConfig)
    arm = redundant_arm(config, Robot.from_urdf(loaded.model_text, loaded.model_source))
    made = contact_aware(config, arm, surroundings(config.rhi, arm), DT)
    made.arm.at(np.array(config.rhi.task.home))
    return made


@pytest.mark.parametrize("resolution", ["projection", "hqp"])
@pytest.mark.parametrize("n", [2, 3, 6])
def test_it_renders_the_force_and_nothing_else(n: int, resolution: str) -> None:
    made, rng = law(n, resolution), np.random.default_rng(n)
    made.reset()
    assert made.places is None
    J, most = made.arm.J, 0.0
    force = 0.02 * min(made.space.limit) / np.abs(J).max() * rng.normal(size=n)
    for _ in range(200):
        assert made.update(force.tolist(), 1.0, 10.0)
        most = max(most, float(np.abs(made.space.null).max()))
    assert made.alpha == pytest.approx(1.0)
    np.testing.assert_allclose(made.torque - made.arm.weight, J.T @ force, atol=1e-6 * made.space.limit.max())
    assert most < 1e-6 * made.space.limit.max()


@pytest.mark.parametrize("resolution", ["projection", "hqp"])
def test_a_force_has_all_of_the_torques(resolution: str) -> None:
    made = law(2, resolution)
    made.reset()
    force = (10.0 * made.space.limit.max() / np.abs(made.arm.J).max() * np.array([1.0, 0.3])).tolist()
    for _ in range(1500):
        assert made.update(force, 1.0, 10.0)
    room = made.space.room
    assert np.max(np.abs(made.torque - made.arm.weight) / room) == pytest.approx(1.0, abs=1e-6)


def test_a_load_is_what_the_chain_s_jacobian_makes_of_it() -> None:
    """In directions of the task as J has them; in the others, too."""
    loaded = random_interface(0)
    arm, rng = controller(loaded).arm, np.random.default_rng(1)
    wrench: Array = rng.normal(size=6)
    inside = np.zeros(6)
    rows = [AXES.index(name) for name in ("x", "y")]
    inside[rows] = wrench[rows]
    np.testing.assert_allclose(arm.load(inside), wrench[rows] @ arm.J, atol=1e-12)
    robot = Robot.from_urdf(loaded.model_text, loaded.model_source)
    q, h, work = arm.q.copy(), 1e-6, np.zeros(arm.n)
    for i, step in enumerate(h * np.eye(arm.n)):
        ends = [robot.placement(arm.transmission @ (q + s * step), "handle") for s in (-1.0, 1.0)]
        turn = ends[1][:3, :3] @ ends[0][:3, :3].T
        turned = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2.0
        work[i] = np.concatenate([ends[1][:3, 3] - ends[0][:3, 3], turned]) @ wrench / (2.0 * h)
    np.testing.assert_allclose(arm.load(wrench), work, atol=1e-6)
