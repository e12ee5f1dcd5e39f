"""A recording keeps EDS files that do not come with hapticd: it replays where they are others, or gone."""

from __future__ import annotations

import dataclasses
import subprocess
from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hapticd.configs import read_text
from hapticd.devices.dictionary import MAX_BYTES, KeptEds, load
from hapticd.devices.errors import EdsError
from hapticd.runtime.configuration import config
from hapticd.runtime.errors import LogError, LogModelError
from hapticd.runtime.live import lockstep_run
from hapticd.runtime.recording.log import MAX_EDS, LogWriter, open_log
from hapticd.runtime.recording.log_file import LogFile, LogWriteError
from hapticd.runtime.recording.replay import replay
from hapticd.testing.terminal import HAPTICD
from mcap.reader import make_reader

from .conftest import changed
from .hostile_logs import METADATA, attachment, metadata, put_together, take_apart

DRIVES = {"motor_1": "joint", "motor_2": "joint", "motor_3": "other joint"}


def with_eds(folder: Path, files: dict[str, str]) -> config.Loaded:
    """The redundant interface, whose devices have EDS files of their own."""
    changes = []
    for device, name in files.items():
        path = folder / f"{name}.eds"
        path.write_text(read_text("joint_drive.eds") + f"\n; {name}\n")
        changes.append((f"[devices.{device}]\n", f'[devices.{device}]\neds = "{path}"\n'))
    text = changed(*changes, machine="rhi")
    return config.Loaded(
        "rhi", config.parse(text, "rhi.toml"), text, "rhi.toml", read_text("rhi.urdf"), "rhi.urdf"
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("own")


@pytest.fixture(scope="module")
def recording(folder: Path) -> Path:
    """Made with EDS files of which one is gone since, and the other damaged."""
    path = folder / "session.mcap"
    (folder / "eds").mkdir()
    lockstep_run.run(with_eds(folder / "eds", DRIVES), path, 0.5, False)
    (folder / "eds" / "joint.eds").unlink()
    (folder / "eds" / "other joint.eds").write_text("[6040]\n")
    return path


def test_it_replays_where_they_are_others_or_gone(recording: Path) -> None:
    """In a process that has not read them."""
    done = subprocess.run(
        [*HAPTICD, "replay", str(recording), "--verify"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr + done.stdout
    assert " 0 differ" in done.stdout


def test_each_is_kept_once_and_those_of_hapticd_are_not(recording: Path, tmp_path: Path) -> None:
    with recording.open("rb") as stream:
        kept = [a.data.decode() for a in make_reader(stream).iter_attachments() if a.name.startswith("eds/")]
    assert kept == [read_text("joint_drive.eds") + f"\n; {name}\n" for name in ("joint", "other joint")]
    devices = open_log(str(recording)).loaded.config.devices
    assert [name for name, device in devices.items() if isinstance(device.eds, KeptEds)] == list(DRIVES)
    again = tmp_path / "again.mcap"
    lockstep_run.run(open_log(str(recording)).loaded, again, 0.1, False)
    assert replay(open_log(str(again))).differing_ticks == 0


@pytest.fixture
def reading(tmp_path: Path) -> Callable[[bytes], int]:
    def read(data: bytes) -> int:
        (tmp_path / "forged.mcap").write_bytes(data)
        return replay(open_log(str(tmp_path / "forged.mcap"))).ticks

    return read


def forged(recording: Path, says: dict[str, str], texts: dict[str, bytes]) -> bytes:
    """A recording that keeps other EDS files."""
    parts = take_apart(recording.read_bytes())
    k = next(k for k, (op, data) in enumerate(parts) if op == METADATA and data[4:].startswith(b"eds"))
    kinds = {attachment("", b"")[0], METADATA}
    rest = [part for part in parts[k + 1 :] if not (part[0] in kinds and part[1][20:].startswith(b"eds/"))]
    return put_together(
        [*parts[:k], metadata("eds", says), *(attachment(*text) for text in texts.items()), *rest]
    )


def test_forged_ones_are_refused(recording: Path, reading: Callable[[bytes], int]) -> None:
    own = dict.fromkeys(DRIVES, "eds/1")
    good = read_text("joint_drive.eds").encode()
    assert reading(forged(recording, own, {"eds/1": good})) > 500
    for says, text, error, what in (
        ({**own, "motor_9": "eds/1"}, good, LogError, "EDS of a device that its configuration does not have"),
        ({**own, "motor_1": "eds/7"}, good, LogError, "lacks its attachment eds/7"),
        (own, b"\xff\xfe", LogError, "is not UTF-8 text"),
        (own, good + b"; \x1b]0;x\x07\n", LogModelError, "holds a control character"),
        (own, b"[DeviceInfo]\n[1000]\n", LogModelError, "cannot be read as a CANopen EDS"),
        (own, good.replace(b"[1A00sub0]", b"[1A00sub0x]"), LogModelError, "refused here"),
    ):
        with pytest.raises(error, match=what):
            reading(forged(recording, says, {"eds/1": text}))


def test_more_than_a_recording_can_keep_are_refused(tmp_path: Path) -> None:
    given = with_eds(tmp_path, {"motor_1": "one"})
    drive = given.config.devices["motor_1"]
    devices = {
        f"drive {k}": msgspec.structs.replace(drive, eds=KeptEds("./own.eds", str(k)))
        for k in range(MAX_EDS + 1)
    }
    many = dataclasses.replace(given, config=msgspec.structs.replace(given.config, devices=devices))
    with LogFile(tmp_path / "x.mcap") as stream, pytest.raises(LogWriteError, match="these devices have 15"):
        LogWriter(stream, many, {}, np.dtype([("tick", "<u8")]), 0)


def test_an_eds_that_no_recording_could_keep_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "own.eds"
    good = read_text("joint_drive.eds")
    for text, what in (
        (good.ljust(MAX_BYTES + 1), "is larger than 1000000 bytes"),
        (good.replace("Controlword", "Control\x1bword", 1), "holds a control character"),
    ):
        path.write_text(text)
        with pytest.raises(EdsError, match=what):
            load(str(path), 1)
        path = tmp_path / "another.eds"
