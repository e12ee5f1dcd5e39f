"""The redundant interface on the runtime: its session, its recording, its configuration."""

import numpy as np
import pytest
from hapticd.machines.rhi.machine import RedundantInterface
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.session import build, fingerprint
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.errors import ConfigError
from hapticd.runtime.live import lockstep_run
from hapticd.runtime.recording.log import Log, open_log
from hapticd.runtime.recording.replay import replay
from hapticd.runtime.recording.summary import Report, table
from hapticd.testing.bench import Bench

from .conftest import loaded

DURATION = 14.0
"""Free motion, a light touch, and a palpation that turns the posture, which turns back after a while."""
LIMIT = np.array([3.0, 3.0, 1.0, 1.0])
FIELDS = ("q", "torque", "position", "hand", "demand", "omega", "alpha", "reserve")


@pytest.fixture(scope="module", params=["projection", "hqp"])
def session(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Report, Log]:
    path = tmp_path_factory.mktemp("log") / "rhi.mcap"
    change = ('resolution = "projection"', f'resolution = "{request.param}"')
    outcome = lockstep_run.run(loaded(change, machine="rhi"), path, DURATION, False)
    assert outcome.status == 0 and outcome.report is not None
    return outcome.report, open_log(str(path))


def traces(log: Log) -> dict[str, np.ndarray]:
    states = [r.fixed["state"] for r in log.records() if r.fixed["mode"] == Mode.ACTIVE]
    return {name: np.array([state[name] for state in states]) for name in FIELDS}


def test_the_session_runs_through_and_its_recording_replays_bit_for_bit(session: tuple[Report, Log]) -> None:
    report, log = session
    assert report.stop == "" and report.put_right == 0 and report.frames_missing == 0
    assert report.modes["ACTIVE"] > 9000
    assert replay(log).differing_ticks == 0


def test_no_motor_passes_its_limit_and_the_posture_turns_to_strong_and_back(
    session: tuple[Report, Log],
) -> None:
    trace = traces(session[1])
    assert (np.abs(trace["torque"]) <= LIMIT).all()
    assert trace["omega"].min() == 0.0  # fully stiff in the palpation
    assert trace["omega"][-200:].min() > 0.9  # and free again after it
    turns = np.count_nonzero(np.diff((trace["omega"] < 0.5).astype(int)))
    assert turns == 2  # no limit cycle


def test_the_hand_feels_the_wall_and_nothing_in_front_of_it(session: tuple[Report, Log]) -> None:
    trace = traces(session[1])
    rendered = trace["alpha"][:, None] * trace["demand"]
    assert 11.0 < np.abs(rendered[:, 1]).max() <= 12.01
    assert np.abs(rendered[:, 0]).max() == 0.0
    touching = trace["demand"][:, 1] < 0.0
    assert (trace["position"][touching, 1] > 0.1).all()
    # the sensor sees the hand push against what is rendered, within inertia and friction
    steady = touching & (np.abs(rendered[:, 1]) > 3.0)
    assert np.median(np.abs(trace["hand"][:, :2] + rendered)[steady, 1]) < 0.5
    free = ~touching
    assert np.median(np.linalg.norm(trace["hand"][free], axis=1)) < 0.5


def test_the_summary_shows_angles_and_torques(session: tuple[Report, Log]) -> None:
    report, _ = session
    text = table(report)
    line = next(line for line in text.splitlines() if line.startswith("motor 1 torque"))
    assert "lower" in line and "mN m" in line
    depth = next(figure for figure in report.figures if figure.name == "depth in the wall")
    assert depth.max > 10.0 and depth.unit == "mm"  # deeper than the motors can hold


@pytest.mark.parametrize(
    ("old", "new", "key", "problem"),
    [
        ('torque = "3 3 1 1 N m"', 'torque = "3 3 1 N m"', "rhi.motors.torque", "holds 3 entries"),
        ("[0, 0, -1, 1]]", "[0, 0, -1]]", "rhi.motors.transmission", "row of 3 numbers"),
        ("[0, 0, -1, 1]]", "[0, 0, 1, 0]]", "rhi.motors.transmission", "is singular"),
        ("normal = [0, 1]", "normal = [0, 0]", "rhi.bodies.wall.normal", "no length"),
        ('home = "0 0 0 0 rad"', 'home = "0 90 -90 0 deg"', "rhi.task.home", "singular"),
        ("leave = 0.7", "leave = 0.95", "rhi.saturation.leave", "not below"),
        ('lower = "-1 -0.8', 'lower = "2 -0.8', "rhi.motors.lower", "not below"),
        ('stop_time = "150 ms"', 'stop_time = "110 ms"', "safety.stop_time", "braking a motor alone"),
        ('rated_torque = "0.1 N m"', 'rated_torque = "0.05 N m"', "devices.motor_1.rated_torque", "carries"),
        ("[devices.safety_plc]", "[devices.plc]", "devices", "lacks a SafetyPlc"),
        ('model = "rhi.urdf"', "model = 3", "model", "Expected `str`"),
        ("steepness = 1 ", "steepnes = 1 ", "rhi.saturation.steepnes", "unknown key"),
        ('posture = "1.02', 'posture = "nan 1.02', "simulation.rhi.posture", "NaN"),
        (
            'point = "0.5 0.1 m"',
            'point = "5 0.1 m"',
            "rhi.bodies.wall.point",
            "everything that the hand can reach",
        ),
    ],
)
def test_a_mistake_is_named_with_its_key(old: str, new: str, key: str, problem: str) -> None:
    with pytest.raises(ConfigError) as error:
        build(loaded((old, new), machine="rhi"))
    assert [problem in found.problem for found in error.value.findings if found.key == key] == [True]


def test_a_session_that_does_not_run_looks_for_no_postures_and_records_the_same_layout() -> None:
    runs, still = build(config.load("rhi")), build(config.load("rhi"), runs=False)
    active, idle = runs.cycle.machine, still.cycle.machine
    assert isinstance(active, RedundantInterface) and active.controller.places
    assert isinstance(idle, RedundantInterface) and not idle.controller.places
    assert fingerprint(runs) == fingerprint(still)
    assert (active.state, active.levels) == (idle.state, idle.levels)


def test_the_hold_and_the_controller_agree_on_the_built_in_configuration() -> None:
    session = build(config.load("rhi"))
    assert session.config.devices["motor_1"].node == 1
    assert [axis.command for axis in session.cycle.machine.axes] == LIMIT.tolist()


@pytest.mark.parametrize("resolution", ["projection", "hqp"])
def test_a_hand_that_drags_a_motor_over_its_limit_meets_the_brakes_in_front_of_it(resolution: str) -> None:
    """A hand of 40 N leads the handle to where no posture is left; the motors hold a fifth of that there."""
    change = ('resolution = "projection"', f'resolution = "{resolution}"')
    bench = Bench(loaded(change, machine="rhi"))
    bench.run(bench.ticks(3.6))
    assert bench.mode is Mode.ACTIVE
    arm, hand, motors = bench.plant.arm, bench.plant.hand, bench.lockstep.session.config.rhi.motors
    begin = arm.position.copy()
    way = np.array([-0.3, 0.45, begin[2]]) - begin
    hand.take()
    room = np.inf
    for k in range(bench.ticks(2.6)):
        hand.lead((begin + way * min(1.0, 0.4 * (k + 1) * bench.dt / np.linalg.norm(way))).tolist())
        bench.run(1)
        room = min(room, np.min(arm.q - motors.lower), np.min(motors.upper - arm.q))
    assert bench.mode is Mode.STOPPED and bench.reason == "overloaded"
    assert 0.0 < room < 0.05  # its brake holds it there, however long the hand pulls
