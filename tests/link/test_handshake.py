"""Who gets a session, who does not, and what both sides say of it; over loopback."""

from __future__ import annotations

import socket
import ssl
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import pytest
from hapticd.link import caller as caller_module
from hapticd.link import host as host_module
from hapticd.link import messages
from hapticd.link.caller import Caller, ask, call
from hapticd.link.channel import TO_AVATAR, Channel, clock
from hapticd.link.credentials import Credentials, load
from hapticd.link.errors import KeysError, LinkError, RefusedError
from hapticd.link.host import WAITING, Host
from hapticd.link.port import Received
from hapticd.link.stations import Role, Station
from hapticd.link.terms import checksums

from .conftest import AVATAR as AVATAR_TERMS
from .conftest import OPERATOR as OPERATOR_TERMS
from .conftest import Ticker, until

LOOPBACK = "127.0.0.1"
ALICE = Station("alice", Role.OPERATOR)
OPERATOR = replace(OPERATOR_TERMS, lease=30.0, oldest=5.0)
AVATAR = replace(AVATAR_TERMS, lease=30.0, oldest=5.0)
"""Terms that a host keeps which stalls for seconds: what is judged here is no time."""


@pytest.fixture(autouse=True)
def patience(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (host_module, caller_module):
        monkeypatch.setattr(module, "PATIENCE", 30.0)


@contextmanager
def waiting(lab: Path, **options: object) -> Iterator[Host]:
    """An avatar's end that is open."""
    terms = options.pop("terms", AVATAR)
    host = Host(load(lab / "robot"), terms, options.pop("address", LOOPBACK), **options)  # type: ignore[arg-type]
    try:
        yield host
    finally:
        host.close()


def credentials(folder: Path, station: Station) -> Credentials:
    """Of a folder that `load` might refuse."""
    return Credentials(folder, station, datetime.now(UTC))


def operator(lab: Path, name: str = "alice") -> Credentials:
    return credentials(lab / name, Station(name, Role.OPERATOR))


def connect(who: Credentials, host: Host, **options: object) -> Channel:
    """One call; a session's channel of the operator's side."""
    terms = options.get("terms", OPERATOR)
    address = options.get("address", LOOPBACK)
    context = who.context()
    session = call(context, who.station, terms, address, host.port, "robot")  # type: ignore[arg-type]
    return Channel(session.sock, session.keys, TO_AVATAR, terms)  # type: ignore[arg-type]


def talk(ours: Channel, host: Host) -> bool:
    """Whether packets go both ways."""
    heard = [False, False]

    def exchange() -> bool:
        ours.send(bytes(40))
        host.send(bytes(24))
        heard[0] |= host.receive() is not None
        heard[1] |= ours.receive() is not None
        return all(heard)

    until(exchange)
    return True


def exchange(caller: Caller, host: Host) -> Received | None:
    """Both send and receive; what the operator's side has heard."""
    caller.send(bytes(40))
    host.receive()
    host.send(bytes(24))
    return caller.receive()


@pytest.mark.parametrize(
    ("here", "called"), [(LOOPBACK, LOOPBACK), ("::1", "::1"), ("0.0.0.0", "127.0.0.2"), ("::", LOOPBACK)]
)
def test_an_operator_of_the_lab_gets_a_session(lab: Path, here: str, called: str) -> None:
    with waiting(lab, address=here) as host:
        ours = connect(operator(lab), host, address=called)
        assert talk(ours, host)
        assert host.peer == Station("alice", Role.OPERATOR) and host.sessions == 1
        assert [event.code for event in host.events()] == ["session_began"]
        assert not host.refused
        ours.close()


def refused(lab: Path, who: Credentials, cause: str, why: str, **options: object) -> None:
    """Call an avatar that has a session; the caller is refused, both say why, and the session goes on."""
    with waiting(lab) as host:
        first = connect(operator(lab), host)
        assert talk(first, host)
        host.events()
        with pytest.raises(RefusedError, match=why) as caught:
            connect(who, host, **options)
        assert caught.value.cause == cause
        until(lambda: bool(host.refused))
        assert host.refused == {cause: 1}
        (event,) = host.events()
        assert event.code == "refused" and event.text.startswith(cause)
        assert host.sessions == 1 and talk(first, host)
        first.close()


def test_a_second_operator_is_refused_and_told_who_has_the_session(lab: Path) -> None:
    refused(lab, operator(lab, "bob"), "lease", "operator 'alice' moves the avatar")


def test_the_same_operator_a_second_time_is_refused_too(lab: Path) -> None:
    refused(lab, operator(lab), "lease", "operator 'alice' moves the avatar")


def test_an_expired_certificate_is_refused(lab: Path) -> None:
    refused(
        lab, operator(lab, "late"), "certificate", "refuses this station's certificate: certificate expired"
    )


def test_a_certificate_that_is_not_valid_yet_is_refused(lab: Path) -> None:
    refused(lab, operator(lab, "early"), "certificate", "refuses this station's certificate")


def test_a_maintainer_and_an_observer_move_nothing(lab: Path) -> None:
    for name, role in (("mike", Role.MAINTAINER), ("olga", Role.OBSERVER)):
        who = credentials(lab / name, Station(name, role))
        refused(lab, who, "role", f"{role} may not ask an avatar for 'move'")


def test_an_avatar_is_no_operator(lab: Path) -> None:
    """Its certificate says server: TLS itself refuses it, whatever the station claims."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname = False
    folder = lab / "robot"
    context.load_verify_locations(folder / "authority.pem")
    context.load_cert_chain(folder / "certificate.pem", folder / "key.pem")
    with waiting(lab) as host:
        with pytest.raises(RefusedError, match="certificate"):
            call(context, Station("robot", Role.OPERATOR), OPERATOR, LOOPBACK, host.port, "robot")
        until(lambda: host.refused["certificate"] == 1)


def test_a_station_of_another_authority_is_refused_by_whoever_sees_it_first(
    lab: Path, tmp_path: Path
) -> None:
    with waiting(lab) as host:
        with pytest.raises(RefusedError, match="the avatar's certificate is refused"):
            connect(operator(lab / "strangers"), host)
        until(lambda: host.refused["tls"] == 1)
    mixed = tmp_path / "mixed"
    mixed.mkdir()
    for name in ("certificate.pem", "key.pem"):
        (mixed / name).write_bytes((lab / "strangers" / "alice" / name).read_bytes())
    (mixed / "authority.pem").write_bytes((lab / "robot" / "authority.pem").read_bytes())
    refused(lab, operator(tmp_path, "mixed"), "certificate", "refuses this station's certificate")


def test_nobody_gets_in_without_a_certificate(lab: Path) -> None:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname = False
    context.load_verify_locations(lab / "robot" / "authority.pem")
    with waiting(lab) as host:
        with pytest.raises(RefusedError, match="certificate required"):
            call(context, Station("alice", Role.OPERATOR), OPERATOR, LOOPBACK, host.port, "robot")
        until(lambda: host.refused["tls"] + host.refused["certificate"] == 1)
        assert host.sessions == 0


def test_nothing_older_than_tls_1_3_is_spoken(lab: Path) -> None:
    context = operator(lab).context()
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    context.maximum_version = ssl.TLSVersion.TLSv1_2
    with waiting(lab) as host:
        with pytest.raises(LinkError, match="protocol version"):
            call(context, Station("alice", Role.OPERATOR), OPERATOR, LOOPBACK, host.port, "robot")
        until(lambda: host.refused["tls"] == 1)


def test_the_operator_judges_the_avatar_too(lab: Path) -> None:
    """Another name than the one called, and a certificate that has expired."""
    context, here = operator(lab).context(), operator(lab).station
    with waiting(lab) as host, pytest.raises(RefusedError, match="avatar 'robot' answers; avatar 'other'"):
        call(context, here, OPERATOR, LOOPBACK, host.port, "other")
    old = Host(credentials(lab / "old-robot", Station("old-robot", Role.AVATAR)), AVATAR, LOOPBACK)
    with pytest.raises(RefusedError, match="the avatar's certificate is refused: certificate has expired"):
        call(context, here, OPERATOR, LOOPBACK, old.port, "old-robot")
    old.close()


def test_an_operator_is_no_avatar(lab: Path) -> None:
    """With its own certificate it waits as an avatar would: TLS at the other end refuses it."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(lab / "bob" / "certificate.pem", lab / "bob" / "key.pem")

    def pretend() -> None:
        sock, _ = listener.accept()
        with sock, pytest.raises(ssl.SSLError):
            context.wrap_socket(sock, server_side=True).recv(1)

    with socket.create_server((LOOPBACK, 0)) as listener:
        thread = threading.Thread(target=pretend)
        thread.start()
        with pytest.raises(RefusedError, match=r"the avatar's certificate is refused: .*purpose"):
            call(operator(lab).context(), ALICE, OPERATOR, LOOPBACK, listener.getsockname()[1], "robot")
        thread.join()


def test_stations_that_differ_in_a_file_are_refused_by_both_and_the_file_is_named(
    lab: Path, tmp_path: Path
) -> None:
    for name in ("avatar.toml", "arm.urdf"):
        (tmp_path / name).write_text(name)
    files = {name: tmp_path / name for name in ("avatar.toml", "arm.urdf")}
    same = replace(AVATAR, identity=checksums(files))
    (tmp_path / "arm.urdf").write_text("arm.urdf ")
    with waiting(lab, terms=same) as host:
        for identity, why in (
            (checksums(files), r"differ in arm.urdf \(\w{12} here, \w{12} there\)"),
            ({**same.identity, "calibration": "00"}, r"calibration \(00 here, missing there\)"),
            ({}, r"avatar.toml \(missing here, \w{12} there\)"),
        ):
            with pytest.raises(RefusedError, match=why) as caught:
                connect(operator(lab), host, terms=replace(OPERATOR, identity=identity))
            assert caught.value.cause == "identity"
        assert host.refused == {"identity": 3} and host.sessions == 0
        ours = connect(operator(lab), host, terms=replace(OPERATOR, identity=same.identity))
        assert talk(ours, host)
        ours.close()


def test_an_operator_does_not_trust_an_avatar_that_overlooks_a_difference(
    lab: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(host_module, "refusal", lambda *_: None)
    with waiting(lab) as host, pytest.raises(RefusedError, match="differ in model"):
        connect(operator(lab), host, terms=replace(OPERATOR, identity={"model": "1"}))


def test_stations_of_other_packet_lengths_or_versions_are_refused(
    lab: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with waiting(lab) as host:
        for terms in (replace(OPERATOR, sends=41), replace(OPERATOR, receives=25)):
            with pytest.raises(RefusedError, match="bytes a packet there"):
                connect(operator(lab), host, terms=terms)
        assert host.refused == {"sizes": 2}
        monkeypatch.setattr(messages, "PROTOCOL", 2)
        ours = operator(lab)
        with pytest.raises(RefusedError, match="protocol"):
            connect(ours, host)


def test_an_attack_is_an_event_and_its_end_too(lab: Path) -> None:
    later = Ticker(0)
    with waiting(lab, clock=lambda: clock() + later.now) as host:
        ours = connect(operator(lab), host)
        assert talk(ours, host)
        host.events()
        for wrong in (150, 0, 0):
            for _ in range(wrong):
                ours._socket.send(b"x")
            host.receive()
            later.wait(1.0)
        assert not host.alarm
        attack, over = host.events()
        assert (attack.code, over.code) == ("attack", "attack_over") and "truncated=150" in attack.text
        ours.close()


def test_two_that_come_at_once_do_not_both_get_the_session(lab: Path) -> None:
    with waiting(lab) as host:
        callers = [
            Caller(operator(lab, name), OPERATOR, LOOPBACK, host.port, "robot") for name in ("alice", "bob")
        ]
        until(lambda: host.refused["lease"] > 0 and any(caller.peer for caller in callers))
        assert sum(caller.sessions for caller in callers) == host.sessions == 1
        for caller in callers:
            caller.close()


def test_an_observer_learns_who_moves_the_avatar_and_a_maintainer_ends_it(lab: Path) -> None:
    olga = credentials(lab / "olga", Station("olga", Role.OBSERVER))
    mike = credentials(lab / "mike", Station("mike", Role.MAINTAINER))
    with waiting(lab) as host:
        assert ask(olga, LOOPBACK, host.port, "robot", "status").operator == ""
        ours = connect(operator(lab), host)
        assert talk(ours, host)
        status = ask(olga, LOOPBACK, host.port, "robot", "status")
        assert status.operator == "operator 'alice'" and status.counts["received"] > 0
        for who in (olga, operator(lab)):
            with pytest.raises(RefusedError, match="may not ask an avatar for 'end'"):
                ask(who, LOOPBACK, host.port, "robot", "end")
        assert host.peer is not None and host.refused == {"role": 2}
        assert ask(mike, LOOPBACK, host.port, "robot", "end").operator == ""
        assert host.peer is None and host.receive() is None
        assert "ended by maintainer 'mike'" in host.events()[-1].text
        ours.close()


def test_whose_session_a_maintainer_ended_stays_out_until_one_admits_it(lab: Path) -> None:
    mike = credentials(lab / "mike", Station("mike", Role.MAINTAINER))
    with waiting(lab) as host:
        ours = connect(operator(lab), host)
        ask(mike, LOOPBACK, host.port, "robot", "end")
        ours.close()
        for _ in range(2):
            with pytest.raises(RefusedError, match="maintainer 'mike' ended its session") as caught:
                connect(operator(lab), host)
            assert caught.value.cause == "ended"
        other = connect(operator(lab, "bob"), host)
        assert talk(other, host), "nobody else is kept out"
        ask(mike, LOOPBACK, host.port, "robot", "admit")
        with pytest.raises(RefusedError, match="operator 'bob' moves the avatar"):
            connect(operator(lab), host)
        with pytest.raises(RefusedError, match="may not ask an avatar for 'admit'"):
            ask(operator(lab), LOOPBACK, host.port, "robot", "admit")
        other.close()


def test_when_the_lease_is_over_another_operator_may_come(lab: Path) -> None:
    later = Ticker(0)
    with waiting(lab, clock=lambda: clock() + later.now) as host:
        first = connect(operator(lab), host)
        assert talk(first, host)
        later.wait(15.0)
        with pytest.raises(RefusedError, match="its lease ends after silence"):
            connect(operator(lab, "bob"), host)
        later.wait(16.0)
        second = connect(operator(lab, "bob"), host)
        assert talk(second, host) and host.sessions == 2
        first.send(bytes(40))
        assert host.peer == Station("bob", Role.OPERATOR)
        codes = [event.code for event in host.events()]
        assert codes == ["session_began", "refused", "session_ended", "session_began"]
        first.close()
        second.close()


def test_a_caller_calls_again_by_itself_with_other_keys(lab: Path) -> None:
    """The avatar's end restarts; packets of the session before are worth nothing to it."""
    later = Ticker(0)
    with waiting(lab) as host:
        port = host.port
        caller = Caller(operator(lab), OPERATOR, LOOPBACK, port, "robot", lambda: clock() + later.now)
        caller.wait(30.0)
        first = caller._channel.session if caller._channel else 0
        until(lambda: bool(exchange(caller, host)))
    later.wait(31.0)
    assert caller.peer is None
    caller.send(bytes(40))  # goes nowhere, and harms nothing
    assert caller.receive() is None and caller.silent == float("inf")
    with waiting(lab, port=port) as host:
        caller.wait(30.0)
        assert caller.sessions == 2 and caller._channel and caller._channel.session != first
        until(lambda: bool(exchange(caller, host)))
        codes = [event.code for event in caller.events()]
        assert codes[:2] == ["session_began", "session_ended"] and codes[-1] == "session_began"
        caller.close()


def test_nobody_there_is_said_with_what_to_look_for(lab: Path) -> None:
    with socket.socket() as sock:
        sock.bind((LOOPBACK, 0))
        port = sock.getsockname()[1]
    caller = Caller(operator(lab), OPERATOR, LOOPBACK, port, "robot")
    until(lambda: caller.error is not None)
    with pytest.raises(LinkError, match=rf"nobody answers at {LOOPBACK}, port {port} .*firewall"):
        caller.wait(0.0)
    caller.close()
    assert len(caller.events()) == 1  # though it called more than once


@pytest.mark.parametrize("address", ["robot.example", "", "1.2.3", "127.0.0.1:7", "localhost"])
def test_an_address_is_in_numbers(lab: Path, address: str) -> None:
    with pytest.raises(LinkError, match="write it in numbers"):
        Caller(operator(lab), OPERATOR, address, 7, "robot")


def test_a_port_that_is_taken_is_said_at_once(lab: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind((LOOPBACK, 0))
        with pytest.raises(LinkError, match="the port is taken"), waiting(lab, port=taken.getsockname()[1]):
            pass
    with pytest.raises(LinkError, match="not an address of this host"), waiting(lab, address="192.0.2.1"):
        pass


def test_only_an_avatar_waits(lab: Path) -> None:
    with pytest.raises(KeysError, match="only an avatar waits"):
        Host(load(lab / "alice"), AVATAR, LOOPBACK)


def test_those_who_connect_and_say_nothing_keep_nobody_out(lab: Path) -> None:
    """Half-open handshakes: each is given up, the oldest first, and an operator comes through."""
    with waiting(lab) as host, ExitStack() as stack:
        for _ in range(3 * WAITING):
            idle = stack.enter_context(socket.socket())
            idle.connect((LOOPBACK, host.port))
            idle.send(b"\x16\x03")  # begins like TLS
        ours = connect(operator(lab), host)
        assert talk(ours, host)
        assert len(host._conversations) <= WAITING
        assert host.refused["evicted"] >= 2 * WAITING
        ours.close()


def test_a_handshake_that_drips_is_given_up_in_time(lab: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A byte now and then buys no time: the deadline is the whole handshake's."""
    monkeypatch.setattr(host_module, "PATIENCE", 0.3)
    with waiting(lab) as host, socket.socket() as slow:
        slow.connect((LOOPBACK, host.port))
        with pytest.raises(OSError):
            for byte in b"\x16\x03\x01\x3f\xff" + bytes(10_000):
                slow.send(bytes([byte]))
                time.sleep(0.02)
        assert host.refused == {"timeout": 1} and not host._conversations


@pytest.mark.parametrize(
    "said",
    [
        b"GET / HTTP/1.1\r\n\r\n",
        b"\x16\x03\x01\xff\xff" + b"\xff" * 70000,
        bytes(100),
        b"\x16\x03\x01\x00\x02\x01\x00",
    ],
)
def test_what_is_no_handshake_is_counted_and_harms_nobody(lab: Path, said: bytes) -> None:
    with waiting(lab) as host:
        with socket.socket() as sock:
            sock.connect((LOOPBACK, host.port))
            try:
                sock.sendall(said)
            except OSError:  # hung up already
                pass
        until(lambda: bool(host.refused))
        ours = connect(operator(lab), host)
        assert talk(ours, host)
        ours.close()


@pytest.mark.parametrize(
    "said",
    [
        b"\xff\xff",
        b"\x00\x02{}",
        b"\x00\x04\xff\xff\xff\xff",
        b"\x20\x00" + b"[" * 0x2000,
        b'\x00\x05{"a"',
    ],
)
def test_a_station_of_the_lab_that_talks_nonsense_is_counted(lab: Path, said: bytes) -> None:
    with waiting(lab) as host:
        raw = socket.create_connection((LOOPBACK, host.port))
        with operator(lab).context().wrap_socket(raw) as tls:
            tls.recv(1000)
            tls.sendall(said)
        until(lambda: bool(host.refused))
        assert set(host.refused) <= {"message", "gone", "tls"}


@pytest.mark.parametrize(
    "changes",
    [{"secret": b""}, {"secret": bytes(33)}, {"protocol": 0}, {"identity": {"x": "y"}}, {"sends": -1}],
)
def test_an_offer_that_is_not_as_it_should_be_is_refused(
    lab: Path, monkeypatch: pytest.MonkeyPatch, changes: dict[str, object]
) -> None:
    real = caller_module.offer
    monkeypatch.setattr(
        caller_module, "offer", lambda *given: msgspec.structs.replace(real(*given), **changes)
    )
    with waiting(lab) as host:
        with pytest.raises(RefusedError):
            connect(operator(lab), host)
        assert host.sessions == 0 and sum(host.refused.values()) == 1


def test_a_port_that_is_none_gets_no_session(lab: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = caller_module.Request
    for port in (-1, 0, 65536, 2**70):
        monkeypatch.setattr(caller_module, "Request", lambda want, mine, _, port=port: real(want, mine, port))
        with waiting(lab) as host:
            with pytest.raises(LinkError):
                connect(operator(lab), host)
            until(lambda: bool(host.refused))
            assert host.refused == {"message": 1} and host.sessions == 0
