"""The operator's end: it calls the avatar, and calls again whenever a session was lost."""

from __future__ import annotations

import os
import socket
import ssl
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from time import monotonic
from typing import Final, Literal, NamedTuple

from cryptography import x509

from .agreement import refusal, session_keys
from .channel import TO_AVATAR, Clock, SessionKeys, clock
from .credentials import Credentials
from .end import End
from .errors import LinkError, RefusedError
from .messages import (
    PATIENCE,
    SECRET,
    Answer,
    Granted,
    Offer,
    Refused,
    Request,
    Status,
    Steps,
    finish,
    offer,
    patient,
    put,
    take,
)
from .places import datagram_socket, place, with_port
from .stations import Role, Station, station_of
from .terms import Terms

AGAIN: Final = 0.25
"""Between two calls [s]."""
LOOK: Final = 0.005
"""Between two looks of who waits for a session [s]."""
NONE: Final = Terms(sends=1, receives=1, oldest=1.0)
"""Terms of those who ask for no session."""


class Session(NamedTuple):
    """What a call brought."""

    sock: socket.socket
    keys: SessionKeys
    peer: Station


class Caller(End):
    """The operator's end of the link.

    A thread of its own calls the avatar until it answers, and anew when a session is over.
    """

    def __init__(
        self,
        credentials: Credentials,
        terms: Terms,
        address: str,
        port: int,
        avatar: str,
        clock: Clock = clock,
    ) -> None:
        """Open the end and begin to call.

        Args:
            credentials: of an operator.
            terms: what is sent, expected and tolerated.
            address: of the avatar's host.
            port: of its end of the link.
            avatar: its name; another station is not spoken to.
            clock: for packets and lease [ns].

        Raises:
            LinkError: the address is not one in numbers; the credentials cannot be used.
        """
        super().__init__(terms, TO_AVATAR, clock)
        place(address, port)
        self.error: LinkError | None = None
        """Why the last call failed; None while a session lives."""
        where = (address, port, avatar)
        self._call = partial(call, credentials.context(), credentials.station, terms, *where)
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._keep, name="link caller", daemon=True)
        self._thread.start()

    def wait(self, seconds: float) -> None:
        """Wait for a session to begin.

        Raises:
            LinkError: none did in that time; the last call says why.
        """
        until = monotonic() + seconds
        while self.peer is None:
            if monotonic() >= until:
                raise self.error or LinkError("the avatar has not answered yet")
            self._closing.wait(LOOK)

    def close(self) -> None:
        """End the session and call no more."""
        self._closing.set()
        self._thread.join()
        with self._lock:
            if self._living():
                self._end("closed at the operator's end")

    def _keep(self) -> None:
        while not self._closing.is_set():
            if self.peer is None:
                self._try()
            self._closing.wait(AGAIN)

    def _try(self) -> None:
        try:
            session = self._call()
        except Exception as error:  # whoever answers must not end the thread that calls
            failure = error
            if not isinstance(failure, LinkError):
                failure = LinkError(f"the call failed: {type(error).__name__}: {error}")
            if str(failure) != str(self.error):  # said once, though it calls on
                self._say("refused" if isinstance(failure, RefusedError) else "unreachable", str(failure))
            self.error = failure
            return
        with self._lock:
            self._begin(*session)
        self.error = None


def call(
    context: ssl.SSLContext, here: Station, terms: Terms, address: str, port: int, avatar: str
) -> Session:
    """Ask an avatar for a session; takes two seconds at most.

    Raises:
        RefusedError: one of both stations does not want the other.
        LinkError: the avatar does not answer, or does not speak as it should.
    """
    until = monotonic() + PATIENCE
    with _connected(context, address, port, until) as tls, _explained():
        there, theirs = _greeted(tls, avatar, until)
        secret = os.urandom(SECRET)
        sock = datagram_socket(with_port(tls.getsockname(), 0))
        try:
            request = Request("move", offer(terms, secret), sock.getsockname()[1])
            answer = finish(_asked(tls, request), tls, until)
            # judged here, too, whatever the avatar thinks of it
            unlike = refusal(terms, theirs) or answer
            if isinstance(unlike, Refused):
                raise RefusedError(unlike.cause, f"{there}: {unlike.why}")
            if not isinstance(answer, Granted):
                raise LinkError(f"{there} gave an answer to another question")
            sock.connect(with_port(tls.getpeername(), answer.port))
            return Session(sock, session_keys(answer.session, secret, theirs.secret, here, there), there)
        except BaseException:
            sock.close()
            raise


def ask(
    credentials: Credentials, address: str, port: int, avatar: str, want: Literal["status", "end", "admit"]
) -> Status:
    """Ask an avatar who moves it; as a maintainer, end that and keep who did out, or admit everybody again.

    Raises:
        RefusedError, LinkError: as `call`.
    """
    until = monotonic() + PATIENCE
    with _connected(credentials.context(), address, port, until) as tls, _explained():
        there, _ = _greeted(tls, avatar, until)
        answer = finish(_asked(tls, Request(want, offer(NONE, bytes(SECRET)), 0)), tls, until)
        if isinstance(answer, Refused):
            raise RefusedError(answer.cause, f"{there}: {answer.why}")
        if not isinstance(answer, Status):
            raise LinkError(f"{there} gave an answer to another question")
        return answer


def _connected(context: ssl.SSLContext, address: str, port: int, until: float) -> ssl.SSLSocket:
    family, where = place(address, port)
    raw = socket.socket(family, socket.SOCK_STREAM)
    try:
        raw.settimeout(max(until - monotonic(), 0.0))
        raw.connect(where)
        raw.setblocking(False)
        return context.wrap_socket(raw, do_handshake_on_connect=False)
    except OSError as error:
        raw.close()
        said = error.strerror or error
        raise LinkError(
            f"nobody answers at {address}, port {port} ({said}); is the avatar's end open, and does a"
            " firewall let TCP and UDP of that port pass?"
        ) from error


def _greeted(tls: ssl.SSLSocket, avatar: str, until: float) -> tuple[Station, Offer]:
    """Who answers, and its first word; it speaks only to those whose certificate it takes."""
    finish(patient(tls.do_handshake), tls, until)
    there = station_of(x509.load_der_x509_certificate(tls.getpeercert(binary_form=True) or b""))
    theirs = finish(take(tls, Offer), tls, until)
    if there != Station(avatar, Role.AVATAR):
        raise RefusedError("role", f"{there} answers; avatar '{avatar}' was called")
    return there, theirs


def _asked(tls: ssl.SSLSocket, request: Request) -> Steps[Answer]:
    yield from put(tls, request)
    answer: Answer = yield from take(tls, Answer)
    return answer


@contextmanager
def _explained() -> Iterator[None]:
    """What TLS and the network say, in words."""
    try:
        yield
    except ssl.SSLCertVerificationError as error:
        raise RefusedError(
            "certificate", f"the avatar's certificate is refused: {error.verify_message}"
        ) from error
    except ssl.SSLError as error:
        said = (error.reason or str(error)).replace("_", " ").lower()
        _, alert, what = said.partition("alert ")
        if alert and ("certificate" in what or "unknown ca" in what):
            raise RefusedError(
                "certificate", f"the avatar refuses this station's certificate: {what}"
            ) from error
        raise LinkError(f"the handshake failed: {said}") from error
    except OSError as error:
        raise LinkError(f"the handshake failed: {error.strerror or error}") from error
