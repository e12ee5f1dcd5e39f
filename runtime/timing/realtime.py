"""Real-time settings of a process; what is not permitted is reported, never fatal."""

from __future__ import annotations

import gc
import os
import sys
from dataclasses import dataclass, field
from pathlib import Path

from .._rt import lib
from ..errors import HapticdError
from .cpu_list import parse_cpus

DAEMON_PRIORITY = 80
PLANT_PRIORITY = 70
TIMER_PRIORITY = DAEMON_PRIORITY + 1
"""Priority of a PREEMPT_RT kernel's threads in which timers expire: what delays them delays the tick."""
SPIN_NS = 60_000
"""How early the timer fires where the loop may spin: the latest wake-ups of an idle processor."""
ISOLATED = Path("/sys/devices/system/cpu/isolated")
WAKE_UP_LIMIT = Path("/dev/cpu_dma_latency")


class NotRealtimeError(HapticdError):
    """A real machine is not run without what the kernel must grant (docs/fault-matrix.md, row 23)."""

    code = "realtime"


@dataclass(slots=True)
class Granted:
    """What the kernel granted.

    Attributes:
        memory, fifo, cpu: locked memory, SCHED_FIFO, the processor that was asked for.
        lost: what was refused, with the fix.
    """

    memory: bool = True
    fifo: bool = True
    cpu: bool = True
    lost: list[str] = field(default_factory=list)


def become_realtime(priority: int, cpu: int | None = None) -> Granted:
    """Locked memory, the process bound to a processor where one is named, and SCHED_FIFO last."""
    granted = Granted()
    error = -int(lib.rt_lock_memory())
    if error:
        granted.memory = False
        granted.lost.append(
            f"memory is not locked ({os.strerror(error)}): page faults may delay ticks;"
            " raise the memlock limit (ulimit -l unlimited) or run with CAP_IPC_LOCK"
        )
    if cpu is not None:
        try:
            os.sched_setaffinity(0, {cpu})
        except OSError as refused:
            granted.cpu = False
            granted.lost.append(
                f"not bound to processor {cpu} ({refused.strerror}): other work may delay ticks;"
                f" name one of {_listed(os.sched_getaffinity(0))} as [loop] cpu"
            )
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(priority))
    except OSError as refused:
        granted.fifo = False
        granted.lost.append(
            f"no SCHED_FIFO ({refused.strerror}): other processes may delay ticks;"
            " raise the rtprio limit (/etc/security/limits.d) or run with CAP_SYS_NICE"
        )
    return granted


def stay_awake(path: Path = WAKE_UP_LIMIT) -> bool:
    """Keep the processors from sleeping for as long as this process lives; whether that was granted.

    Waking up takes tens of microseconds, and what runs next finds its caches and its frequency gone.
    """
    try:
        fd = os.open(path, os.O_WRONLY)
    except OSError:
        return False
    try:
        os.write(fd, (0).to_bytes(4, sys.byteorder))
    except OSError:
        os.close(fd)
        return False
    return True  # and not closed: the kernel forgets the wish with the descriptor


def automatic_spin_ns(granted: Granted, cpu: int | None) -> int:
    """Spinning pays, and harms nobody, under SCHED_FIFO on a processor that is kept free of other work."""
    return SPIN_NS if granted.fifo and granted.cpu and cpu in isolated_cpus() else 0


def isolated_cpus(path: Path = ISOLATED) -> set[int]:
    """Processors that the kernel keeps free (isolcpus=)."""
    try:
        return parse_cpus(path.read_text(encoding="ascii"))
    except OSError:
        return set()


def leave_cpu(pid: int, cpu: int | None) -> None:
    """Keep another process off the loop's processor, where there is any other."""
    others = os.sched_getaffinity(0) - {cpu}
    if cpu is not None and others:
        os.sched_setaffinity(pid, others)


def settle_memory() -> None:
    """Collect once, then keep the collector off: a collection in the tick costs tens of milliseconds."""
    gc.collect()
    gc.freeze()
    gc.disable()


def _listed(cpus: set[int]) -> str:
    return ", ".join(map(str, sorted(cpus)))
