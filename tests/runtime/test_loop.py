"""The fixed-rate loop: an absolute grid, late periods skipped and counted."""

import asyncio
import time
from itertools import pairwise

import pytest
from hapticd.runtime.timing.loop import FixedRate, now_ns
from hapticd.runtime.timing.slack import pause

PERIOD = 2_000_000


async def collect(count: int, block: dict[int, float] | None = None) -> list[tuple[int, int, int]]:
    """Tick, skipped and deadline of each callback; ``block`` sleeps in some of them."""
    loop = asyncio.get_running_loop()
    done, seen = asyncio.Event(), []

    def callback() -> None:
        seen.append((rhythm.tick, rhythm.skipped, rhythm.deadline_ns))
        time.sleep((block or {}).get(len(seen), 0.0))
        if len(seen) == count:
            rhythm.stop(loop.remove_reader)
            done.set()

    rhythm = FixedRate(PERIOD, callback)
    start = rhythm.start(loop.add_reader, 5_000_000)
    await done.wait()
    assert seen[0][2] - seen[0][0] * PERIOD == start
    return seen


async def test_every_deadline_lies_on_the_grid_and_every_period_is_accounted_for() -> None:
    seen = await collect(50)
    for before, after in pairwise(seen):
        assert after[0] == before[0] + 1 + after[1]
        assert after[2] - before[2] == (after[0] - before[0]) * PERIOD


async def test_a_blocked_callback_skips_periods_and_never_runs_after_them() -> None:
    seen = await collect(20, {5: 0.02})
    late = seen[5]
    assert late[1] >= 8  # 20 ms are ten periods
    assert late[0] == seen[4][0] + 1 + late[1]
    assert [tick for tick, _, _ in seen] == sorted({tick for tick, _, _ in seen})


async def test_a_spinning_loop_never_calls_before_the_deadline() -> None:
    loop = asyncio.get_running_loop()
    done, early = asyncio.Event(), []

    def callback() -> None:
        early.append(now_ns() < rhythm.deadline_ns)
        if len(early) == 50:
            rhythm.stop(loop.remove_reader)
            done.set()

    rhythm = FixedRate(PERIOD, callback, spin_ns=500_000)
    rhythm.start(loop.add_reader, 5_000_000)
    await done.wait()
    assert not any(early)


async def test_a_shifted_grid_moves_the_next_deadline_and_counts_as_before() -> None:
    loop = asyncio.get_running_loop()
    done, seen = asyncio.Event(), []

    def callback() -> None:
        seen.append((rhythm.tick, rhythm.skipped, rhythm.deadline_ns, now_ns()))
        rhythm.shift(100_000)
        if len(seen) == 20:
            rhythm.stop(loop.remove_reader)
            done.set()

    rhythm = FixedRate(PERIOD, callback)
    rhythm.start(loop.add_reader, 5_000_000)
    await done.wait()
    for before, after in pairwise(seen):
        assert after[0] == before[0] + 1 + after[1]
        assert after[2] - before[2] == (after[0] - before[0]) * PERIOD + 100_000
        assert after[3] >= after[2]


async def test_slack_work_runs_between_the_ticks() -> None:
    loop = asyncio.get_running_loop()
    done, order = asyncio.Event(), []

    async def work() -> None:
        while True:
            order.append("work")
            await pause()

    def callback() -> None:
        order.append("tick")
        enough = order.count("tick") >= 10 and order.count("work") >= 3
        if enough or order.count("tick") == 1000:
            rhythm.stop(loop.remove_reader)
            done.set()

    rhythm = FixedRate(PERIOD, callback)
    rhythm.slack.add(work())
    rhythm.start(loop.add_reader, 0)
    await done.wait()
    rhythm.slack.close()
    assert order[0] == "tick"
    assert order.count("work") >= 3


async def test_no_callback_comes_after_stop() -> None:
    loop = asyncio.get_running_loop()
    calls: list[int] = []
    rhythm = FixedRate(PERIOD, lambda: calls.append(1))
    rhythm.start(loop.add_reader, 0)
    while not calls:
        await asyncio.sleep(0)
    rhythm.stop(loop.remove_reader)
    rhythm.stop(loop.remove_reader)
    count = len(calls)
    end = now_ns() + 5 * PERIOD
    while now_ns() < end:
        await asyncio.sleep(0)
    assert len(calls) == count


def test_the_clock_is_monotonic() -> None:
    first, second = now_ns(), now_ns()
    assert 0 < first <= second
    assert abs(first - time.monotonic_ns()) < 1_000_000_000


def test_a_period_of_zero_is_refused() -> None:
    async def begin() -> None:
        FixedRate(-1, lambda: None).start(asyncio.get_running_loop().add_reader, 0)

    with pytest.raises(Exception, match="timerfd"):
        asyncio.run(begin())
