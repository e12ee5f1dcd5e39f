"""A process that waits for a processor is told from one that runs, sleeps, is stopped or is gone."""

import os
import select
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hapticd.runtime.timing.starvation import LONGEST_DOZE_S, Starvation


@pytest.fixture
def child() -> Iterator[Callable[[Callable[[], None]], int]]:
    pids: list[int] = []

    def start(work: Callable[[], None]) -> int:
        pid = os.fork()
        if pid == 0:
            work()
            os._exit(0)
        pids.append(pid)
        return pid

    yield start
    for pid in pids:
        os.kill(pid, signal.SIGKILL)
        os.waitpid(pid, 0)


def sleep() -> None:
    time.sleep(60)


def spin() -> None:
    while True:
        pass


def looks(starvation: Starvation, seconds: float) -> list[bool]:
    starvation.now(True)
    found = []
    for _ in range(10):
        time.sleep(seconds)
        found.append(starvation.now(False))
    return found


def test_a_sleeping_and_a_stopped_process_do_not_starve(
    child: Callable[[Callable[[], None]], int],
) -> None:
    assert not any(looks(Starvation(child(sleep)), 0.005))
    pid = child(spin)
    os.kill(pid, signal.SIGSTOP)
    os.waitpid(pid, os.WUNTRACED)
    assert not any(looks(Starvation(pid), 0.005))


def wait_for_events() -> None:
    select.epoll().poll()


def test_a_process_in_its_event_loop_counts_as_not_woken_for_a_tenth_of_a_second(
    child: Callable[[Callable[[], None]], int],
) -> None:
    pid = child(wait_for_events)
    while Path(f"/proc/{pid}/wchan").read_text() not in ("ep_poll", "do_epoll_wait"):
        time.sleep(0.005)
    starvation = Starvation(pid)
    assert starvation.now(True)
    assert starvation.now(False)
    time.sleep(LONGEST_DOZE_S)
    assert not starvation.now(False)
    assert starvation.now(True)  # another silence


def test_a_process_that_runs_is_seen_to_run_before_a_watchdog_would_act(
    child: Callable[[Callable[[], None]], int],
) -> None:
    pid = child(spin)
    before = Path(f"/proc/{pid}/schedstat").read_text().split()[0]
    time.sleep(0.02)
    while int(Path(f"/proc/{pid}/schedstat").read_text().split()[0]) - int(before) < 20_000_000:
        time.sleep(0.02)  # until it had 20 ms of a processor
    starvation = Starvation(pid)
    starvation.now(True)
    time.sleep(0.2)
    assert not starvation.now(False)


def test_a_process_behind_another_on_one_processor_starves_now_and_then(
    child: Callable[[Callable[[], None]], int],
) -> None:
    pids = [child(spin) for _ in range(4)]
    cpu = min(os.sched_getaffinity(0))
    for pid in pids:
        os.sched_setaffinity(pid, {cpu})
    watched = [Starvation(pid) for pid in pids]
    starved = ran = 0
    for _ in range(200):
        time.sleep(1e-3)
        now = [starvation.now(False) for starvation in watched]
        starved, ran = starved + sum(now), ran + len(now) - sum(now)
    assert starved > ran > 0


def test_a_process_that_is_gone_and_a_kernel_that_tells_nothing_count_as_not_starving(
    tmp_path: Path, child: Callable[[Callable[[], None]], int]
) -> None:
    pid = os.fork()
    if pid == 0:
        os._exit(0)
    starvation = Starvation(pid)
    os.waitpid(pid, 0)
    assert not starvation.now(True)
    assert not Starvation(os.getpid(), tmp_path).now(True)
