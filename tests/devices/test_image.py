from __future__ import annotations

import struct
from math import inf, nan, pi

import numpy as np
import pytest
from hapticd.devices.axis_drive import AxisDrive
from hapticd.devices.device import Device
from hapticd.devices.errors import FrameError, NetworkError
from hapticd.devices.frames import Frames
from hapticd.devices.image import COUNTERS, Emergency, ProcessImage
from hapticd.devices.joint_drive import JointDrive
from hapticd.devices.network import Network
from msgspec.structs import replace

COUNTER = 0x1234


@pytest.fixture
def image(devices: list[Device]) -> ProcessImage:
    return ProcessImage(Network(devices))


def joint_tpdo(
    counter: int = COUNTER,
    al_state: int = 8,
    statusword: int = 0x0637,
    mode: int = 10,
    position: int = 0,
    link: int = 0,
    velocity: int = 0,
    torque: int = 0,
    error: int = 0,
) -> bytes:
    body = struct.pack(
        "<HBHbiiihH", counter, al_state, statusword, mode, position, link, velocity, torque, error
    )
    return body.ljust(24, b"\0")


def frames_of(*frames: tuple[int, bytes]) -> Frames:
    buffer = Frames()
    for can_id, data in frames:
        buffer.append(can_id, data)
    return buffer


def only(image: ProcessImage, *expected: str) -> bool:
    """Whether exactly these counters moved, by one each; `frames` counts everything."""
    moved = {name: int(n) for name, n in zip(COUNTERS, image.counters, strict=True) if n}
    moved.pop("frames")
    return moved == dict.fromkeys(expected, 1)


def test_a_tpdo_becomes_si_values_in_its_places(image: ProcessImage) -> None:
    data = bytes.fromhex("3412 08 3706 0a 00004000 00000800 00ffffff 18fc 1023 0000")
    assert image.latch(frames_of((0x182, data)), COUNTER) == 1
    assert image.working_counter == 1
    assert image.fresh.tolist() == [False, True] + [False] * 10
    assert image.al_state[1] == 8
    radians = 2 * pi / 65536 / 100
    assert image["joints.position"][1] == pytest.approx(0x400000 * radians)
    assert image["joints.link_position"][1] == pytest.approx(pi)
    assert image["joints.velocity"][1] == pytest.approx(-256 * radians)
    assert image["joints.load_torque"][1] == pytest.approx(-100.0)
    assert image.word("joints.statusword")[1] == 0x0637
    assert image.word("joints.mode")[1] == 10
    assert image.word("joints.error_code")[1] == 0x2310
    assert image.raw[24:48].tobytes() == data
    assert not image["joints.position"][[0, 2, 3, 4, 5]].any()


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("raw", [-(2**31), -1, 0, 1, 2**31 - 1])
def test_inputs_hold_at_the_limits_of_their_type_and_follow_the_sign(sign: int, raw: int) -> None:
    axis = AxisDrive(name="axis", node=1, counts_per_metre=1000, sign=sign, zero=0.5)
    image = ProcessImage(Network([axis]))
    data = struct.pack("<HBHbiiH", COUNTER, 8, 0, 9, raw, raw, 0)
    image.latch(frames_of((0x181, data)), COUNTER)
    assert image["axes.position"][0] == pytest.approx(sign * raw / 1000 + 0.5)
    assert image["axes.velocity"][0] == pytest.approx(sign * raw / 1000)


def test_vectors_and_nan_of_a_sensor_pass_through(image: ProcessImage) -> None:
    data = struct.pack("<HB6fH", COUNTER, 8, 1.5, -2.0, nan, 0.25, 0.0, -0.125, 1).ljust(32, b"\0")
    image.latch(frames_of((0x189, data)), COUNTER)
    wrench = image["force_torque.wrench"]
    assert wrench.shape == (1, 6)
    np.testing.assert_array_equal(wrench[0], [1.5, -2.0, nan, 0.25, 0.0, -0.125])
    assert image["imus.acceleration"].shape == (2, 3)


def test_views_are_bound_once_and_stay_valid(image: ProcessImage) -> None:
    position = image["joints.position"]
    image.latch(frames_of((0x181, joint_tpdo(position=65536 * 100))), COUNTER)
    assert position[0] == pytest.approx(2 * pi)
    assert position.flags.c_contiguous


def test_the_kernel_may_set_the_fdf_flag(image: ProcessImage) -> None:
    frames = frames_of((0x181, joint_tpdo()))
    frames.array["flags"] = 0x04 | 0x01
    assert image.latch(frames, COUNTER) == 1


def test_a_stale_tpdo_is_dropped_and_counted(image: ProcessImage) -> None:
    image.latch(frames_of((0x181, joint_tpdo(COUNTER - 1, position=7))), COUNTER)
    assert image.working_counter == 0
    assert image["joints.position"][0] == 0.0
    assert only(image, "stale")


def test_a_tpdo_with_a_counter_of_the_future_is_dropped_and_counted(image: ProcessImage) -> None:
    image.latch(frames_of((0x181, joint_tpdo(COUNTER + 1))), COUNTER)
    assert only(image, "ahead")


def test_the_counter_wraps(image: ProcessImage) -> None:
    assert image.latch(frames_of((0x181, joint_tpdo(0))), 0x10000) == 1
    image.latch(frames_of((0x181, joint_tpdo(0xFFFF))), 0x10000)
    assert image.counters[COUNTERS.index("stale")] == 1


def test_a_duplicate_is_dropped_and_counted(image: ProcessImage) -> None:
    image.latch(frames_of((0x181, joint_tpdo()), (0x181, joint_tpdo())), COUNTER)
    assert image.working_counter == 1
    assert only(image, "duplicate")


def test_two_different_answers_in_a_tick_are_a_second_sender(image: ProcessImage) -> None:
    image.latch(frames_of((0x181, joint_tpdo(position=1)), (0x181, joint_tpdo(position=2))), COUNTER)
    assert image["joints.position"][0] == pytest.approx(2 * pi / 6553600)
    assert only(image, "conflict")


@pytest.mark.parametrize(
    ("sent", "discarded", "intruding"),
    [
        ([(0x181, joint_tpdo(COUNTER - 1))], 1, 0),
        ([(0x181, joint_tpdo(COUNTER + 1))], 1, 0),
        ([(0x181, joint_tpdo())] * 3, 2, 0),
        ([(0x181, joint_tpdo(position=1)), (0x181, joint_tpdo(position=2))], 0, 1),
        ([(0x080, b"")], 0, 1),
    ],
)
def test_what_was_discarded_and_what_intruded_is_told_of_the_last_tick_alone(
    image: ProcessImage, sent: list[tuple[int, bytes]], discarded: int, intruding: int
) -> None:
    for _ in range(2):
        image.latch(frames_of(*sent), COUNTER)
        assert (image.discarded, image.intruding) == (discarded, intruding)
    image.latch(Frames(), COUNTER)
    assert (image.discarded, image.intruding) == (0, 0)


@pytest.mark.parametrize(
    "trouble",
    [
        (0x182, joint_tpdo(al_state=4)),  # it answers, but fell back to SAFEOP
        (0x182, b""),  # it does not answer
        (0x702, b"\x7f"),  # it left OPERATIONAL
        (0x082, b"\x10\x23" + bytes(6)),  # it reports an error
    ],
)
def test_a_network_is_calm_where_every_device_answers_in_op_without_an_error(
    devices: list[Device], trouble: tuple[int, bytes]
) -> None:
    image = ProcessImage(Network(devices[:2]))
    healthy = [(0x181, joint_tpdo()), (0x182, joint_tpdo())]
    image.latch(frames_of(*healthy), COUNTER)
    assert image.calm
    others = [frame for frame in healthy if frame[0] != trouble[0]]
    image.latch(frames_of(*others, trouble), COUNTER)
    assert not image.calm


@pytest.mark.parametrize("data", [b"", joint_tpdo()[:-1], joint_tpdo() + bytes(8)])
def test_a_tpdo_of_the_wrong_length_is_dropped_and_counted(image: ProcessImage, data: bytes) -> None:
    assert image.latch(frames_of((0x181, data)), COUNTER) == 0
    assert only(image, "length")


def test_the_clock_of_the_bus_is_nobody_s_fault(image: ProcessImage) -> None:
    image.latch(frames_of((0x100, bytes(6))), COUNTER)
    assert image.counters.sum() == image.counters[COUNTERS.index("frames")] == 1


@pytest.mark.parametrize("can_id", [0x140, 0x1FF, 0x18D, 0x201, 0x281, 0x58D, 0x7FF, 0x80000181])
def test_identifiers_that_nobody_owns_are_counted(image: ProcessImage, can_id: int) -> None:
    assert image.latch(frames_of((can_id, joint_tpdo())), COUNTER) == 0
    assert only(image, "unknown")


@pytest.mark.parametrize("can_id", [0x000, 0x080, 0x101, 0x13F, 0x601])
def test_what_only_a_master_sends_is_counted_as_foreign(image: ProcessImage, can_id: int) -> None:
    image.latch(frames_of((can_id, b"\x01\x00")), COUNTER)
    assert only(image, "foreign")


@pytest.mark.parametrize(
    ("can_id", "data", "counter"),
    [
        (0x081, b"\x10\x23\x01", "bad_emcy"),
        (0x701, b"", "bad_heartbeat"),
        (0x701, b"\x05\x00", "bad_heartbeat"),
        (0x701, b"\x42", "bad_heartbeat"),
        (0x581, b"\x60", "bad_sdo"),
        (0x20000004, bytes(8), "error_frames"),
    ],
)
def test_malformed_service_frames_are_counted(
    image: ProcessImage, can_id: int, data: bytes, counter: str
) -> None:
    image.latch(frames_of((can_id, data)), COUNTER)
    assert only(image, counter)
    assert not image.emergencies


def test_bus_off_is_counted_besides_the_error_frame(image: ProcessImage) -> None:
    image.latch(frames_of((0x20000040, bytes(8))), COUNTER)
    assert only(image, "error_frames", "bus_off")


def test_an_emergency_is_kept_until_it_is_reset(image: ProcessImage) -> None:
    image.latch(frames_of((0x083, bytes.fromhex("1023 09 0102030405"))), COUNTER)
    assert image.emergencies == [Emergency(2, 0x2310, 0x09, b"\x01\x02\x03\x04\x05")]
    image.latch(Frames(), COUNTER)
    assert image.emergencies == []
    assert image.emcy[2] == 0x2310
    image.latch(frames_of((0x083, bytes(8))), COUNTER)
    assert image.emcy[2] == 0


ERROR, RESET = (0x083, bytes.fromhex("1023 09 0000000000")), (0x083, bytes(8))


@pytest.mark.parametrize(
    ("sent", "during", "after"),
    [
        ([ERROR, RESET], 0x2310, 0),
        ([ERROR, RESET, RESET], 0x2310, 0),
        ([ERROR, RESET, (0x083, b"\x10\x43" + bytes(6))], 0x4310, 0x4310),
        ([RESET, ERROR], 0x2310, 0x2310),
    ],
)
def test_an_error_that_is_reset_within_its_tick_stands_for_that_tick(
    image: ProcessImage, sent: list[tuple[int, bytes]], during: int, after: int
) -> None:
    for _ in range(2):
        image.latch(frames_of(*sent), COUNTER)
        assert image.emcy[2] == during
        image.latch(Frames(), COUNTER)
        assert image.emcy[2] == after
    image.latch(frames_of(RESET), COUNTER)  # of an error of another tick: at once
    assert image.emcy[2] == 0


def test_more_emergencies_than_are_kept_do_no_harm(image: ProcessImage) -> None:
    image.latch(frames_of(*[(0x081 + i % 12, b"\x00\x10" + bytes(6)) for i in range(60)]), COUNTER)
    assert len(image.emergencies) == 16


def test_consecutive_misses_are_counted_per_device(image: ProcessImage) -> None:
    for tick in range(3):
        image.latch(frames_of((0x181, joint_tpdo(tick))), tick)
    for tick in range(3, 8):
        image.latch(frames_of((0x182, joint_tpdo(tick))), tick)
    assert image.missed[:3].tolist() == [5, 0, 8]
    assert image.counters[COUNTERS.index("misses")] == 5  # of devices that had been heard
    image.latch(frames_of((0x181, joint_tpdo(8))), 8)
    assert image.missed[:3].tolist() == [0, 1, 9]


def test_a_device_that_missed_a_tick_keeps_its_last_inputs(image: ProcessImage) -> None:
    image.latch(frames_of((0x181, joint_tpdo(position=100))), COUNTER)
    before = image["joints.position"][0]
    image.latch(Frames(), COUNTER + 1)
    assert image["joints.position"][0] == before != 0.0
    assert not image.fresh.any()


@pytest.mark.parametrize("state", [0, 4, 127])
def test_a_boot_up_or_non_operational_heartbeat_while_running_means_lost(
    image: ProcessImage, state: int
) -> None:
    image.latch(frames_of((0x701, bytes([127]))), COUNTER)
    assert not image.lost.any()
    image.latch(frames_of((0x181, joint_tpdo()), (0x701, b"\x05")), COUNTER)
    assert not image.lost.any()
    image.latch(frames_of((0x701, bytes([state]))), COUNTER)
    assert image.lost.tolist() == [True] + [False] * 11
    image.reset()
    assert not image.lost.any()


def test_the_age_of_a_heartbeat_counts_ticks(image: ProcessImage) -> None:
    image.latch(frames_of((0x702, b"\x05")), COUNTER)
    for _ in range(7):
        image.latch(Frames(), COUNTER)
    assert image.heartbeat_age[1] == 7
    assert image.nmt_state[:2].tolist() == [255, 5]


def test_random_frames_never_crash_the_decoder(image: ProcessImage) -> None:
    rng = np.random.default_rng(3)
    ids = [0, 0x80, 0x101, *range(0x081, 0x08E), *range(0x181, 0x18E), *range(0x701, 0x70E)]
    frames = Frames()
    for tick in range(3000):
        frames.clear()
        for _ in range(rng.integers(0, 30)):
            can_id = int(rng.choice(ids)) if rng.random() < 0.8 else int(rng.integers(0, 2**32))
            data = rng.bytes(int(rng.choice([0, 1, 5, 8, 16, 24, 32, 64])))
            if rng.random() < 0.3:
                data = struct.pack("<H", tick & 0xFFFF) + data[2:]
            frames.append(can_id, data)
        before = int(image.counters[0])
        working = image.latch(frames, tick)
        assert working == int(image.fresh.sum())
        assert image.counters[0] == before + len(frames)
        assert len(image.emergencies) <= 16


def test_every_dropped_frame_is_counted_exactly_once(image: ProcessImage) -> None:
    rng = np.random.default_rng(4)
    drops = [COUNTERS.index(name) for name in COUNTERS[1:12]]
    for tick in range(500):
        can_id = int(rng.integers(0x180, 0x190))
        frames = frames_of((can_id, rng.bytes(24)))
        before = int(image.counters[drops].sum())
        taken = image.latch(frames, tick)
        assert int(image.counters[drops].sum()) - before == 1 - taken


def outputs(image: ProcessImage, operational: bool = True) -> bytes:
    frames = Frames()
    image.compose(frames, COUNTER, operational)
    assert [can_id for can_id, _ in frames] == [0x080]
    return frames[0][1]


def test_outputs_become_bytes_in_their_slots(image: ProcessImage) -> None:
    image.word("joints.controlword")[0] = 0x000F
    image["joints.target_torque"][0] = -12.3456
    image["axes.target_velocity"][1] = 0.25
    image.word("safety.request")[0] = 0x01
    data = outputs(image)
    assert data[:4] == b"\x34\x12\x01\x00"
    assert data[4:8] == b"\x0f\x00" + struct.pack("<h", -123)
    assert data[36:40] == struct.pack("<i", 250_000)
    assert data[40] == 0x01
    assert image.raw[image.network.raw_inputs :].tobytes() == data


@pytest.mark.parametrize(
    ("torque", "raw", "saturated"),
    [
        (0.05, 0, 0),  # halves to even
        (0.25, 2, 0),
        (-0.75, -8, 0),
        (3276.7, 32767, 0),
        (3276.8, 32767, 1),
        (-3276.8, -32768, 0),
        (-1e300, -32768, 1),
    ],
)
def test_outputs_are_rounded_and_saturated(
    image: ProcessImage, torque: float, raw: int, saturated: int
) -> None:
    image["joints.target_torque"][0] = torque
    assert struct.unpack_from("<h", outputs(image), 6) == (raw,)
    assert image.counters[COUNTERS.index("saturated")] == saturated


def test_the_sign_of_an_output_follows_the_device(devices: list[Device]) -> None:
    joint = devices[0]
    assert isinstance(joint, JointDrive)
    image = ProcessImage(Network([replace(joint, sign=-1)]))
    image["joints.target_torque"][0] = 1.0
    assert struct.unpack_from("<h", outputs(image), 6) == (-10,)


@pytest.mark.parametrize("value", [nan, inf, -inf])
def test_an_output_that_is_no_number_goes_out_as_zero_and_is_reported(
    image: ProcessImage, value: float
) -> None:
    image["joints.target_torque"][:] = 5.0
    image["joints.target_torque"][2] = value
    image["axes.target_velocity"][0] = value
    frames = Frames()
    assert image.compose(frames, COUNTER, operational=True) == 2
    assert image.not_finite == ["joint3.target_torque", "ppu_x.target_velocity"]
    data = frames[0][1]
    assert [struct.unpack_from("<h", data, 6 + 4 * i)[0] for i in range(6)] == [50, 50, 0, 50, 50, 50]
    assert data[30:34] == bytes(4)
    assert image.counters[COUNTERS.index("not_finite")] == 2
    image["joints.target_torque"][2] = image["axes.target_velocity"][0] = 0.0
    assert image.compose(frames, COUNTER, operational=True) == 0
    assert image.not_finite == []


def test_outputs_that_are_not_valid_go_out_as_zeros(image: ProcessImage) -> None:
    image["joints.target_torque"][:] = 5.0
    image.word("joints.controlword")[:] = 0x0F
    assert outputs(image, operational=False) == b"\x34\x12" + bytes(46)


def test_further_output_frames_go_out_before_sync_with_the_same_counter() -> None:
    drives = [AxisDrive(name=f"axis{i}", node=i, counts_per_metre=1000) for i in range(1, 26)]
    image = ProcessImage(Network(drives))
    image["axes.target_velocity"][:] = np.arange(25)
    frames = Frames()
    image.compose(frames, COUNTER, operational=True)
    assert [can_id for can_id, _ in frames] == [0x101, 0x102, 0x080]
    assert {data[:3] for _, data in frames} == {b"\x34\x12\x01"}
    assert struct.unpack_from("<i", frames[0][1], 4 + 2) == (10_000,)


def test_composing_into_a_full_buffer_is_an_error(image: ProcessImage) -> None:
    frames = Frames(capacity=1)
    frames.append(1, b"")
    with pytest.raises(FrameError, match="no room for the output frames"):
        image.compose(frames, COUNTER, operational=True)


def test_names_that_do_not_exist_are_answered_with_those_that_do(image: ProcessImage) -> None:
    with pytest.raises(NetworkError, match=r"no quantity 'joints\.statusword'.*joints\.position"):
        image["joints.statusword"]
    with pytest.raises(NetworkError, match=r"no word 'joints\.position'.*joints\.statusword"):
        image.word("joints.position")
