"""The C core's serial chain against pinocchio."""

import numpy as np
import pinocchio as pin
import pytest
from hapticd.binding import pointer
from hapticd.configs import read_text
from hapticd.control._kernels import lib
from hapticd.control.serial import SerialChain
from hapticd.models import ModelError, Robot

FRAMES = ["handle", "joint_4", "carriage", "imu_handle"]


def dynamics_arguments(
    chain: SerialChain, q: np.ndarray, qd: np.ndarray, gravity: np.ndarray, tau: np.ndarray, M: np.ndarray
) -> list[object]:
    """Of ``lib.serial_dynamics``."""
    n = chain.n
    read = [pointer(array, "const double", len(array)) for array in (q, qd, gravity)]
    return [chain.pointer, *read, pointer(tau, "double", n), pointer(M, "double", n, n)]


def giant() -> Robot:
    """All eight joints: prismatic and revolute, a continuous one, and frames along the chain."""
    return Robot.from_urdf(read_text("giant.urdf"), "giant.urdf")


def random_arm(seed: int) -> Robot:
    """A chain with joints about and along x, y, z and other axes in random poses."""
    rng = np.random.default_rng(seed)
    model, parent = pin.Model(), 0
    kinds = [
        pin.JointModelRX,
        pin.JointModelPY,
        pin.JointModelRY,
        pin.JointModelPX,
        pin.JointModelRZ,
        pin.JointModelPZ,
        lambda: pin.JointModelRevoluteUnaligned(np.array([0.6, 0.0, -0.8])),
        lambda: pin.JointModelPrismaticUnaligned(np.array([0.0, -1.0, 0.0])),
    ]
    for i, kind in enumerate(kinds):
        parent = model.addJoint(
            parent, kind(), pin.SE3(pin.exp3(rng.standard_normal(3)), rng.standard_normal(3)), f"j{i}"
        )
        model.appendBodyToJoint(parent, pin.Inertia.Random(), pin.SE3.Random())
    placement = pin.SE3(pin.exp3(rng.standard_normal(3)), rng.standard_normal(3))
    model.addFrame(pin.Frame("tip", parent, 0, placement, pin.FrameType.OP_FRAME))
    model.addFrame(pin.Frame("middle", 3, 0, placement, pin.FrameType.OP_FRAME))
    return Robot(model)


@pytest.mark.parametrize("robot", [giant(), random_arm(1), random_arm(2)], ids=["giant", "random", "random"])
def test_frames_and_torques_are_those_of_pinocchio(robot: Robot) -> None:
    rng = np.random.default_rng(3)
    names = FRAMES if robot.model.existFrame("handle") else ["tip", "middle"]
    chain = SerialChain(robot, names)
    n = chain.n
    q, qd, qdd, tau, gravity = *(np.zeros(n) for _ in range(4)), np.zeros(3)
    chain.bind(q, qd)
    arguments = chain.torque_arguments(q, qd, qdd, gravity, tau)
    at_rest, M = np.zeros(n), np.zeros((n, n))
    dynamics = dynamics_arguments(chain, q, qd, gravity, at_rest, M)
    model, data = robot.model, robot.data
    for _ in range(100):
        q[:], qd[:], qdd[:] = rng.uniform(-2, 2, n), rng.standard_normal(n), rng.standard_normal(n)
        gravity[:] = rng.standard_normal(3)
        chain.update()
        qp = robot.configuration(q)
        pin.computeJointJacobians(model, data, qp)
        pin.forwardKinematics(model, data, qp, qd, np.zeros(n))
        pin.updateFramePlacements(model, data)
        for name, frame in zip(names, chain.frames, strict=True):
            at = robot.frame(name)
            np.testing.assert_allclose(frame.position, data.oMf[at].translation, atol=1e-12)
            np.testing.assert_allclose(frame.rotation, data.oMf[at].rotation, atol=1e-12)
            J = pin.getFrameJacobian(model, data, at, pin.LOCAL_WORLD_ALIGNED)
            np.testing.assert_allclose(frame.J, J, atol=1e-11)
            drift = pin.getFrameClassicalAcceleration(model, data, at, pin.LOCAL_WORLD_ALIGNED).vector
            np.testing.assert_allclose(frame.drift, drift, atol=1e-10)
        model.gravity.linear = gravity
        lib.serial_torques(*arguments)
        np.testing.assert_allclose(tau, pin.rnea(model, data, qp, qd, qdd), atol=1e-9)
        lib.serial_dynamics(*dynamics)
        np.testing.assert_allclose(at_rest, pin.rnea(model, data, qp, qd, np.zeros(n)), atol=1e-9)
        upper = np.triu(pin.crba(model, data, qp))
        np.testing.assert_allclose(M, upper + np.triu(upper, 1).T, atol=1e-10)


def test_what_is_found_together_is_to_the_bit_what_is_found_alone() -> None:
    chain, rng = SerialChain(random_arm(5), []), np.random.default_rng(5)
    n = chain.n
    q, qd, gravity = rng.standard_normal(n), rng.standard_normal(n), rng.standard_normal(3)
    at_rest, M, tau, none = np.zeros(n), np.zeros((n, n)), np.zeros(n), np.zeros(n)
    lib.serial_dynamics(*dynamics_arguments(chain, q, qd, gravity, at_rest, M))
    lib.serial_torques(*chain.torque_arguments(q, qd, none, gravity, tau))
    assert tau.tobytes() == at_rest.tobytes()
    for row, unit in zip(M, np.eye(n), strict=True):
        lib.serial_torques(*chain.torque_arguments(q, none, unit, np.zeros(3), tau))
        assert tau.tobytes() == row.tobytes()


def test_what_is_no_serial_chain_is_refused() -> None:
    model = pin.Model()
    model.addJoint(0, pin.JointModelSpherical(), pin.SE3.Identity(), "ball")
    with pytest.raises(ModelError, match="'ball' is a"):
        SerialChain(Robot(model), [])
    model = pin.Model()
    for name in ("a", "b"):
        model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), name)
    with pytest.raises(ModelError, match="branches off"):
        SerialChain(Robot(model), [])
    model, parent = pin.Model(), 0
    for i in range(17):
        parent = model.addJoint(parent, pin.JointModelRZ(), pin.SE3.Identity(), f"j{i}")
    with pytest.raises(ModelError, match="17 joints"):
        SerialChain(Robot(model), [])
