"""Redundant interfaces as somebody would describe their own: they run, or are refused with a reason."""

from dataclasses import replace

import msgspec
import pytest
from hapticd.devices.joint_drive import JointDrive
from hapticd.experiments.hands import session
from hapticd.experiments.random_interface import FEWEST, MOST, gentle, random_interface
from hapticd.machines.rhi.config import RhiConfig
from hapticd.models import Robot
from hapticd.runtime.configuration.config import Loaded
from hapticd.runtime.configuration.session import build
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.errors import ConfigError
from hapticd.sim.joint_drive import SimJointDrive
from hapticd.testing.bench import Bench


def described(loaded: Loaded) -> RhiConfig:
    assert isinstance(loaded.config, RhiConfig)
    return loaded.config


def with_drives(loaded: Loaded, **changes: int) -> Loaded:
    """The same with other encoders on all motors."""
    devices = {
        name: msgspec.structs.replace(device, **changes) if isinstance(device, JointDrive) else device
        for name, device in loaded.config.devices.items()
    }
    return replace(loaded, config=msgspec.structs.replace(loaded.config, devices=devices))


def test_interfaces_are_of_all_sorts_and_repeat() -> None:
    found = [random_interface(seed) for seed in range(40)]
    robots = [Robot.from_urdf(loaded.model_text, loaded.model_source) for loaded in found]
    assert {robot.nv for robot in robots} == set(range(FEWEST, MOST + 1))
    tasks = {described(loaded).rhi.task.directions for loaded in found}
    assert {len(task) for task in tasks} == {1, 2, 3, 6}
    assert any(any(robot.sliding) for robot in robots)
    square = [len(described(x).rhi.task.directions) == r.nv for x, r in zip(found, robots, strict=True)]
    assert True in square
    assert False in square
    assert {described(loaded).rhi.null_space.resolution for loaded in found} == {"projection", "hqp"}
    assert random_interface(7) == found[7]


def test_most_can_be_built_and_the_others_say_why_not() -> None:
    built, reasons = 0, []
    for seed in range(40):
        try:
            build(without_scan(random_interface(seed)))
            built += 1
        except ConfigError as error:
            reasons += [found.key for found in error.findings]
    assert built > 30
    assert reasons
    assert set(reasons) <= {"rhi.motors.torque", "rhi.motors.velocity", "rhi.task.home"}


def without_scan(loaded: Loaded) -> Loaded:
    """The same without the scan, which takes seconds."""
    rhi = described(loaded).rhi
    space = msgspec.structs.replace(rhi.null_space, scan=0)
    config = msgspec.structs.replace(loaded.config, rhi=msgspec.structs.replace(rhi, null_space=space))
    return replace(loaded, config=config)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2, 4])
def test_two_joints_for_one_direction_of_the_hand_hold_what_it_pulls_across(seed: int) -> None:
    """What the hand holds across the task balances motors, and a coarse encoder is no frozen one."""
    loaded = random_interface(seed, 2, 1)
    found = session(loaded, seed, 5.0, gentle(loaded))
    assert not found.stop, found.detail


@pytest.mark.slow
@pytest.mark.parametrize(("joints", "directions", "seed"), [(2, 2, 105), (3, 3, 103), (6, 6, 100)])
@pytest.mark.parametrize("resolution", ["projection", "hqp"])
def test_as_many_directions_as_joints(joints: int, directions: int, seed: int, resolution: str) -> None:
    loaded = random_interface(seed, joints, directions)
    found = session(loaded, seed, 4.0, gentle(loaded))
    assert not found.stop, found.detail
    assert found.returned < 0.05


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 10, 17, 22, 27])
def test_an_interface_of_one_s_own_stops_for_nothing(seed: int) -> None:
    loaded = random_interface(seed)
    found = session(loaded, seed, 6.0, gentle(loaded))
    assert not found.stop, found.detail
    assert all(excess <= 0.0 for excess in found.excess.values())


@pytest.mark.parametrize("counts", [4096, 1_048_576])
def test_a_frozen_encoder_of_such_an_interface_is_found(counts: int) -> None:
    """However coarse: its motor is pushed, and measures no motion."""
    bench = Bench(with_drives(random_interface(0, 2, 1), counts_per_turn=counts, link_counts_per_turn=counts))
    bench.until(Mode.ACTIVE, limit=5000)
    (node, *_) = bench.plant.nodes.of(SimJointDrive)
    kept = node.position, node.link_position

    def freeze() -> None:
        node.position, node.link_position = kept
        node.velocity = 0.0

    bench.after_sensing(freeze)
    machine = bench.cycle.machine
    update, most = machine.update, machine.axes[0].command

    def pushed(gain: float, trust: float) -> None:
        update(gain, trust)
        machine.commands[0] = 0.9 * most

    machine.update = pushed  # type: ignore[method-assign]
    bench.run(300)
    assert bench.reason == "encoder_frozen"
