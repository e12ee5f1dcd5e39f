"""`hapticd calibrate ft` from the arm to the daemon that uses the file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pinocchio as pin
import pytest
from hapticd.control.ft_calibration import CalibrationError, Tool
from hapticd.devices.errors import MismatchError
from hapticd.machines.arm.rig import LedArm
from hapticd.machines.calibration import session
from hapticd.machines.calibration.report import file_of
from hapticd.machines.rendering.tool import carrying, tool_of
from hapticd.models import Array, Robot
from hapticd.runtime.command_line.cli import main
from hapticd.runtime.configuration.config import Loaded, calibration, load
from hapticd.runtime.configuration.session import build
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.errors import ConfigError
from hapticd.runtime.live.lockstep import Lockstep
from hapticd.sim.force_torque import SimForceTorque

CONFIGS = Path(__file__).parents[3] / "configs"
TEXT, MODEL = (CONFIGS / "panda.toml").read_text(), (CONFIGS / "panda.urdf").read_text()
GAIN = 0.002
ERRORS = f"""
[simulation.sensors]
force = {{ noise = "0.3 N", bias = "15 N", drift = "0.05 N", gain = {GAIN}, step = "0.02 N" }}
torque = {{ noise = "0.01 N m", bias = "0.5 N m", drift = "0.002 N m", gain = {GAIN}, step = "0.001 N m" }}
"""
HANDLE = TEXT[TEXT.index("[arm.handle]") : TEXT.index("[arm.posture]")]
SENSOR = 'torque = "20 N m"'
POSES = 8


def vector(tool: Tool) -> Array:
    return np.concatenate([tool.bias, [tool.mass], tool.centre])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sensor with a bias that would not let the arm start, and its calibration."""
    made = tmp_path_factory.mktemp("calibration")
    (made / "panda.urdf").write_text(MODEL)
    (made / "arm.toml").write_text(TEXT + ERRORS)
    return made


@pytest.fixture(scope="module")
def taken(folder: Path) -> session.Taken:
    seen: list[tuple[int, int, str]] = []
    (one,) = session.run(load(str(folder / "arm.toml")), POSES, 3, None, lambda *at: seen.append(at))
    assert [done for done, _, _ in seen] == [0, *range(POSES), POSES]
    (folder / "tool.toml").write_text(file_of(one, "2026-11-22").text("a test"))
    return one


@pytest.fixture
def calibrated(folder: Path, taken: session.Taken, tmp_path: Path) -> Callable[..., Loaded]:
    """A configuration that uses the file, with changes."""

    def made(*changes: tuple[str, str], file: str = "") -> Loaded:
        text = TEXT.replace(HANDLE, "").replace(SENSOR, f'{SENSOR}\nserial = 0\ncalibration = "tool.toml"', 1)
        for old, new in changes:
            assert old in text
            text = text.replace(old, new, 1)
        (tmp_path / "panda.urdf").write_text(MODEL)
        (tmp_path / "arm.toml").write_text(text + ERRORS)
        (tmp_path / "tool.toml").write_text(file or (folder / "tool.toml").read_text())
        return load(str(tmp_path / "arm.toml"))

    return made


def truth(folder: Path) -> Tool:
    """What the simulated sensor's errors are, and the handle of the model."""
    plant: Any = build(load(str(folder / "arm.toml"))).plant()
    return Tool(plant._errors._bias.copy(), 0.5, np.array([0.0, 0.0, 0.07]))


def test_the_tool_is_found_within_what_theory_expects(folder: Path, taken: session.Taken) -> None:
    assert taken.fit.condition < 2.5
    off = np.abs(vector(taken.fit.tool) - vector(truth(folder)))
    by_gain = GAIN * np.abs(vector(truth(folder)))  # theory knows of noise alone
    assert (off < 5.0 * vector(taken.expected(0.0)) + by_gain).all()
    assert np.abs(truth(folder).bias[:3]).max() > 5.0
    assert off[:3].max() < 0.2 and off[6] < 0.02 and off[7:].max() < 0.005


def test_the_file_says_what_was_found_and_survives_reading(folder: Path, taken: session.Taken) -> None:
    kept = calibration((folder / "tool.toml").read_text(), "tool.toml")
    assert kept == file_of(taken, "2026-11-22")
    assert kept.sha256 == kept.digest
    np.testing.assert_allclose([*kept.force_bias, *kept.torque_bias], taken.fit.tool.bias, atol=1e-6)
    assert (kept.sensor, kept.serial, kept.date, kept.poses) == ("force_torque", 0, "2026-11-22", POSES)


def test_a_daemon_with_the_file_starts_where_the_bias_would_have_refused(
    folder: Path, calibrated: Callable[..., Loaded]
) -> None:
    modes = []
    for loaded in (load(str(folder / "arm.toml")), calibrated()):
        lockstep = Lockstep(build(loaded))
        lockstep.run(600)
        modes.append(lockstep.mode)
    assert modes == [Mode.READY, Mode.ENGAGING]
    # what the hand does is known to what the sensor is worth, which reads far more
    machine: Any = lockstep.session.cycle.machine
    assert np.linalg.norm(machine._force_torque.wrench[0, :3]) > 5.0
    plant: Any = lockstep.plant
    assert np.linalg.norm((machine._estimator.wrench - plant.wrench)[:3]) < 1.5


@pytest.mark.parametrize(
    ("changes", "key", "problem"),
    [
        ([("serial = 0\n", "")], "devices.force_torque.serial", "is missing, but"),
        ([("serial = 0", "serial = 7")], "devices.force_torque.serial", "is of 0"),
        (
            [('"tool.toml"', '"other.toml"')],
            "devices.force_torque.calibration",
            'no calibration "other.toml"',
        ),
        ([('"tool.toml"', '"../tool.toml"')], "devices.force_torque.calibration", "leaves the folder"),
        ([("[arm.posture]", f"{HANDLE}[arm.posture]")], "arm.handle", "a second time"),
        ([('calibration = "tool.toml"', "")], "arm.handle", "is missing"),
    ],
)
def test_what_contradicts_is_named(
    calibrated: Callable[..., Loaded], changes: list[tuple[str, str]], key: str, problem: str
) -> None:
    with pytest.raises(ConfigError) as refused:
        build(calibrated(*changes))
    assert problem in {f.key: f.problem for f in refused.value.findings}.get(key, ""), refused.value


def test_a_file_that_was_changed_or_is_of_another_sensor_is_refused(
    folder: Path, calibrated: Callable[..., Loaded]
) -> None:
    file = (folder / "tool.toml").read_text()
    for old, new, problem in (
        ('mass = "0.', 'mass = "0.9', "was changed after it was written"),
        ('sensor = "force_torque"', 'sensor = "left"', "is of 'left', another sensor"),
    ):
        with pytest.raises(ConfigError, match=problem):
            build(calibrated(file=file.replace(old, new, 1)))
    with pytest.raises(ConfigError) as refused:
        calibrated(file=file.replace('mass = "', 'mass = "-', 1))
    assert refused.value.findings[0].line == file[: file.index("mass")].count("\n") + 1
    assert "tool.toml" in str(refused.value)


def test_a_sensor_with_another_serial_number_does_not_come_up(calibrated: Callable[..., Loaded]) -> None:
    """The file is of number 0, and so says the configuration; the sensor on the bus is number 5."""
    lockstep = Lockstep(build(calibrated()))
    plant: Any = lockstep.plant
    restore = plant.nodes["force_torque"].objects.restore

    def exchanged() -> None:
        restore()
        plant.nodes["force_torque"].objects.write((0x1018, 4), 5)

    plant.nodes["force_torque"].objects.restore = exchanged
    try:
        lockstep.run(300)
        said = [str(event) for event in lockstep.outputs.events]
    except MismatchError as error:
        said = [str(error)]
    assert lockstep.mode is Mode.FAILED or said
    assert lockstep.mode not in (Mode.READY, Mode.ENGAGING)


def test_gravity_compensation_takes_the_calibrated_handle(calibrated: Callable[..., Loaded]) -> None:
    """As if the model had been written with it: joint torques at rest in random postures."""
    loaded = calibrated()
    device: Any = loaded.config.devices["force_torque"]
    heavy = msgspec.structs.replace(
        device,
        kept=msgspec.structs.replace(
            device.kept, mass=type(device.kept.mass)(0.8), centre=type(device.kept.centre)((0.01, -0.02, 0.1))
        ),
    )
    robot = Robot.from_urdf(MODEL, "panda.urdf")
    found = carrying(robot, "handle", "force_torque", heavy, None)
    tool, rng = tool_of(None, heavy), np.random.default_rng(1)
    q = rng.uniform(-1.0, 1.0, 7)
    T = robot.placement(q, "force_torque")
    old, new = (
        (mass, T[:3, :3] @ np.array(centre) + T[:3, 3])
        for mass, centre in ((0.5, (0.0, 0.0, 0.07)), (tool.mass, tool.centre))
    )
    difference = np.zeros(7)
    for sign, (mass, at) in ((-1.0, old), (1.0, new)):
        for i in range(7):  # virtual work: the height of the centre by finite differences
            e = 1e-6 * np.eye(7)[i]
            heights = []
            for d in (q - e, q + e):
                S = robot.placement(d, "force_torque")
                local = T[:3, :3].T @ (at - T[:3, 3])
                heights.append((S[:3, :3] @ local + S[:3, 3])[2])
            difference[i] += sign * mass * 9.81 * (heights[1] - heights[0]) / 2e-6
    torques = [
        pin.computeGeneralizedGravity(each.model, each.data, each.configuration(q)).copy()
        for each in (robot, found)
    ]
    np.testing.assert_allclose(torques[1] - torques[0], difference, atol=1e-6)
    assert np.abs(difference).max() > 0.5


def test_somebody_at_the_handle_is_refused(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A hand that leans on the tool in one of the poses, and one that moves while a sample is taken."""
    loaded = load(str(folder / "arm.toml"))
    go, pushed = session._Driver.go, {"n": 0, "force": lambda tick: 5.0}

    def pushing(self: Any, place: Array) -> None:
        go(self, place)
        pushed["n"] += 1
        sensor = self._lockstep.plant.nodes.of(SimForceTorque)[0]
        tick = self._tick
        if pushed["n"] == 4:

            def touched() -> None:
                sensor.fields["wrench"][0] += pushed["force"](0)
                tick()

            self._tick = touched
        else:
            self.__dict__.pop("_tick", None)

    monkeypatch.setattr(session._Driver, "go", pushing)
    with pytest.raises(CalibrationError, match=r"pose 4: .* remain unexplained"):
        session.run(loaded, POSES, 3)


def test_a_machine_that_stops_says_why(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    loaded = load(str(folder / "arm.toml"))

    def hindered(self: Any, place: Array) -> None:
        self._lockstep.plant._plc.dead_man = (False, False)
        for _ in range(20):
            self._tick()

    monkeypatch.setattr(session._Driver, "go", hindered)
    with pytest.raises(CalibrationError, match=r"the machine stopped: .*dead-man"):
        session.run(loaded, POSES, 3)


def test_machines_without_such_a_sensor_say_so(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["calibrate", "ft", "rhi"]) == 2
    assert "no six-axis sensor" in capsys.readouterr().err


def test_a_result_that_cannot_be_kept_is_refused_before_anything_moves(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config, there = str(folder / "arm.toml"), str(folder / "arm.toml")
    for options, problem in (
        (["--out", str(folder / "new.toml")], "add --date"),
        (["--out", str(folder / "no" / "new.toml"), "--date", "2026-11-22"], "there is no folder"),
        (["--out", there, "--date", "2026-11-22"], "exists already"),
        (["--out", str(folder / "new.txt"), "--date", "2026-11-22"], "does not end in .toml"),
        (["--sensor", "forcetorque"], 'did you mean "force_torque"'),
    ):
        assert main(["calibrate", "ft", config, *options, "--json"]) == 2
        shown = capsys.readouterr()
        assert problem in shown.err and msgspec.json.decode(shown.out)["error"] == "calibrate"
    with pytest.raises(SystemExit):
        main(["calibrate", "ft", config, "--date", "2026-13-22"])


def test_refused_samples_are_named_one_a_line(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["calibrate", "ft", str(folder / "arm.toml"), "--poses", "2", "--json"]) == 1
    shown = capsys.readouterr()
    assert shown.err.startswith("hapticd: error [calibration]: refused:\n  2 poses; it takes")
    assert msgspec.json.decode(shown.out)["error"] == "calibration"


def test_the_command_prints_writes_and_speaks_json(
    folder: Path,
    taken: session.Taken,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(session, "run", lambda *_: [taken])
    out = tmp_path / "tool.toml"
    words = ["calibrate", "ft", str(folder / "arm.toml"), "--out", str(out), "--date", "2026-11-22"]
    assert main(words) == 0
    said = capsys.readouterr().out
    for line in ("force bias x", "centre z", "mass", "condition number", "residuals", "is written"):
        assert line in said
    assert calibration(out.read_text(), "tool.toml").serial == 0
    assert main(["calibrate", "ft", str(folder / "arm.toml"), "--json"]) == 0
    (found,) = msgspec.json.decode(capsys.readouterr().out)
    assert found["mass"] == taken.fit.tool.mass and len(found["residuals"]) == POSES


def test_the_led_arm_stays_where_it_is_while_it_engages(folder: Path) -> None:
    rig = session.rig_of(load(str(folder / "arm.toml")))
    assert rig.machine is LedArm
    np.testing.assert_allclose(rig.start, [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785], atol=1e-9)
