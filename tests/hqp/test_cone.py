"""Distances from cones, known by construction, with multipliers so large that doubles lose them."""

import numpy as np
import pytest
from hapticd.hqp.cone import distance


def units(rows):
    return rows / np.linalg.norm(rows, axis=1)[:, None]


def target_above_a_face(away, near, seed, n=8):
    """A target, free rows and cone rows of length 1, and the target is `away` from what they span.

    Free rows and a face of the cone have nothing of the last coordinate, the other rows go down from them.
    The target is over a point within the face, a sum with positive multipliers, of which those of rows that
    are `near` the opposite of another one are 1 / near.
    """
    rng = np.random.default_rng(seed)
    free, face, others = (rng.normal(size=(count, n)) for count in (2, 4, 3))
    face = np.vstack([face, -(face[:2] + near * rng.normal(size=(2, n)))])
    free[:, -1] = face[:, -1] = 0.0
    others[:, -1] = -1.0
    free, face, others = units(free), units(face), units(others)
    multipliers = rng.uniform(1.0, 2.0, size=6)
    multipliers[[0, 1, 4, 5]] += 1.0 / near
    target = rng.normal(size=2) @ free.astype(np.longdouble) + multipliers @ face.astype(np.longdouble)
    target[-1] = away
    return target.astype(float), free, np.vstack([face, others])


@pytest.mark.parametrize("near", [1e-2, 1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize("away", [0.0, 1e-6, 1e-2])
def test_the_distance_is_known_whatever_the_multipliers(near, away):
    for seed in range(30):
        target, free, cone = target_above_a_face(away, near, seed)
        assert distance(target, free, cone) == pytest.approx(away, abs=1e-10), seed


def test_what_is_behind_the_corner_is_as_far_as_the_corner():
    assert distance(np.array([-3.0, 4.0]), np.zeros((0, 2)), np.eye(2)) == pytest.approx(3.0)
    assert distance(np.array([-3.0, -4.0]), np.zeros((0, 2)), np.eye(2)) == pytest.approx(5.0)
    assert distance(np.array([-3.0, -4.0]), np.zeros((0, 2)), np.zeros((0, 2))) == pytest.approx(5.0)
    assert distance(np.array([-3.0, -4.0]), np.array([[0.0, 1.0]]), np.zeros((0, 2))) == pytest.approx(3.0)
    assert distance(np.array([3.0, 4.0]), np.zeros((0, 2)), np.array([[1.0, 0.0]] * 3)) == pytest.approx(4.0)
