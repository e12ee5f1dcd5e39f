"""Which silence does what to an arm that follows, and what only a person may undo."""

from __future__ import annotations

from math import nan

import pytest
from hapticd.control.lease import ENDS_S, FRESH_S, TOLD_S, Fader, Granted, Lease, Standing

NEVER, DT = 6.5, 1e-3


def led(delay: float = 0.0) -> Lease:
    lease = Lease(delay, DT)
    assert lease.update(delay, True, True, 1)
    return lease


def test_nobody_who_has_not_acted_leads() -> None:
    lease = Lease(0.0, DT)
    assert not lease.update(NEVER, True, False, 0)
    assert not lease.update(0.0, True, True, 0)
    assert lease.standing is Standing.IDLE
    assert lease.update(0.0, True, True, 1)


@pytest.mark.parametrize("delay", [0.0, 0.16])
def test_what_is_older_than_declared_moves_nothing_and_comes_back_by_itself_within_the_lease(
    delay: float,
) -> None:
    lease = led(delay)
    assert lease.update(delay + 0.99 * FRESH_S, True, True, 1)
    assert not lease.update(delay + 1.01 * FRESH_S, True, True, 1)
    assert lease.standing is Standing.WAITS
    lease.update(delay + 1.01 * TOLD_S, True, True, 1)
    assert lease.standing is Standing.SILENT
    lease.update(delay + 0.99 * ENDS_S, True, True, 1)
    assert lease.update(delay, True, True, 1)


def test_after_two_seconds_only_a_new_act_leads() -> None:
    lease = led()
    lease.update(1.01 * ENDS_S, True, True, 1)
    assert lease.standing is Standing.ENDED
    assert not lease.update(0.0, True, True, 1)
    assert not lease.update(NEVER, True, True, 1)
    assert lease.update(0.0, True, True, 2)


def test_an_arm_that_stopped_itself_needs_a_new_act() -> None:
    lease = led()
    lease.bar()
    assert not lease.update(0.0, True, True, 1)
    assert lease.standing is Standing.BARRED
    lease.update(NEVER, True, True, 1)
    assert not lease.update(0.0, True, True, 1)
    assert lease.update(0.0, True, True, 2)


def test_an_operator_who_does_not_lead_keeps_the_lease() -> None:
    lease = led()
    assert not lease.update(0.0, True, False, 1)
    assert lease.standing is Standing.RESTS
    assert lease.update(0.0, True, True, 1)


@pytest.mark.parametrize(("age", "valid"), [(nan, True), (-1.0, True), (0.0, False)])
def test_what_makes_no_sense_was_not_heard(age: float, valid: bool) -> None:
    assert not led().update(age, valid, True, 1)


@pytest.mark.parametrize(("age", "valid"), [(nan, True), (-1.0, True), (0.0, False)])
def test_nonsense_that_keeps_coming_ends_the_lease_after_two_seconds(age: float, valid: bool) -> None:
    lease = led()
    for _ in range(round(0.98 * ENDS_S / DT)):
        lease.update(age, valid, True, 1)
    assert lease.standing is Standing.SILENT and lease.useless == round(0.98 * ENDS_S / DT)
    again = led()
    for _ in range(round(1.5 * ENDS_S / DT)):
        again.update(age, valid, True, 1)
        again.update(0.0, True, True, 1)  # every other word makes sense
    assert again.follows
    for _ in range(round(0.04 * ENDS_S / DT)):
        lease.update(age, valid, True, 1)
    assert lease.standing is Standing.ENDED
    assert not lease.update(0.0, True, True, 1)
    assert lease.update(0.0, True, True, 2)


def test_an_act_before_the_operator_knew_of_the_stop_starts_nothing() -> None:
    lease = led()
    lease.bar(told=False)
    for act in (1, 2, 3):  # under way when the arm stopped
        assert not lease.update(0.0, True, True, act, False)
    assert not lease.update(0.0, True, True, 3, True) and lease.standing is Standing.BARRED
    assert not lease.update(0.0, True, True, 3, True)
    assert lease.update(0.0, True, True, 4, False)


def test_a_share_falls_in_its_time_whatever_it_rose_to() -> None:
    fader = Fader(3.0, 50e-3, 1e-3)
    for _ in range(3000):
        fader.update(True)
    assert fader.share == pytest.approx(1.0)
    shares = [fader.update(False) for _ in range(51)]
    assert shares[-1] == 0.0 and shares[24] == pytest.approx(0.5)


def test_energy_counts_from_the_first_word_and_goes_on_where_the_other_side_begins_anew() -> None:
    granted = Granted()
    assert [granted.update(sent) for sent in (5.0, 5.5, 5.5, 0.2, 0.3)] == pytest.approx(
        [0.0, 0.5, 0.5, 0.5, 0.6]
    )
    granted.begin()
    assert granted.update(7.0) == 0.0
