"""A running session shown to observers on other hosts: zenoh over TLS, with certificates on both sides.

Keys of a publisher NAME: ``hapticd/NAME/about`` answers a question with what the session is about, and
``hapticd/NAME/frame`` bears its frames, both as the recorder publishes them on its own host. A third,
``hapticd/NAME/alive``, lives as long as they come, and ``hapticd/NAME/over`` says that the session has
ended, so that nobody takes that for a link that is lost. Nothing is taken from observers but subscriptions
and questions: who looks cannot act, nor show anything to others.
"""

from __future__ import annotations

import json
import os
from enum import Enum
from pathlib import Path
from queue import SimpleQueue
from threading import Event, Lock, Thread
from time import monotonic_ns
from typing import Any, Final

import msgspec
import zenoh

from ..link.credentials import AUTHORITY, CERTIFICATE, KEY, Credentials
from ..link.stations import Role
from ..runtime.recording.frames import Frame
from ..runtime.recording.published import SUFFIX, About, Publisher, SessionError, Subscriber, run_folder
from .errors import ViewError

ABOUT, FRAME, ALIVE, OVER = "about", "frame", "alive", "over"
ANSWER_S: Final = 5.0
"""How long a publisher may take to answer."""
MOST_ABOUT: Final = 4 << 20
"""Bytes of what a session is about; a large robot's model takes a tenth."""
LOOKED_AT: Final = "declare_subscriber", "query", "liveliness_query", "declare_liveliness_subscriber"
SHOWN: Final = "put", "reply", "declare_queryable", "liveliness_token"
"""What observers may ask of a publisher, and what they are sent; everything else is denied."""
AGAIN: Final = {"period_init_ms": 500, "period_increase_factor": 2.0, "period_max_ms": 8000}
"""Between two tries of an observer whose link is lost: longer and longer."""


def publishes(credentials: Credentials) -> Credentials:
    """The same, if they are a publisher's.

    Raises:
        ViewError: they are not.
    """
    if credentials.station.role is not Role.PUBLISHER:
        raise ViewError(
            f"{credentials.folder} are keys of {credentials.station}, and a session is shown by a"
            " publisher; make keys with `hapticd link keygen DIR --publisher NAME`"
        )
    return credentials


class Shown:
    """The publisher's end: frames of a session of this host go out, to whoever asks with a certificate."""

    def __init__(self, credentials: Credentials, endpoint: str, path: Path) -> None:
        """Wait for observers, and show them the session whose frames are in a file.

        Args:
            credentials: of a publisher.
            endpoint: "ADDRESS:PORT" to wait at.
            path: of the frames.

        Raises:
            ViewError: the keys are not a publisher's, or nobody can wait there.
            SessionError: the session is over.
        """
        publishes(credentials)
        self._frames = Subscriber(path)
        about = msgspec.structs.replace(
            self._frames.about,
            config=f"{os.path.basename(self._frames.about.config)} ({credentials.station.name})",
            words=[],  # who looks from elsewhere gives no orders
            log="",
        )
        self._said = msgspec.json.encode(about)
        keys = {each: _key(credentials.station.name, each) for each in (ABOUT, FRAME, ALIVE, OVER)}
        self._session = _open(_publishing(credentials, f"tls/{endpoint}"), f"cannot wait at {endpoint}")
        self._session.declare_queryable(keys[ABOUT], lambda query: query.reply(keys[ABOUT], self._said))
        # a slow observer misses frames, and holds up nobody
        drop = zenoh.CongestionControl.DROP
        self._publisher = self._session.declare_publisher(keys[FRAME], congestion_control=drop)
        self._over = self._session.declare_publisher(
            keys[OVER], congestion_control=zenoh.CongestionControl.BLOCK
        )
        self._alive = self._session.liveliness().declare_token(keys[ALIVE])

    @property
    def over(self) -> bool:
        """Whether the session has ended."""
        return self._frames.over

    def pass_on(self) -> int:
        """Send the frames since the last time; how many."""
        frames = self._frames.take()
        for frame in frames:
            self._publisher.put(msgspec.msgpack.encode(frame))
        return len(frames)

    def close(self) -> None:
        """Show no more; where the session has ended, observers are told."""
        if not self._session.is_closed():
            if self.over:
                self._over.put(b"")
            self._session.close()
            self._frames.close()


class Seen(Enum):
    """What an observer sees of a session. It is lost where the link is, or where nobody shows it."""

    SHOWN = "shown"
    LOST = "lost"
    OVER = "over"


class Followed:
    """The observer's end: publishes on this host what a publisher elsewhere shows, for every viewer here.

    Attributes:
        about: the session.
        seen: of it, when somebody last waited.
        count: of frames that came.
        wrong: of messages that were no frames.
    """

    def __init__(self, credentials: Credentials, endpoint: str, name: str = "*") -> None:
        """Look at a session.

        Args:
            credentials: of an observer.
            endpoint: "ADDRESS:PORT" of the publisher.
            name: of the publisher; "*" for whichever is there.

        Raises:
            ViewError: the keys are not an observer's, or nobody is there who takes them.
            SessionError: no session is shown there.
        """
        if credentials.station.role is not Role.OBSERVER:
            raise ViewError(
                f"{credentials.folder} are keys of {credentials.station}, and who looks is an observer;"
                " make keys with `hapticd link keygen DIR --observer NAME`"
            )
        refused = f"no publisher at {endpoint} takes the keys in {credentials.folder}"
        self._session = _open(_observing(credentials, f"tls/{endpoint}"), refused)
        self.count, self.wrong, self.seen = 0, 0, Seen.SHOWN
        self._news, self._alive, self._lost, self._over = Event(), True, False, False
        self._publishing = Lock()
        try:
            found = self._ask(_key(name, ABOUT))
            if found is None:
                raise SessionError("nobody shows a session there, or nobody of that name")
            self._asked, self._told = found
            self._here: Publisher | None = self._publisher()
        except BaseException:
            self._session.close()
            raise
        folder = self._asked.rpartition("/")[0]
        self._session.declare_subscriber(f"{folder}/{FRAME}", self._take)
        self._session.declare_subscriber(f"{folder}/{OVER}", self._end)
        self._session.liveliness().declare_subscriber(f"{folder}/{ALIVE}", self._live, history=True)

    def wait(self, seconds: float) -> Seen:
        """Wait, at most so long, for something else to be seen; what is.

        A link that is lost is tried again, with longer and longer pauses. What is shown then is asked anew:
        viewers here see more of the same session, or the end of the first where it is another one.

        Raises:
            SessionError: what is shown there now is no session of this version.
        """
        if self._news.wait(seconds):
            self._news.clear()
        if self._over:
            self.seen = Seen.OVER
        elif self._lost:
            self.seen = Seen.SHOWN if self._alive and self._again() else Seen.LOST
        return self.seen

    def close(self) -> None:
        """Look no more."""
        self._session.close()
        with self._publishing:
            if self._here:
                self._here.close()
                self._here = None

    def _again(self) -> bool:
        """The link is back; whether the publisher answers."""
        self._lost = False  # before asking: what is lost from now on is lost anew
        found = self._ask(self._asked)
        if found is None:
            self._lost = True
            return False
        _, told = found
        if told != self._told:
            with self._publishing:
                self._told = told
                if self._here:
                    self._here.close()
                self._here = self._publisher()
        return True

    def _publisher(self) -> Publisher:
        self.about = msgspec.structs.replace(self._told, words=[], pid=os.getpid())
        return Publisher(run_folder() / f"{os.getpid()}{SUFFIX}", self.about)

    def _ask(self, selector: str) -> tuple[str, About] | None:
        """Who answers first, and what the session is about; None where nobody does."""
        for reply in self._session.get(selector, timeout=ANSWER_S):
            answer = reply.ok
            if answer is None or len(answer.payload) > MOST_ABOUT:
                continue
            try:
                about = msgspec.json.decode(answer.payload.to_bytes(), type=About)
            except msgspec.MsgspecError as error:
                raise SessionError(f"what is shown there is no session of this version: {error}") from error
            return str(answer.key_expr), about
        return None

    def _take(self, sample: Any) -> None:
        """From another thread: a frame has come."""
        try:
            frame = msgspec.msgpack.decode(sample.payload.to_bytes(), type=Frame)
        except msgspec.MsgspecError:
            self.wrong += 1
            return
        frame.published_ns = monotonic_ns()  # of this host: clocks of two are not compared
        with self._publishing:
            if self._here and not self._lost:
                self._here.publish(frame)
                self.count += 1

    def _live(self, sample: Any) -> None:
        """From another thread: the publisher is there, or is there no more."""
        self._alive = sample.kind != zenoh.SampleKind.DELETE
        self._lost = self._lost or not self._alive
        self._news.set()

    def _end(self, _: Any) -> None:
        """From another thread: the session has ended."""
        self._over = True
        self._news.set()


def _key(name: str, what: str) -> str:
    return f"hapticd/{name}/{what}"


def _tls(credentials: Credentials) -> dict[str, Any]:
    """Who is not of the lab's authority is refused. Stations are known by name, wherever they are."""
    folder = credentials.folder
    own = {"private_key": os.fspath(folder / KEY), "certificate": os.fspath(folder / CERTIFICATE)}
    return {
        "root_ca_certificate": os.fspath(folder / AUTHORITY),
        "enable_mtls": True,
        "verify_name_on_connect": False,
        "close_link_on_expiration": True,
        **{f"{side}_{name}": path for side in ("listen", "connect") for name, path in own.items()},
    }


def _config(credentials: Credentials, mode: str, listen: list[str], connect: list[str]) -> dict[str, Any]:
    """Nothing is searched for, and nothing but TLS is spoken."""
    return {
        "mode": mode,
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        "listen": {"endpoints": listen},
        "connect": {"endpoints": connect},
        "transport": {"link": {"protocols": ["tls"], "tls": _tls(credentials)}},
    }


def _publishing(credentials: Credentials, endpoint: str) -> dict[str, Any]:
    keys = [_key("*", "*")]
    rules = [
        {"id": flow, "permission": "allow", "flows": [flow], "messages": messages, "key_exprs": keys}
        for flow, messages in (("ingress", LOOKED_AT), ("egress", SHOWN))
    ]
    access = {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [{"id": "all"}],
        "policies": [{"rules": [rule["id"] for rule in rules], "subjects": ["all"]}],
    }
    return {**_config(credentials, "peer", [endpoint], []), "access_control": access}


def _observing(credentials: Credentials, endpoint: str) -> dict[str, Any]:
    config = _config(credentials, "client", [], [endpoint])
    return {**config, "connect": {**config["connect"], "retry": AGAIN}}


def _open(config: dict[str, Any], refused: str) -> Any:
    """A session of zenoh, opened by another thread: that may take 10 s, for which Ctrl-C is not to wait."""
    ready: SimpleQueue[Any] = SimpleQueue()

    def open_it() -> None:
        try:
            ready.put(zenoh.open(zenoh.Config.from_json5(json.dumps(config))))
        except zenoh.ZError as error:
            ready.put(error)

    Thread(target=open_it, name="zenoh opens", daemon=True).start()
    found = ready.get()
    if isinstance(found, zenoh.ZError):
        raise ViewError(f"{refused}: {str(found).partition(' at /')[0].strip()}") from found
    return found
