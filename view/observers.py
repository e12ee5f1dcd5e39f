"""A running session shown to observers on other hosts: zenoh over TLS, with certificates on both sides.

Two keys of a publisher NAME: ``hapticd/NAME/about`` answers a question with what the session is about, and
``hapticd/NAME/frame`` bears its frames, both as the recorder publishes them on its own host. A third one,
``hapticd/NAME/alive``, lives as long as they come. Nothing is taken from observers but these subscriptions
and questions: who looks cannot act, nor show anything to others.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from threading import Event
from time import monotonic_ns
from typing import Any, Final

import msgspec
import zenoh

from ..link.credentials import AUTHORITY, CERTIFICATE, KEY, Credentials
from ..link.stations import Role
from ..runtime.recording.frames import Frame
from ..runtime.recording.published import SUFFIX, About, Publisher, SessionError, Subscriber, run_folder
from .errors import ViewError

ABOUT, FRAME, ALIVE = "about", "frame", "alive"
ANSWER_S: Final = 5.0
"""How long a publisher may take to answer."""
MOST_ABOUT: Final = 4 << 20
"""Bytes of what a session is about; a large robot's model takes a tenth."""
LOOKED_AT: Final = "declare_subscriber", "query", "liveliness_query", "declare_liveliness_subscriber"
SHOWN: Final = "put", "reply", "declare_queryable", "liveliness_token"
"""What observers may ask of a publisher, and what they are sent; everything else is denied."""


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
        if credentials.station.role is not Role.PUBLISHER:
            raise ViewError(
                f"{credentials.folder} are keys of {credentials.station}, and a session is shown by a"
                " publisher; make keys with `hapticd link keygen DIR --publisher NAME`"
            )
        self._frames = Subscriber(path)
        about = msgspec.structs.replace(
            self._frames.about,
            config=f"{os.path.basename(self._frames.about.config)} ({credentials.station.name})",
            words=[],  # who looks from elsewhere gives no orders
            log="",
        )
        self._said = msgspec.json.encode(about)
        keys = {each: _key(credentials.station.name, each) for each in (ABOUT, FRAME, ALIVE)}
        self._session = _open(_publishing(credentials, f"tls/{endpoint}"), f"cannot wait at {endpoint}")
        self._session.declare_queryable(keys[ABOUT], lambda query: query.reply(keys[ABOUT], self._said))
        # a slow observer misses frames, and holds up nobody
        drop = zenoh.CongestionControl.DROP
        self._publisher = self._session.declare_publisher(keys[FRAME], congestion_control=drop)
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
        """Show no more."""
        if not self._session.is_closed():
            self._session.close()
            self._frames.close()


class Followed:
    """The observer's end: publishes on this host what a publisher elsewhere shows, for every viewer here.

    Attributes:
        about: the session.
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
        self._gone, self.count, self.wrong = Event(), 0, 0
        try:
            key, self.about = self._ask(_key(name, ABOUT))
            self._here: Publisher | None = Publisher(run_folder() / f"{os.getpid()}{SUFFIX}", self.about)
        except BaseException:
            self._session.close()
            raise
        folder = key.rpartition("/")[0]
        self._session.declare_subscriber(f"{folder}/{FRAME}", self._take)
        self._session.liveliness().declare_subscriber(f"{folder}/{ALIVE}", self._live, history=True)

    def wait(self, seconds: float) -> bool:
        """Wait, at most so long; whether the session is still shown."""
        return not self._gone.wait(seconds)

    def close(self) -> None:
        """Look no more."""
        self._session.close()
        if self._here:
            self._here.close()
            self._here = None

    def _ask(self, selector: str) -> tuple[str, About]:
        for reply in self._session.get(selector, timeout=ANSWER_S):
            answer = reply.ok
            if answer is None or len(answer.payload) > MOST_ABOUT:
                continue
            try:
                about = msgspec.json.decode(answer.payload.to_bytes(), type=About)
            except msgspec.MsgspecError as error:
                raise SessionError(f"what is shown there is no session of this version: {error}") from error
            return str(answer.key_expr), msgspec.structs.replace(about, words=[], pid=os.getpid())
        raise SessionError("nobody shows a session there, or nobody of that name")

    def _take(self, sample: Any) -> None:
        """From another thread: a frame has come."""
        try:
            frame = msgspec.msgpack.decode(sample.payload.to_bytes(), type=Frame)
        except msgspec.MsgspecError:
            self.wrong += 1
            return
        frame.published_ns = monotonic_ns()  # of this host: clocks of two are not compared
        if here := self._here:
            here.publish(frame)
            self.count += 1

    def _live(self, sample: Any) -> None:
        if sample.kind == zenoh.SampleKind.DELETE:
            self._gone.set()


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
    return _config(credentials, "client", [], [endpoint])


def _open(config: dict[str, Any], refused: str) -> Any:
    try:
        return zenoh.open(zenoh.Config.from_json5(json.dumps(config)))
    except zenoh.ZError as error:
        raise ViewError(f"{refused}: {str(error).partition(' at /')[0].strip()}") from error
