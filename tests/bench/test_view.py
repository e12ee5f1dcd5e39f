"""Many pages, one that never reads, and a view that is killed: the session does not know of them."""

from __future__ import annotations

import re
import shutil
from contextlib import AbstractContextManager
from pathlib import Path
from subprocess import Popen

import pytest
from hapticd.bench import view
from hapticd.bench.recorded import BenchError
from hapticd.bench.view import FIGURES, Session, session, summarise
from hapticd.configs import read_text
from hapticd.runtime.recording.log import open_log
from hapticd.runtime.recording.replay import replay

PROGRAM = view.PROGRAM


@pytest.mark.live
def test_a_session_under_many_eyes_loses_no_record_and_replays(tmp_path: Path) -> None:
    log = tmp_path / "viewed.mcap"
    found = session("panda", 4.0, 20, log)
    assert found.summary["stop"] == ""
    assert found.frames > 20 * 10
    assert replay(open_log(str(log))).differing_ticks == 0


@pytest.mark.parametrize(("pages", "seconds", "says"), [(1, 1.0, "more --seconds"), (201, 9.0, "up to 200")])
def test_what_cannot_be_measured_is_refused_at_once(pages: int, seconds: float, says: str) -> None:
    with pytest.raises(BenchError, match=says):
        view.run("panda", pages, 1, seconds, False)


TICK = "<anon_inode:[timerfd]>"
WAITS = {"futex", "poll", "ppoll", "select", "pselect6", "connect", "accept4", "nanosleep", "clock_nanosleep"}
WAITS |= {"flock", "fsync", "fdatasync", "msync"}


def waits(call: str) -> bool:
    """Whether a system call, as strace writes it, may wait for anything but the next tick."""
    name = call.partition("(")[0]
    if name.startswith(("recv", "send")):
        return "MSG_DONTWAIT" not in call
    if name in ("read", "write"):  # messages for people are standard error's
        return TICK not in call and "</proc/" not in call and not call.startswith("write(2<")
    return name in WAITS or (name.startswith("wait") and "WNOHANG" not in call)


@pytest.mark.live
@pytest.mark.slow
@pytest.mark.skipif(not shutil.which("strace"), reason="NO TRACE OF SYSTEM CALLS: sudo apt install strace")
def test_no_call_of_a_session_waits_for_those_who_look(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text, slow = read_text("panda.toml"), tmp_path / "panda.toml"
    slow.write_text(re.sub(r'(?m)^rate = ".*"', 'rate = "500 Hz"', text, count=1), encoding="utf-8")
    (tmp_path / "panda.urdf").write_text(read_text("panda.urdf"), encoding="utf-8")
    trace, begun = tmp_path / "trace", view.begun
    strace = ("strace", "-D", "-qq", "-y", "-o", str(trace))  # -D: the session keeps its own number

    def traced(*arguments: str, error: int | None = None) -> AbstractContextManager[Popen[str]]:
        program = (*strace, *PROGRAM) if arguments[0] == "run" else PROGRAM
        monkeypatch.setattr(view, "PROGRAM", program)
        return begun(*arguments, error=error)

    monkeypatch.setattr(view, "begun", traced)
    found = session(str(slow), 4.0, 5, tmp_path / "traced.mcap")
    assert found.frames > 5 * 10
    calls = trace.read_text(encoding="utf-8").splitlines()
    ticks = [i for i, call in enumerate(calls) if TICK in call]
    seen = calls[ticks[500] : ticks[1000]]  # of the second second
    assert [call for call in seen if waits(call)] == []


def test_a_ratio_is_of_medians_and_beside_the_spread_of_the_host() -> None:
    def at(us: float) -> Session:
        return Session({of: {which: us} for of, which in FIGURES.values()}, frames=3, pages=2)

    found = summarise([at(10.0), at(40.0), at(20.0)], [at(30.0), at(30.0), at(90.0)])
    for name in FIGURES:
        assert found[name] == {"bare_us": 20.0, "viewed_us": 30.0, "ratio": 1.5, "bare_spread": 4.0}
    assert (found["pages"], found["frames"]) == (2, 9)
