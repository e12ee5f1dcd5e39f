"""An arm that carries weight: torques against pinocchio, what they leave to the law, postures that stay."""

from functools import cache
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hapticd.configs import read_text
from hapticd.experiments.hands import session
from hapticd.experiments.temper import Temper
from hapticd.machines.rendering.own_plant import heavier
from hapticd.machines.rhi.bodies import environment
from hapticd.machines.rhi.config import RhiConfig
from hapticd.machines.rhi.contact_aware import ContactAware
from hapticd.machines.rhi.guard import SPEED
from hapticd.machines.rhi.machine import contact_aware, redundant_arm
from hapticd.machines.rhi.nullspace import dynamic_inverse, null_projection
from hapticd.machines.rhi.redundant import AXES, RedundantArm
from hapticd.models import Array, Robot
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.session import build
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.live.lockstep import Lockstep
from hapticd.sim.hand import Path, PointHand
from hapticd.sim.rigid import RigidArm

from ...runtime.conftest import changed

DT = 1e-3
ROTOR = (0.6, 0.6, 0.5, 0.5, 0.2, 0.2, 0.2)
NONE = np.zeros(7)


def panda() -> Robot:
    return Robot.from_urdf(read_text("panda.urdf"), "panda.urdf")


def loaded(*changes: tuple[str, str]) -> config.Loaded:
    """The built-in arm with some texts replaced."""
    text, model = changed(*changes, machine="panda_rhi"), read_text("panda.urdf")
    return config.Loaded("arm", config.parse(text, "arm.toml"), text, "arm.toml", model, "panda.urdf")


@cache
def described(resolution: str = "projection") -> RhiConfig:
    change = ('resolution = "projection"', f'resolution = "{resolution}"')
    found = loaded(change, ("scan = 2000", "scan = 500")).config
    assert isinstance(found, RhiConfig)
    return found


def controller(resolution: str = "projection") -> ContactAware:
    chosen = described(resolution)
    return contact_aware(chosen, redundant_arm(chosen, panda()), environment(chosen.rhi.bodies), DT)


def test_the_weight_is_pinocchio_s_through_any_transmission() -> None:
    rng, robot = np.random.default_rng(2), panda()
    T = np.eye(7) + 0.3 * rng.normal(size=(7, 7))
    arm = RedundantArm(robot, "handle", AXES, T, np.full(7, 0.1))
    for _ in range(20):
        arm.q[:], arm.qd[:] = rng.normal(size=7), rng.normal(size=7)
        arm.update()
        wanted = T.T @ pin.computeGeneralizedGravity(robot.model, robot.data, T @ arm.q)
        np.testing.assert_allclose(arm.weight, wanted, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("resolution", ["projection", "hqp"])
def test_what_the_weight_leaves_is_all_that_the_law_uses(resolution: str) -> None:
    law, limit = controller(resolution), np.array(described().rhi.motors.torque)
    rng, scarce = np.random.default_rng(5), 0
    lower, upper = np.array(described().rhi.motors.lower), np.array(described().rhi.motors.upper)
    for _ in range(60):
        law.arm.at(rng.uniform(lower + 0.3, upper - 0.3))
        law.reset()
        for force in rng.normal(scale=300.0, size=(3, 3)):
            if not law.update(force.tolist(), 1.0, 1.0):
                continue
            room = limit - np.abs(law.arm.weight)
            own = law.torque - law.arm.weight
            assert (np.abs(own) <= room * (1.0 + 1e-9)).all() and (np.abs(law.torque) <= limit).all()
            scarce += bool((np.abs(own) > 0.99 * room).any())
    assert scarce > 20


def settled(mass: float, seconds: float = 2.0) -> Array:
    """The posture in a hand that stands [rad]: links so many times the believed ones, 0 in a world without
    gravity, which the controller knows.
    """
    own, believed, rhi = panda(), panda(), described().rhi
    if not mass:
        own.model.gravity.linear = believed.model.gravity.linear = NONE[:3]
    law = contact_aware(described(), redundant_arm(described(), believed), environment(rhi.bodies), DT)
    plant = RigidArm(
        heavier(own, own.names, mass or 1.0),
        "handle",
        np.eye(7),
        *map(np.array, (ROTOR, rhi.motors.friction)),
        NONE,
    )
    start = law.space.free.copy()
    plant.reset(start)
    hand = PointHand(Path([0.0, 1e3], np.array([plant.position, plant.position])), 3000.0, 60.0, 150.0)
    law.arm.at(start)
    law.reset()
    for k in range(round(seconds / DT)):
        law.arm.q[:], law.arm.qd[:] = plant.q, plant.qd
        law.arm.update()
        assert law.update([0.0] * 3, 1.0)
        for half in range(2):
            hand.aim(plant.hold, (k + 0.5 * half) * DT, plant.position.tolist())
            plant.step(law.torque, [False] * 7, [0.0] * 3, 0.5 * DT)
    posture: Array = plant.q.copy()
    return posture


def test_a_posture_does_not_sink_and_hardly_where_links_are_heavier_than_believed() -> None:
    weightless, as_believed, heavy = settled(0.0), settled(1.0), settled(1.02)
    assert np.abs(as_believed - weightless).max() < 1e-3
    assert 1e-3 < np.abs(heavy - weightless).max() < 0.02


def test_the_weight_is_held_while_the_machine_engages_and_stops() -> None:
    bench = Lockstep(build(loaded(("scan = 2000", "scan = 0"))))
    plant: Any = bench.plant
    start = plant.arm.q.copy()
    bench.run(450)
    assert bench.mode is Mode.ENGAGING
    assert np.abs(plant.arm.q - start).max() < 0.01
    plant._plc.emergency_stop = (True, True)
    bench.run(600)
    assert bench.mode is Mode.STOPPED
    assert np.abs(plant.arm.q - start).max() < 0.01


def test_the_plant_of_an_arm_in_the_air_keeps_its_energy() -> None:
    robot = panda()
    plant = RigidArm(robot, "handle", np.eye(7), np.array(ROTOR), NONE, NONE)
    plant.reset(np.array([0.3, -0.5, 0.2, -1.5, 0.4, 1.0, 0.0]))
    before, fell = plant.energy() + plant.potential(), plant.potential()
    for _ in range(2000):
        plant.step(NONE, [False] * 7, [0.0] * 3, 1e-4)
    assert fell - plant.potential() > 1.0
    assert plant.energy() + plant.potential() == pytest.approx(before, abs=5e-3)


def test_a_speed_limit_is_kept_by_the_posture() -> None:
    law = controller()
    arm, guard = law.arm, law.space.guard
    most = SPEED * np.array(described().rhi.motors.velocity)
    arm.q[:], arm.qd[:] = described().rhi.task.home, 0.0
    arm.qd[2] = 1.2 * most[2]
    arm.update()
    assert law.space.secondary(1.0)
    load = arm.bias + np.array(described().rhi.motors.friction) * arm.qd
    N = null_projection(arm.J, arm.M)
    still = -np.linalg.solve(arm.M, N @ load) - dynamic_inverse(arm.J, arm.M) @ arm.drift
    ceiling = guard.ceiling[2] / arm.M[2, 2] + still[2]  # as an acceleration
    assert ceiling == pytest.approx(-0.2 * most[2] / 0.01)


def test_what_the_posture_cannot_slow_down_the_hand_feels() -> None:
    law = controller()
    arm, guard = law.arm, law.space.guard
    most = SPEED * np.array(described().rhi.motors.velocity)
    arm.q[:], arm.qd[:] = described().rhi.task.home, 0.0
    for rate, share in ((0.99, 0.0), (1.1, -0.1), (-1.1, 0.1)):
        arm.qd[3] = rate * most[3]
        arm.update()
        assert law.space.secondary(1.0)
        expected = [0.0, 0.0, 0.0, share * most[3] * arm.M[3, 3] / 0.01, 0.0, 0.0, 0.0]
        np.testing.assert_allclose(guard.stop, expected, rtol=1e-9)
    arm.qd[3] = 10.0 * most[3]
    arm.update()
    assert law.space.secondary(1.0)
    assert guard.stop[3] == -described().rhi.motors.torque[3]


@pytest.mark.parametrize(
    ("machine", "seed", "seconds"), [("panda_rhi", 8019, 5.5), ("panda_rhi", 8022, 10.5), ("rhi", 2034, 13.0)]
)
def test_a_hand_that_drags_the_arm_past_a_singular_posture_is_no_reason_to_stop(
    machine: str, seed: int, seconds: float
) -> None:
    """A hand of 30 N that stretches the arm at 0.5 m/s, on the hierarchy; no limit is passed."""
    done = session(config.load(machine), seed, seconds, Temper(force=30.0, speed=0.5))
    assert (done.stop, done.detail) == ("", "")
    assert max(done.excess.values()) <= 0.0
