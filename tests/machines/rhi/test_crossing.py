"""Ways out of dead ends of the self-motion, on the device at a place that limits divide."""

import numpy as np
import pytest
from hapticd.experiments.hands import session
from hapticd.experiments.rhi_hands import TEMPER
from hapticd.machines.rhi.crossing import PERIOD, Crossings
from hapticd.machines.rhi.reachable import Targets
from hapticd.machines.rhi.redundant import RedundantArm
from hapticd.machines.rhi.self_motion import Ellipsoid, close
from hapticd.models import Array
from hapticd.runtime.configuration import config

from .rhi_device import LIMIT, U, four_dof, home_shape
from .test_guard import SPAN

PLACE = np.array([0.267, -0.261])
"""Where limits divide the self-motion in two, of which one is a dead end."""
JOINED = np.array([0.24, -0.2])
"""Where they do not."""
ENDED = np.array([0.34, -0.35])
"""Where the dead end has ended."""
DEAD_END = np.array([-0.5, 2.15, 1.35, -1.4])


@pytest.fixture(scope="module")
def found() -> tuple[RedundantArm, Targets]:
    arm, uu = four_dof(), np.outer(U, U)
    shape = home_shape(arm)
    objectives = [Ellipsoid(shape.free(uu), LIMIT), Ellipsoid(shape.stiff(uu), LIMIT)]
    return arm, Targets(arm, PLACE, SPAN, objectives, 4000)


def towards(arm: RedundantArm, q: Array, goal: Array, x: Array, step: float) -> Array:
    """A posture (n,) goes towards a goal as far as its hand at x and the limits let it."""
    way = goal - q
    lower, upper = SPAN.inside(0.0)
    tried = np.clip(q + way * min(1.0, step / max(float(np.linalg.norm(way)), 1e-12)), lower, upper)
    (closed,) = close(arm, tried[None], x)
    inside = (lower <= closed).all() and (closed <= upper).all()
    return closed if inside and np.linalg.norm(arm.at(closed).position - x) < 1e-6 else q


def test_a_part_from_which_the_hand_can_go_on_in_few_directions_is_told_from_one_where_it_can_in_all(
    found: tuple[RedundantArm, Targets],
) -> None:
    arm, targets = found
    dead = targets.parts.of(close(arm, DEAD_END[None], PLACE)[0])
    best = int(np.argmax(targets.reach))
    assert dead != best
    assert len(targets.ways[best]) == 8 and len(targets.ways[dead]) < 8


def test_targets_follow_the_hand_on_all_ways_of_their_part(found: tuple[RedundantArm, Targets]) -> None:
    arm, targets = found
    lower, upper = SPAN.inside(SPAN.margin)
    for pair, ways in zip(targets.best, targets.ways, strict=True):
        for q in pair:
            for way in ways:
                at = q[None]
                for share in np.linspace(0.05, 1.0, 20):
                    at = close(arm, at, PLACE + share * way)
                    # a path in other steps: to the second order the same
                    assert (lower - 0.02 <= at[0]).all() and (at[0] <= upper + 0.02).all()
                np.testing.assert_allclose(arm.at(at[0]).position, PLACE + way, atol=1e-6)


def test_while_the_hand_is_where_the_parts_are_joined_the_posture_leaves_the_dead_end(
    found: tuple[RedundantArm, Targets],
) -> None:
    arm, targets = found
    crossings = Crossings(arm, PLACE, targets, SPAN)
    q = close(arm, DEAD_END[None], PLACE)[0]
    dead = targets.parts.of(q)
    crossings.reset(dead)
    goals = targets.best[dead]
    lower, upper = SPAN.inside(0.0)
    for x in (PLACE, JOINED):
        for k in range(200 * PERIOD):
            said = crossings.follow(x, q)
            goals = goals if said is None else said
            if k % PERIOD == 0:
                q = towards(arm, q, goals[0], x, 0.05)
            assert (lower <= q).all() and (q <= upper).all()
        if x is PLACE:
            assert crossings.part == dead  # there is no way
            np.testing.assert_array_equal(goals, targets.best[dead])
            q = close(arm, q[None], JOINED)[0]
    assert crossings.part == int(np.argmax(targets.reach))
    np.testing.assert_array_equal(goals, targets.best[crossings.part])
    # and from there it follows the hand to where the dead end has ended
    for share in np.linspace(0.0, 1.0, 50):
        q = towards(arm, close(arm, q[None], JOINED + share * (ENDED - JOINED))[0], goals[0], ENDED, 0.0)
        assert (lower <= q).all() and (q <= upper).all()


@pytest.mark.parametrize(("seed", "seconds"), [(53709, 8.0), (53822, 13.0)])
def test_hands_that_dragged_motors_from_dead_ends_stop_nothing(seed: int, seconds: float) -> None:
    kept = session(config.load("rhi"), seed, seconds, TEMPER)
    assert (kept.stop, kept.seconds) == ("", seconds)
    assert max(excess for name, excess in kept.excess.items() if "torque" not in name) <= 0.0
