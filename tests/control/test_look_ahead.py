"""Whether the look-ahead sees what coal sees, and every stop that ends too near."""

from dataclasses import replace

import coal
import numpy as np
import pinocchio as pin
import pytest
from hapticd.configs import read_text
from hapticd.control.ability import Ability
from hapticd.control.look_ahead import Box, Capsule, LookAhead, Plane, Room, Stop
from hapticd.models import Robot

MARGIN = 0.02
GIANT = Robot.from_urdf(read_text("giant.urdf"), "giant.urdf")
N = GIANT.nv


def bodies(rng):
    """Capsules on every joint, and things that stand around them."""
    moving = [
        Capsule(f"part {i}", i, rng.uniform(-0.3, 0.3, 3), rng.uniform(-0.3, 0.3, 3), rng.uniform(0.02, 0.1))
        for i in range(N)
    ]
    axes = pin.Quaternion(*rng.normal(size=4)).normalized().matrix()
    normal = rng.normal(size=3)
    return moving, [
        Box("box", rng.uniform(-1.0, 1.0, 3), rng.uniform(0.05, 0.5, 3), axes),
        Plane("plane", np.array([0.0, 0.0, -2.0]), normal / np.linalg.norm(normal)),
        Capsule("post", -1, rng.uniform(-1.0, 1.0, 3), rng.uniform(-1.0, 1.0, 3), 0.1),
        Capsule("ball", -1, *[rng.uniform(-1.0, 1.0, 3)] * 2, 0.2),
    ]


def pairs(rng):
    moving, standing = bodies(rng)
    return [
        *((first, second) for first in moving for second in standing),
        *((first, second) for first in moving for second in moving if first.joint > second.joint + 1),
    ]


def state():
    """Arrays that a look-ahead is bound to: joints, and what a stop would do."""
    return np.zeros(N), Stop(*(np.zeros(N) for _ in range(3)), np.ones(N))


def placed(body, q):
    """A body as coal has it, and where."""
    if isinstance(body, Plane):
        return coal.Halfspace(body.normal, float(body.normal @ body.point)), coal.Transform3s()
    if isinstance(body, Box):
        return coal.Box(*(2.0 * body.half)), coal.Transform3s(body.axes, body.centre)
    way = body.b - body.a
    length = float(np.linalg.norm(way))
    turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), way).matrix() if length else np.eye(3)
    pose = pin.SE3(turn, 0.5 * (body.a + body.b))
    if body.joint >= 0:
        pin.forwardKinematics(GIANT.model, GIANT.data, GIANT.configuration(q))
        pose = GIANT.data.oMi[body.joint + 1] * pose
    shape = coal.Capsule(body.radius, length) if length else coal.Sphere(body.radius)
    return shape, coal.Transform3s(pose.rotation, pose.translation)


def by_coal(first, second, q):
    (a, at_a), (b, at_b) = placed(first, q), placed(second, q)
    return coal.distance(a, at_a, b, at_b, coal.DistanceRequest(), coal.DistanceResult())


def postures(rng, count):
    return rng.uniform(np.maximum(GIANT.lower, -3.0), np.minimum(GIANT.upper, 3.0), (count, N))


@pytest.mark.parametrize("seed", range(5))
def test_distances_are_those_of_coal(seed):
    rng = np.random.default_rng(seed)
    q, stop = state()
    look = LookAhead(GIANT, pairs(rng), MARGIN, q, stop)
    apart = 0
    for posture in postures(rng, 10):
        for pair, distance in zip(look.pairs, look.distances(posture).tolist(), strict=True):
            truth = by_coal(*pair, posture)
            # coal measures how deep things overlap, this how near the middle lines are
            if truth > 0.0:
                assert distance == pytest.approx(truth, abs=1e-6), pair
                apart += 1
            else:
                assert distance < 1e-9, pair
    assert apart > 100


def along(stop, q, t):
    """Where a stop is after t: closed form, joint by joint."""
    felt = np.minimum(t, stop.reaction)
    braked = np.minimum(t - felt, np.abs(stop.rate) / stop.rated)
    slow = np.abs(stop.rate) * braked - 0.5 * stop.rated * braked**2
    return q + stop.drift * felt + np.sign(stop.rate) * slow


def draw(rng, q, stop):
    """A random state, mostly of moderate speed."""
    q[:] = postures(rng, 1)[0]
    stop.rate[:] = rng.uniform(-1.0, 1.0, N) * GIANT.velocity * rng.uniform(0.0, 1.0)
    stop.drift[:] = stop.rate + rng.normal(0.0, 0.05, N)
    stop.reaction[:] = rng.uniform(0.0, 0.05, N)
    stop.rated[:] = rng.uniform(3.0, 25.0, N)


def test_of_random_stops_those_that_come_too_near_are_seen_and_no_others():
    rng = np.random.default_rng(3)
    q, stop = state()
    look = LookAhead(GIANT, pairs(rng), MARGIN, q, stop)
    seen = 0
    for _ in range(500):
        draw(rng, q, stop)
        look.reset()
        begin = look.distances(q).copy()
        met = look.update()
        end = (stop.reaction + np.abs(stop.rate) / stop.rated).max()
        way = np.array([look.distances(along(stop, q, t)).copy() for t in np.linspace(0.0, end, 60)])
        # what is nearer than the margin may stay, but come no nearer
        free = np.minimum(MARGIN, np.where(begin > 0.0, np.maximum(begin - 2e-3, 0.0), begin - 2e-3))
        least = (way - free).min()
        if least < -1e-3:
            assert met, least
        if met:
            assert least < 1e-4
            seen += 1
    assert 50 < seen < 450


def test_ticks_in_a_row_see_what_a_fresh_look_sees():
    """What is remembered from tick to tick never hides anything, and spares most looks."""
    rng = np.random.default_rng(4)
    q, stop = state()
    every = LookAhead(GIANT, pairs(rng), MARGIN, q, stop)
    looks = fresh_looks = met = 0
    for _ in range(60):
        draw(rng, q, stop)
        stop.drift[:] = stop.rate
        apart = (every.distances(q) > 0.1).tolist()
        watched = [pair for pair, far in zip(every.pairs, apart, strict=True) if far]
        look, fresh = (LookAhead(GIANT, watched, MARGIN, q, stop) for _ in range(2))
        for _ in range(200):
            fresh.reset()
            found, again = look.update(), fresh.update()
            looks, fresh_looks = looks + look.looks, fresh_looks + fresh.looks
            assert bool(found) == bool(again)
            if found:
                met += 1
                break
            q += 1e-3 * stop.rate
    assert 5 < met < 50
    assert looks < 0.95 * fresh_looks


def test_what_is_too_near_may_leave_and_come_no_nearer():
    q, stop = state()
    slide = Capsule("part", 0, np.zeros(3), np.zeros(3), 0.1)
    wall = Box("wall", np.array([1.0, 0.0, 0.0]), np.array([0.1, 5.0, 5.0]))
    look = LookAhead(GIANT, [(slide, wall)], MARGIN, q, stop)
    q[0] = 0.79  # 10 mm from the wall
    stop.rated[:] = 2.0
    look.reset()
    assert look.distances(q)[0] == pytest.approx(0.01)
    assert look.update() is None
    stop.rate[0] = -1.0
    assert look.update() is None
    stop.rate[0] = 0.15  # stops after 5.6 mm
    met = look.update()
    assert met
    assert met.names == ("part", "wall")
    assert met.apart == pytest.approx(0.01)
    assert met.after < 0.008
    assert str(met).startswith("part would have met wall in ")
    # once it was far away, the margin holds again
    q[0], stop.rate[0] = 0.5, 0.0
    assert look.update() is None
    q[0], stop.rate[0] = 0.769, 0.1  # 31 mm away, 2.5 mm of way
    assert look.update() is None
    q[0], stop.rate[0] = 0.769, 0.25  # 15.6 mm of way
    assert look.update()


@pytest.mark.parametrize("seed", range(20))
def test_a_stop_is_followed_as_far_as_limits_let_a_point_go(seed):
    """What stands up to 10 mm beyond a room is met, or what is that near to where the point is outside it."""
    rng = np.random.default_rng(seed)
    q, stop = state()
    stop.rated[:] = 2.0
    side, at = rng.choice([-1.0, 1.0]), rng.uniform(-0.2, 0.2, 3)
    pin.forwardKinematics(GIANT.model, GIANT.data, GIANT.configuration(q))
    offset = GIANT.data.oMi[1].act(at)[0]
    end = rng.uniform(0.3, 0.6)  # of the room
    q[0] = side * (end + rng.uniform(-0.2, 0.05)) - offset
    furthest = max(end, side * (q[0] + offset)) + 0.01
    stop.rate[0] = side * 1.2  # goes on for 0.36 m
    slide = Capsule("part", 0, at, at, 0.05)
    corners = np.full(3, 5.0)
    corners[0] = end
    for gap, seen in ((-5e-3, True), (5e-3, False)):
        centre = side * (furthest + 0.05 + MARGIN + gap + 0.1)
        wall = Box("wall", np.array([centre, 0.0, 0.0]), np.array([0.1, 9.0, 9.0]))
        watched = [(slide, wall)]
        assert LookAhead(GIANT, watched, MARGIN, q, stop).update(), "without a room it is met"
        look = LookAhead(GIANT, watched, MARGIN, q, stop, [Room(0, at, -corners, corners)])
        assert (look.update() is not None) == seen


def test_joints_that_make_up_for_one_another_are_foreseen_to_stop_sooner_than_their_motors_must():
    """A gantry that coasts on and an arm that holds its end still: only a stop brings the end to the wall."""
    q, stop = state()
    ability = Ability(6)
    ability.inertia[:] = np.eye(6)
    ability.most[:], ability.least[:] = 0.5, -0.5  # weak motors: they brake with a tenth of what is rated
    stop = replace(stop, ability=ability)
    tip = Capsule("tip", 2, np.array([0.5, 0.0, 0.0]), np.array([0.5, 0.0, 0.0]), 0.1)
    pin.forwardKinematics(GIANT.model, GIANT.data, GIANT.configuration(q))
    J = pin.computeJointJacobians(GIANT.model, GIANT.data, GIANT.configuration(q))
    place = (GIANT.data.oMi[3] * pin.SE3(np.eye(3), tip.a)).translation
    moved = [J[:3, i] + np.cross(J[3:, i], place) for i in range(3)]
    away = moved[1] / np.linalg.norm(moved[1])
    wall = Plane("wall", place + 0.25 * away, -away)  # 0.15 m from the tip
    look = LookAhead(GIANT, [(tip, wall)], MARGIN, q, stop)
    stop.rated[:] = [0.7, 0.7, *[10.0] * 6]
    stop.rate[1] = stop.drift[1] = 0.5
    stop.rate[2] = stop.drift[2] = -0.5 * float(moved[1] @ away) / float(moved[2] @ away)
    look.reset()
    assert look.distances(q)[0] == pytest.approx(0.15, abs=1e-9)
    met = look.update()
    assert met
    assert met.after < MARGIN


@pytest.mark.parametrize("seed", range(10))
def test_an_arm_that_keeps_a_point_at_its_wall_turns_until_its_gantry_stands(seed):
    """A gantry carries the elbow to its wall, from where the arm takes it back: the hand goes on."""
    rng = np.random.default_rng(seed)
    q, stop = state()
    stop = replace(stop, ability=Ability(6))
    stop.ability.inertia[:] = np.eye(6)
    stop.ability.most[:], stop.ability.least[:] = 1e4, -1e4
    stop.rated[:] = [0.7, 0.7, *[25.0] * 6]
    q[2] = rng.uniform(0.3, 1.2)
    elbow, hand = np.array([0.5, 0.0, 0.0]), np.array([1.0, 0.0, 0.0])

    def places(q):
        pin.forwardKinematics(GIANT.model, GIANT.data, GIANT.configuration(q))
        return [GIANT.data.oMi[3].act(at) for at in (elbow, hand)]

    begin, _ = places(q)
    arm = begin - GIANT.data.oMi[3].translation
    stop.rate[0] = stop.drift[0] = 0.3  # stands after 0.43 s, 64 mm further
    stop.rate[2] = stop.drift[2] = 0.3 / float(arm[1])  # the elbow stays where it is along x
    end = q.copy()
    end[0] += 0.5 * stop.rate[0] * 0.3 / 0.7
    end[2] += 0.5 * stop.rate[2] * 0.3 / 0.7
    tip = Capsule("hand", 2, hand, hand, 0.05)
    way = places(end)[1] - places(q)[1]
    along = way / np.linalg.norm(way)
    wall = Plane("wall", places(end)[1] + 0.05 * along, -along)  # touched where they stand together
    room = Room(2, elbow, np.full(3, -9.0), np.array([begin[0], 9.0, 9.0]))
    free, kept = (LookAhead(GIANT, [(tip, wall)], MARGIN, q, stop, rooms) for rooms in ((), [room]))
    assert free.update() is None, "an arm that stands sooner ends farther from it"
    assert kept.update()
