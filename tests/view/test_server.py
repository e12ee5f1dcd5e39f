"""Who may look and press: nobody without the token, of another origin, or on another host without TLS."""

from __future__ import annotations

import asyncio
import json
import socket
import webbrowser
from collections.abc import AsyncIterator, Callable
from http.client import HTTPConnection
from pathlib import Path
from threading import Event
from typing import Any
from urllib.parse import urlsplit

import pytest
from hapticd.runtime.command_line.cli import main
from hapticd.runtime.recording.log import open_log

pytest.importorskip("websockets", reason="the extra `view` is not installed")
from hapticd.view.errors import ViewError
from hapticd.view.server import MOST_WAITING, Address, Dashboard, Visit, loopback, open_browser, page
from hapticd.view.source import Recording
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidStatus


class Said:
    """A live source that notes what is said to it."""

    hello = b'{"type":"hello"}'
    live, over, unseen, missed, age_ns = True, False, False, 0, 0
    earlier = (b'{"type":"said","events":[[7,"stop","R4"]]}',)

    def __init__(self) -> None:
        self.words: list[str] = []
        self.frames: list[bytes] = []

    def take(self) -> list[bytes]:
        frames, self.frames = self.frames, []
        return frames

    def say(self, word: str) -> bool:
        self.words.append(word)
        return word == "stop"


@pytest.fixture
async def dashboard() -> AsyncIterator[Dashboard]:
    shown = Dashboard(Said(), follow=False)  # type: ignore[arg-type]
    server = await shown.serve(Address("127.0.0.1", None, 0))
    handing = asyncio.create_task(shown.run())
    yield shown
    handing.cancel()
    server.close()
    await server.wait_closed()


def get(url: str, path: str, **headers: str) -> tuple[int, str, dict[str, str]]:
    """Status, text and headers of an answer."""
    where = urlsplit(url)
    connection = HTTPConnection(str(where.hostname), where.port, timeout=20)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    found = answer.status, answer.read().decode(), dict(answer.getheaders())
    connection.close()
    return found


async def test_the_page_wants_the_token_and_the_name_of_this_server(dashboard: Dashboard) -> None:
    whole = f"/?token={dashboard.token}"
    status, text, headers = await asyncio.to_thread(get, dashboard.url, whole)
    assert status == 200 and text == page()
    assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]
    assert (await asyncio.to_thread(get, dashboard.url, "/"))[0] == 401
    assert (await asyncio.to_thread(get, dashboard.url, "/?token=x"))[0] == 401
    assert (await asyncio.to_thread(get, dashboard.url, f"/other?token={dashboard.token}"))[0] == 404
    rebound = await asyncio.to_thread(lambda: get(dashboard.url, whole, Host="evil.example"))
    assert rebound[0] == 421


def socket_url(dashboard: Dashboard, token: str | None = None) -> str:
    where = urlsplit(dashboard.url)
    return f"ws://{where.netloc}/session?token={dashboard.token if token is None else token}"


@pytest.mark.parametrize("origin", [None, "https://evil.example", "http://127.0.0.1:1", "null"])
async def test_a_foreign_origin_is_refused_before_the_socket_is_accepted(
    dashboard: Dashboard, origin: Any
) -> None:
    with pytest.raises(InvalidStatus) as refused:
        async with connect(socket_url(dashboard), origin=origin):
            pass
    assert refused.value.response.status_code == 403
    assert dashboard._source.words == []  # type: ignore[union-attr]


async def test_a_socket_wants_the_token(dashboard: Dashboard) -> None:
    origin: Any = "http://" + urlsplit(dashboard.url).netloc
    with pytest.raises(InvalidStatus) as refused:
        async with connect(socket_url(dashboard, "wrong"), origin=origin):
            pass
    assert refused.value.response.status_code == 401


async def test_its_own_page_sees_frames_and_says_words(dashboard: Dashboard) -> None:
    origin: Any = "http://" + urlsplit(dashboard.url).netloc
    said: Any = dashboard._source
    async with asyncio.timeout(30), connect(socket_url(dashboard), origin=origin) as page_end:
        assert json.loads(await page_end.recv()) == {"type": "hello"}
        assert json.loads(await page_end.recv())["events"] == [[7, "stop", "R4"]]  # before it looked
        said.frames = [b'{"tick":1}', b'{"tick":2}']
        frames = json.loads(await page_end.recv())
        assert frames["frames"] == [{"tick": 1}, {"tick": 2}] and frames["dropped"] == 0
        await page_end.send("say stop")
        await page_end.send("say dance")
        assert json.loads(await page_end.recv()) == {"type": "unsaid", "word": "dance"}
        await page_end.send("ping 12.5")
        assert json.loads(await page_end.recv()) == {"type": "pong", "of": "12.5"}
        said.over = said.unseen = True  # its recorder died
        assert json.loads(await page_end.recv())["frames"] == [{"type": "unseen"}]
        said.unseen = False
        assert json.loads(await page_end.recv())["frames"] == [{"type": "over"}]
    assert said.words == ["stop", "dance"]


async def test_a_page_that_does_not_read_loses_frames_and_they_are_counted() -> None:
    visit = Visit()
    visit.begin(b"hello")
    for tick in range(MOST_WAITING + 50):
        visit.put([b"%d" % tick])
    first, frames = await visit.take()
    assert first == [b"hello"]
    assert (len(frames), visit.dropped) == (MOST_WAITING, 50)
    assert frames[-1] == b"%d" % (MOST_WAITING + 49)


async def test_nothing_listens_but_on_loopback(dashboard: Dashboard) -> None:
    port = urlsplit(dashboard.url).port
    listening = [
        line.split()[1]
        for table in ("/proc/net/tcp", "/proc/net/tcp6")
        if Path(table).exists()
        for line in Path(table).read_text().splitlines()[1:]
        if line.split()[3] == "0A" and int(line.split()[1].split(":")[1], 16) == port
    ]
    assert listening == [f"0100007F:{port:04X}"]


@pytest.mark.parametrize(
    ("host", "alone"),
    [
        *((host, True) for host in ("127.0.0.1", "127.3.2.1", "::1", "localhost")),
        *((host, False) for host in ("0.0.0.0", "::", "192.168.1.5", "example.org", "")),
    ],
)
def test_an_address_that_others_can_reach_wants_tls(host: str, alone: bool) -> None:
    assert loopback(host) == alone
    if alone:
        Address(host, 0, 0).require_safe()
        return
    with pytest.raises(ViewError, match="can be reached from other hosts"):
        Address(host, 0, 0).require_safe()
    Address(host, 0, 0, Path("c"), Path("k")).require_safe()


def test_a_certificate_without_its_key(tmp_path: Path) -> None:
    with pytest.raises(ViewError, match="come together"):
        Address("127.0.0.1", 0, 0, tmp_path / "c").require_safe()
    (tmp_path / "c").write_text("none")
    with pytest.raises(ViewError, match="c, "):
        Address("0.0.0.0", 0, 0, tmp_path / "c", tmp_path / "c").tls()


def test_the_usual_port_where_it_is_free_and_a_named_one_or_none() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with Address("127.0.0.1", None, port).listen() as other:
            assert other.getsockname()[1] not in (0, port)
        with pytest.raises(ViewError, match=f"port {port}: Address already in use"):
            Address("127.0.0.1", port, port).listen()


def test_the_command_refuses_with_the_reason(
    recorded: Callable[[str], Path],
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert main(["view", str(recorded("giant")), "--host", "0.0.0.0"]) == 2
    assert "Give --cert FILE and --key FILE" in capsys.readouterr().err
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    assert main(["view"]) == 2
    assert "no session runs" in capsys.readouterr().err


async def test_a_recording_is_sent_as_a_whole(recorded: Callable[[str], Path]) -> None:
    source = Recording(open_log(str(recorded("rhi"))))
    shown = Dashboard(source, follow=False)
    server = await shown.serve(Address("127.0.0.1", 0, 0))
    origin: Any = "http://" + urlsplit(shown.url).netloc
    frames: list[Any] = []
    async with asyncio.timeout(60), connect(socket_url(shown), origin=origin, max_size=1 << 24) as page_end:
        hello = json.loads(await page_end.recv())
        while (said := json.loads(await page_end.recv()))["type"] != "whole":
            frames += said["frames"]
    server.close()
    await server.wait_closed()
    assert hello["planes"][0]["name"] == "wall" and hello["words"] == [] and not hello["live"]
    ticks = [frame["tick"] for frame in frames]
    assert ticks == sorted(ticks) and ticks[-1] >= 1500
    moving = frames[-1]
    assert len(moving["mean"]) == len(hello["channels"])
    assert len(moving["joints"]) % 7 == 0 and len(moving["grips"]) == 3
    assert any(text.startswith("READY") for frame in frames for _, _, text in frame["events"])


def test_a_browser_holds_up_nothing_and_needs_a_desktop(monkeypatch: pytest.MonkeyPatch) -> None:
    opened, closed = Event(), Event()
    monkeypatch.setattr(webbrowser, "open", lambda url: (opened.set(), closed.wait(20)))
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    open_browser("http://127.0.0.1/")  # such as over ssh: a text browser would take the terminal
    assert not opened.wait(0.2)
    monkeypatch.setenv("DISPLAY", ":0")
    open_browser("http://127.0.0.1/")
    assert opened.wait(20)
    closed.set()


def test_a_recording_belongs_to_no_session(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["view", "some.mcap", "--session", "1"]) == 2
    assert "leave out --session or LOG" in capsys.readouterr().err
