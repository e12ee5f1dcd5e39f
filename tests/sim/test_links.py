"""The plant's own mechanics beside pinocchio's."""

import numpy as np
import pinocchio as pin
import pytest
from hapticd.configs import read_text
from hapticd.models import ModelError, Robot
from hapticd.sim.links import Links, SimulationError

AXES = pin.LOCAL_WORLD_ALIGNED


def robot(name: str) -> Robot:
    return Robot.from_urdf(read_text(f"{name}.urdf"), f"{name}.urdf")


def random_state(links: Links, rng: np.random.Generator) -> None:
    for array in (links.q, links.qd, links.load, links.gravity):
        array[:] = rng.normal(size=len(array)) * rng.choice([0.1, 1.0, 10.0])


@pytest.mark.parametrize("name", ["giant", "panda", "rhi"])
def test_a_random_state_accelerates_as_pinocchio_says(name: str) -> None:
    own, rng = robot(name), np.random.default_rng(3)
    model, data = own.model, own.data
    armature = rng.uniform(0.0, 1.0, own.nv)
    links = Links(own, "handle", armature)
    model.armature = armature
    for _ in range(50):
        random_state(links, rng)
        links.accelerate()
        model.gravity.linear = links.gravity
        q = own.configuration(links.q)
        qdd = pin.aba(model, data, q, links.qd, links.load)
        np.testing.assert_allclose(links.qdd, qdd, rtol=1e-9, atol=1e-9 * np.abs(qdd).max())
        M = np.triu(pin.crba(model, data, q))
        M += np.triu(M, 1).T
        np.testing.assert_allclose(links.inverse @ M, np.eye(own.nv), atol=1e-9)


@pytest.mark.parametrize("name", ["giant", "panda", "rhi"])
def test_the_frame_moves_as_pinocchio_says(name: str) -> None:
    own, rng = robot(name), np.random.default_rng(4)
    model, data = own.model, own.data
    links, at = Links(own, "handle", np.zeros(own.nv)), own.frame("handle")
    for _ in range(50):
        random_state(links, rng)
        links.qdd[:] = rng.normal(size=own.nv)
        links.observe()
        q = own.configuration(links.q)
        pin.forwardKinematics(model, data, q, links.qd, links.qdd)
        pose = pin.updateFramePlacement(model, data, at)
        np.testing.assert_allclose(links.position, pose.translation, atol=1e-12)
        np.testing.assert_allclose(links.rotation, pose.rotation, atol=1e-12)
        np.testing.assert_allclose(links.J, pin.computeFrameJacobian(model, data, q, at, AXES), atol=1e-12)
        twist = pin.getFrameVelocity(model, data, at, AXES).vector
        np.testing.assert_allclose(links.twist, twist, rtol=1e-11, atol=1e-11)
        acceleration = pin.getFrameClassicalAcceleration(model, data, at, AXES).vector
        np.testing.assert_allclose(links.acceleration, acceleration, rtol=1e-11, atol=1e-10)


def test_a_state_that_is_not_finite_is_an_error() -> None:
    links = Links(robot("panda"), "handle", np.zeros(7))
    links.q[2] = np.nan
    with pytest.raises(SimulationError, match="nan"):
        links.accelerate()


def test_what_is_no_serial_chain_is_refused() -> None:
    model = pin.Model()
    for name in ("a", "b"):
        model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), name)
    with pytest.raises(ModelError, match="branches off"):
        Links(Robot(model), "a", np.zeros(2))
