"""The live daemon with plant and recorder in their own processes: what happens when one of them dies."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pytest
from hapticd.devices.image import COUNTERS
from hapticd.runtime.core.events import Event, EventKind
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.core.stages import Stage
from hapticd.runtime.live.bus_watch import watch_bus
from hapticd.runtime.live.children import tied
from hapticd.runtime.live.plant_link import FROZEN_S
from hapticd.runtime.live.recorder_link import HUNG_LOOKS, RecorderLink
from hapticd.runtime.recording.log import open_log
from hapticd.runtime.recording.ring import Drain
from hapticd.testing.terminal import child
from mcap.reader import make_reader

PATIENCE_S = 60.0


class Live:
    """A daemon in its own process."""

    def __init__(self, folder: Path, config: str, *options: str) -> None:
        self.log = folder / "session.mcap"
        self._errors = folder / "stderr.txt"
        self._output = folder / "stdout.txt"
        command = [sys.executable, "-m", "hapticd.runtime", "run", config, "--log", str(self.log), *options]
        with self._errors.open("wb") as err, self._output.open("wb") as out:
            self.process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=out, stderr=err, cwd=folder, preexec_fn=tied()
            )

    @property
    def errors(self) -> str:
        return self._errors.read_text(errors="replace")

    @property
    def output(self) -> str:
        return self._output.read_text()

    def wait_for(self, text: str) -> None:
        deadline = time.monotonic() + PATIENCE_S
        while text not in self.errors:
            assert self.process.poll() is None, f"the daemon ended: {self.errors}"
            assert time.monotonic() < deadline, f"no '{text}' in {self.errors}"
            time.sleep(0.02)

    def type(self, text: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(text.encode())
        self.process.stdin.flush()

    def child(self, module: str) -> int:
        """Process id of the plant or the recorder."""
        return child(self.process.pid, module)

    def end(self) -> int:
        return self.process.wait(PATIENCE_S)

    def modes(self) -> list[Mode]:
        return [Mode(int(record.fixed["mode"])) for record in open_log(str(self.log)).records()]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Callable[..., Live]]:
    running: list[Live] = []

    def begin(config: str, *options: str) -> Live:
        running.append(Live(tmp_path, config, *options))
        return running[-1]

    yield begin
    for live in running:
        live.process.kill()
        live.process.wait()
        if live.process.stdin:
            live.process.stdin.close()


def bound_to(cpu: int, tie: Callable[[], None]) -> None:
    tie()
    os.sched_setaffinity(0, {cpu})


def wait_until_gone(pid: int) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while (
        Path(f"/proc/{pid}").exists()
        and "Z" not in Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1][:3]
    ):
        assert time.monotonic() < deadline, f"process {pid} lives on"
        time.sleep(0.02)


def test_a_short_session_ends_with_a_summary_and_one_log_that_replays(
    start: Callable[..., Live], machine: str, tmp_path: Path
) -> None:
    live = start(machine, "--duration", "1.5", "--json")
    assert live.end() == 0, live.errors
    report = msgspec.json.decode(live.output)
    assert report["ticks"] + report["skipped"] >= 1500
    assert set(report["lateness_us"]) == {"mean", "p50", "p99", "p999", "max"}
    assert report["status"] == 0
    assert set(report["stages_us"]) == {stage.name.lower() for stage in Stage}
    assert report["vitals"]["threads"] == 1
    assert len(list(tmp_path.glob("*.mcap"))) == 1
    modes = live.modes()
    assert modes[-1] is Mode.STOPPED and Mode.ENGAGING in modes
    verify = [sys.executable, "-m", "hapticd.runtime", "replay", str(live.log), "--verify"]
    assert subprocess.run(verify, capture_output=True, check=False).returncode == 0


def test_a_killed_plant_stops_the_daemon_with_a_ramp_and_a_readable_log(
    start: Callable[..., Live], machine: str
) -> None:
    live = start(machine, "--duration", "30")
    live.wait_for("ENGAGING")
    os.kill(live.child("plant_process"), signal.SIGKILL)
    assert live.end() == 3
    assert "R3 device_silent" in live.errors
    records = list(open_log(str(live.log)).records())
    assert Mode(int(records[-1].fixed["mode"])) is Mode.STOPPED
    assert records[-1].fixed["reason"] == b"device_silent"
    assert len(records) < 15_000  # at once, not at the end of the 30 s


def test_a_plant_that_dies_before_the_machine_is_armed_ends_the_session(
    start: Callable[..., Live], machine: str, write_config: Callable[..., Path]
) -> None:
    later = 'dead_man = [{ at = "20 s", pressed = true }]'
    config = write_config(('dead_man = [{ at = "0.3 s", pressed = true }]', later), machine=machine)
    live = start(str(config), "--duration", "30")
    live.wait_for("READY")
    os.kill(live.child("plant_process"), signal.SIGKILL)
    assert live.end() == 3
    assert "the bus is gone" in live.errors
    assert open_log(str(live.log)).events()


def test_a_killed_recorder_is_told_at_once_and_ends_in_an_error(
    start: Callable[..., Live], machine: str
) -> None:
    live = start(machine, "--duration", "2.5")
    live.wait_for("ENGAGING")
    os.kill(live.child("recorder"), signal.SIGKILL)
    live.wait_for("the recorder died")
    assert live.process.poll() is None  # the machine goes on
    assert live.end() == 1
    assert "there is no summary" in live.errors


def test_a_recorder_that_hangs_is_told_within_about_two_seconds_and_the_machine_goes_on(
    start: Callable[..., Live],
) -> None:
    live = start("giant", "--duration", "6")
    live.wait_for("ENGAGING")
    recorder = live.child("runtime.live.recorder")
    os.kill(recorder, signal.SIGSTOP)
    stopped = time.monotonic()
    live.wait_for("the recorder hangs: nothing was recorded for 2 s")
    assert time.monotonic() - stopped < 4.5  # 2.2 s on a machine that does nothing else
    assert live.process.poll() is None
    os.kill(recorder, signal.SIGCONT)
    live.wait_for("not recorded any more: what runs goes on, and the machine is not armed again")
    assert live.end() == 0, live.errors
    assert live.modes().count(Mode.ENGAGING) + live.modes().count(Mode.ACTIVE) > 2000


def test_a_recorder_that_hung_before_the_press_lets_nothing_start(
    start: Callable[..., Live], write_config: Callable[..., Path]
) -> None:
    later = 'dead_man = [{ at = "5 s", pressed = true }]'
    config = write_config(('dead_man = [{ at = "0.3 s", pressed = true }]', later))
    live = start(str(config), "--duration", "6")
    live.wait_for("READY")
    recorder = live.child("runtime.live.recorder")
    os.kill(recorder, signal.SIGSTOP)
    live.wait_for("the recorder hangs")
    os.kill(recorder, signal.SIGCONT)
    live.wait_for("not started: the recorder is gone or lost records")
    assert live.end() == 1, live.errors
    assert set(live.modes()) <= {Mode.BRINGUP, Mode.READY, Mode.STOPPED}


def test_records_that_find_no_room_count_as_a_lost_recorder() -> None:
    link = RecorderLink(Path("session.mcap"))
    child: Any = SimpleNamespace(poll=lambda: None)
    link.child = child
    ring = link._ring
    drain = Drain(ring, HUNG_LOOKS)
    assert link.fault(drain) == ""
    while ring.push(bytes(60_000)):
        pass
    assert "records were lost" in link.fault(drain)
    child.poll = lambda: -9
    assert "the recorder died" in link.fault(drain)


def test_after_the_daemon_is_killed_every_drive_is_safe_by_itself_and_the_log_opens(
    start: Callable[..., Live], machine: str
) -> None:
    live = start(machine, "--duration", "30")
    live.wait_for("ENGAGING")
    time.sleep(0.3)
    plant, recorder = live.child("plant_process"), live.child("recorder")
    live.process.send_signal(signal.SIGKILL)
    live.process.wait()
    wait_until_gone(plant)
    wait_until_gone(recorder)
    found = re.search(r"every simulated drive is safe after (\d+) ms of plant time", live.errors)
    assert found, live.errors
    assert 1 <= int(found[1]) <= 20
    assert "its log is complete" in live.errors
    modes = live.modes()
    assert modes[-1] is Mode.ENGAGING
    assert len(modes) > 300


def test_releasing_the_dead_man_stops_and_needs_a_reset_and_a_new_press(
    start: Callable[..., Live], machine: str, write_config: Callable[..., Path]
) -> None:
    presses = [(0.3, True), (0.8, False), (1.2, True), (3.0, False), (5.0, True)]
    script = ", ".join(f'{{ at = "{at} s", pressed = {str(pressed).lower()} }}' for at, pressed in presses)
    later = f"dead_man = [{script}]"
    changes = [('dead_man = [{ at = "0.3 s", pressed = true }]', later)]
    if machine == "rhi":  # a light arm in a firm hand moves as its brakes open, and is not started
        changes.append(('force = "40 N"', 'force = "2 N"'))
    config = write_config(*changes, machine=machine)
    live = start(str(config), "--duration", "30")
    live.wait_for("R3 dead_man")
    live.wait_for("STOPPED")
    time.sleep(1.0)  # the second press, at 1.2 s, does nothing
    assert live.errors.count("ENABLING") == 1
    live.type("reset\n")
    live.wait_for("release the dead-man switch first")  # it is held until 3 s
    while "READY: reset" not in live.errors:  # from 3 s on
        live.type("reset\n")
        time.sleep(0.5)
    live.wait_for("ENABLING: dead-man pressed; drives switch on")
    deadline = time.monotonic() + PATIENCE_S
    while live.errors.count("ENGAGING") < 2 and time.monotonic() < deadline:
        time.sleep(0.05)
    assert live.errors.count("ENGAGING") == 2
    live.type("quit\n")
    assert live.end() == 0


def test_an_interrupt_ends_the_session_after_the_machine_came_to_rest(
    start: Callable[..., Live], machine: str
) -> None:
    live = start(machine, "--duration", "30")
    live.wait_for("ENGAGING")
    live.process.send_signal(signal.SIGINT)
    assert live.end() == 0
    assert live.modes()[-1] is Mode.STOPPED


def test_a_plant_that_freezes_ends_the_session_with_the_reason(
    start: Callable[..., Live], machine: str
) -> None:
    live = start(machine, "--duration", "30")
    live.wait_for("ENGAGING")
    plant = live.child("plant_process")
    os.kill(plant, signal.SIGSTOP)
    frozen = time.monotonic()
    assert live.end() == 1
    assert time.monotonic() - frozen >= FROZEN_S
    assert "hapticd: the simulated plant froze: no answer for 2 s" in live.errors
    wait_until_gone(plant)
    modes = live.modes()
    assert modes[-1] is Mode.STOPPED
    assert len(modes) < 15_000


def test_a_plant_that_stands_still_for_a_while_costs_no_plant_time(start: Callable[..., Live]) -> None:
    live = start("giant", "--duration", "2", "--json")
    live.wait_for("ENGAGING")
    plant = live.child("plant_process")
    for _ in range(2):
        os.kill(plant, signal.SIGSTOP)
        time.sleep(0.7)
        os.kill(plant, signal.SIGCONT)
        time.sleep(0.2)
    assert live.end() == 0, live.errors
    report = msgspec.json.decode(live.output)
    assert report["ticks"] + report["shed"] >= 2000
    assert report["skipped"] > 1000
    assert report["frames_missing"] == 0
    assert "this host was too busy" in report["verdict"] and "--lockstep" in report["verdict"]


@pytest.mark.slow
def test_a_daemon_that_starves_does_the_whole_session_all_the_same(tmp_path: Path, machine: str) -> None:
    cpu = min(os.sched_getaffinity(0))
    unprivileged = ["setpriv", "--inh-caps=-all", "--bounding-set=-all"] if os.geteuid() == 0 else []
    if unprivileged and not shutil.which("setpriv"):
        pytest.skip("root needs setpriv to do without real time")
    run = [sys.executable, "-m", "hapticd.runtime", "run", machine, "--duration", "1.2", "--json"]
    on_one_cpu = partial(bound_to, cpu, tied())
    busy = [
        subprocess.Popen([sys.executable, "-c", "while True: pass"], preexec_fn=on_one_cpu) for _ in range(3)
    ]
    try:
        done = subprocess.run(
            [*unprivileged, *run],
            preexec_fn=on_one_cpu,
            capture_output=True,
            text=True,
            cwd=tmp_path,
            check=False,
            timeout=4 * PATIENCE_S,
        )
    finally:
        for process in busy:
            process.kill()
            process.wait()
    assert done.returncode == 0, done.stderr
    report = msgspec.json.decode(done.stdout)
    assert report["ticks"] + report["shed"] >= 1200
    assert report["skipped"] > 100  # or nothing was shown
    assert report["verdict"].endswith("close other programs, or run with --lockstep")


NOBODY = (
    ('kind = "simulated"', 'kind = "python-can"\ninterface = "virtual"\nchannel = "nobody"'),
    ('on_overrun = "record"', 'on_overrun = "stop"\nbest_effort = true'),
    ('by = "dead-man"', 'by = "command"'),
)


@pytest.mark.parametrize("seconds", ["0.5", "5"])
def test_a_bus_on_which_nobody_answers_is_a_failure_however_short_the_session(
    start: Callable[..., Live], machine: str, write_config: Callable[..., Path], seconds: str
) -> None:
    live = start(str(write_config(*NOBODY, machine=machine)), "--duration", seconds)
    assert live.end() == 1
    assert "hapticd: the devices " in live.errors and "not come up" in live.errors


def test_a_session_too_short_for_the_bring_up_is_a_failure_in_lockstep_too(
    tmp_path: Path, machine: str
) -> None:
    command = [*(sys.executable, "-m", "hapticd.runtime", "run", machine), "--lockstep", "--duration", "0.02"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.returncode == 1
    assert "the devices had not come up" in done.stderr


def test_ticks_follow_the_clock_of_the_bus(
    start: Callable[..., Live], write_config: Callable[..., Path]
) -> None:
    config = str(write_config(('rate = "1 kHz"', 'rate = "1 kHz"\nsync = "bus"')))
    live = start(config, "--duration", "60")
    live.wait_for("ticks follow the clock of the bus")
    live.wait_for("ENGAGING")
    live.type("quit\n")
    assert live.end() == 0, live.errors
    verify = [sys.executable, "-m", "hapticd.runtime", "replay", str(live.log), "--verify"]
    assert subprocess.run(verify, capture_output=True, check=False).returncode == 0


def test_what_the_bus_drops_becomes_an_event_once() -> None:
    image = SimpleNamespace(counters=np.zeros(len(COUNTERS), np.int64))
    bus = SimpleNamespace(unsent=0, malformed=0)
    events: list[Event] = []
    work = watch_bus(bus, image, events.append)  # type: ignore[arg-type]
    work.send(None)
    image.counters[COUNTERS.index("frames")] += 5
    image.counters[COUNTERS.index("misses")] += 1
    work.send(None)
    assert events == []
    image.counters[COUNTERS.index("length")] += 2
    bus.malformed += 1
    work.send(None)
    work.send(None)
    assert events == [EventKind.BUS_LOSSES(losses=["1 malformed", "2 length"])]
    work.close()


DISTURBED = """
import asyncio, sys, time
from hapticd.runtime.command_line import cli; from hapticd.runtime.live import daemon

def disturb():
    {disturbance}

become = daemon.Daemon._become_realtime
def become_and_disturb(self):
    become(self)
    asyncio.get_running_loop().call_later(1.0, disturb)
daemon.Daemon._become_realtime = become_and_disturb
sys.exit(cli.main(["run", "giant", "--duration", "3", "--log", sys.argv[1], "--json"]))
"""


def disturbed(folder: Path, disturbance: str) -> subprocess.CompletedProcess[str]:
    """A session in which something happens on the event loop after a second."""
    script = folder / "disturbed.py"
    script.write_text(DISTURBED.format(disturbance=disturbance))
    command = [sys.executable, str(script), str(folder / "session.mcap")]
    return subprocess.run(command, capture_output=True, text=True, cwd=folder, check=False)


def test_a_blocking_callback_is_named_with_its_source_line_in_the_log_and_in_the_summary(
    tmp_path: Path,
) -> None:
    done = disturbed(tmp_path, "time.sleep(2e-3)")
    assert done.returncode == 0, done.stderr
    where = f"{tmp_path.name}/disturbed.py:5 disturb"
    report = msgspec.json.decode(done.stdout)
    (overstay,) = [o for o in report["overstays"] if "disturb" in o["where"]]
    assert overstay["where"] == where
    assert overstay["count"] == 1 and overstay["worst_us"] >= 2000.0
    events = [event.text for event in open_log(str(tmp_path / "session.mcap")).events()]
    assert any(where in text for text in events)
    with open(tmp_path / "session.mcap", "rb") as stream:
        late = [json.loads(message.data) for _, _, message in make_reader(stream).iter_messages(["late"])]
    assert any(where in (name for name, _ in tick["callbacks"]) for tick in late)


def test_an_unexpected_error_on_the_loop_ends_the_session_and_every_drive_is_safe(tmp_path: Path) -> None:
    done = disturbed(tmp_path, "raise ZeroDivisionError('on purpose')")
    assert done.returncode == 1
    assert "ZeroDivisionError: on purpose" in done.stderr
    found = re.search(r"every simulated drive is safe after (\d+) ms of plant time", done.stderr)
    assert found and int(found[1]) <= 20
    assert open_log(str(tmp_path / "session.mcap")).events()


def test_a_flood_of_commands_is_answered_now_and_then_and_loses_no_record(
    start: Callable[..., Live], machine: str
) -> None:
    live = start(machine, "--duration", "300", "--json")
    live.wait_for("ENGAGING")
    live.wait_for("ACTIVE")
    for _ in range(4):
        live.type("reset\nhelp\nnonsense\n" * 200)
        time.sleep(0.02)
    live.type("\nquit\n")
    assert live.end() == 0, live.errors[-2000:]
    assert live.errors.count("typed: reset") < 700  # of 800
    assert msgspec.json.decode(live.output)["shed"] == 0
