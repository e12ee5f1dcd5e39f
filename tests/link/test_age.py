"""How old packets are, with clocks that nobody shares."""

import random
from typing import NamedTuple

import pytest
from hapticd.link._inbox import ffi, lib

MS = 1_000_000
DRIFT = 1 / lib.LINK_DRIFT


class Age(NamedTuple):
    """A `link_age`."""

    likely: int
    most: int
    unheard: int


class Ages:
    """A `link_ages`."""

    def __init__(self) -> None:
        self.c = ffi.new("link_ages *")

    @property
    def jumps(self) -> int:
        return int(self.c.jumps)

    def judge(self, *stamps: int) -> Age | None:
        age = ffi.new("link_age *")
        return Age(age.likely, age.most, age.unheard) if lib.link_judge(self.c, *stamps, age) else None


class Walk:
    """Two stations that send each other stamps over a network of any delays; true time is ours."""

    def __init__(self, seed: int, there: tuple[float, float], back: tuple[float, float]) -> None:
        self.chance = random.Random(seed)
        self.offset = self.chance.randrange(-(10**15), 10**15)
        self.rate = 1.0 + self.chance.uniform(-0.9, 0.9) * DRIFT / 2
        self.there, self.back = there, back

    def theirs(self, now: int) -> int:
        """The other clock, far from ours and at another rate."""
        return 10**16 + self.offset + round(now * self.rate)

    def round(self, now: int) -> tuple[int, int, int, int, int]:
        """Our stamp goes there, waits, comes back: arrival, sent, echo, held, true age."""
        heard = now + round(self.chance.uniform(*self.there) * MS)
        sent = heard + round(self.chance.uniform(0.0, 3.0) * MS)
        age = round(self.chance.uniform(*self.back) * MS)
        return sent + age, self.theirs(sent), now, self.theirs(sent) - self.theirs(heard), age


@pytest.mark.parametrize("seed", range(10))
def test_no_packet_is_older_than_the_most_and_the_likely_age_errs_by_half_the_fastest_way(seed: int) -> None:
    chance = random.Random(100 + seed)
    slow, fast = chance.uniform(1.0, 300.0), chance.uniform(0.1, 1.0)
    walk = Walk(seed, (fast, slow), (fast, slow))
    ages, now = Ages(), 10**12
    for turn in range(2000):
        arrival, sent, echo, held, true = walk.round(now)
        age = ages.judge(arrival, sent, echo, held)
        assert age is not None
        assert age.most >= true - held * DRIFT
        assert 0 <= age.likely <= age.most
        if turn > 1000:  # the fastest ways have come up in both directions
            assert abs(age.likely - true) < (0.1 * (slow - fast) + 0.6) * MS
        now = arrival
    assert ages.jumps == 0


def test_a_way_that_becomes_slower_on_one_side_is_told_from_the_other() -> None:
    walk = Walk(1, (1.0, 1.2), (1.0, 1.2))
    ages, now = Ages(), 10**12
    for _ in range(50):
        now, *stamps, _ = walk.round(now)
        ages.judge(now, *stamps)
    walk.back = (200.0, 200.0)
    arrival, *stamps, true = walk.round(now)
    age = ages.judge(arrival, *stamps)
    assert age is not None and abs(age.likely - true) < 2 * MS
    walk.there, walk.back = (200.0, 200.0), (1.0, 1.0)
    arrival, *stamps, true = walk.round(arrival)
    age = ages.judge(arrival, *stamps)
    assert age is not None and age.likely < 3 * MS and age.most > 200 * MS


def test_a_clock_that_jumps_costs_one_estimate_and_no_more() -> None:
    for jump in (3600 * 10**9, -3600 * 10**9):
        walk = Walk(2, (5.0, 5.0), (5.0, 5.0))
        ages, now = Ages(), 10**12
        for turn in range(20):
            if turn == 10:
                walk.offset += jump
            now, *stamps, true = walk.round(now)
            age = ages.judge(now, *stamps)
            assert age is not None and abs(age.likely - true) < MS
        assert ages.jumps == 1


def test_what_no_honest_station_stamps_has_no_age() -> None:
    ages = Ages()
    assert ages.judge(10**9, 5, 0, 0) is None  # has heard nothing of us
    assert ages.judge(10**9, 5, 10**9 + 1, 0) is None  # heard a stamp of our future
    assert ages.judge(10**9, 5, 10**9 - 5, 6) is None  # before we sent it
    assert ages.judge(10**9, 2**64 - 1, 1, 2**32 - 1) is None
    assert ages.judge(10**10, 2**64 - 1, 1, 2**32 - 1) is not None


@pytest.mark.parametrize("seed", range(4))
def test_whatever_is_stamped_no_age_is_negative_or_above_the_round_trip(seed: int) -> None:
    """Also where clocks are about to begin anew, and where nothing of it is true."""
    chance = random.Random(seed)
    ages, now = Ages(), 10**12
    edges = [0, 2**63, 2**64 - 1, now]
    for _ in range(3000):
        now += chance.randrange(1, 10 * MS)
        echo, held = now - chance.randrange(1000 * MS), chance.randrange(100 * MS)
        sent = (chance.choice(edges) + chance.randrange(-1000 * MS, 1000 * MS)) % 2**64
        age = ages.judge(now, sent, echo, held)
        assert (age is None) == (now - echo < held)
        assert age is None or (0 <= age.likely <= age.most == now - echo - held and age.unheard == held)
    assert ages.jumps > 1000
