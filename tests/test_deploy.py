"""The systemd units: valid, hardened, and generous enough for what the daemon does."""

from __future__ import annotations

import os
import shutil
import subprocess
from configparser import ConfigParser
from pathlib import Path

import pytest
from hapticd.runtime.doctor import cpu, kernel
from hapticd.runtime.doctor.line import State
from hapticd.runtime.live.children import CHILD_LIMIT_S
from hapticd.runtime.live.outcome import END_LIMIT_S
from hapticd.runtime.live.plant_link import FROZEN_S
from hapticd.runtime.timing.host import Host
from hapticd.runtime.timing.realtime import DAEMON_PRIORITY

DEPLOY = Path(__file__).parent.parent / "deploy"
UNITS = ("hapticd@.service", "hapticd@.socket", "hapticd-host.service")
MOST_EXPOSURE = 25
"""In tenths, as `systemd-analyze security` counts; 10.0 is a service without any protection."""


@pytest.fixture
def service() -> dict[str, str]:
    parser = ConfigParser(interpolation=None, delimiters=("=",), strict=False)
    parser.optionxform = str  # type: ignore[assignment,method-assign]
    parser.read(DEPLOY / UNITS[0])
    return dict(parser["Service"])


@pytest.fixture
def analyze() -> str:
    program = shutil.which("systemd-analyze")
    if not program:
        pytest.skip("there is no systemd-analyze")
    return program


def test_the_service_may_do_what_the_daemon_does(service: dict[str, str]) -> None:
    assert service["Type"] == "notify"
    assert set(service["AmbientCapabilities"].split()) == {"CAP_SYS_NICE", "CAP_IPC_LOCK", "CAP_NET_RAW"}
    assert service["CapabilityBoundingSet"] == service["AmbientCapabilities"]
    assert int(service["LimitRTPRIO"]) >= DAEMON_PRIORITY
    assert service["LimitMEMLOCK"] == "infinity"
    assert {"AF_UNIX", "AF_CAN"} <= set(service["RestrictAddressFamilies"].split())


def test_the_managers_patience_is_longer_than_the_daemons(service: dict[str, str]) -> None:
    assert float(service["WatchdogSec"]) > FROZEN_S
    assert float(service["TimeoutStopSec"]) > END_LIMIT_S + CHILD_LIMIT_S
    assert float(service["TimeoutStartSec"]) > 2 * CHILD_LIMIT_S


def test_systemd_accepts_the_units(analyze: str, tmp_path: Path) -> None:
    for unit in UNITS:
        text = (DEPLOY / unit).read_text().replace("/opt/hapticd/bin/hapticd", "/bin/true")
        (tmp_path / unit.replace("@", "@giant")).write_text(text)
    paths = [str(tmp_path / unit.replace("@", "@giant")) for unit in UNITS]
    told = subprocess.run([analyze, "verify", *paths], capture_output=True, text=True, check=False)
    assert "hapticd" not in told.stderr
    assert told.returncode == 0, told.stderr


THREAD = "18 (ktimers/0) S" + 36 * " 0"
PROGRAMS = {
    "pgrep": 'cd "$HOST/proc" && grep -lE "$1" [0-9]*/comm | cut -d/ -f1',
    "chrt": f'[ "$1 $2" = "--fifo --pid" ] && echo "{THREAD} $3 1" >"$HOST/proc/$4/stat"',
}
"""Stand-ins that see and change the threads of a host made of files."""


def test_the_host_service_makes_the_settings_that_the_doctor_wants(tmp_path: Path) -> None:
    cpus = "sys/devices/system/cpu"
    before = {
        f"{cpus}/cpu0/cpufreq/scaling_governor": "powersave",
        f"{cpus}/cpu0/cpuidle/state1/latency": "20",
        f"{cpus}/cpu0/cpuidle/state1/disable": "0",
        f"{cpus}/cpu0/cpuidle/state2/latency": "100",
        f"{cpus}/cpu0/cpuidle/state2/disable": "0",
        "sys/kernel/debug/sched/fair_server/cpu0/runtime": "50000000",
        "sys/kernel/realtime": "1",
        "proc/sys/kernel/osrelease": "6.12.0",
        "proc/17/comm": "ksoftirqd/0",
        "proc/18/comm": "ktimers/0",
        "proc/18/stat": f"{THREAD} 1 1",
        **{f"bin/{name}": f"#!/bin/sh\n{text}\n" for name, text in PROGRAMS.items()},
    }
    for path, text in before.items():
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(text)
    for name in PROGRAMS:
        (tmp_path / "bin" / name).chmod(0o755)
    environment = {"PATH": f"{tmp_path}/bin:{os.environ['PATH']}", "HOST": str(tmp_path)}
    host = Host(tmp_path)
    checks = (cpu.governor, cpu.sleep_states, kernel.fair_server, kernel.timer_threads)
    assert [check(host).state for check in checks] == [State.WARN] * 4
    for line in (DEPLOY / "hapticd-host.service").read_text().splitlines():
        if line.startswith("ExecStart=-"):
            # as systemd reads it, in a folder that stands for the host
            command = line.removeprefix("ExecStart=-").replace("$$", "$").replace("/sys/", f"{tmp_path}/sys/")
            subprocess.run(["/bin/sh", "-c", command], check=True, env=environment)
    assert [check(host).state for check in checks] == [State.PASS] * 4
    assert (tmp_path / f"{cpus}/cpu0/cpuidle/state1/disable").read_text().strip() == "0"


def test_the_service_is_little_exposed(analyze: str) -> None:
    command = [analyze, "security", "--offline=true", f"--threshold={MOST_EXPOSURE}"]
    told = subprocess.run([*command, str(DEPLOY / UNITS[0])], capture_output=True, text=True, check=False)
    if "unrecognized option" in told.stderr:
        pytest.skip("this systemd-analyze is too old to judge a file")
    assert told.returncode == 0, told.stdout[-300:]
