"""Random hands on the simulated machines: few and short here, `hapticd hands` asks many."""

import pickle
import shlex
from dataclasses import replace
from itertools import pairwise
from math import dist
from random import Random
from typing import Any

import msgspec
import numpy as np
import pytest
from hapticd.devices.torque_drive import TorqueDrive
from hapticd.experiments import hands
from hapticd.experiments.hands import BLOCK, NOT_STARTED, Kept, Session, Tally, Work, session, sessions
from hapticd.experiments.own_plant import TYPICAL, Doubt, believed
from hapticd.experiments.random_hand import stranger
from hapticd.experiments.temper import Temper
from hapticd.machines.giant.config import GiantConfig
from hapticd.machines.giant.kinematics import points
from hapticd.models import Robot
from hapticd.runtime.command_line.cli import main
from hapticd.runtime.configuration.config import Loaded, load, parse
from hapticd.runtime.configuration.known import built_in
from hapticd.runtime.configuration.session import build
from hapticd.runtime.configuration.system import System, find_system
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.core.sections import Config
from hapticd.runtime.errors import ConfigError, Finding
from hapticd.runtime.live.lockstep import Lockstep

MACHINES = ("giant", "rhi")
TEMPER = Temper(force=30.0, torque=5.0, speed=1.0)


class Shifted:
    """Wants to be somewhere else."""

    def at(self, t: float) -> tuple[list[float], list[float]]:
        return [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]


def a_stranger(machine: str, seed: int, seconds: float = 12.0, temper: Temper = TEMPER) -> Config:
    loaded = load(machine)
    robot = Robot.from_urdf(loaded.model_text, loaded.model_source)
    return stranger(loaded.config, find_system(machine), robot, seed, seconds, temper)


@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize("seed", range(4))
def test_a_stranger_is_a_valid_configuration_and_holds_the_handle_where_it_is(
    machine: str, seed: int
) -> None:
    config = a_stranger(machine, seed)
    lockstep = Lockstep(build(replace(load(machine), config=config)))
    lockstep.run(200)
    # whoever pulls at a machine that stands keeps it from starting
    assert not lockstep.session.cycle.machine.unrest(True)
    assert config.simulation is not None
    hand = config.simulation.hand
    assert hand.force <= TEMPER.force and hand.path[-1].at >= 12.0
    moving = [(a, b) for a, b in pairwise(hand.path) if a.position != b.position]
    assert all(dist(a.position, b.position) <= TEMPER.speed * (b.at - a.at) for a, b in moving)
    assert len(moving) > 2


@pytest.mark.parametrize("machine", MACHINES)
def test_a_seed_is_a_hand(machine: str) -> None:
    assert a_stranger(machine, 3) == a_stranger(machine, 3)
    assert a_stranger(machine, 3) != a_stranger(machine, 4)
    assert a_stranger(machine, 3, 6.0) == a_stranger(machine, 3, 25.0)
    long = a_stranger(machine, 3, 40.0)
    assert long.simulation is not None and long.simulation.hand.path[-1].at >= 40.0


def test_a_machine_that_says_nothing_of_its_space_begins_as_configured() -> None:
    loaded = load("rhi")
    robot = Robot.from_urdf(loaded.model_text, loaded.model_source)
    system = find_system("rhi")
    silent = System(*(getattr(system, name) for name in system.__slots__[:6]))
    config = stranger(loaded.config, silent, robot, 1, 8.0, TEMPER)
    assert config.simulation is not None and loaded.config.simulation is not None
    assert config.simulation.rhi == loaded.config.simulation.rhi  # type: ignore[attr-defined]
    own = np.array([point.position for point in loaded.config.simulation.hand.path])
    path = np.array([point.position for point in config.simulation.hand.path])
    assert (path[0] == own[0]).all() and len(path) > 4
    assert (path >= own.min(axis=0) - 1e-9).all() and (path <= own.max(axis=0) + 1e-9).all()


def test_giants_begin_inside_their_limits_all_over_their_space() -> None:
    loaded = load("giant")
    assert isinstance(loaded.config, GiantConfig)
    robot = Robot.from_urdf(loaded.model_text, loaded.model_source)
    stance = find_system("giant").stance
    assert stance is not None
    elbows = []
    for seed in range(50):
        config = stance(loaded.config, robot, Random(seed)).config
        q, ppu = config.simulation.giant.posture, config.simulation.giant.ppu
        handle, elbow = points(q, ppu)
        box, tilt = config.giant.box, config.giant.manipulator.tilt
        for place in (handle, elbow):
            assert all(low < x < high for x, low, high in zip(place, box.lower, box.upper, strict=True))
        assert tilt[0] < q[3] + q[4] < tilt[1]
        elbows.append(elbow)
    assert np.ptp(elbows, axis=0)[:2].min() > 2.0


@pytest.mark.parametrize("machine", ["operator", "avatar"])
def test_at_a_station_both_palms_are_led_about_and_the_machine_starts(machine: str) -> None:
    config = a_stranger(machine, 3)
    assert config.simulation is not None
    path: Any = config.simulation.hand.path
    for part in ("position", "turned", "left", "left_turned"):
        assert np.ptp([getattr(poses, part) for poses in path], axis=0).min() > 0.3, part
    for a, b in pairwise(path):
        for part in ("position", "left"):
            assert dist(getattr(a, part), getattr(b, part)) <= TEMPER.speed * (b.at - a.at)
    found = session(load(machine), 3, 3.0, TEMPER)
    assert (found.stop, found.seconds) == ("", 3.0)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1009, 1011, 74021])
def test_an_avatar_that_is_led_further_than_it_reaches_goes_on_inside_its_limits(seed: int) -> None:
    found = session(load("avatar"), seed, 13.0, Temper(force=50.0, torque=10.0, speed=1.5))
    assert (found.stop, found.seconds) == ("", 13.0)
    assert max(found.excess.values()) < 0.01


def test_a_hand_presses_as_late_as_the_configured_one_and_stands_until_then() -> None:
    loaded = load("giant")
    text = loaded.text.replace('at = "0.3 s", pressed', 'at = "2 s", pressed')
    late = replace(loaded, text=text, config=parse(text, loaded.source))
    robot = Robot.from_urdf(late.model_text, late.model_source)
    config = stranger(late.config, find_system("giant"), robot, 3, 6.0, TEMPER)
    soon = a_stranger("giant", 3, 6.0)
    assert config.simulation is not None and soon.simulation is not None
    hand, sooner = config.simulation.hand, soon.simulation.hand
    assert (hand.dead_man[0].at, sooner.dead_man[0].at) == (2.0, 0.3)
    assert [point.at for point in hand.path[1:9]] == pytest.approx([p.at + 1.7 for p in sooner.path[1:9]])


@pytest.mark.parametrize("arming", ["dead-man", "command"])
def test_a_hand_starts_a_machine_that_nobody_is_configured_to_start(arming: str) -> None:
    loaded = load("giant")
    text = loaded.text.replace('[{ at = "0.3 s", pressed = true }]', "[]")
    text = text.replace('by = "dead-man"', f'by = "{arming}"')
    config = parse(text, loaded.source)
    assert config.simulation is not None and not config.simulation.hand.dead_man
    gentle = Temper(force=5.0, torque=1.0, speed=0.2)
    found = session(replace(loaded, text=text, config=config), 3, 4.5, gentle)
    assert (found.stop, found.seconds) == ("", 4.5)


@pytest.mark.parametrize("machine", MACHINES)
def test_a_gentle_hand_stops_nothing_and_passes_no_limit(machine: str) -> None:
    gentle = Temper(force=5.0, torque=1.0, speed=0.2)
    found = session(load(machine), 2, 5.0, gentle)
    assert (found.stop, found.seconds) == ("", 5.0)
    assert found.excess and max(found.excess.values()) < 1e-3


@pytest.mark.parametrize("seed", [3, 5, 14, 31])
def test_a_redundant_interface_keeps_its_joint_limits_under_any_wall_home_and_hand(seed: int) -> None:
    """Both resolutions; strong and fast hands: only the posture keeps the motors off their limits."""
    found = session(load("rhi"), seed, 6.0, Temper(force=30.0, speed=0.5))
    assert (found.stop, found.seconds) == ("", 6.0)
    assert max(excess for name, excess in found.excess.items() if "torque" not in name) <= 0.0


def test_random_walls_and_homes_are_all_over_the_reach_and_postures_inside_the_limits() -> None:
    configs = [a_stranger("rhi", seed) for seed in range(12)]
    points = np.array([config.rhi.bodies["wall"].point for config in configs])  # type: ignore[attr-defined]
    assert np.ptp(points, axis=0).min() > 0.3
    assert {c.rhi.null_space.resolution for c in configs} == {"projection", "hqp"}  # type: ignore[attr-defined]
    for config in configs:
        motors, plant = config.rhi.motors, config.simulation.rhi  # type: ignore[attr-defined, union-attr]
        for q in (plant.posture, config.rhi.task.home):  # type: ignore[attr-defined]
            assert all(
                a <= x - 0.09 and x + 0.09 <= b for a, x, b in zip(motors.lower, q, motors.upper, strict=True)
            )


@pytest.mark.slow
@pytest.mark.parametrize(("machine", "count"), [("giant", 24), ("rhi", 16)])
def test_strangers_stop_nothing_and_pass_no_limit_by_more_than_its_margin(machine: str, count: int) -> None:
    loaded, tally = load(machine), Tally()
    for found in sessions(loaded, range(100, 100 + count), 5.0, TEMPER, 1):
        tally.add(found)
    assert {reason: found.detail for reason, found in tally.examples.items()} == {}
    assert tally.finished == count and tally.worst_excess
    assert max(tally.worst_excess.values()) < loaded.config.safety.position_margin


def test_a_hand_waits_until_a_slow_machine_is_ready() -> None:
    loaded = load("panda")
    config: Any = loaded.config
    plant = msgspec.structs.replace(config.simulation.arm, substeps=12)
    slow = msgspec.structs.replace(
        config,
        loop=msgspec.structs.replace(config.loop, rate=260.0),
        simulation=msgspec.structs.replace(config.simulation, arm=plant),
    )
    assert session(replace(loaded, config=slow), 1, 1.5, Temper()).stop != NOT_STARTED


def test_extents_are_those_of_every_tick_beyond_where_it_began() -> None:
    bench = Lockstep(build(load("rhi")))
    kept, rows = Kept(bench), []
    bench.session.cycle.phase.mode = Mode.ACTIVE
    rng = np.random.default_rng(1)
    specs = bench.session.system.limits(bench.session.config).specs
    for k in range(2 * BLOCK + 5):
        rows.append((rng.normal(size=len(specs)) * (5.0 if k else 0.1)).tolist())
        rows[-1][1] = float("nan")
        kept._limits.values = lambda state: rows[-1]  # type: ignore[method-assign]
        kept.add()
    values = np.array(rows)
    excess = kept.excess
    assert list(excess) == [spec.name for i, spec in enumerate(specs) if i != 1]
    for i, spec in enumerate(specs):
        beyond = np.maximum(spec.lower - values[:, i], values[:, i] - spec.upper)
        assert i == 1 or excess[spec.name] == beyond.max() - max(0.0, beyond[0])


def test_what_stops_a_session_and_when_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def press(lockstep: Lockstep) -> None:
        if lockstep.inputs.tick == 1000:
            lockstep.plant._plc.emergency_stop = (True, True)  # type: ignore[attr-defined]

    found = session(load("rhi"), 1, 5.0, TEMPER, press)
    assert found.stop == "e_stop" and found.detail and found.seconds == pytest.approx(1.002, abs=2e-3)


def test_a_machine_that_does_not_start_is_no_session_that_finished() -> None:
    def pull(lockstep: Lockstep) -> None:
        lockstep.plant.hand._course = Shifted()  # type: ignore[attr-defined]

    found = session(load("rhi"), 1, 1.0, TEMPER, pull)
    assert found.stop == NOT_STARTED and "the handle is pulled" in found.detail


def test_the_worst_session_is_the_earliest_of_the_strongest_stops_or_passes_a_limit_furthest() -> None:
    calm = Session(1, "", "", 0, 9.0, {"a": -0.1, "b": 0.1})
    wide = Session(2, "", "", 0, 9.0, {"a": 0.2, "b": -0.3})
    late, early = (Session(s, "x", "why", 3, t) for s, t in ((3, 8.0), (4, 7.0)))
    tally = Tally()
    seen = []
    for one in (calm, wide, late, early, replace(early, seed=5, seconds=2.0, reaction=2), calm):
        tally.add(one)
        assert tally.worst is not None
        seen.append(tally.worst.seed)
    assert seen == [1, 2, 3, 4, 4, 4]
    assert (tally.sessions, tally.finished, dict(tally.stops)) == (6, 3, {"x": 3})
    assert tally.worst_excess == {"a": 0.2, "b": 0.1}


def test_what_a_hand_got_back_is_the_most_it_ever_had_beyond_what_it_put_in(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    lockstep = Lockstep(build(load("rhi")))
    powers = iter([2.0, 2.0, -6.0, -6.0, 4.0, 30.0])
    monkeypatch.setattr(type(lockstep.plant), "hand_power", property(lambda plant: next(powers)))
    lockstep.session.cycle.phase.mode = Mode.ACTIVE
    work = Work(lockstep)
    for _ in range(6):
        work.add()
    # between the ticks, in turn: 2, -2, -6, -1 and 17 W
    assert work.returned == pytest.approx(7.0 / lockstep.session.config.loop.rate)


@pytest.mark.parametrize(
    ("seed", "seconds"),
    [
        pytest.param(702030, 5.8, id="joint 2 rides on its speed"),
        pytest.param(700024, 8.1, id="gantry and arm take the elbow to its wall"),
        pytest.param(700035, 6.4, id="the elbow in the corner next to a post"),
    ],
)
def test_a_strong_hand_that_stopped_the_giant_stops_it_no_more(seed: int, seconds: float) -> None:
    found = session(load("giant"), seed, seconds, Temper(150.0, 12.0, 2.0))
    assert not found.stop
    assert max(found.excess.values()) < 0.005


def test_an_arm_that_stops_along_a_wall_of_its_box_meets_nothing_beyond_it() -> None:
    """Its stop from there, followed to its end, would take the handle through the wall to a link."""
    doubt = Doubt(model=False, errors=True)
    assert not session(load("panda"), 5303, 9.0, Temper(150.0, 12.0, 2.0), doubt=doubt).stop


def test_a_hand_s_power_is_what_the_plant_s_steps_count_as_its_work() -> None:
    lockstep = Lockstep(build(load("panda")))
    plant: Any = lockstep.plant
    summed = counted = 0.0
    for _ in range(5000):
        before, power = plant.arm.work.hand, plant.hand_power
        lockstep.tick()
        summed += 0.5e-3 * (power + plant.hand_power)
        counted += plant.arm.work.hand - before
    assert summed == pytest.approx(counted, rel=0.02) and abs(counted) > 0.2


def test_processes_share_the_work_and_change_nothing() -> None:
    loaded, seeds = load("rhi"), (7, 8, 9)
    alone = list(sessions(loaded, seeds, 1.0, TEMPER, 1))
    assert list(sessions(loaded, seeds, 1.0, TEMPER, 2)) == alone
    assert [found.seed for found in alone] == [7, 8, 9]


def test_the_command_prints_what_became_of_them_and_how_to_see_the_worst_again(
    capsys: pytest.CaptureFixture[str],
) -> None:
    words = ["hands", "rhi", "--count", "3", "--seed", "5", "--seconds", "1.5", "--force", "20", "--json"]
    status = main(words)
    found = msgspec.json.decode(capsys.readouterr().out)
    assert list(found) == ["sessions", "finished", "stops", "worst_excess", "worst", "returned"]
    assert found["sessions"] == 3 == found["finished"] + sum(found["stops"].values())
    assert status == int(found["finished"] < 3)
    again = shlex.split(found["worst"])[1:]
    assert again[:5] == ["hands", "rhi", "--count", "1", "--seed"] and again[5] in ("5", "6", "7")
    assert again[6:] == ["--seconds", "1.5", "--force", "20.0"]
    main([*again, "--json"])
    alone = msgspec.json.decode(capsys.readouterr().out)
    limits = found["worst_excess"]
    assert alone["worst_excess"]
    assert any(excess == limits[name] for name, excess in alone["worst_excess"].items())
    assert main(words[:-1]) == status
    told = capsys.readouterr().out
    assert f"the worst again: {found['worst']}" in told and all(name in told for name in limits)


def test_a_machine_without_a_simulation_is_an_error_that_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    loaded = load("rhi")
    bare: Loaded = replace(loaded, config=msgspec.structs.replace(loaded.config, simulation=None))
    with pytest.raises(Exception, match=r"rhi.toml has no \[simulation\]"):
        list(sessions(bare, [1], 1.0, TEMPER, 1))


def test_a_machine_without_variations_says_what_to_leave_out() -> None:
    with pytest.raises(Exception, match="no variation 'frog' of this machine; it has none; leave --vary out"):
        list(sessions(load("giant"), [1], 1.0, TEMPER, 1, vary="frog"))


@pytest.mark.parametrize(
    ("option", "value"), [("--seed", "-1"), ("--workers", "0"), ("--workers", "1000"), ("--force", "0")]
)
def test_words_that_make_no_sense_are_refused(option: str, value: str) -> None:
    with pytest.raises(SystemExit):
        main(["hands", "rhi", f"{option}={value}"])


def test_a_wrong_model_is_drawn_by_the_seed_and_the_hand_is_the_same() -> None:
    config, wrong = a_stranger("giant", 3), Doubt(model=True)
    varied, again, other = (wrong.vary(config, seed).simulation for seed in (3, 3, 4))
    assert varied == again != other
    assert varied is not None and config.simulation is not None
    assert varied.hand == config.simulation.hand and varied.sensors == config.simulation.sensors
    plant = varied.plant  # type: ignore[attr-defined]
    for factors, most in (
        (plant.masses, 0.2),
        (plant.rotor_inertia, 0.3),
        (plant.stiffness, 0.4),
    ):
        assert len(set(factors)) == 6 and all(abs(x - 1.0) <= most for x in factors)
    spread = [wrong.vary(config, s).simulation.plant.stiffness[0] for s in range(40)]  # type: ignore[union-attr]
    assert min(spread) < 0.7 and max(spread) > 1.3
    assert (plant.delay, plant.gear_friction) == (1, config.simulation.plant.gear_friction)  # type: ignore[attr-defined]


@pytest.mark.parametrize("machine", built_in())
def test_a_machine_that_can_be_doubted_can_be_built_so(machine: str) -> None:
    loaded, doubt = load(machine), Doubt(model=True, errors=True)
    assert doubt.fits(loaded.config) is (machine not in ("rhi", "panda_rhi", "panda_stamp"))
    if doubt.fits(loaded.config):
        changed = doubt.vary(loaded.config, 5)
        build(replace(loaded, config=changed))
        plant = changed.simulation.plant  # type: ignore[union-attr]
        arms = 2 if machine in ("operator", "avatar", "giant_avatar") else 1
        motors = sum(isinstance(device, TorqueDrive) for device in changed.devices.values())
        assert len(set(plant.masses)) == motors / arms and plant.delay == 1


@pytest.mark.parametrize("machine", ["giant", "rhi", "panda"])
def test_errors_are_those_of_the_sensors_that_a_machine_has(machine: str) -> None:
    loaded = load(machine)
    simulation = Doubt(errors=True).vary(loaded.config, 1).simulation
    assert simulation is not None and simulation.sensors is not None
    assert simulation.sensors.force == TYPICAL.force
    assert (simulation.sensors.acceleration is not None) is (machine == "giant")
    if machine != "rhi":
        assert simulation.plant.gear_friction > 0.0  # type: ignore[attr-defined]
    build(replace(loaded, config=msgspec.structs.replace(loaded.config, simulation=simulation)))


def test_a_doubtful_machine_under_a_gentle_hand_is_told_from_one_that_is_believed() -> None:
    gentle = Temper(force=5.0, torque=1.0, speed=0.2)
    giant = believed(load("giant"))
    as_believed = session(giant, 2, 4.5, gentle)
    doubtful = [
        session(giant, 2, 4.5, gentle, doubt=doubt) for doubt in (Doubt(model=True), Doubt(errors=True))
    ]
    assert all(found.excess != as_believed.excess for found in doubtful)
    assert session(giant, 2, 4.5, gentle, doubt=Doubt(errors=True)) == doubtful[1]


def test_a_machine_without_such_a_plant_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["hands", "rhi", "--count", "1", "--seconds", "1", "--wrong-model"]) == 2
    assert "leave --wrong-model out" in capsys.readouterr().err


def test_the_worst_again_is_as_doubtful(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["hands", "panda", "--count", "1", "--seconds", "0.5", "--wrong-model", "--errors", "--json"]
    main(words)
    again = shlex.split(msgspec.json.decode(capsys.readouterr().out)["worst"])
    assert again[-2:] == ["--wrong-model", "--errors"]


def test_surroundings_that_check_refuses_are_drawn_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """A seed whose first draw is fine keeps it; what no draw mends is told with the file's own line."""
    loaded = load("rhi")
    refusals = iter(["first"])
    made = hands.build

    def picky(varied: Loaded) -> Any:
        if next(refusals, ""):
            raise ConfigError(varied.source, [Finding(7, "rhi.bodies", "are not to its taste", "")])
        return made(varied)

    monkeypatch.setattr(hands, "build", picky)
    again = session(loaded, 3, 1.0, TEMPER)
    assert again.stop == "" and not next(refusals, "")
    plain = session(loaded, 3, 1.0, TEMPER)
    assert again.excess != plain.excess
    monkeypatch.setattr(hands, "DRAWS", 2)
    refusals = iter(["first", "second"])
    with pytest.raises(hands.HandsError, match="check refused 2 random surroundings, the last for: rhi"):
        session(loaded, 3, 1.0, TEMPER)


def test_an_error_comes_back_from_a_process_of_its_own_whole() -> None:
    error = ConfigError("mine.toml", [Finding(3, "loop.rate", "is odd", "make it even")])
    again = pickle.loads(pickle.dumps(error))
    assert str(again) == str(error) and again.findings == error.findings
    assert again.exit_status == 2
