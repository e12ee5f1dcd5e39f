"""Real-time settings of a process; what is not permitted is reported, never fatal."""

from __future__ import annotations

import gc
import os

from ._rt import lib

DAEMON_PRIORITY = 80
PLANT_PRIORITY = 70


def become_realtime(priority: int) -> list[str]:
    """SCHED_FIFO at a priority and locked memory; returns what was refused, with the fix."""
    lost = []
    error = -int(lib.rt_lock_memory())
    if error:
        lost.append(
            f"memory is not locked ({os.strerror(error)}): page faults may delay ticks;"
            " raise the memlock limit (ulimit -l unlimited) or run with CAP_IPC_LOCK"
        )
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(priority))
    except OSError as refused:
        lost.append(
            f"no SCHED_FIFO ({refused.strerror}): other processes may delay ticks;"
            " raise the rtprio limit (/etc/security/limits.d) or run with CAP_SYS_NICE"
        )
    return lost


def settle_memory() -> None:
    """Collect once, then keep the collector off: a collection in the tick costs tens of milliseconds."""
    gc.collect()
    gc.freeze()
    gc.disable()
