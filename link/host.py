"""The avatar's end: it waits, judges who comes, and lets one operator at a time move it."""

from __future__ import annotations

import os
import secrets
import selectors
import socket
import ssl
import threading
from collections import Counter
from dataclasses import asdict
from time import monotonic
from typing import Final

from cryptography import x509

from .agreement import refusal, session_keys
from .channel import TO_OPERATOR, Clock, clock
from .credentials import Credentials
from .end import End
from .errors import KeysError, LinkError
from .messages import (
    PATIENCE,
    SECRET,
    Answer,
    Granted,
    Refused,
    Request,
    Status,
    Steps,
    offer,
    patient,
    put,
    take,
)
from .places import datagram_socket, listening_socket, with_port
from .stations import Role, Station, station_of
from .terms import Terms

WAITING: Final = 8
"""Handshakes that go on at once; for one more the oldest of them is given up."""
PAUSE: Final = 0.01
"""After each connection taken [s]: so a flood of them costs at most a hundred handshakes a second."""
MAY: Final = {
    "move": (Role.OPERATOR,),
    "status": (Role.OPERATOR, Role.MAINTAINER, Role.OBSERVER),
    "end": (Role.MAINTAINER,),
    "admit": (Role.MAINTAINER,),
}
"""What each role may ask for."""


class Host(End):
    """The avatar's end of the link.

    A thread of its own answers those who connect: under TLS 1.3, with certificates on both sides, each
    within two seconds, however slowly they speak. Whoever is refused is counted and told why; the session
    that lives is not touched by it.
    """

    def __init__(
        self, credentials: Credentials, terms: Terms, address: str, port: int = 0, clock: Clock = clock
    ) -> None:
        """Open the end.

        Args:
            credentials: of an avatar.
            terms: what is sent, expected and tolerated.
            address: of this host, IPv4 or IPv6, on which it is reached.
            port: of TCP for the handshake, and of UDP for the packets; 0: any.
            clock: for packets and lease [ns].

        Raises:
            KeysError: the credentials are not an avatar's.
            LinkError: there is no such address here, or the port is taken.
        """
        if credentials.station.role is not Role.AVATAR:
            raise KeysError(
                f"{credentials.folder} is {credentials.station}'s; only an avatar waits for others"
            )
        super().__init__(terms, TO_OPERATOR, clock)
        self.station: Final = credentials.station
        self.refused: Final[Counter[str]] = Counter()
        """How many were refused, by cause."""
        self._out: dict[Station, Station] = {}  # whose session a maintainer ended, and which maintainer
        self._context = credentials.context()
        self._listener = listening_socket(address, port)
        self._waker, self._woken = socket.socketpair()
        self._conversations: dict[socket.socket, tuple[Steps[None], float]] = {}
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._selector.register(self._woken, selectors.EVENT_READ)
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._wait, name="link host", daemon=True)
        self._thread.start()

    @property
    def port(self) -> int:
        """Of TCP, and of UDP."""
        return int(self._listener.getsockname()[1])

    def close(self) -> None:
        """End the session, if one lives, and answer nobody any more."""
        self._closing.set()
        self._waker.send(b"x")
        self._thread.join()
        for sock in list(self._conversations):
            self._drop(sock)
        self._selector.close()
        for each in (self._listener, self._waker, self._woken):
            each.close()
        with self._lock:
            if self._living():
                self._end("closed at the avatar's end")

    def _wait(self) -> None:
        while not self._closing.is_set():
            soonest = min((until for _, until in self._conversations.values()), default=None)
            ready = self._selector.select(None if soonest is None else max(soonest - monotonic(), 0.0))
            for key, _ in ready:
                if key.fileobj is self._listener:
                    self._accept()
                    self._closing.wait(PAUSE)
                elif isinstance(key.fileobj, socket.socket) and key.fileobj in self._conversations:
                    self._go_on(key.fileobj)
            now = monotonic()
            for sock in [sock for sock, (_, until) in self._conversations.items() if until <= now]:
                self._refuse("timeout", f"a handshake took longer than {PATIENCE:g} s")
                self._drop(sock)

    def _accept(self) -> None:
        try:
            raw, place = self._listener.accept()
        except OSError:  # gone again, or too many files are open: the others go on
            return
        if len(self._conversations) >= WAITING:
            oldest = min(self._conversations, key=lambda sock: self._conversations[sock][1])
            self._refuse("evicted", "too many handshakes at once; the oldest was given up")
            self._drop(oldest)
        raw.setblocking(False)
        try:
            tls = self._context.wrap_socket(raw, server_side=True, do_handshake_on_connect=False)
        except OSError:  # gone again
            raw.close()
            return
        self._conversations[tls] = (self._converse(tls, place), monotonic() + PATIENCE)
        self._selector.register(tls, selectors.EVENT_READ)
        self._go_on(tls)

    def _go_on(self, sock: socket.socket) -> None:
        steps, _ = self._conversations[sock]
        try:
            self._selector.modify(sock, next(steps))
            return
        except StopIteration:
            pass
        except ssl.SSLCertVerificationError as error:
            self._refuse("certificate", f"a station's certificate is refused: {error.verify_message}")
        except ssl.SSLError as error:
            self._refuse("tls", f"a handshake failed: {error.reason or error}")
        except (LinkError, KeysError) as error:
            self._refuse("message", f"a handshake failed: {error}")
        except OSError as error:
            self._refuse("gone", f"a handshake failed: {error}")
        except Exception as error:  # whoever connects must not end the thread that others wait for
            self._refuse("internal", f"a handshake failed: {type(error).__name__}: {error}")
        self._drop(sock)

    def _drop(self, sock: socket.socket) -> None:
        self._selector.unregister(sock)
        del self._conversations[sock]
        sock.close()

    def _refuse(self, cause: str, why: str) -> None:
        self.refused[cause] += 1
        self._say("refused", f"{cause}: {why}")

    def _converse(self, tls: ssl.SSLSocket, place: tuple[str, int]) -> Steps[None]:
        yield from patient(tls.do_handshake)
        there = station_of(x509.load_der_x509_certificate(tls.getpeercert(binary_form=True) or b""))
        secret = os.urandom(SECRET)
        yield from put(tls, offer(self.terms, secret))
        request = yield from take(tls, Request)
        answer = self._answer(there, request, secret, tls, place)
        if isinstance(answer, Refused):
            self._refuse(answer.cause, f"{there}: {answer.why}")
        yield from put(tls, answer)

    def _answer(
        self, there: Station, request: Request, secret: bytes, tls: ssl.SSLSocket, place: tuple[str, int]
    ) -> Answer:
        if there.role not in MAY[request.want]:
            return Refused("role", f"{_a(there.role)} may not ask an avatar for '{request.want}'")
        if request.want == "status":
            return self._status()
        if request.want == "end":
            with self._lock:
                if self._living() and self._peer is not None:
                    self._out[self._peer] = there
                    self._end(f"ended by {there}")
            return self._status()
        if request.want == "admit":
            if self._out:
                self._out.clear()
                self._say("admitted", f"{there} admits everybody again")
            return self._status()
        if there in self._out:
            why = f"{self._out[there]} ended its session; a maintainer has to admit it again"
            return Refused("ended", why)
        different = refusal(self.terms, request.offer)
        if different:
            return different
        if not request.port:
            return Refused("message", "no port to send packets to")
        with self._lock:
            if self._living():
                return Refused("lease", f"{self._peer} moves the avatar; its lease ends after silence")
            session = secrets.randbits(63)
            keys = session_keys(session, request.offer.secret, secret, there, self.station)
            try:
                here = tls.getsockname()
                sock = datagram_socket(with_port(here, self.port), with_port(place, request.port))
            except OSError as error:
                return Refused("socket", f"no socket for packets: {error.strerror or error}")
            self._begin(sock, keys, there)
        return Granted(session, self.port)

    def _status(self) -> Status:
        counts = asdict(self.counts())
        peer, silent = self.peer, self.silent
        return Status(str(peer or ""), silent if peer else 0.0, dict(self.refused), counts)


def _a(role: Role) -> str:
    return f"{'an' if role[0] in 'ao' else 'a'} {role}"
