"""The kernel: preemption, timers, limits on real-time processes, clock, swap."""

from __future__ import annotations

import platform
import shlex

from ..invocation import script_path
from ..timing.cpu_list import format_cpus
from ..timing.host import Host
from ..timing.realtime import DAEMON_PRIORITY, TIMER_PRIORITY
from .line import Line, State

RT_KERNEL = {"x86_64": "linux-image-rt-amd64", "aarch64": "linux-image-rt-arm64"}
"""Debian's PREEMPT_RT kernel by machine type."""
SLOW_CLOCKS = {"hpet", "acpi_pm", "jiffies", "refined-jiffies", "pit"}
FAIR_SERVERS = "/sys/kernel/debug/sched/fair_server"


def preempt_rt(host: Host) -> Line:
    """A kernel that can interrupt itself for a tick."""
    why = "Only a PREEMPT_RT kernel lets a tick interrupt the kernel's own work within microseconds."
    release = host.read("/proc/sys/kernel/osrelease") or "unknown"
    if _preempts(host):
        return Line("preempt_rt", State.PASS, f"Linux {release}, PREEMPT_RT", why)
    fix = f"sudo apt install {_rt_kernel()} && sudo reboot"
    return Line("preempt_rt", State.FAIL, f"Linux {release} without PREEMPT_RT", why, fix)


def timer_threads(host: Host) -> Line:
    """The threads in which timers expire under PREEMPT_RT, the timer of the tick, too."""
    why = (
        "The tick's timer expires in a kernel thread: real-time processes of a higher priority than its delay"
        " the tick, even those that the daemon itself could interrupt."
    )
    if not _preempts(host):
        return Line("timer_threads", State.PASS, "timers expire in the interrupt", why)
    priorities = _timer_priorities(host)
    if not priorities:
        found = "no thread ktimers/N is visible; other kernels leave timers to ksoftirqd/N, at no priority"
        again = f"sudo {shlex.quote(str(script_path() or 'hapticd'))} doctor"
        fix = f"{again}    # still none: sudo apt install {_rt_kernel()}, or Linux 6.13 and later"
        return Line("timer_threads", State.WARN, found, why, fix)
    low = {cpu for cpu, priority in priorities.items() if priority <= DAEMON_PRIORITY}
    found = f"priority {min(priorities.values())}, the daemon's is {DAEMON_PRIORITY}"
    if not low:
        return Line("timer_threads", State.PASS, found, why)
    fix = f"for p in $(pgrep ^ktimers/); do sudo chrt --fifo --pid {TIMER_PRIORITY} $p; done"
    return Line("timer_threads", State.WARN, f"{found} (CPU {format_cpus(low)})", why, fix)


def rt_throttling(host: Host) -> Line:
    """The share of time that the kernel leaves to SCHED_FIFO."""
    why = "Throttling takes the CPU away from real-time processes that use most of it, for 50 ms at a time."
    told = host.read("/proc/sys/kernel/sched_rt_runtime_us")
    fix = (
        "echo kernel.sched_rt_runtime_us = -1 | sudo tee /etc/sysctl.d/60-hapticd.conf"
        " && sudo sysctl -p /etc/sysctl.d/60-hapticd.conf"
    )
    if told is None:
        return Line("rt_throttling", State.PASS, "this kernel does not throttle", why)
    runtime, period = int(told), int(host.read("/proc/sys/kernel/sched_rt_period_us") or 1_000_000)
    if runtime < 0:
        return Line("rt_throttling", State.PASS, "off", why)
    found = f"real-time processes get {runtime / period:.0%} of each {period / 1e6:g} s"
    return Line("rt_throttling", State.WARN if runtime > 0 else State.FAIL, found, why, fix)


def fair_server(host: Host) -> Line:
    """The kernel's reserve for ordinary processes, which replaces throttling since Linux 6.12."""
    why = "The reserve runs ordinary processes before real-time ones, for up to 50 ms of each second."
    release = host.read("/proc/sys/kernel/osrelease") or "0.0"
    if _version(release) < (6, 12):
        return Line("fair_server", State.PASS, f"Linux {release} has none", why)
    fix = (
        "sudo sh -c 'mountpoint -q /sys/kernel/debug || mount -t debugfs none /sys/kernel/debug;"
        f" for f in {FAIR_SERVERS}/cpu*/runtime; do printf 0 > $f; done'"
    )
    paths = host.find(f"{FAIR_SERVERS}/cpu*/runtime")
    if not paths:
        return Line(
            "fair_server", State.WARN, "cannot be read: debugfs is not mounted, or root alone may", why, fix
        )
    active = {path: value for path in paths if (value := host.read(path)) != "0"}
    if not active:
        return Line("fair_server", State.PASS, "off", why)
    longest = max(int(value) if value and value.isdecimal() else 0 for value in active.values())
    found = f"{longest / 1e6:g} ms of each second on {len(active)} CPUs"
    return Line("fair_server", State.WARN, found, why, fix)


def clocksource(host: Host) -> Line:
    """The counter behind CLOCK_MONOTONIC."""
    why = "Every tick reads the clock many times; a slow one costs microseconds at each reading."
    folder = "/sys/devices/system/clocksource/clocksource0"
    current = host.read(f"{folder}/current_clocksource") or "unknown"
    if current not in SLOW_CLOCKS:
        return Line("clocksource", State.PASS, current, why)
    fix = "sudo dmesg | grep -i tsc    # the kernel says here why it gave the TSC up; update the firmware"
    if "tsc" in (host.read(f"{folder}/available_clocksource") or "").split():
        fix = f"echo tsc | sudo tee {folder}/current_clocksource"
    return Line("clocksource", State.FAIL, f"{current}, a slow one", why, fix)


def swap(host: Host) -> Line:
    """Memory that may go to disk."""
    why = "What was swapped out comes back from disk in milliseconds; the daemon's helpers are not locked."
    rows = (host.read("/proc/swaps") or "").splitlines()[1:]
    if not rows:
        return Line("swap", State.PASS, "none", why)
    names = ", ".join(row.split()[0] for row in rows)
    fix = r"sudo swapoff -a && sudo sed -i -E 's/^[^#].*\sswap\s/#&/' /etc/fstab"
    return Line("swap", State.WARN, names, why, fix)


def _preempts(host: Host) -> bool:
    version = host.read("/proc/sys/kernel/version") or ""
    return host.read("/sys/kernel/realtime") == "1" or "PREEMPT_RT" in version


def _timer_priorities(host: Host) -> dict[int, int]:
    """Real-time priority (0: none) of the kernel's threads ``ktimers/CPU``, by CPU."""
    found = {}
    for path in host.find("/proc/[0-9]*/comm"):
        name, _, cpu = (host.read(path) or "").partition("/")
        if name == "ktimers" and cpu.isdecimal() and (status := host.read(f"{path[:-4]}stat")):
            found[int(cpu)] = int(status.rpartition(")")[2].split()[37])  # rt_priority, see proc(5)
    return found


def _rt_kernel() -> str:
    return RT_KERNEL.get(platform.machine(), "linux-image-rt-*")


def _version(release: str) -> tuple[int, int]:
    major, _, rest = release.partition(".")
    minor = rest.partition(".")[0].partition("-")[0]
    return (int(major) if major.isdecimal() else 0, int(minor) if minor.isdecimal() else 0)
