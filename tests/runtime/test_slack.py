"""Supervisory work runs between the ticks; into the next one at most once a second."""

import time
from itertools import count, pairwise

import pytest
from hapticd.runtime.timing import slack as slack_module
from hapticd.runtime.timing.loop import now_ns
from hapticd.runtime.timing.slack import GUARD_NS, Slack, pause
from hapticd.runtime.timing.watch import Overstay, Watch

BUDGET = 200_000
FAR = 10**12


async def write(name: str, done: list[str], slices: int | None = None) -> None:
    """Supervisory work that says when it has had a slice."""
    for _ in count() if slices is None else range(slices):
        done.append(name)
        await pause()


def test_slices_alternate_and_work_ends() -> None:
    done: list[str] = []
    slack = Slack(Watch())
    slack.add(write("a", done, 2))
    slack.add(write("b", done, 3))
    for _ in range(5):
        slack.serve(now_ns() + FAR)
    assert done == ["a", "b", "a", "b", "b"]


def test_no_slice_starts_where_its_budget_does_not_fit_and_it_comes_first_next_time() -> None:
    done: list[str] = []
    slack = Slack(Watch())
    slack.add(write("a", done), BUDGET)
    slack.add(write("b", done), BUDGET)
    slack.serve(now_ns() + BUDGET + GUARD_NS - 1)
    assert done == []

    async def long() -> None:
        done.append("long")
        time.sleep(1e-3)
        await pause()

    slack.add(long(), BUDGET)
    slack.add(write("c", done), BUDGET)
    slack.serve(now_ns() + 3 * BUDGET + GUARD_NS + 600_000)
    assert done[:3] == ["a", "b", "long"]  # and no time was left
    slack.serve(now_ns() + FAR)
    assert done[3:] == ["c", "a", "b"]


def test_work_that_never_fits_in_gets_a_slice_after_a_second_and_keeps_nobody_waiting(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(slack_module, "PATIENCE_NS", 20_000_000)
    done: list[str] = []
    slack = Slack(Watch())
    begin = now_ns()
    slack.add(write("long", done), FAR)
    slack.add(write("longer", done), FAR)
    slack.add(write("short", done), 0)
    while done.count("longer") < 2 and now_ns() < begin + 10 * 10**9:
        slack.serve(now_ns() + FAR // 2)
    assert [name for name in done if name != "short"] == ["long", "longer", "long", "longer"]
    assert now_ns() - begin > 80_000_000  # one slice in 20 ms, of both together
    assert done.count("short") > 10


def test_a_rest_is_kept() -> None:
    times: list[int] = []

    async def work() -> None:
        while True:
            times.append(now_ns())
            await pause(5e-3)

    slack = Slack(Watch())
    slack.add(work())
    while len(times) < 4:
        slack.serve(now_ns() + FAR)
    assert all(after - before >= 5_000_000 for before, after in pairwise(times))


def test_a_slice_beyond_its_budget_is_named_with_its_line() -> None:
    found: list[Overstay] = []

    async def work() -> None:
        await pause()
        time.sleep(2e-3)
        await pause()

    slack = Slack(Watch(found.append))
    slack.add(work(), BUDGET)
    slack.serve(now_ns() + FAR)
    before = len(found)  # a host that stalls makes any slice too long
    slack.serve(now_ns() + FAR)
    (overstay,) = found[before:]
    line = work.__code__.co_firstlineno + 1
    assert overstay.where.startswith(f"runtime/test_slack.py:{line} ")
    assert overstay.us > 1900 and overstay.budget_us == 200.0


def test_work_that_raises_is_dropped_and_reported_and_the_rest_goes_on() -> None:
    failed: list[tuple[str, Exception]] = []
    done: list[int] = []

    async def broken() -> None:
        raise ValueError("bad")

    async def work() -> None:
        while True:
            done.append(1)
            await pause()

    slack = Slack(Watch(), lambda work, error: failed.append((work, error)))
    slack.add(broken())
    slack.add(work())
    for _ in range(3):
        slack.serve(now_ns() + FAR)
    assert len(done) == 3
    ((broken_work, error),) = failed
    assert broken_work.endswith("broken") and repr(error) == "ValueError('bad')"


def test_closed_work_does_not_run() -> None:
    async def work() -> None:
        await pause()

    slack = Slack(Watch())
    slack.add(work())
    slack.close()
    slack.serve(now_ns() + FAR)
