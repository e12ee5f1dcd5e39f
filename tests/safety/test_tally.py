"""Bad ticks among the last ones, with and without good ones between them."""

import numpy as np
import pytest
from hapticd.safety import Reaction
from hapticd.safety.tally import Rule, Tallies, Tally

IN_A_ROW = Rule(Reaction.HOLD, 3, 3)
OFTEN = Rule(Reaction.RAMP, 6, 100)


def pushed(tally: Tally, ticks: list[int]) -> list[Reaction]:
    return [tally.push(bool(bad)) for bad in ticks]


def test_bad_ticks_in_a_row_count_until_a_good_one() -> None:
    assert pushed(Tally(IN_A_ROW), [1, 1, 0, 1, 1, 1, 1, 0]) == [
        *[Reaction.PASS] * 5,
        *[Reaction.HOLD] * 2,
        Reaction.PASS,
    ]


def test_bad_ticks_within_a_window_count_whatever_lies_between_them() -> None:
    tally = Tally(IN_A_ROW, OFTEN)
    found = pushed(tally, [1, 0, 0, 0] * 6)
    assert found.index(Reaction.RAMP) == 20
    assert tally.count == 6
    assert pushed(tally, [0] * 100)[75:77] == [Reaction.RAMP, Reaction.PASS]


@pytest.mark.parametrize("seed", range(3))
def test_a_tally_counts_what_a_list_would(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ticks = (rng.random(1000) < 0.06).astype(int).tolist()
    tally = Tally(OFTEN)
    for k, found in enumerate(pushed(tally, ticks)):
        assert (found is Reaction.RAMP) == (sum(ticks[max(0, k - 99) : k + 1]) >= 6)


def test_skipped_ticks_are_bad_ones_in_their_places() -> None:
    tally = Tally(OFTEN)
    assert tally.push(False, skipped=5) is Reaction.PASS
    assert tally.count == 5
    assert tally.push(True) is Reaction.RAMP
    assert tally.push(False, skipped=10**9) is Reaction.RAMP
    assert tally.count == 99  # the present tick is good
    tally.clear()
    assert tally.count == 0


def test_of_several_things_the_worst_is_named_with_its_count() -> None:
    tallies = Tallies(("a", "b"), Rule(Reaction.SANITISE, 1, 1), OFTEN)
    assert tallies.push([0, 0]) == (Reaction.PASS, [], "")
    for _ in range(5):
        assert tallies.push([0, 1])[:2] == (Reaction.SANITISE, [1])
    assert tallies.push([1, 0]) == (Reaction.SANITISE, [0], "a: 1 of 100")
    assert tallies.push([0, 1]) == (Reaction.RAMP, [1], "b: 6 of 100")


def test_things_that_were_fine_for_a_whole_window_start_from_nothing() -> None:
    tallies = Tallies(("a", "b"), OFTEN)
    for _ in range(5):
        tallies.push([False, True])
    for _ in range(300):
        assert tallies.push([False, False])[0] is Reaction.PASS
    assert tallies.push([False, True]) == (Reaction.PASS, [0, 1], "a: 0 of 100")
    for _ in range(4):
        assert tallies.push([False, True])[0] is Reaction.PASS
    assert tallies.push([False, True]) == (Reaction.RAMP, [1], "b: 6 of 100")
