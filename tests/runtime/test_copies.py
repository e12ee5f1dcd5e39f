"""Tests that run in copies of the process: what happens there is told here and leaves nothing."""

from __future__ import annotations

import os
import signal
import warnings

import pytest
from hapticd.runtime.core.modes import Mode
from hapticd.testing.copies import in_a_copy

from .conftest import Bench, parked

seen: list[int] = []


def test_what_happens_in_a_copy_does_not_happen_here() -> None:
    in_a_copy(lambda: seen.append(os.getpid()))()
    assert seen == []


def test_arguments_reach_the_copy() -> None:
    def same(here: int, *, also: int) -> None:
        assert os.getppid() == here == also

    in_a_copy(same)(os.getpid(), also=os.getpid())


@pytest.mark.parametrize("turn", range(2))
def test_each_test_finds_a_session_where_it_was_parked(engaging: Bench, turn: int) -> None:
    assert engaging.mode is Mode.ENGAGING
    engaging.press(False)
    engaging.until(Mode.STOPPED)


def test_a_session_that_was_moved_here_is_not_given_to_the_next(machine: str) -> None:
    def careless() -> None:
        parked(Mode.BRINGUP, 0, machine).run(1)
        with pytest.raises(AssertionError, match="not in a copy"):
            parked(Mode.BRINGUP, 0, machine)

    in_a_copy(careless)()


def test_a_failure_is_told_with_its_lines_and_values() -> None:
    def fails() -> None:
        found = 41
        assert found == 42, "the answer"

    with pytest.raises(pytest.fail.Exception) as failure:
        in_a_copy(fails)()
    text = str(failure.value)
    assert "assert found == 42" in text and "assert 41 == 42" in text and "the answer" in text
    assert "test_copies.py" in text


def test_a_warning_in_a_copy_is_the_error_that_it_is_here() -> None:
    with pytest.raises(pytest.fail.Exception, match="UserWarning: careful"):
        in_a_copy(lambda: warnings.warn("careful", stacklevel=1))()


class Loud:
    """Raises where nobody can catch it."""

    def __del__(self) -> None:
        raise ValueError("unheard")


def test_what_nobody_could_raise_is_a_failure() -> None:
    def drops() -> None:
        loud = Loud()
        del loud

    with pytest.raises(pytest.fail.Exception, match="unheard"):
        in_a_copy(drops)()


def test_a_skip_in_a_copy_is_a_skip() -> None:
    with pytest.raises(pytest.skip.Exception, match="no such bus"):
        in_a_copy(lambda: pytest.skip("no such bus"))()


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_a_copy_that_dies_fails_with_its_signal(number: int) -> None:
    with pytest.raises(pytest.fail.Exception, match=rf"died without a report, status -{number:d}"):
        in_a_copy(lambda: os.kill(os.getpid(), number))()


@pytest.mark.parametrize("leave", [os._exit, lambda code: (_ for _ in ()).throw(SystemExit(code))])
def test_a_copy_that_leaves_early_has_not_passed(leave: object) -> None:
    with pytest.raises(pytest.fail.Exception):
        in_a_copy(leave)(0)  # type: ignore[arg-type]


def test_an_interrupted_test_leaves_no_copy_behind() -> None:
    children: list[int] = []
    fork = os.fork

    def watched() -> int:
        if child := fork():
            children.append(child)
            signal.setitimer(signal.ITIMER_REAL, 0.05)
        return child

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    os.fork = watched
    try:
        with pytest.raises(KeyboardInterrupt):
            in_a_copy(signal.pause)()
    finally:
        os.fork = fork
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    with pytest.raises(ChildProcessError):
        os.waitpid(children[0], 0)
