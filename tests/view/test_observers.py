"""A session that observers elsewhere look at: the same frames, by certificate, and nothing back."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from pathlib import Path
from time import monotonic, sleep
from typing import Any, TypeAlias

import msgspec
import pytest
from hapticd.link.credentials import Credentials, load
from hapticd.link.keygen import keygen
from hapticd.link.stations import Role, Station
from hapticd.runtime.command_line.cli import main
from hapticd.runtime.configuration import config
from hapticd.runtime.recording.frames import Frame, Said
from hapticd.runtime.recording.published import SUFFIX, About, Publisher, SessionError, Subscriber, run_folder
from hapticd.view import observers
from hapticd.view.errors import ViewError
from hapticd.view.observers import Followed, Seen, Shown

PATIENCE_S = 20.0
Closed: TypeAlias = Callable[[Any], Any]
NAMES = {
    **{"lab": Role.PUBLISHER, "olga": Role.OBSERVER, "otto": Role.OBSERVER},
    **{"robot": Role.AVATAR, "alice": Role.OPERATOR},
}


@pytest.fixture(scope="module")
def keys(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Credentials]:
    folder = tmp_path_factory.mktemp("keys")
    keygen(folder / "ours", [Station(name, role) for name, role in NAMES.items()], days=1)
    keygen(folder / "theirs", [Station(name, role) for name, role in NAMES.items()], days=1)
    return lambda name: load(folder / ("ours" if name in NAMES else "theirs") / name.removeprefix("strange "))


@pytest.fixture
def endpoint() -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"127.0.0.1:{probe.getsockname()[1]}"


@pytest.fixture
def session(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Path, Publisher]]:
    """What a recorder publishes of a session, as that of a process that is not this one."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    rhi = config.load("rhi")
    texts = rhi.text, rhi.source, rhi.model_text, rhi.model_source
    path = run_folder() / f"1{SUFFIX}"
    publisher = Publisher(path, About("/home/anna/a.mcap", "rhi", *texts, 1000.0, 1, ["stop", "press"]))
    yield path, publisher
    if path.exists():
        publisher.close()


@pytest.fixture
def closed() -> Iterator[Closed]:
    """Closes at the end what it is given; sessions of zenoh would keep the process."""
    with ExitStack() as stack:
        yield lambda what: stack.enter_context(closing(what))


@pytest.fixture
def program() -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Runs the program, with a folder for its sessions, until the test is over at most."""
    with ExitStack() as stack:

        def run(folder: Path, *words: str) -> subprocess.Popen[str]:
            command = [sys.executable, "-m", "hapticd.runtime", *words]
            surroundings = {**os.environ, "XDG_RUNTIME_DIR": str(folder)}
            child = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=surroundings)
            stack.enter_context(child)
            stack.callback(child.kill)
            return child

        yield run


@pytest.fixture
def share(
    session: tuple[Path, Publisher],
    keys: Callable[[str], Credentials],
    endpoint: str,
    tmp_path: Path,
    program: Callable[..., subprocess.Popen[str]],
) -> subprocess.Popen[str]:
    """`hapticd share`, which waits for observers."""
    share = program(tmp_path, "share", str(keys("lab").folder), "--listen", endpoint)
    assert share.stdout and f"shown at {endpoint}" in share.stdout.readline()
    return share


def frame(number: int) -> Frame:
    said = [Said(number, "note", f"event {number}")]
    return Frame(
        **{"tick": 20 * number, "ticks": 20, "published_ns": 7, "mode": "ACTIVE", "pressed": True},
        mean=[0.5] * number,
        events=said,
    )


def patiently(what: Callable[[], bool]) -> bool:
    until = monotonic() + PATIENCE_S
    while not (done := what()) and monotonic() < until:
        sleep(0.01)
    return done


def test_an_observer_sees_the_frames_and_can_order_nothing(
    session: tuple[Path, Publisher], keys: Callable[[str], Credentials], endpoint: str, closed: Closed
) -> None:
    path, publisher = session
    shown = closed(Shown(keys("lab"), endpoint, path))
    followed = closed(Followed(keys("olga"), endpoint, "lab"))
    here = Subscriber(run_folder() / f"{os.getpid()}{SUFFIX}")
    assert here.about.config == "rhi (lab)" and here.about.words == [] and here.about.log == ""
    assert here.about.text == config.load("rhi").text and here.about.pid == os.getpid()

    def reached() -> bool:  # the subscription takes its time
        publisher.publish(frame(1))
        shown.pass_on()
        return followed.count > 0

    assert patiently(reached)
    here.take()
    for number in range(2, 30):
        publisher.publish(frame(number))
    assert shown.pass_on() == 28
    assert patiently(lambda: here.missed + followed.count >= 29)
    found = [each for each in here.take() if each.tick > 20]
    for each in found:
        each.published_ns = 7
    assert found == [frame(number) for number in range(2, 30)]
    assert followed.wait(0.01) is Seen.SHOWN
    publisher.close()
    assert shown.over
    shown.close()
    assert patiently(lambda: followed.wait(0.01) is Seen.OVER)
    followed.close()
    assert here.over and followed.wrong == 0
    here.close()


def test_a_link_that_is_lost_is_tried_again_and_another_session_is_told_from_the_same(
    session: tuple[Path, Publisher], keys: Callable[[str], Credentials], endpoint: str, closed: Closed
) -> None:
    path, publisher = session
    first = closed(Shown(keys("lab"), endpoint, path))
    followed = closed(Followed(keys("olga"), endpoint))
    mine = run_folder() / f"{os.getpid()}{SUFFIX}"
    here = Subscriber(mine)

    def comes(publisher: Publisher, shown: Shown, number: int) -> bool:
        publisher.publish(frame(number))
        shown.pass_on()
        return followed.wait(0.01) is Seen.SHOWN and any(each.tick == 20 * number for each in here.take())

    assert patiently(lambda: comes(publisher, first, 1))
    first.close()  # the session goes on
    assert patiently(lambda: followed.wait(0.01) is Seen.LOST) and not here.over
    again = closed(Shown(keys("lab"), endpoint, path))
    assert patiently(lambda: comes(publisher, again, 2)) and not here.over
    again.close()
    assert patiently(lambda: followed.wait(0.01) is Seen.LOST)
    other = closed(Publisher(path.with_stem("2"), msgspec.structs.replace(here.about, pid=2)))
    third = closed(Shown(keys("lab"), endpoint, path.with_stem("2")))
    assert patiently(lambda: followed.wait(0.01) is Seen.SHOWN) and here.over
    here.close()
    here = closed(Subscriber(mine))
    assert patiently(lambda: comes(other, third, 3))


@pytest.mark.parametrize("name", ["robot", "alice", "olga"])
def test_only_a_publisher_shows(
    session: tuple[Path, Publisher], keys: Callable[[str], Credentials], endpoint: str, name: str
) -> None:
    with pytest.raises(ViewError, match="shown by a"):
        Shown(keys(name), endpoint, session[0])


def test_who_has_no_certificate_of_the_lab_sees_nothing(
    session: tuple[Path, Publisher], keys: Callable[[str], Credentials], endpoint: str, closed: Closed
) -> None:
    for name in ("alice", "lab", "robot"):
        with pytest.raises(ViewError, match="who looks is an observer"):
            Followed(keys(name), endpoint)
    with pytest.raises(ViewError, match="no publisher at"):  # nobody is there
        Followed(keys("olga"), endpoint)
    closed(Shown(keys("lab"), endpoint, session[0]))
    with pytest.raises(ViewError, match="takes the keys"):
        Followed(keys("strange olga"), endpoint)
    with pytest.raises(SessionError, match="nobody of that name"):
        Followed(keys("olga"), endpoint, "other")
    with pytest.raises(ViewError, match="cannot wait at"):
        Shown(keys("lab"), endpoint, session[0])


def test_an_observer_shows_nothing_to_another(
    session: tuple[Path, Publisher], keys: Callable[[str], Credentials], endpoint: str, closed: Closed
) -> None:
    path, publisher = session
    shown = closed(Shown(keys("lab"), endpoint, path))
    followed = closed(Followed(keys("olga"), endpoint))
    otto = closed(observers._open(observers._observing(keys("otto"), f"tls/{endpoint}"), ""))
    alive = otto.liveliness().declare_token("hapticd/lab/alive")
    for _ in range(5):
        otto.put("hapticd/lab/frame", b"no frame")
    alive.undeclare()

    def reached() -> bool:
        publisher.publish(frame(3))
        shown.pass_on()
        return followed.count > 5

    assert patiently(reached)
    assert followed.wrong == 0 and followed.wait(0.2) is Seen.SHOWN
    alice = closed(observers._open(observers._observing(keys("alice"), f"tls/{endpoint}"), ""))
    assert [reply.ok is not None for reply in alice.get("hapticd/lab/about", timeout=5.0)] == [True]
    for name in ("robot", "lab"):  # their certificates are for those who wait
        with pytest.raises(ViewError):
            closed(observers._open(observers._observing(keys(name), f"tls/{endpoint}"), "refused"))
    shown._publisher.put(b"\xc1")  # a publisher of another version
    assert patiently(lambda: followed.wrong == 1)


@pytest.mark.live
def test_the_commands_show_a_session_on_another_host(
    session: tuple[Path, Publisher],
    share: subprocess.Popen[str],
    keys: Callable[[str], Credentials],
    endpoint: str,
    tmp_path: Path,
    program: Callable[..., subprocess.Popen[str]],
) -> None:
    _, publisher = session
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    follow = program(elsewhere, "follow", str(keys("olga").folder), endpoint)
    assert follow.stdout and "following rhi (lab)" in follow.stdout.readline()
    top = program(elsewhere, "top", "--json")
    while top.poll() is None:
        publisher.publish(frame(4))
        sleep(0.02)
    assert top.stdout and json.loads(top.stdout.read())["tick"] == 80 and top.returncode == 0
    publisher.close()
    assert share.wait(PATIENCE_S) == 0 and share.stdout and "the session is over" in share.stdout.read()
    assert follow.wait(PATIENCE_S) == 0 and "the session is over" in follow.stdout.read()


@pytest.mark.parametrize("where", ["localhost:7447", "127.0.0.1", "127.0.0.1:0", "::1:x", "[::1]:70000", ""])
def test_addresses_are_numbers(where: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["follow", "keys", where])
    assert ended.value.code == 2
    assert "is no address and port in numbers" in capsys.readouterr().err


def test_without_its_package_it_says_what_to_install(
    keys: Callable[[str], Credentials], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delitem(sys.modules, "hapticd.view.observers")
    monkeypatch.setitem(sys.modules, "zenoh", None)
    assert main(["follow", str(keys("olga").folder), "127.0.0.1:7447"]) == 2
    assert "needs eclipse-zenoh; type:" in capsys.readouterr().err


def test_keys_are_judged_before_anybody_waits_for_a_session(
    keys: Callable[[str], Credentials],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))  # where no session runs
    for folder, said in ((keys("olga").folder, "shown by a publisher"), (tmp_path, "No such file")):
        assert main(["share", str(folder)]) == 2
        assert said in capsys.readouterr().err


@pytest.mark.live
def test_control_c_ends_it(share: subprocess.Popen[str]) -> None:
    share.send_signal(signal.SIGINT)
    assert share.wait(PATIENCE_S) == 130


@pytest.mark.live
def test_control_c_ends_it_also_where_nobody_answers(
    keys: Callable[[str], Credentials], tmp_path: Path, program: Callable[..., subprocess.Popen[str]]
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        silent.settimeout(PATIENCE_S)
        follow = program(tmp_path, "follow", str(keys("olga").folder), f"127.0.0.1:{silent.getsockname()[1]}")
        caller, _ = silent.accept()
        with caller:
            follow.send_signal(signal.SIGINT)
            assert follow.wait(3.0) == 130  # zenoh would wait 10 s for an answer
