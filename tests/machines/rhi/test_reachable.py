"""Parts of the self-motion that limits divide, against an arm whose parts are known, and random walks."""

import numpy as np
import pytest
from hapticd.machines.rhi import planar
from hapticd.machines.rhi.guard import Span
from hapticd.machines.rhi.reachable import TRACED, Parts, Targets, _connected, _ways, lead
from hapticd.machines.rhi.redundant import RedundantArm
from hapticd.machines.rhi.self_motion import Ellipsoid, close, scan
from hapticd.models import Array, ModelError, Robot

from .rhi_device import LIMIT, X0, U, four_dof, home_shape
from .test_guard import SPAN


def elbow_arm() -> RedundantArm:
    """Two equal links, and a third that hardly counts: elbow to the left or to the right."""
    links = [planar.Link(0.25, 0.5), planar.Link(0.25, 0.5), planar.Link(0.01, 0.05)]
    robot = Robot.from_urdf(planar.urdf("elbow", links), "elbow.urdf")
    return RedundantArm(robot, planar.HANDLE, ("x", "y"), np.eye(3), np.zeros(3))


def test_an_arm_whose_elbow_cannot_pass_the_middle_has_two_parts_and_one_that_stretches_has_one() -> None:
    arm = elbow_arm()
    near, far = np.array([0.3, 0.1]), np.array([0.5, 0.0])
    bounds = (np.array([-3.0, -2.8, -3.0]), np.array([3.0, 2.8, 3.0]))
    apart = Parts(arm, near, bounds, 3000)
    side = np.sign(apart.postures[:, 1])
    assert set(apart.part) == {0, 1}
    assert len({(int(s), int(p)) for s, p in zip(side, apart.part, strict=True)}) == 2  # a side is a part
    assert apart.of(np.array([0.0, 1.8, 0.0])) != apart.of(np.array([0.0, -1.8, 0.0]))
    assert set(Parts(arm, far, bounds, 3000).part) == {0}  # the last link lets it stretch


def test_a_few_postures_are_not_joined_because_there_are_no_nearer_ones() -> None:
    """The middle between an elbow to the left and one to the right closes onto one of them: no way."""
    arm = elbow_arm()
    bounds = (np.array([-3.0, -2.8, -3.0]), np.array([3.0, 2.8, 3.0]))
    x = np.array([0.3, 0.1])
    few = scan(arm, x, bounds, 12)
    side = np.sign(few[:, 1])
    assert set(side) == {-1.0, 1.0}
    ways = _ways(arm, x, bounds, few)
    assert (side[ways[:, 0]] == side[ways[:, 1]]).all()
    label = _connected(len(few), ways)
    assert not set(label[side < 0.0]) & set(label[side > 0.0])


WALL = np.array([0.14, 0.19])
"""A place at which the limits of the device divide its self-motion."""


def walked(arm: RedundantArm, q: Array, x: Array, bounds: tuple[Array, Array], seed: int) -> Array:
    """Where random walks along the self-motion and inside the limits get to from a posture (n,), (k, n)."""
    rng = np.random.default_rng(seed)
    at = np.repeat(q[None], 200, axis=0)
    seen = []
    for _ in range(400):
        trial = close(arm, at + 0.05 * rng.standard_normal(at.shape), x, 4)
        good = np.linalg.norm(arm.reach(trial)[0] - x, axis=1) < 1e-8
        good &= np.all((bounds[0] <= trial) & (trial <= bounds[1]), axis=1)
        good &= np.linalg.norm(trial - at, axis=1) < 0.3
        at[good] = trial[good]
        seen.append(at.copy())
    return np.concatenate(seen[::10])


def test_random_walks_stay_in_their_part() -> None:
    arm = four_dof()
    bounds = SPAN.inside(SPAN.margin)
    parts = Parts(arm, WALL, bounds, 4000)
    assert parts.part.max() >= 1
    for part in range(int(parts.part.max()) + 1):
        start = parts.postures[np.flatnonzero(parts.part == part)[0]]
        reached = walked(arm, start, WALL, bounds, part)
        labels = np.array([parts.of(q) for q in reached])
        assert np.mean(labels == part) > 0.99  # at the edge the next scanned posture may be another part's


def test_targets_keep_the_margin_and_are_the_best_of_their_part_that_can_follow_the_hand() -> None:
    arm = four_dof()
    shape = home_shape(arm)
    uu = np.outer(U, U)
    objectives = [Ellipsoid(shape.free(uu), LIMIT), Ellipsoid(shape.stiff(uu), LIMIT)]
    for x in (X0, WALL):
        targets = Targets(arm, x, SPAN, objectives, 2000)
        lower, upper = SPAN.inside(SPAN.margin)
        roomy = SPAN.inside(3.0 * SPAN.margin)
        for part, pair in enumerate(targets.best):
            own = targets.parts.postures[targets.parts.part == part]
            able = own[:TRACED]
            for way in targets.ways[part]:
                able = able[lead(arm, able, x, (lower, upper), way)[0]]
            for q, objective in zip(pair, objectives, strict=True):
                np.testing.assert_allclose(arm.at(q).position, x, atol=1e-8)
                assert (lower <= q).all() and (q <= upper).all()
                assert targets.parts.of(q) == part
                best = able[np.all((roomy[0] <= able) & (able <= roomy[1]), axis=1)]
                if len(best) >= 20:
                    assert objective.cost(arm.at(q).J) <= objective.cost(arm.reach(best)[1]).min() + 1e-9
            np.testing.assert_array_equal(targets.reachable(own[0]), pair)


def test_where_nothing_keeps_the_margin_the_limits_themselves_count_and_beyond_them_nothing() -> None:
    arm = four_dof()
    objectives = [Ellipsoid(home_shape(arm).free(np.outer(U, U)), LIMIT)]
    q = np.array([0.6, 0.6, 0.4, 0.1])
    tight = Span(tuple(q - 0.2), tuple(q + 0.2), 0.19)
    x = arm.at(q + np.array([0.15, -0.1, 0.15, 0.1])).position.copy()
    found = Targets(arm, x, tight, objectives, 3000).best[0, 0]
    assert (np.abs(found - q) <= 0.2).all()
    with pytest.raises(ModelError, match="cannot reach"):
        Targets(arm, np.array([2.0, 0.0]), SPAN, objectives, 200)
