"""Tests in copies of this process: sessions are brought to a state once, and each test gets its own copy."""

from __future__ import annotations

import functools
import os
import pickle
import signal
import sys
import warnings
from collections.abc import Callable
from typing import Any, NoReturn

import pytest

from ..runtime.live.children import tied

Report = tuple[str, str]
"""What became of a copy: "passed", "failed" or "skipped", and why."""


def _told(error: BaseException) -> str:
    """An error as pytest shows it."""
    return str(pytest.ExceptionInfo.from_exception(error).getrepr(style="long"))


def in_a_copy(test: Callable[..., None]) -> Callable[..., None]:
    """Run a test in a copy of the process: what it does to a session, no other test sees.

    A failure, a skip, an exception that nobody could raise (as in ``__del__``) and the death of the copy
    become those of the test. The copy dies with this process.
    """

    @functools.wraps(test)
    def copied(*args: Any, **kwargs: Any) -> None:
        read, write = os.pipe()
        tie = tied()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # the copy has no use for other threads
            child = os.fork()
        if child == 0:
            tie()
            os.close(read)
            _copy(functools.partial(test, *args, **kwargs), write)
        os.close(write)
        _judge(*_outcome(child, read))

    return copied


def _copy(test: Callable[[], None], write: int) -> NoReturn:
    """The life of a copy; it runs nothing that its parent meant to run in the end."""
    unraised: list[str] = []
    sys.unraisablehook = lambda found: unraised.append(f"{found.err_msg}: {found.exc_value!r} {found.object}")
    try:
        report = _run(test)
        if unraised and report[0] == "passed":
            report = ("failed", "not raised: " + "\n".join(unraised))
        with open(write, "wb") as pipe:
            pickle.dump(report, pipe)
    finally:
        os._exit(0)


def _run(test: Callable[[], None]) -> Report:
    __tracebackhide__ = True
    try:
        test()
    except pytest.skip.Exception as skip:
        return "skipped", str(skip)
    except BaseException as error:
        return "failed", _told(error)
    return "passed", ""


def _outcome(child: int, read: int) -> tuple[bytes, int]:
    """What a copy reported, and the status of its end."""
    try:
        with open(read, "rb") as pipe:
            report = pipe.read()
    except BaseException:  # this test is being interrupted
        os.kill(child, signal.SIGKILL)
        raise
    finally:
        _, status = os.waitpid(child, 0)
    return report, status


def _judge(report: bytes, status: int) -> None:
    if status or not report:
        code = os.waitstatus_to_exitcode(status)
        pytest.fail(f"the copy of the process died without a report, status {code}", pytrace=False)
    outcome, why = pickle.loads(report)
    if outcome == "skipped":
        pytest.skip(why)
    if outcome == "failed":
        pytest.fail(why, pytrace=False)
