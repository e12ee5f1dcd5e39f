"""The dashboard's server: one page and one socket, on this host only unless it is told and allowed otherwise.

It refuses, before a socket is accepted, whoever does not know the token of the printed address, pages of
another origin, and requests under another name of this host. A page that does not read fast enough loses
frames, which are counted; it holds up nobody.
"""

from __future__ import annotations

import asyncio
import hmac
import ipaddress
import json
import os
import secrets
import socket
import ssl
import webbrowser
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from errno import EADDRINUSE
from http import HTTPStatus
from importlib import resources
from pathlib import Path
from threading import Thread
from time import monotonic_ns
from urllib.parse import parse_qs, urlsplit

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.typing import Origin

from ..configs.printable import printable
from ..runtime.errors import HapticdError
from ..runtime.live.interrupts import asking
from .errors import ViewError
from .source import LiveSource, Recording, newest

LOOK_S = 0.02
"""Between two looks at what the recorder has published."""
SEARCH_S = 0.5
"""Between two looks for the next session."""
MOST_WAITING = 100
"""Frames that wait for a page: two seconds of a session."""
BATCH = 200
"""Frames of a recording in a message."""
LONGEST_MESSAGE = 256
"""Of a page [bytes]."""
SOCKET = "/session"
OVER, UNSEEN = (json.dumps({"type": name}).encode() for name in ("over", "unseen"))
ENDS_S = 0.5
"""A session that ends outlives its recorder by less."""
POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; connect-src 'self'; "
    "img-src data:; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
)


@dataclass(frozen=True, slots=True)
class Address:
    """Where to listen.

    Attributes:
        host: name or number of an address of this host.
        port: None: ``usual``, or whichever is free where that is taken.
        usual: see there.
        cert, key: files of TLS, None without.
    """

    host: str
    port: int | None
    usual: int
    cert: Path | None = None
    key: Path | None = None

    def require_safe(self) -> None:
        """Others than this host are let in over TLS only.

        Raises:
            ViewError: there is none.
        """
        if (self.cert is None) != (self.key is None):
            raise ViewError("--cert and --key come together")
        if not (loopback(self.host) or self.cert):
            raise ViewError(
                f"{self.host} can be reached from other hosts, and what a person does there moves a machine:"
                " whoever is on the way could read the token and do it, too. Give --cert FILE and --key FILE,"
                f" or leave out --host and go through ssh: ssh -L {self.usual}:127.0.0.1:{self.usual} HOST"
            )

    def listen(self) -> socket.socket:
        """A socket that listens.

        Raises:
            ViewError: the address is taken, or none of this host.
        """
        family = socket.AF_INET6 if ":" in self.host else socket.AF_INET
        for port in (self.usual, 0) if self.port is None else (self.port,):
            try:
                return socket.create_server((self.host, port), family=family)
            except OSError as error:
                if port == self.usual and self.port is None and error.errno == EADDRINUSE:
                    continue
                raise ViewError(f"cannot listen on {self.host} port {port}: {error.strerror}") from error
        raise AssertionError

    def tls(self) -> ssl.SSLContext | None:
        """TLS with the files.

        Raises:
            ViewError: they are none.
        """
        if not (self.cert and self.key):
            return None
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        try:
            context.load_cert_chain(self.cert, self.key)
        except (OSError, ssl.SSLError) as error:
            raise ViewError(f"{self.cert}, {self.key}: {error}") from error
        return context


class Visit:
    """One page: what waits to be sent to it.

    Attributes:
        dropped: frames that it did not take in time.
    """

    def __init__(self) -> None:
        self._waiting: deque[bytes] = deque()
        self._first: deque[bytes] = deque()
        self._news = asyncio.Event()
        self.dropped = 0

    def begin(self, *first: bytes) -> None:
        """Another session: what waited of the one before is nobody's any more."""
        self._waiting.clear()
        self._first.extend(first)
        self._news.set()

    def put(self, frames: list[bytes]) -> None:
        """More frames; the oldest go where they are too many."""
        self._waiting.extend(frames)
        while len(self._waiting) > MOST_WAITING:
            self._waiting.popleft()
            self.dropped += 1
        if frames:
            self._news.set()

    async def take(self) -> tuple[list[bytes], list[bytes]]:
        """What waits: beginnings of sessions, then frames; at least one of them."""
        while not (self._first or self._waiting):
            self._news.clear()
            await self._news.wait()
        first, frames = list(self._first), list(self._waiting)
        self._first.clear()
        self._waiting.clear()
        return first, frames


class Dashboard:
    """Shows one source to any number of pages.

    Attributes:
        token: that a page must know.
        url: to be opened.
    """

    def __init__(self, source: LiveSource | Recording, follow: bool) -> None:
        """``follow``: when its session is over, go on with the next one of this user."""
        self._source, self._follow = source, follow
        self._visits: set[Visit] = set()
        self.token = secrets.token_urlsafe(16)
        self.url = ""
        self._hosts: set[str] = set()
        self._page = page()

    async def serve(self, address: Address) -> Server:
        """Listen; the server, to be closed.

        Raises:
            ViewError: the address is not of this host alone and there is no TLS, or it is taken.
        """
        address.require_safe()
        tls, listening = address.tls(), address.listen()
        scheme, port = "https" if tls else "http", listening.getsockname()[1]
        names = {address.host, "localhost"} if loopback(address.host) else {address.host}
        self._hosts = {f"{_bracketed(name)}:{port}" for name in names}
        self.url = f"{scheme}://{_bracketed(address.host)}:{port}/?token={self.token}"
        return await serve(
            self._attend,
            sock=listening,
            ssl=tls,
            origins=[Origin(f"{scheme}://{name}") for name in sorted(self._hosts)],
            process_request=self._request,
            max_size=LONGEST_MESSAGE,
            max_queue=16,
            compression=None,
            write_limit=1 << 16,
            server_header=None,
        )

    async def run(self) -> None:
        """Hand frames on for as long as this is not cancelled."""
        if not self._source.live:
            await asyncio.Event().wait()
        unseen = 0.0
        while True:
            frames = self._source.take()
            for visit in self._visits:
                visit.put(frames)
            if not frames and self._source.unseen:
                if unseen < ENDS_S <= (unseen := unseen + LOOK_S):
                    for visit in self._visits:
                        visit.put([UNSEEN])
            elif not frames and self._source.over:
                for visit in self._visits:
                    visit.put([OVER])
                if not self._follow:
                    await asyncio.Event().wait()
                await self._next()
            await asyncio.sleep(LOOK_S)

    async def _next(self) -> None:
        """Wait for another session, and show it."""
        while (path := newest()) is None:
            await asyncio.sleep(SEARCH_S)
        with suppress(HapticdError):
            source = await asyncio.to_thread(LiveSource, path)
            self._source.close()
            self._source = source
            for visit in self._visits:
                visit.begin(source.hello)

    def _request(self, connection: ServerConnection, request: Request) -> Response | None:
        """The page, a refusal, or None: then the socket is accepted."""
        parts = urlsplit(request.path)
        given = parse_qs(parts.query).get("token", [""])[0]
        if request.headers.get("Host", "") not in self._hosts:
            return _answer(HTTPStatus.MISDIRECTED_REQUEST, "this is not the name of this server")
        if parts.path not in ("/", SOCKET):
            return _answer(HTTPStatus.NOT_FOUND, "there is no such page")
        if not hmac.compare_digest(given.encode(), self.token.encode()):
            return _answer(
                HTTPStatus.UNAUTHORIZED, "open the whole address that hapticd printed, with its token"
            )
        if parts.path == SOCKET:
            return None
        return _answer(HTTPStatus.OK, self._page, "text/html; charset=utf-8")

    async def _attend(self, connection: ServerConnection) -> None:
        visit = Visit()
        source = self._source
        visit.begin(source.hello, *source.earlier)
        if source.live:
            self._visits.add(visit)
        if source.unseen:
            visit.put([UNSEEN])
        sending = asyncio.create_task(self._send(connection, visit))
        try:
            async for message in connection:
                await self._hear(connection, str(message))
        except ConnectionClosed:
            pass
        finally:
            self._visits.discard(visit)
            sending.cancel()
            with suppress(asyncio.CancelledError, ConnectionClosed):
                await sending

    async def _send(self, connection: ServerConnection, visit: Visit) -> None:
        with suppress(ConnectionClosed):
            if not self._source.live:
                await self._send_recording(connection)
                return
            while True:
                first, frames = await visit.take()
                for hello in first:
                    await connection.send(hello.decode())
                if frames:
                    await connection.send(self._message(frames, visit.dropped))

    async def _send_recording(self, connection: ServerConnection) -> None:
        await connection.send(self._source.hello.decode())
        frames = self._source.take()
        for at in range(0, len(frames), BATCH):
            await connection.send(self._message(frames[at : at + BATCH], 0))
        await connection.send(json.dumps({"type": "whole"}))

    def _message(self, frames: list[bytes], dropped: int) -> str:
        age_ms = (monotonic_ns() - self._source.age_ns) / 1e6 if isinstance(self._source, LiveSource) else 0.0
        missed = dropped + self._source.missed
        head = f'{{"type":"frames","age_ms":{age_ms:.1f},"dropped":{missed},"frames":['
        return head + ",".join(frame.decode() for frame in frames) + "]}"

    async def _hear(self, connection: ServerConnection, message: str) -> None:
        """A page asks how long the way is, or a person for something."""
        kind, _, rest = message.partition(" ")
        if kind == "ping":
            await connection.send(json.dumps({"type": "pong", "of": rest[:32]}))
        elif kind == "say" and not self._source.say(rest):
            await connection.send(json.dumps({"type": "unsaid", "word": rest[:32]}))


def loopback(host: str) -> bool:
    """Whether an address is of this host alone."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def show(source: LiveSource | Recording, follow: bool, address: Address, opened: bool) -> int:
    """Serve until a signal asks for the end; the exit status.

    Args:
        source: what to show.
        follow: see ``Dashboard``.
        address: where.
        opened: whether the browser of this desktop is told.
    """
    asyncio.run(_show(Dashboard(source, follow), source.name, address, opened))
    return 0


async def _show(dashboard: Dashboard, name: str, address: Address, opened: bool) -> None:
    loop, ended = asyncio.get_running_loop(), asyncio.Event()
    for number in asking():
        loop.add_signal_handler(number, ended.set)
    server = await dashboard.serve(address)
    print(f"view: {dashboard.url} ({printable(name)})", flush=True)
    if opened:
        open_browser(dashboard.url)
    handing = asyncio.create_task(dashboard.run())
    waiting = asyncio.create_task(ended.wait())
    await asyncio.wait((handing, waiting), return_when=asyncio.FIRST_COMPLETED)
    waiting.cancel()
    handing.cancel()
    server.close()
    with suppress(asyncio.CancelledError):
        await handing


def open_browser(url: str) -> None:
    """Tell the browser of this desktop, and wait for nothing: some browsers last as long as their window.

    Without a desktop there is none, but for one that $BROWSER names: a text browser would take the terminal.
    """
    if any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")):
        Thread(target=webbrowser.open, args=(url,), daemon=True).start()


def page() -> str:
    """The page, with everything in it."""
    folder = resources.files(__package__) / "page"

    def text(name: str) -> str:
        return (folder / name).read_text(encoding="utf-8")

    style = text("colours.css") + text("view.css")
    script = "".join(text(name) for name in ("maths.js", "scene.js", "plots.js", "view.js"))
    return text("view.html").replace("/*STYLE*/", style).replace("/*SCRIPT*/", script)


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host else host


def _answer(status: HTTPStatus, text: str, kind: str = "text/plain; charset=utf-8") -> Response:
    body = text.encode()
    headers = Headers(
        [
            ("Content-Type", kind),
            ("Content-Length", str(len(body))),
            ("Content-Security-Policy", POLICY),
            ("Referrer-Policy", "no-referrer"),
            ("X-Content-Type-Options", "nosniff"),
            ("Cache-Control", "no-store"),
            ("Connection", "close"),
        ]
    )
    return Response(status.value, status.phrase, headers, body)
