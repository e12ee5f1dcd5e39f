"""The seated person, and where the arm is mounted for him."""

import msgspec
import numpy as np
import pytest
from hapticd.experiments import bimanual_fig7
from hapticd.experiments.mount import Mount, draw
from hapticd.experiments.mounting import INITIAL, LOWER, base, possible, reached, search
from hapticd.experiments.moved_arm import panda
from hapticd.experiments.seated_operator import FORE, FRONT, HAND, SHOULDER, UPPER, hand_poses, palm
from hapticd.runtime.command_line.cli import main


def test_the_arm_of_the_person_has_its_lengths_and_hangs_at_rest() -> None:
    positions, rotations = palm(np.zeros((1, 7)))
    np.testing.assert_allclose(positions[0], SHOULDER - [0.0, 0.0, UPPER + FORE + HAND], atol=1e-12)
    np.testing.assert_allclose(rotations[0][:, 2], [0.0, -1.0, 0.0], atol=1e-12)  # the palm faces the thigh
    bent = np.zeros((1, 7))
    bent[0, 3] = np.pi / 2
    positions, rotations = palm(bent)
    np.testing.assert_allclose(positions[0], SHOULDER + np.array([FORE + HAND, 0.0, -UPPER]), atol=1e-12)
    np.testing.assert_allclose(rotations[0][:, 0], [1.0, 0.0, 0.0], atol=1e-12)


def test_poses_are_those_of_a_seed_in_front_of_the_person() -> None:
    poses, again = hand_poses(500, 3), hand_poses(500, 3)
    assert (poses.positions == again.positions).all() and len(poses.positions) == 500
    assert not np.allclose(poses.positions, hand_poses(500, 4).positions)
    assert poses.positions[:, 0].min() > FRONT
    far = np.linalg.norm(poses.positions - SHOULDER, axis=1)
    assert far.max() <= UPPER + FORE + HAND + 1e-9 and far.max() > 0.6
    unit = np.einsum("kij,kil->kjl", poses.rotations, poses.rotations)
    np.testing.assert_allclose(unit, np.broadcast_to(np.eye(3), unit.shape), atol=1e-12)
    assert np.linalg.det(poses.rotations).min() > 0.99


def test_what_is_reached_is_what_the_forward_kinematics_comes_to() -> None:
    """Palms that the mounted arm itself is put to are reached, and none outside its sphere."""
    robot, random = panda(), np.random.default_rng(1)
    T = base(INITIAL)
    palms = [T @ robot.placement(q, "handle") for q in random.uniform(robot.lower, robot.upper, (100, 7))]
    poses = hand_poses(100, 1)
    poses.positions[:], poses.rotations[:] = [P[:3, 3] for P in palms], [P[:3, :3] for P in palms]
    assert reached(INITIAL, poses).mean() > 0.95
    poses.positions[:] += 2.5
    assert not reached(INITIAL, poses).any()


def test_a_search_finds_what_reaches_poses_that_it_has_not_seen() -> None:
    seen = []
    best = search(hand_poses(100, 20), 5, None, lambda p: seen.append(p))
    held = hand_poses(300, 21)
    assert reached(best, held).mean() >= 0.96 > 0.8 > reached(INITIAL, held).mean()
    assert possible(np.array(best)) and seen[-1].done == seen[-1].of
    shares = [p.best for p in seen]
    assert shares == sorted(shares)


def test_no_base_stands_in_the_person() -> None:
    assert not possible(np.array([0.2, 0.2, 0.0, *LOWER[3:]]))
    assert possible(np.array(INITIAL))


def test_the_picture_is_drawn() -> None:
    figure = pytest.importorskip("matplotlib.figure").Figure()
    poses = hand_poses(120, 1)
    mask = np.arange(120) % 2 == 0
    found = Mount(poses, poses, INITIAL, mask, ~mask, 0.5, 0.6)
    draw(figure, found)
    assert [axes.get_title() for axes in figure.axes] == ["initial: 50.0 %", "optimised: 50.0 %"]
    assert msgspec.json.encode(found.figures())


@pytest.mark.parametrize("wrong", [["--poses", "12"], ["--workers", "0"], ["--seed", "-1"]])
def test_wrong_options_are_refused(wrong: list[str]) -> None:
    with pytest.raises(SystemExit) as error:
        main(["mount", *wrong])
    assert error.value.code == 2


def test_the_controller_takes_a_good_part_of_the_force_away() -> None:
    figures = bimanual_fig7.run(lambda _: None).figures
    assert figures["ratio"] <= 0.65
