"""The simulated giant behind its devices: sensors tell the truth, up to noise and quantisation."""

import numpy as np
import pytest
from hapticd.control.estimation import WrenchEstimator
from hapticd.experiments.own_plant import believed
from hapticd.machines.giant.kinematics import points
from hapticd.machines.giant.plant import GiantPlant
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.session import build
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.live.lockstep import Lockstep
from hapticd.sim.tool import SensedTool

Moving = tuple[Lockstep, GiantPlant]


@pytest.fixture(scope="module")
def moving() -> Moving:
    """A session in the middle of the round walk."""
    lockstep = Lockstep(build(believed(config.load("giant"))))
    while lockstep.mode is not Mode.ACTIVE:
        lockstep.tick()
    lockstep.run(2000)
    assert isinstance(lockstep.plant, GiantPlant)
    return lockstep, lockstep.plant


def test_the_daemon_sees_the_plants_joints_within_an_encoder_step(
    moving: Moving,
) -> None:
    lockstep, plant = moving
    before = plant.arm.q.copy(), plant.arm.motor.copy(), list(plant.ppu.position)
    lockstep.tick()
    lockstep.tick()  # sampled at the SYNC of the tick before
    image = lockstep.session.cycle.image
    # the sample lies between the states before and after one period
    assert np.abs(image["joints.link_position"] - before[0]).max() < 5e-3
    assert np.abs(image["joints.position"] - before[1]).max() < 5e-3
    assert np.abs(image["axes.position"] - before[2]).max() < 2e-3


def test_the_wrench_that_the_daemon_estimates_is_the_hands(moving: Moving) -> None:
    lockstep, plant = moving
    errors = []
    for _ in range(300):
        hand = plant._wrench.copy()
        lockstep.tick()
        lockstep.tick()
        errors.append(lockstep.session.cycle.machine._estimator.wrench - hand)  # type: ignore[attr-defined]
    error = np.abs(np.mean(errors, axis=0))
    assert error[:3].max() < 0.1
    assert error[3:].max() < 0.02


class HeldStill:
    """A handle along the axes of the base, at rest."""

    def __init__(self) -> None:
        self.rotation, self.twist, self.acceleration = np.eye(3), np.zeros(6), np.zeros(6)


def test_sensor_and_estimator_are_inverse_to_each_other() -> None:
    lockstep = Lockstep(build(believed(config.load("giant"))))
    plant = lockstep.plant
    assert isinstance(plant, GiantPlant)
    rng = np.random.default_rng(2)
    T = np.eye(4)
    T[:3, 3] = plant.tool.place
    wrench, tool = np.zeros(6), plant.tool.tool
    sensed = SensedTool(tool, plant.tool.place, HeldStill(), wrench)  # the estimator neglects its rotation
    estimator = WrenchEstimator(
        tool.mass, np.array(tool.centre), T, sensed.felt, sensed.base, np.eye(3), 1e-3
    )
    for _ in range(100):
        sensed.base[:], wrench[:] = rng.standard_normal(3), rng.standard_normal(6)
        sensed.update()
        estimator.update()
        np.testing.assert_allclose(estimator.wrench, wrench, atol=1e-12)


def test_at_rest_the_sensors_show_gravity_and_nothing_else() -> None:
    lockstep = Lockstep(build(believed(config.load("giant"))))
    plant = lockstep.plant
    assert isinstance(plant, GiantPlant)
    nodes = plant.nodes
    np.testing.assert_allclose(nodes["imu_carriage"].acceleration, [0, 0, 9.81], atol=0.15)  # type: ignore[attr-defined]
    assert np.linalg.norm(nodes["imu_handle"].acceleration) == pytest.approx(9.81, abs=0.15)  # type: ignore[attr-defined]
    weight = nodes["force_torque"].wrench  # type: ignore[attr-defined]
    assert np.linalg.norm(weight[:3]) == pytest.approx(0.9 * 9.81, abs=0.2)


def test_the_hand_keeps_the_handle_near_its_path(moving: Moving) -> None:
    _, plant = moving
    value, _ = plant.hand._path.at(plant.time)
    handle, _ = points(plant.arm.q.tolist(), plant.ppu.position)
    assert np.linalg.norm(np.array(handle) - value[:3]) < 0.03


def test_noise_follows_the_seed() -> None:
    def sensed(seed: int) -> list[float]:
        loaded = config.load("giant")
        text = loaded.text.replace("seed = 1", f"seed = {seed}")
        again = config.Loaded(
            "giant", config.parse(text, "giant.toml"), text, "giant.toml", loaded.model_text, "u"
        )
        plant = Lockstep(build(again)).plant
        assert isinstance(plant, GiantPlant)
        return list(plant.nodes["force_torque"].wrench)  # type: ignore[attr-defined]

    assert sensed(1) == sensed(1)
    assert sensed(1) != sensed(2)
