"""What this user's processes may do: SCHED_FIFO and locked memory."""

from __future__ import annotations

import re

from ..timing.host import Host
from ..timing.realtime import DAEMON_PRIORITY
from .line import Line, State

CAP_IPC_LOCK, CAP_SYS_NICE = 14, 23
"""Bits of the capability sets, from linux/capability.h."""
LIMITS = "/etc/security/limits.d/hapticd.conf"
LOG_IN = "log out and in again; a service gets this from its unit instead"


def fifo(host: Host) -> Line:
    """Permission for SCHED_FIFO at the daemon's priority."""
    why = "Without SCHED_FIFO any other process may keep the CPU for milliseconds when a tick is due."
    if _capable(host, CAP_SYS_NICE):
        return Line("fifo", State.PASS, "CAP_SYS_NICE", why)
    limit = _limit(host, "Max realtime priority")
    if limit >= DAEMON_PRIORITY:
        return Line("fifo", State.PASS, f"priority {limit:g} allowed, {DAEMON_PRIORITY} used", why)
    found = f"priority {limit:g} allowed, {DAEMON_PRIORITY} needed"
    return Line("fifo", State.FAIL, found, why, _raise("rtprio", "90"))


def memlock(host: Host) -> Line:
    """Permission to lock memory."""
    why = "Memory that is not locked may be missing when a tick needs it, and comes back in milliseconds."
    if _capable(host, CAP_IPC_LOCK):
        return Line("memlock", State.PASS, "CAP_IPC_LOCK", why)
    limit = _limit(host, "Max locked memory")
    if limit == float("inf"):
        return Line("memlock", State.PASS, "unlimited", why)
    return Line("memlock", State.FAIL, f"at most {limit / 2**20:g} MiB", why, _raise("memlock", "unlimited"))


def _raise(item: str, value: str) -> str:
    return f'echo "$USER - {item} {value}" | sudo tee -a {LIMITS}    # then {LOG_IN}'


def _capable(host: Host, bit: int) -> bool:
    match = re.search(r"^CapEff:\s*([0-9a-f]+)$", host.read("/proc/self/status") or "", re.MULTILINE)
    return bool(match and int(match[1], 16) >> bit & 1)


def _limit(host: Host, name: str) -> float:
    """The soft limit, as mlockall and sched_setscheduler obey it."""
    match = re.search(rf"^{name}\s+(\S+)", host.read("/proc/self/limits") or "", re.MULTILINE)
    if not match:
        return 0.0
    return float("inf") if match[1] == "unlimited" else float(match[1])
