"""Keys of a direction."""

from hapticd.link.ratchet import Ratchet, roots
from hapticd.link.sealing import Sealing

from .test_sealing import sealed

SECRETS = bytes(range(64))


def seal(keys: Sealing | None) -> bytes:
    assert keys is not None
    return sealed(keys, bytes(20), b"word")


def test_both_ends_have_the_same_keys_and_each_epoch_has_its_own() -> None:
    ours, theirs = Ratchet(bytes(32)), Ratchet(bytes(32))
    found = set()
    for epoch in range(20):
        ours.reached(epoch)
        assert seal(ours.at(epoch)) == seal(theirs.at(epoch))
        theirs.reached(epoch)
        found.add(seal(ours.at(epoch)))
    assert len(found) == 20


def test_keys_of_the_epoch_its_neighbours_and_no_other_are_there() -> None:
    ratchet = Ratchet(bytes(32))
    first = seal(ratchet.at(0))
    for epoch in range(1, 5):
        ratchet.reached(epoch)
    assert [epoch for epoch in range(-3, 10) if ratchet.at(epoch)] == [3, 4, 5]
    fresh = Ratchet(bytes(32))
    assert [epoch for epoch in range(-3, 10) if fresh.at(epoch)] == [0, 1]
    assert seal(fresh.at(0)) == first


def test_only_the_next_epoch_is_reached() -> None:
    ratchet = Ratchet(bytes(32))
    for epoch in (0, 2, 7, -1):
        ratchet.reached(epoch)
    assert ratchet.at(0) and not ratchet.at(2)


def test_roots_depend_on_all_that_they_are_made_of_and_differ_by_direction() -> None:
    made = roots(SECRETS, b"session1", b"names")
    others = [
        roots(SECRETS[::-1], b"session1", b"names"),
        roots(SECRETS, b"session2", b"names"),
        roots(SECRETS, b"session1", b"Names"),
    ]
    found = {root for each in (made, *others) for root in each}
    assert len(found) == 8 and {len(root) for root in found} == {32}
