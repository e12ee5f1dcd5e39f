"""Callbacks that overstay are named with their source line."""

import asyncio
import inspect
import sys
import time
from functools import partial

import pytest
from hapticd.runtime.timing.watch import BUDGET_NS, KEPT_NS, Overstay, Watch, WatchedLoop, source


def block() -> None:
    time.sleep(2e-3)


async def block_twice() -> None:
    await asyncio.sleep(0)
    time.sleep(2e-3)  # the line before is where it is resumed
    await asyncio.sleep(0)


def line_of(function: object, text: str) -> int:
    lines, start = inspect.getsourcelines(function)  # type: ignore[arg-type]
    return start + next(i for i, line in enumerate(lines) if text in line)


def run(main: object) -> list[Overstay]:
    found: list[Overstay] = []
    with asyncio.Runner(loop_factory=WatchedLoop) as runner:
        runner.get_loop().watch = Watch(found.append)  # type: ignore[attr-defined]
        runner.run(main)  # type: ignore[arg-type]
    return found


def test_a_blocking_coroutine_is_named_with_the_line_where_it_was_resumed() -> None:
    resumed = line_of(block_twice, "await asyncio.sleep(0)")
    where = f"runtime/test_watch.py:{resumed} block_twice"
    (found,) = [o for o in run(block_twice()) if o.where == where]  # a busy host may hold up others
    assert found.us > 1900 and found.budget_us == 100.0


def test_a_name_leaves_nothing_behind_in_the_table_of_interned_strings(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    interned: list[str] = []
    monkeypatch.setattr(sys, "intern", lambda text: interned.append(text) or text)
    assert source(block).endswith(" block")
    assert interned == []


@pytest.mark.parametrize("how", ["call_soon", "call_later", "call_at", "call_soon_threadsafe", "add_reader"])
def test_a_blocking_callback_is_named_however_it_was_scheduled(how: str) -> None:
    import os

    async def main() -> None:
        loop = asyncio.get_running_loop()
        done = asyncio.Event()

        def blocking() -> None:
            block()
            loop.remove_reader(readable)
            done.set()

        readable, writable = os.pipe()
        os.write(writable, b"x")
        when = {"call_later": (1e-3,), "call_at": (loop.time() + 1e-3,), "add_reader": (readable,)}
        getattr(loop, how)(*when.get(how, ()), blocking)
        await done.wait()
        os.close(readable)
        os.close(writable)

    (found,) = [o for o in run(main()) if o.where.endswith("main.<locals>.blocking")]
    assert found.us > 1900
    assert found.where.startswith("runtime/test_watch.py:")


def test_what_ran_is_kept_until_it_is_taken_and_trifles_are_left_out() -> None:
    watch = Watch()
    watch.time(block)
    watch.account(run, 0, KEPT_NS - 1, BUDGET_NS)
    ((where, ns),) = watch.take()
    assert where == f"runtime/test_watch.py:{block.__code__.co_firstlineno} block"
    assert ns >= 2_000_000
    assert watch.take() == []


def test_the_result_and_the_error_of_a_callback_pass_through() -> None:
    watch = Watch()
    assert watch.time(int, "7") == 7
    with pytest.raises(ZeroDivisionError):
        watch.time(lambda: 1 // 0)


def test_sources_of_partials_methods_and_builtins() -> None:
    class Thing:
        def work(self) -> None: ...

    assert source(partial(partial(block))) == source(block)
    assert source(Thing().work).endswith("Thing.work")
    assert source(print) == "print"
