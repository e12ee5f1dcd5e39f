"""Inside the test machine: the real kernel's answers, and a session over SocketCAN. Run by `make vm-test`."""

from __future__ import annotations

import json
import os
import shutil
import signal
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

KERNEL = tuple(int(part) for part in os.uname().release.split(".")[:2])
ROOT = Path(__file__).resolve().parent.parent.parent
RATE = 250
"""In virtual time a tick takes half a millisecond, and a second of the plant half a second."""
PATIENCE_S = 120.0
FIFO_PRIORITY = {"daemon": 80, "plant": 70}
CHANGES = (
    ('rate = "1 kHz"', f'rate = "{RATE} Hz"'),
    ("substeps = 3", "substeps = 12"),
    ('on_overrun = "record"', 'on_overrun = "stop"'),
    ('duration = "30 s"', 'duration = "600 s"'),
    ('kind = "simulated"', 'kind = "socketcan"\ninterface = "vcan0"'),
    ('by = "dead-man"', 'by = "command"'),
    (
        'dead_man = [{ at = "0.3 s", pressed = true }]',
        'dead_man = [{ at = "1 s", pressed = true }, { at = "6 s", pressed = false }, '
        '{ at = "7.5 s", pressed = true }]',
    ),
)


def hapticd(*arguments: str) -> list[str]:
    return [sys.executable, "-m", "hapticd.runtime", *arguments]


def as_root(command: str) -> None:
    """Runs a command of the doctor's; everybody is root here, and there may be no sudo."""
    subprocess.run(["sh", "-ec", f'sudo() {{ "$@"; }}\n{command}'], check=True, timeout=PATIENCE_S)


@contextmanager
def no_idling() -> Iterator[None]:
    """Keeps the CPU busy: an idle one makes virtual time leap while files are read, and start-ups fail."""
    spinner = subprocess.Popen(["chrt", "--idle", "0", "sh", "-c", "while :; do :; done"])
    try:
        yield
    finally:
        spinner.kill()
        spinner.wait()


def wait_until(condition: Callable[[], bool], what: Callable[[], str]) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline, what()
        time.sleep(0.02)


class Process:
    """A command with its output in files."""

    def __init__(self, folder: Path, name: str, *arguments: str) -> None:
        self._out, self._err = folder / f"{name}.out", folder / f"{name}.err"
        with self._out.open("wb") as out, self._err.open("wb") as err:
            self.process = subprocess.Popen(
                hapticd(*arguments), stdin=subprocess.PIPE, stdout=out, stderr=err
            )

    @property
    def output(self) -> str:
        return self._out.read_text()

    @property
    def errors(self) -> str:
        return self._err.read_text()

    def wait_for(self, text: str) -> None:
        def come() -> bool:
            assert self.process.poll() is None, f"it ended: {self.errors}"
            return text in self.errors

        wait_until(come, lambda: f"no '{text}' in {self.errors}")

    def type(self, text: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(text.encode())
        self.process.stdin.flush()

    def end(self) -> int:
        return self.process.wait(PATIENCE_S)

    def __enter__(self) -> Process:
        return self

    def __exit__(self, *error: object) -> None:
        """Leaves nothing behind, whatever failed."""
        assert self.process.stdin is not None
        self.process.stdin.close()
        self.process.kill()
        self.process.wait()

    def status(self, key: str) -> str:
        for line in Path(f"/proc/{self.process.pid}/status").read_text().splitlines():
            if line.startswith(f"{key}:"):
                return line.split()[1]
        raise AssertionError(key)

    def page_faults(self) -> tuple[int, int]:
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        return int(fields[7]), int(fields[9])


@pytest.fixture(scope="session")
def machine(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The giant's configuration for a CAN FD interface of the kernel."""
    folder = tmp_path_factory.mktemp("machine")
    text = (ROOT / "configs" / "giant.toml").read_text()
    for old, new in CHANGES:
        assert old in text, old
        text = text.replace(old, new, 1)
    (folder / "machine.toml").write_text(text)
    (folder / "giant.urdf").write_bytes((ROOT / "configs" / "giant.urdf").read_bytes())
    return folder / "machine.toml"


@pytest.fixture(scope="session")
def plant(machine: Path) -> Iterator[Process]:
    with Process(machine.parent, "plant", "plant", str(machine), "--interface", "vcan0") as plant:
        with no_idling():
            plant.wait_for("serves vcan0")
        yield plant
        plant.process.send_signal(signal.SIGTERM)
        assert plant.end() == 0


@pytest.fixture
def daemon(machine: Path, plant: Process, tmp_path: Path) -> Iterator[Process]:
    """A daemon that has brought its devices up."""
    log = str(tmp_path / "session.mcap")
    with Process(tmp_path, "daemon", "run", str(machine), "--json", "--log", log) as daemon:
        with no_idling():
            daemon.wait_for("READY: all devices answer")
        yield daemon


def doctor(*arguments: str) -> tuple[int, dict[str, Any]]:
    told = subprocess.run(hapticd("doctor", "--json", *arguments), stdout=subprocess.PIPE, check=False)
    return told.returncode, {line["check"]: line for line in json.loads(told.stdout)["lines"]}


def listen() -> list[tuple[int, bytes]]:
    """Frames of about 20 ms on vcan0: identifier and data."""
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as sock:
        sock.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FD_FRAMES, 1)
        sock.bind(("vcan0",))
        frames = []
        until = time.monotonic() + 0.02
        while time.monotonic() < until:
            data = sock.recv(72)
            can_id, length = struct.unpack_from("=IB", data)
            frames.append((can_id, data[8 : 8 + length]))
    return frames


def hog(periods: float) -> None:
    """Takes the only CPU away from everybody, the daemon included, for some periods of the loop."""
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(99))
    until = time.monotonic_ns() + round(periods * 1e9 / RATE)
    while time.monotonic_ns() < until:
        pass
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


# ------------------------------------------------------------------------------------------ the tests


def test_the_kernel_is_preempt_rt() -> None:
    assert Path("/sys/kernel/realtime").read_text().strip() == "1"


def test_the_doctor_names_what_is_wrong_and_its_commands_mend_it(machine: Path) -> None:
    with no_idling():
        status, lines = doctor(str(machine))
        assert status == 1
        assert lines["can_vcan0"]["state"] == "fail"
        assert lines["rt_throttling"]["state"] == "warn"
        assert lines["timer_threads"]["state"] == "warn"
        assert lines["fair_server"]["state"] == ("warn" if KERNEL >= (6, 12) else "pass")
        for check in ("preempt_rt", "fifo", "memlock", "clocksource", "uvloop", "libraries"):
            assert lines[check]["state"] == "pass", lines[check]
        for check in ("timer_threads", "rt_throttling", "fair_server"):
            if lines[check]["state"] == "warn":
                as_root(lines[check]["fix"])
        as_root(lines["can_vcan0"]["fix"].partition("# a virtual one: ")[2])
        status, lines = doctor(str(machine))
        assert status == 0
        for check in ("timer_threads", "rt_throttling", "fair_server", "can_vcan0"):
            assert lines[check]["state"] == "pass", lines[check]


def test_a_session_runs_over_can_fd_with_fifo_and_locked_memory(daemon: Process, plant: Process) -> None:
    daemon.type("arm\n")
    daemon.wait_for("ENGAGING")
    for name, process in (("daemon", daemon), ("plant", plant)):
        pid = process.process.pid
        assert os.sched_getscheduler(pid) & ~os.SCHED_RESET_ON_FORK == os.SCHED_FIFO
        assert os.sched_getparam(pid).sched_priority == FIFO_PRIORITY[name]
        assert int(process.status("VmLck")) >= int(process.status("VmRSS")) > 0
    faults = daemon.page_faults()
    frames = listen()
    assert {0x180 + node for node in range(1, 13)} <= {can_id for can_id, _ in frames}
    assert max(len(data) for can_id, data in frames if can_id == 0x080) > 8
    daemon.wait_for("ACTIVE: engaged")
    assert daemon.page_faults() == faults
    daemon.type("quit\n")
    assert daemon.end() == 0, daemon.errors
    report = json.loads(daemon.output)
    assert report["skipped"] == report["frames_missing"] == 0
    assert report["modes"]["ACTIVE"] > 0
    assert "warning" not in daemon.errors


def test_skipped_ticks_are_counted_and_stop_the_machine_when_they_are_many(daemon: Process) -> None:
    daemon.type("arm\n")
    daemon.wait_for("ENGAGING")
    hog(2.5)
    time.sleep(0.1)
    assert "STOPPING" not in daemon.errors
    hog(4.5)
    daemon.wait_for("R2 overrun")
    daemon.wait_for("HOLDING")
    hog(22.5)
    daemon.wait_for("R3 stall")
    daemon.wait_for("STOPPED")
    daemon.type("quit\n")
    assert daemon.end() == 3
    report = json.loads(daemon.output)
    # the first tick of a gap is served late, and the others are skipped: of 2.5 periods, 2 or 1
    assert 1 + 3 + 21 <= report["skipped"] <= 2 + 4 + 22
    assert report["stop"] == "stall"
    assert report["frames_missing"] == 0  # the plant stalled, too


UNITS = Path("/run/systemd/system")
MANAGER = Path("/lib/systemd/systemd")
ERRORS, SAID = Path("/run/hapticd.err"), Path("/run/hapticd.said")
SERVICE_JOB = """
systemctl start hapticd@machine; echo "started $?"
sleep 1; systemctl show -P StatusText hapticd@machine
echo arm > /run/hapticd-machine
sleep 5; systemctl show -P ActiveState hapticd@machine
systemctl kill --kill-whom=main --signal=STOP hapticd@machine
sleep 5; systemctl show -P Result hapticd@machine
echo finished
"""


@contextmanager
def systemd(job: str) -> Iterator[None]:
    """A systemd in its own process namespace, with the project's units and a job for a shell."""
    subprocess.run(["mount", "-t", "cgroup2", "none", "/sys/fs/cgroup"], check=True)
    shutil.copytree(ROOT / "deploy", UNITS)
    alone = "[Unit]\nDefaultDependencies=no\n"
    # a clone may lie where the service must not look
    visible = f"ProtectHome=tmpfs\nBindReadOnlyPaths={ROOT} {sys.base_prefix}\nStandardError=file:{ERRORS}\n"
    for unit, text in (("service", f"{alone}[Service]\n{visible}"), ("socket", alone)):
        folder = UNITS / f"hapticd@.{unit}.d"
        folder.mkdir()
        (folder / "test.conf").write_text(text)
    script = Path("/run/job.sh")
    script.write_text(job)
    run = f"TimeoutStartSec=infinity\nExecStart=/bin/sh {script}\nStandardOutput=file:{SAID}\n"
    (UNITS / "job.service").write_text(f"{alone}[Service]\nType=oneshot\n{run}")
    (UNITS / "job.target").write_text(f"{alone}Wants=job.service\n")
    namespace = ["unshare", "--pid", "--mount", "--fork", "--mount-proc", "--kill-child"]
    process = subprocess.Popen(
        [*namespace, str(MANAGER), "--system", "--unit=job.target", "--show-status=no", "--log-target=null"],
        env={**os.environ, "container": "other"},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
    )
    try:
        yield
    finally:
        process.kill()
        process.wait()


def test_the_service_takes_commands_and_is_ended_when_its_ticks_stall(machine: Path, plant: Process) -> None:
    if not (MANAGER.exists() and shutil.which("systemctl")):
        pytest.skip("there is no systemd")
    for folder in ("/etc/hapticd", "/opt/hapticd"):  # this host's own, which is only hidden here
        shutil.rmtree(folder, ignore_errors=True)
    Path("/etc/hapticd").mkdir()
    for name in ("machine.toml", "giant.urdf"):
        shutil.copy(machine.parent / name, "/etc/hapticd")
    Path("/opt/hapticd/bin").mkdir(parents=True)
    Path("/opt/hapticd/bin/hapticd").symlink_to(Path(sys.executable).parent / "hapticd")

    def said() -> str:
        return SAID.read_text() if SAID.exists() else ""

    with systemd(SERVICE_JOB):
        with no_idling():
            wait_until(lambda: "started" in said(), said)
        wait_until(lambda: "finished" in said(), said)
    assert said().split() == ["started", "0", "READY", "active", "watchdog", "finished"]
    events = ERRORS.read_text()
    assert "armed by command" in events
    assert "warning" not in events  # FIFO and locked memory by its capabilities
