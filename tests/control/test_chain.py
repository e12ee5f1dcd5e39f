"""The levels that the C core writes, against the formulas of HapticGiant written out in numpy."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin
import pytest
import quadprog
from hapticd import hqp
from hapticd.configs import read_text
from hapticd.control._kernels import ffi, lib
from hapticd.control.ability import Ability
from hapticd.control.chain import (
    CAUGHT,
    FREE,
    HOMING,
    LOCKED,
    LOWER,
    UPPER,
    BoxedPoint,
    ChainLevels,
    Gains,
    Horizons,
    JointSum,
    Rule,
    input_shapes,
)
from hapticd.control.limits import Limits
from hapticd.control.serial import SerialChain
from hapticd.hqp import Level
from hapticd.models import Robot

DT, HORIZONS, GAINS = 1e-3, Horizons(5e-3, 15e-3), Gains(100.0, 80.0, 20.0, 15.0)
TILT, BOX = (0.6, 2.54), ((-2.2, -2.6, -1.28), (2.2, 2.6, -0.7))
MANIPULATOR = Limits(
    np.array([-np.inf, 0.45, -2.2, -0.6, -0.9, -1.2]),
    np.array([np.inf, 2.4, 1.2, 1.15, 2.2, 1.2]),
    np.array([2.5, 2.5, 3.0, 3.0, 4.0, 5.0]),
    np.array([25.0, 25.0, 35.0, 40.0, 60.0, 90.0]),
)


def twin_limits(n: int) -> Limits:
    return Limits(-np.arange(1.0, n + 1), np.arange(1.0, n + 1), np.full(n, 3.0), np.full(n, 60.0))


def random_inputs(n: int, seed: int) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    shapes = input_shapes(6, n) | {"J_elbow": (6, 6), "drift_elbow": (6,), "x_elbow": (3,)}
    inputs = {name: rng.standard_normal(shape) for name, shape in shapes.items()}
    inputs["R_H"][:] = pin.exp3(rng.standard_normal(3))
    inputs["R_E"][:] = inputs["R_H"] @ pin.exp3(0.2 * rng.standard_normal(3))
    inputs["q"][:] = rng.uniform([-4.0, 0.5, -2.0, -0.5, -0.8, -1.0], [4.0, 2.3, 1.1, 1.1, 2.1, 1.1])
    inputs["qd"] *= 0.3
    inputs["q_a"] *= 0.5
    root = rng.standard_normal((n, n))
    inputs["M_a"][:] = root @ root.T + 0.5 * np.eye(n)
    return inputs


def make(
    inputs: dict[str, np.ndarray], n: int, rule: Rule = "torques", held: np.ndarray | None = None
) -> ChainLevels:
    tilt = JointSum((0, 0, 0, 1, 1, 0), *TILT)
    points = [
        BoxedPoint(inputs["x_H"], inputs["J"], inputs["drift"], *BOX),
        BoxedPoint(inputs["x_elbow"], inputs["J_elbow"], inputs["drift_elbow"], *BOX),
    ]
    limits, six = twin_limits(n), tuple(range(6))
    return ChainLevels(inputs, MANIPULATOR, limits, [tilt], points, GAINS, HORIZONS, DT, rule, six, held)


def interval(kind: str, limits: Limits, i: int, q: float, qd: float) -> tuple[float, float]:
    row = {"lower": limits.lower[i], "upper": limits.upper[i], "velocity": limits.velocity[i]}
    c = ffi.new("bounds_limits *", row | {"acceleration": limits.acceleration[i]})
    found = lib.bounds_a(c, q, qd, DT) if kind == "a" else lib.bounds_b(c, q, qd, HORIZONS.viability)
    return found.lower, found.upper


def bounds_8(lower: float, upper: float, x: float, v: float) -> tuple[float, float]:
    h = HORIZONS.point
    return 2.0 / h**2 * (lower - x - h * v), 2.0 / h**2 * (upper - x - h * v)


def in_order(chain: ChainLevels) -> list[Level]:
    """The levels in the order of Table II, which has the coupling first."""
    levels = list(chain.levels)
    return [levels.pop(chain.coupling_level), *levels]


@pytest.mark.parametrize("n", [1, 2, 4, 6, 9])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_levels_are_the_formulas_of_the_paper(n: int, seed: int) -> None:
    s = random_inputs(n, seed)
    chain = make(s, n)
    assert chain.assemble()
    dim = 2 * n + 19
    m, a, alpha = slice(0, 6), slice(6, 6 + n), slice(6 + n, dim)

    x_H, v_H, drift_H = s["x_H"].copy(), s["J"] @ s["qd"], s["drift"].copy()
    x_el, v_el, drift_el = s["x_elbow"].copy(), s["J_elbow"] @ s["qd"], s["drift_elbow"].copy()
    for x, v, d in ((x_H, v_H, drift_H), (x_el, v_el, drift_el)):
        x[:2], v[:2], d[:2] = x[:2] + s["q_p"], v[:2] + s["qd_p"], d[:2] + s["qdd_p"]

    error = np.concatenate([s["x_E"] - x_H, s["R_H"] @ pin.log3(s["R_H"].T @ s["R_E"])])
    np.testing.assert_allclose(chain.error, error, atol=1e-9)
    k_p, k_d = np.repeat([100.0, 80.0], 3), np.repeat([20.0, 15.0], 3)
    far = np.repeat([np.linalg.norm(error[:3]), np.linalg.norm(error[3:])], 3)
    returning = np.minimum(k_p, HOMING * k_d / far) * error  # no faster than HOMING
    sync = returning + k_d * (s["v_E"] - v_H)  # (11)
    coupling, set_A, tilts, handle, elbow, twin_A, set_B, twin_B, dynamics, torques, size = in_order(chain)
    np.testing.assert_allclose(coupling.A[:, m], s["J"])
    np.testing.assert_allclose(coupling.A[:, a], -s["J_a"])
    assert not coupling.A[:, alpha].any()
    np.testing.assert_allclose(coupling.b, sync - drift_H + s["drift_a"], atol=1e-7)  # (12)

    for level, kind, limits, q, qd in (
        (set_A, "a", MANIPULATOR, s["q"], s["qd"]),  # (13)
        (twin_A, "a", twin_limits(n), s["q_a"], s["qd_a"]),  # (17)
        (set_B, "b", MANIPULATOR, s["q"], s["qd"]),  # (18)
        (twin_B, "b", twin_limits(n), s["q_a"], s["qd_a"]),  # (19)
    ):
        expected = [interval(kind, limits, i, q[i], qd[i]) for i in range(limits.n)]
        np.testing.assert_allclose(np.column_stack([level.lb, level.ub]), expected)
    assert (set_A.C == np.eye(dim)[m]).all() and (twin_A.C == np.eye(dim)[a]).all()

    tilt = bounds_8(*TILT, s["q"][3] + s["q"][4], s["qd"][3] + s["qd"][4])  # (14)
    np.testing.assert_allclose([tilts.lb[0], tilts.ub[0]], tilt)
    assert (tilts.C == np.eye(dim)[3] + np.eye(dim)[4]).all()
    for level, J, x, v, drift in (
        (handle, s["J"], x_H, v_H, drift_H),  # (15), (16)
        (elbow, s["J_elbow"], x_el, v_el, drift_el),
    ):
        np.testing.assert_allclose(level.C[:, m], J[:3])
        for i in range(3):
            lower, upper = bounds_8(BOX[0][i], BOX[1][i], x[i], v[i])
            np.testing.assert_allclose([level.lb[i], level.ub[i]], [lower - drift[i], upper - drift[i]])

    J_inverse_transposed = np.linalg.inv(s["J"]).T
    T = np.hstack(
        [
            np.eye(n),
            s["J_a"].T @ J_inverse_transposed,  # (21)
            (s["J_a"].T @ J_inverse_transposed @ np.array([0, 0, 0, 1, 1, 0]))[
                :, None
            ],  # (22) as a case of (21)
            s["J_a"][:3].T,  # (23)
            s["J_a"].T @ J_inverse_transposed @ s["J_elbow"][:3].T,  # (24)
        ]
    )
    np.testing.assert_allclose(
        dynamics.A[:, alpha], -np.linalg.solve(s["M_a"], T), rtol=1e-6, atol=1e-8
    )  # (20)
    np.testing.assert_allclose(dynamics.A[:, a], np.eye(n))
    np.testing.assert_allclose(dynamics.b, np.linalg.solve(s["M_a"], s["force_a"]), rtol=1e-7)
    assert (torques.C == np.eye(dim)[alpha]).all() and (size.A == np.eye(dim)[alpha]).all()
    assert not size.b.any()


@pytest.mark.parametrize("n", [1, 2, 6])
def test_where_limits_contradict_each_other_the_handle_leaves_the_twin(n: int) -> None:
    left = 0.0
    for seed in range(20):
        s = random_inputs(n, seed)
        chain = make(s, n, "gauss")
        assert chain.assemble()
        x = hqp.solve(chain.levels).x
        coupling, set_A, *_, twin_A, _set_B, _twin_B, _dynamics = in_order(chain)
        for level, y in ((set_A, x[:6]), (twin_A, x[6 : 6 + n])):
            assert (y >= level.lb - 1e-6 * (1.0 + abs(level.lb))).all()
            assert (y <= level.ub + 1e-6 * (1.0 + abs(level.ub))).all()
        left = max(left, np.linalg.norm(coupling.A @ x - coupling.b))
    assert left > 0.1


def test_the_tilts_constraint_torque_is_the_printed_one_on_the_giants_kinematics() -> None:
    robot = Robot.from_urdf(read_text("giant.urdf"), "giant.urdf").without(["ppu_x", "ppu_y"])
    arm = SerialChain(robot, ["handle"])
    rng = np.random.default_rng(3)
    q, qd = np.zeros(6), np.zeros(6)
    arm.bind(q, qd)
    inputs = random_inputs(6, 1)
    for _ in range(20):
        q[:] = rng.uniform([-4.0, 0.5, -2.0, 0.2, 0.5, -1.0], [4.0, 2.3, 1.1, 1.1, 2.1, 1.1])
        arm.update()
        inputs["J"][:] = arm.frames[0].J
        chain = make(inputs, 6)
        assert chain.assemble()
        printed = inputs["J_a"][3:].T @ inputs["J"][3:, 3]  # (22): the axis of joint 4
        found = -inputs["M_a"] @ in_order(chain)[8].A[:, 6 + 6 + 6 + 6]
        np.testing.assert_allclose(found, printed, atol=1e-6)


@pytest.mark.parametrize(("m", "n", "directions"), [(6, 6, range(6)), (7, 6, range(6)), (3, 2, [0, 2])])
@pytest.mark.parametrize("seed", range(5))
def test_under_gauss_the_twin_moves_as_the_constrained_multibody_system(
    m: int, n: int, directions: Sequence[int], seed: int
) -> None:
    """Against quadprog: M (a - M^-1 f) is balanced by forces of tight limits alone, each pushing inwards."""
    rng = np.random.default_rng(seed)
    s = {name: rng.standard_normal(shape) for name, shape in input_shapes(m, n).items()}
    s["R_H"][:], s["R_E"][:] = np.eye(3), np.eye(3)
    for name in ("q", "qd", "q_a", "qd_a", "drift", "drift_a", "q_p", "qd_p", "qdd_p", "x_H", "x_E", "v_E"):
        s[name][:] = 0.0
    root = rng.standard_normal((n, n))
    s["M_a"][:] = root @ root.T + 0.5 * np.eye(n)
    s["force_a"] *= 30.0
    joints = Limits(np.full(m, -np.inf), np.full(m, np.inf), np.full(m, 9.0), rng.uniform(2.0, 9.0, m))
    twin = Limits(np.full(n, -np.inf), np.full(n, np.inf), np.full(n, 9.0), rng.uniform(2.0, 9.0, n))
    chain = ChainLevels(s, joints, twin, [], [], GAINS, HORIZONS, DT, "gauss", directions)
    assert chain.assemble()
    solution = hqp.solve(chain.levels)
    assert solution.status == hqp.Status.SOLVED
    # minimise (a - M^-1 f)^T M (a - M^-1 f) / 2 over (qdd_m, a) under coupling and limits
    weight = np.zeros((m + n, m + n))
    weight[m:, m:] = s["M_a"]
    weight[:m, :m] = 1e-10 * np.eye(m)
    goal = np.concatenate([np.zeros(m), s["force_a"]])
    rows = np.vstack([in_order(chain)[0].A, np.eye(m + n), -np.eye(m + n)])
    most = np.concatenate([joints.acceleration, twin.acceleration])
    bounds = np.concatenate([in_order(chain)[0].b, -most, -most])
    best = quadprog.solve_qp(weight, goal, rows.T, bounds, len(in_order(chain)[0].b))[0]
    np.testing.assert_allclose(solution.x[m:], best[m:], atol=1e-5)


@pytest.mark.parametrize("n", [2, 6])
@pytest.mark.parametrize("seed", [1, 2])
def test_the_twins_stops_count_on_what_motors_and_joints_of_the_machine_reach(n: int, seed: int) -> None:
    """Half of the acceleration at which the first of them gives all that is left."""
    inputs, rng = random_inputs(n, seed), np.random.default_rng(seed)
    inputs["J_a"] *= 0.2
    inputs["q_a"][:] = np.where(rng.random(n) < 0.5, 0.95, -0.95) * np.arange(1.0, n + 1)
    inputs["qd_a"][:] = np.sign(inputs["q_a"]) * rng.uniform(0.5, 2.5, n)
    ability, root = Ability(6), rng.standard_normal((6, 6))
    ability.inertia[:] = root @ root.T + np.eye(6)
    ability.load[:], ability.most[:] = rng.uniform(-60.0, 60.0, 6), rng.uniform(100.0, 300.0, 6)
    ability.least[:] = -ability.most
    six, twin = tuple(range(6)), twin_limits(n)
    chain = ChainLevels(
        *(inputs, MANIPULATOR, twin, [], [], GAINS, HORIZONS, DT, "gauss", six), ability=ability
    )
    assert chain.assemble()
    braking = chain.levels[chain.coupling_level + 2]
    up, down = ability.most - ability.load, ability.load - ability.least
    own = np.diag(ability.inertia)
    joint_up, joint_down = (
        np.clip(0.7 * room / own, 0.1 * MANIPULATOR.acceleration, MANIPULATOR.acceleration)
        for room in (up, down)
    )
    limited = 0
    for i in range(n):
        moves = np.linalg.solve(inputs["J"], inputs["J_a"][:, i])
        takes = ability.inertia @ moves

        def most(sign: float, moves: np.ndarray = moves, takes: np.ndarray = takes) -> float:
            torques = np.where(sign * takes > 0.0, up, down) / np.abs(takes)
            joints = np.where(sign * moves > 0.0, joint_up, joint_down) / np.abs(moves)
            return float(np.clip(0.5 * min(torques.min(), joints.min()), 6.0, 60.0))

        limited += 6.0 < most(-1.0) < 60.0
        row = {"lower": twin.lower[i], "upper": twin.upper[i], "velocity": twin.velocity[i]}
        expected = lib.bounds_b_within(
            ffi.new("bounds_limits *", row | {"acceleration": twin.acceleration[i]}),
            *(most(-1.0), most(1.0), inputs["q_a"][i], inputs["qd_a"][i], HORIZONS.viability),
        )
        assert braking.lb[i] == pytest.approx(expected.lower)
        assert braking.ub[i] == pytest.approx(expected.upper)
    assert limited


def test_what_is_fed_back_takes_of_a_motors_torque_and_adds_none() -> None:
    """Accelerations within the level are within the torques with the feedback, and without it."""
    inputs, ability, rng = random_inputs(6, 4), Ability(6), np.random.default_rng(4)
    root = rng.standard_normal((6, 6))
    ability.inertia[:] = root @ root.T + np.eye(6)
    ability.load[:], ability.feedback[:] = rng.uniform(-60.0, 60.0, 6), rng.uniform(-80.0, 80.0, 6)
    ability.feedback[2], ability.feedback[4] = 1e4, -1e4  # a rotor that something throws
    ability.most[:], ability.least[:] = rng.uniform(100.0, 300.0, 6), -rng.uniform(100.0, 300.0, 6)
    chain = ChainLevels(
        *(inputs, MANIPULATOR, twin_limits(6), [], [], GAINS, HORIZONS, DT, "gauss", tuple(range(6))),
        ability=ability,
    )
    assert chain.assemble()
    motors = chain.levels[0]
    assert motors.lb is not None and motors.ub is not None
    both, thrown = np.stack([ability.load, ability.load + ability.feedback]), [2, 4]
    kept = [0, 1, 3, 5]
    np.testing.assert_allclose(motors.ub[kept], (ability.most - both).min(axis=0)[kept])
    np.testing.assert_allclose(motors.lb[kept], (ability.least - both).max(axis=0)[kept])
    against = np.array([ability.least[2], ability.most[4]]) - ability.load[thrown]
    np.testing.assert_allclose(motors.lb[thrown], against)
    np.testing.assert_allclose(motors.ub[thrown], against)
    assert (motors.lb <= motors.ub).all()


@pytest.mark.parametrize("share", [0.01, 0.1, 1.0])
def test_a_box_counts_on_no_more_than_the_joints_are_rated_for(share: float) -> None:
    """However strong the motors are: a point that joints hardly move cannot brake any harder."""
    inputs, ability = random_inputs(6, 3), Ability(6)
    ability.inertia[:] = 0.01 * np.eye(6)
    ability.most[:], ability.least[:] = 300.0, -300.0
    J = np.zeros((6, 6))
    J[0] = share * np.array([0.1, -0.3, 0.0, 0.0, 0.0, 0.0])
    inputs["qd"][:2] = 0.5 / J[0, 0], 0.0
    inputs["q_p"][:] = inputs["qd_p"][:] = inputs["qdd_p"][:] = 0.0
    x = np.array([1.9, 0.0, -1.0])
    chain = ChainLevels(
        *(inputs, MANIPULATOR, twin_limits(6), []),
        *([BoxedPoint(x, J, np.zeros(6), *BOX)], GAINS, HORIZONS, DT, "gauss", tuple(range(6))),
        ability=ability,
    )
    assert chain.assemble()
    reach = float(np.clip(0.5 * np.abs(J[0]) @ np.abs([25.0, 25.0, 0.0, 0.0, 0.0, 0.0]), 1.0, 15.0))
    free = ffi.new(
        "bounds_limits *", {"lower": -2.2, "upper": 2.2, "velocity": np.inf, "acceleration": np.inf}
    )
    pace = ffi.new("bounds_pace *", {"ease": 20e-3, "settle": 50e-3, "homing": HOMING})
    expected = lib.bounds_able(free, pace, reach, reach, x[0], 0.5)
    assert chain.levels[3].ub[0] == pytest.approx(expected.upper)
    assert chain.levels[3].lb[0] == pytest.approx(expected.lower)


def test_the_posture_decides_only_what_the_coupling_leaves_free() -> None:
    rng = np.random.default_rng(8)
    s = {name: 0.1 * rng.standard_normal(shape) for name, shape in input_shapes(7, 6).items()}
    s["J"] *= 10.0
    s["R_H"][:], s["R_E"][:], s["M_a"][:] = np.eye(3), np.eye(3), np.eye(6)
    wide = [Limits(np.full(k, -np.inf), np.full(k, np.inf), np.full(k, 1e3), np.full(k, 1e3)) for k in (7, 6)]
    chain = ChainLevels(s, *wide, [], [], GAINS, HORIZONS, DT, "gauss")
    found = []
    for posture in (np.zeros(7), rng.standard_normal(7)):
        chain.posture[:] = posture
        assert chain.assemble()
        found.append(hqp.solve(chain.levels).x.copy())
    np.testing.assert_allclose(found[0][7:], found[1][7:], atol=1e-9)  # the twin does not feel it
    null = np.eye(7) - np.linalg.pinv(s["J"]) @ s["J"]
    np.testing.assert_allclose(found[1][:7] - found[0][:7], null @ posture, atol=1e-9)


def test_constraint_torques_need_an_invertible_coupling() -> None:
    inputs = {name: np.zeros(shape) for name, shape in input_shapes(7, 6).items()}
    wide = [Limits(np.full(k, -1.0), np.ones(k), np.ones(k), np.ones(k)) for k in (7, 6)]
    with pytest.raises(ValueError, match=r"7 joints coupled in 6 directions.*Gauss"):
        ChainLevels(inputs, *wide, [], [], GAINS, HORIZONS, DT)
    for directions in ([], [0, 6], [1, 0], [2, 2]):
        with pytest.raises(ValueError, match="directions"):
            ChainLevels(inputs, *wide, [], [], GAINS, HORIZONS, DT, "gauss", directions)
    with pytest.raises(ValueError, match="a sum of 2 joints; the manipulator has 7"):
        ChainLevels(inputs, *wide, [JointSum((1, 1), 0, 1)], [], GAINS, HORIZONS, DT, "gauss")


def test_the_range_of_a_constraint_torque_follows_from_the_active_limits() -> None:
    chain = make(random_inputs(2, 1), 2)
    chain.active[:4] = 0, UPPER, LOWER, LOWER | UPPER
    chain.set_range()
    bounds = np.column_stack([in_order(chain)[9].lb, in_order(chain)[9].ub])[:4]
    assert bounds.tolist() == [[0, 0], [-np.inf, 0], [0, np.inf], [-np.inf, np.inf]]  # (26) and (31)


def test_detection_marks_every_limit_that_is_reached_or_violated_and_no_other() -> None:
    n = 2
    inputs = random_inputs(n, 4)
    inputs["q"][:] = 0.0, 1.4, -0.5, 0.5, 0.7, 0.0
    for name in ("qd", "qd_a", "qd_p", "qdd_p", "drift", "drift_elbow", "q_a", "q_p"):
        inputs[name][:] = 0.0
    inputs["x_H"][:], inputs["x_elbow"][:] = (0.5, 0.0, -1.0), (0.4, 0.0, -0.75)
    chain = make(inputs, n)
    assert chain.assemble()
    levels = in_order(chain)
    x = np.zeros(chain.dim)
    assert chain.detect(x) == 0
    x[6] = levels[7].ub[0]  # the twin's first joint, acceleration
    x[2] = levels[6].lb[2] - 5.0  # joint 3 violates its acceleration limit
    x[3] = levels[2].ub[0] + 1.0  # the tilt, with joint 4 alone
    before = x.copy()
    assert chain.detect(x) >= 3
    assert (x == before).all()
    twin, manipulator, tilt = chain.active[:n], chain.active[n : n + 6], chain.active[n + 6]
    assert twin.tolist() == [UPPER, 0]
    assert manipulator[2] == LOWER
    assert tilt == UPPER
    for level, flags in ((levels[3], chain.active[n + 7 : n + 10]), (levels[4], chain.active[n + 10 :])):
        y = level.C @ x
        assert [bool(f & UPPER) for f in flags] == (y >= level.ub - 1e-6 * (1 + abs(level.ub))).tolist()
        assert [bool(f & LOWER) for f in flags] == (y <= level.lb + 1e-6 * (1 + abs(level.lb))).tolist()
    assert chain.detect(x) == 0  # nothing new the second time
    found = chain.active.copy()
    chain.active[:] = LOWER | UPPER
    chain.settle(x)  # what x does not reach is active no longer
    assert (chain.active == found).all()


def test_a_singular_manipulator_is_reported() -> None:
    inputs = random_inputs(6, 5)
    chain = make(inputs, 6)
    inputs["J"][4] = inputs["J"][3]
    assert not chain.assemble()
    inputs["J"][:] = np.eye(6)
    inputs["M_a"][0, 0] = -1.0
    assert not chain.assemble()


def test_inputs_of_the_wrong_shape_are_refused() -> None:
    inputs = random_inputs(6, 5)
    inputs["J_a"] = np.zeros((6, 5))
    with pytest.raises(ValueError, match=r"J_a has shape \(6, 5\); expected .* shape \(6, 6\)"):
        make(inputs, 6)
    with pytest.raises(ValueError, match="not below"):
        Limits(np.ones(2), np.ones(2), np.ones(2), np.ones(2))


@pytest.mark.parametrize("rule", ["torques", "gauss"])
def test_a_lock_stops_a_joint_of_the_twin_and_a_caught_one_may_only_fall(rule: Rule) -> None:
    n, most = 4, 60.0
    s = random_inputs(n, seed=5)
    s["q_a"][:], s["qd_a"][:] = 0.0, [0.02, -0.3, 0.5, -0.4]
    held = np.array([LOCKED, LOCKED, CAUGHT, CAUGHT], np.uint8)
    free, chain = make(s, n, rule), make(s, n, rule, held)
    assert free.assemble() and chain.assemble()
    for a, b in ((in_order(free)[5], in_order(chain)[5]), (in_order(free)[7], in_order(chain)[7])):
        # (31): at rest after this tick, or braked as rated
        np.testing.assert_allclose([b.lb[0], b.ub[0]], [-20.0, -20.0])
        np.testing.assert_allclose([b.lb[1], b.ub[1]], [most, most])
        # rising, it brakes; falling, it goes on, and no further than to rest within a tick
        np.testing.assert_allclose(b.ub[2], -most)
        assert b.lb[2] == min(a.lb[2], b.ub[2])
        np.testing.assert_allclose(b.ub[3], min(a.ub[3], 0.4 / DT))
        assert b.lb[3] == a.lb[3]
    held[:] = FREE
    assert chain.assemble()
    np.testing.assert_array_equal(in_order(chain)[5].ub, in_order(free)[5].ub)
    if rule == "torques":  # both limits of what is locked are active: any constraint torque may act
        held[0] = LOCKED
        assert chain.assemble()
        x = np.zeros(chain.dim)
        x[6] = -20.0
        chain.detect(x)
        chain.set_range()
        assert in_order(chain)[9].lb[0] == -np.inf and in_order(chain)[9].ub[0] == np.inf
