"""What C does with datagrams before anything is opened."""

import random
import socket
from typing import Any

import pytest
from hapticd.link._inbox import ffi, lib
from hapticd.link.channel import HEADER

SIZE = 100


class Model:
    """The window as a set of all that has come."""

    def __init__(self) -> None:
        self.seen: set[int] = set()
        self.newest = 0

    def mark(self, counter: int) -> int:
        if counter > self.newest:
            what = lib.LINK_NEWEST
        elif counter in self.seen or counter < 1 or self.newest - counter >= lib.LINK_WINDOW:
            return int(lib.LINK_SEEN)
        else:
            what = lib.LINK_LATE
        self.seen.add(counter)
        self.newest = max(self.newest, counter)
        return int(what)

    @property
    def lost(self) -> int:
        """Counters behind the window that never came."""
        gone = range(1, self.newest - lib.LINK_WINDOW + 1)
        return len(gone) - len(self.seen.intersection(gone))


@pytest.mark.parametrize("seed", range(8))
def test_the_window_is_that_of_a_set_of_all_that_came_in_any_order(seed: int) -> None:
    chance = random.Random(seed)
    window, model = new_window(), Model()
    spread = chance.choice([1, 5, 63, 64, 65, 200])
    at = 0
    for turn in range(3000):
        at += chance.choice([0, 1, 1, 1, 2, chance.randrange(1, 2 * spread + 1)])
        counter = max(at + chance.randrange(-spread, spread + 1), 0)
        looked = lib.link_look(window, counter)
        assert lib.link_mark(window, counter) == looked == model.mark(counter), counter
        assert window.newest == model.newest
        assert turn % 100 or window.lost == model.lost
    assert window.lost == model.lost


def test_the_window_holds_at_the_end_of_its_numbers() -> None:
    window = new_window()
    last = 2**64 - 1
    for counter, what in (
        (last - 64, 2),
        (last, 2),
        (last, 0),
        (last - 63, 1),
        (last - 63, 0),
        (last - 64, 0),
    ):
        assert lib.link_mark(window, counter) == what
    assert lib.link_look(window, 0) == lib.LINK_SEEN


def new_window() -> Any:
    window = ffi.new("link_window *")
    window.seen = 2**64 - 1
    return window


def new_inbox() -> Any:
    inbox = ffi.new("link_inbox *")
    inbox.session, inbox.size, inbox.direction, inbox.window.seen = 7, SIZE, 1, 2**64 - 1
    return inbox


def datagram(
    counter: int, session: int = 7, direction: int = 1, version: int = 1, magic: int = 0x4C48
) -> bytes:
    return HEADER.pack(magic, version, direction, session, counter).ljust(SIZE, b"\x5a")


def test_each_fault_of_a_datagram_has_its_count(wire: tuple[socket.socket, socket.socket]) -> None:
    ours, theirs = wire
    inbox = new_inbox()
    lib.link_mark(ffi.addressof(inbox, "window"), 100)
    faults = {
        "truncated": [b"", datagram(101)[:-1], b"x"],
        "oversize": [datagram(101) + b"x", bytes(1232), bytes(1233), bytes(9000)],
        "foreign": [datagram(101, session=8), datagram(101, version=2), datagram(101, magic=0)],
        "reflected": [datagram(101, direction=0), datagram(101, direction=255)],
        "duplicate": [datagram(100)],
        "replayed": [datagram(36), datagram(0)],
        "ahead": [datagram(2 << lib.LINK_EPOCH_BITS), datagram(2**64 - 1)],
    }
    for packets in faults.values():
        for packet in packets:
            theirs.send(packet)
        theirs.send(datagram(99))  # behind the newest, and in the window
        assert lib.link_receive(ours.fileno(), inbox) == 1
        assert bytes(inbox.datagram[0])[:SIZE] == datagram(99) and inbox.counter[0] == 99
    for name, packets in faults.items():
        assert getattr(inbox, name) == len(packets), name
    assert inbox.window.newest == 100  # nobody marks what is not authentic
    assert inbox.failures == 0


def test_a_datagram_cut_to_the_largest_size_is_none(wire: tuple[socket.socket, socket.socket]) -> None:
    ours, theirs = wire
    inbox = new_inbox()
    inbox.size = lib.LINK_LARGEST
    whole = datagram(1).ljust(lib.LINK_LARGEST, b"x")
    theirs.send(whole + b"x")
    assert lib.link_receive(ours.fileno(), inbox) == 0 and inbox.oversize == 1
    theirs.send(whole)
    assert lib.link_receive(ours.fileno(), inbox) == 1


def test_a_flood_costs_a_call_no_more_than_its_cap() -> None:
    """Whatever waits, a call takes LINK_TAKE datagrams and keeps the LINK_KEEP newest of them."""
    inbox, tap = new_inbox(), Tap(lib.LINK_TAKE + 100)
    order = list(range(1, lib.LINK_TAKE + 101))
    random.Random(1).shuffle(order)
    with tap as fd:
        for counter in order:
            tap.send(datagram(counter))
        assert lib.link_receive(fd, inbox) == lib.LINK_KEEP
        assert inbox.taken == lib.LINK_TAKE
        kept = sorted(inbox.counter[slot] for slot in range(lib.LINK_KEEP))
        assert kept == sorted(order[: lib.LINK_TAKE])[-lib.LINK_KEEP :]
        assert inbox.shed == lib.LINK_TAKE - lib.LINK_KEEP
        for slot in range(lib.LINK_KEEP):
            assert bytes(inbox.datagram[slot])[:SIZE] == datagram(inbox.counter[slot])
        lib.link_receive(fd, inbox)
        assert inbox.taken == lib.LINK_TAKE + 100


class Tap:
    """A UDP socket on loopback with room for many datagrams."""

    def __init__(self, room: int) -> None:
        self.receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096 * room)
        self.receiver.bind(("127.0.0.1", 0))
        self.sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.sender.connect(self.receiver.getsockname())

    def __enter__(self) -> int:
        return self.receiver.fileno()

    def __exit__(self, *_: object) -> None:
        self.receiver.close()
        self.sender.close()

    def send(self, packet: bytes) -> None:
        self.sender.send(packet)


def test_a_socket_that_fails_ends_the_call_and_is_counted() -> None:
    inbox = new_inbox()
    assert lib.link_receive(-1, inbox) == 0
    assert 0 < inbox.failures <= lib.LINK_TAKE
    assert inbox.error != 0
