from __future__ import annotations

import msgspec
import numpy as np
import pytest
from hapticd.configs.quantities import PeakTime, Torque
from hapticd.devices.axis_drive import AxisDrive
from hapticd.devices.cia301 import AlState
from hapticd.devices.cia402 import State
from hapticd.devices.device import Device
from hapticd.devices.errors import NetworkError
from hapticd.devices.joint_drive import JointDrive
from hapticd.sim.axis_drive import SimAxisDrive
from hapticd.sim.drive import Drives, SimDrive
from hapticd.sim.joint_drive import SimJointDrive

from ..conftest import Rig


def command(rig: Rig, controlword: int, ticks: int = 1) -> State:
    """Sends a controlword to joint 1 and gives the state that it leads to."""
    rig.image.word("joints.controlword")[0] = controlword
    rig.run(ticks)
    return joint(rig).state


def joint(rig: Rig) -> SimJointDrive:
    return rig.nodes.of(SimJointDrive)[0]


def lead_to(rig: Rig, state: State) -> None:
    commands = {
        State.SWITCH_ON_DISABLED: [0x00],
        State.READY_TO_SWITCH_ON: [0x06],
        State.SWITCHED_ON: [0x06, 0x07],
        State.OPERATION_ENABLED: [0x06, 0x07, 0x0F],
        State.QUICK_STOP_ACTIVE: [0x06, 0x07, 0x0F, 0x02],
    }
    for controlword in commands[state]:
        command(rig, controlword)
    assert joint(rig).state is state


@pytest.mark.parametrize(
    ("number", "start", "controlword", "end"),
    [
        (2, State.SWITCH_ON_DISABLED, 0x06, State.READY_TO_SWITCH_ON),
        (3, State.READY_TO_SWITCH_ON, 0x07, State.SWITCHED_ON),
        (3, State.READY_TO_SWITCH_ON, 0x0F, State.SWITCHED_ON),
        (4, State.SWITCHED_ON, 0x0F, State.OPERATION_ENABLED),
        (5, State.OPERATION_ENABLED, 0x07, State.SWITCHED_ON),
        (6, State.SWITCHED_ON, 0x06, State.READY_TO_SWITCH_ON),
        (7, State.READY_TO_SWITCH_ON, 0x00, State.SWITCH_ON_DISABLED),
        (7, State.READY_TO_SWITCH_ON, 0x02, State.SWITCH_ON_DISABLED),
        (8, State.OPERATION_ENABLED, 0x06, State.READY_TO_SWITCH_ON),
        (9, State.OPERATION_ENABLED, 0x00, State.SWITCH_ON_DISABLED),
        (10, State.SWITCHED_ON, 0x00, State.SWITCH_ON_DISABLED),
        (10, State.SWITCHED_ON, 0x02, State.SWITCH_ON_DISABLED),
        (11, State.OPERATION_ENABLED, 0x02, State.QUICK_STOP_ACTIVE),
        (12, State.QUICK_STOP_ACTIVE, 0x00, State.SWITCH_ON_DISABLED),
        (16, State.QUICK_STOP_ACTIVE, 0x0F, State.OPERATION_ENABLED),
        (0, State.SWITCH_ON_DISABLED, 0x07, State.SWITCH_ON_DISABLED),
        (0, State.SWITCH_ON_DISABLED, 0x0F, State.SWITCH_ON_DISABLED),
        (0, State.QUICK_STOP_ACTIVE, 0x06, State.QUICK_STOP_ACTIVE),
    ],
)
def test_a_command_makes_the_transition_of_the_standard(
    ready: Rig, number: int, start: State, controlword: int, end: State
) -> None:
    lead_to(ready, start)
    assert command(ready, controlword) is end
    assert joint(ready).powered is (end is State.OPERATION_ENABLED)
    assert joint(ready).brake is (end is not State.OPERATION_ENABLED)


def test_a_fault_runs_through_its_reaction_and_needs_a_rising_edge(ready: Rig) -> None:
    lead_to(ready, State.OPERATION_ENABLED)
    drive = joint(ready)
    drive.fault = 0x2310
    ready.run(1)
    assert drive.state is State.FAULT_REACTION_ACTIVE  # 13
    assert drive.brake
    ready.run(2)
    assert drive.state is State.FAULT  # 14
    assert ready.image.word("joints.error_code")[0] == 0x2310
    assert ready.image.emcy[0] == 0x2310
    assert command(ready, 0x80) is State.FAULT  # the cause is still there
    drive.fault = 0
    assert command(ready, 0x80) is State.FAULT  # no edge
    assert command(ready, 0x00) is State.FAULT
    assert command(ready, 0x80) is State.SWITCH_ON_DISABLED  # 15
    ready.run(2)
    assert ready.image.word("joints.error_code")[0] == 0
    assert ready.image.emcy[0] == 0


def test_outputs_act_only_in_operation_enabled(ready: Rig) -> None:
    drive = joint(ready)
    axis = ready.nodes.of(SimAxisDrive)[0]
    ready.image["joints.target_torque"][0] = 7.5
    ready.image["axes.target_velocity"][0] = -0.5
    for state in (State.SWITCH_ON_DISABLED, State.READY_TO_SWITCH_ON, State.SWITCHED_ON):
        lead_to(ready, state)
        assert drive.target_torque == pytest.approx(7.5)
        assert drive.torque == 0.0
        assert axis.velocity_command == 0.0
        lead_to(ready, State.SWITCH_ON_DISABLED)
    lead_to(ready, State.OPERATION_ENABLED)
    assert drive.torque == pytest.approx(7.5)
    lead_to(ready, State.SWITCH_ON_DISABLED)
    assert drive.torque == 0.0


def test_outputs_act_only_in_the_drives_own_mode(enabled: Rig) -> None:
    enabled.image["joints.target_torque"][:] = 5.0
    enabled.run(1)
    joint(enabled).mode = 8
    enabled.run(2)
    assert joint(enabled).torque == 0.0
    assert joint(enabled).brake
    assert enabled.image.word("joints.mode").tolist() == [8, 10, 10, 10, 10, 10]


def test_in_safeop_the_controlword_is_ignored(ready: Rig) -> None:
    ready.image.word("joints.controlword")[0] = 0x06
    ready.run(5, operational=False)
    assert joint(ready).state is State.SWITCH_ON_DISABLED
    assert joint(ready).al_state is AlState.SAFEOP


@pytest.mark.parametrize("command", [b"\x02\x01", b"\x80\x01", b"\x81\x01"])
def test_leaving_operational_switches_the_drive_off(enabled: Rig, command: bytes) -> None:
    enabled.outgoing.clear()
    enabled.outgoing.append(0x000, command)
    enabled.nodes.receive(enabled.outgoing, enabled.incoming)
    assert not joint(enabled).powered
    assert [d.powered for d in enabled.nodes.of(SimDrive)[1:]] == [True] * 7


def test_a_drive_without_a_safety_controller_has_no_sto(make_rig: type[Rig]) -> None:
    rig = make_rig([AxisDrive(name="axis", node=1, counts_per_metre=1000)])
    rig.bring_up()
    rig.walk(State.OPERATION_ENABLED)
    assert rig.nodes.of(SimAxisDrive)[0].powered


def test_drives_side_by_side_are_what_they_are_one_by_one(enabled: Rig) -> None:
    joints = enabled.nodes.of(SimJointDrive)
    enabled.image["joints.target_torque"][:] = np.arange(6.0)
    enabled.run(1)
    some = Drives(joints[1:4])
    some["position"][:] = (0.1, 0.2, 0.3)
    assert [joint.position for joint in joints] == [0.0, 0.1, 0.2, 0.3, 0.0, 0.0]
    for _ in range(2):
        some.update()
        assert some.command.tolist() == [joint.torque for joint in joints[1:4]]
        assert some.braked.tolist() == [joint.brake for joint in joints[1:4]]
        joints[2].mode = 8
    assert some.braked.tolist() == [False, True, False] and some.command[1] == 0.0 != some.command[2]


def test_drives_of_several_groups_do_not_lie_side_by_side(make_rig: type[Rig]) -> None:
    kinds = [("a", "left"), ("b", "right"), ("c", "left")]
    rig = make_rig(
        [
            AxisDrive(name=name, node=i, group=group, counts_per_metre=1000)
            for i, (name, group) in enumerate(kinds, 1)
        ]
    )
    a, b, c = rig.nodes.of(SimAxisDrive)
    assert Drives([a, c])["velocity"].shape == (2,)
    with pytest.raises(NetworkError, match=r"of a, b do not lie side by side; make them one group"):
        Drives([a, b])


@pytest.fixture
def heated(devices: list[Device]) -> Rig:
    """Joint 1 may give 150 instead of 100 N m for 0.5 s; it is enabled."""
    first = devices[0]
    assert isinstance(first, JointDrive)
    devices[0] = msgspec.structs.replace(first, peak_torque=Torque(150.0), peak_time=PeakTime(0.5))
    rig = Rig(devices)
    rig.bring_up()
    rig.run(3)
    rig.walk(State.OPERATION_ENABLED)
    return rig


def tell(rig: Rig, torque: float, ticks: int) -> list[float]:
    """Tells joint 1 a torque; what it gives in each tick."""
    rig.image["joints.target_torque"][0] = torque
    given = []
    for _ in range(ticks):
        rig.run(1)
        given.append(joint(rig).torque)
    return given


def test_a_drive_folds_back_to_its_rated_torque_after_the_time_of_its_peak(heated: Rig) -> None:
    given = tell(heated, 150.0, 560)
    assert 498 <= np.count_nonzero(np.isclose(given, 150.0)) <= 502
    np.testing.assert_allclose(given[-50:], 100.0)
    assert joint(heated).folded
    assert heated.image.word("joints.statusword")[0] & 0x0800  # internal limit active
    assert not heated.image.word("joints.statusword")[1] & 0x0800
    assert heated.image.emcy[0] == 0
    tell(heated, 0.0, 100)
    assert not joint(heated).folded
    assert not heated.image.word("joints.statusword")[0] & 0x0800
    np.testing.assert_allclose(tell(heated, 200.0, 10)[1:], 150.0)  # never more than the peak (6072h)


def test_a_drive_that_is_told_more_while_it_is_folded_back_has_a_fault_until_it_cooled(heated: Rig) -> None:
    tell(heated, 150.0, 610)
    assert joint(heated).state is State.FAULT
    assert heated.image.emcy[0] == 0x2350
    heated.image["joints.target_torque"][0] = 0.0
    assert command(heated, 0x80) is State.FAULT  # still hot
    heated.run(60)
    command(heated, 0x00)
    assert command(heated, 0x80) is State.SWITCH_ON_DISABLED


def test_a_motor_does_not_cool_because_its_drive_restarts_and_stays_cool_below_its_rated_torque(
    heated: Rig,
) -> None:
    tell(heated, 150.0, 250)
    used = joint(heated).used
    assert used == pytest.approx(0.5, abs=0.01)
    joint(heated).reset()
    assert joint(heated).used == used
    others = heated.nodes.of(SimJointDrive)[1]
    assert others.used == 0.0


def test_a_drive_without_a_peak_gives_what_it_is_told(enabled: Rig) -> None:
    np.testing.assert_allclose(tell(enabled, 150.0, 100)[1:], 150.0)
    assert not joint(enabled).folded
