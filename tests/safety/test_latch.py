"""Stops latch, the strongest stands, and only a person at rest and with open hand resets them."""

from hapticd.safety import PASS, Reaction, StopLatch, Verdict, describe

HOLD = Verdict(Reaction.HOLD, "overrun", "3 ticks skipped")
RAMP = Verdict(Reaction.RAMP, "dead_man", "the dead-man switch is open")


def test_the_strongest_stop_stands_with_the_tick_it_tripped_at() -> None:
    latch = StopLatch()
    assert latch.reaction is Reaction.PASS
    assert not latch.take(Verdict(Reaction.SANITISE, "x", "y"), 1)
    assert latch.take(HOLD, 2)
    assert not latch.take(Verdict(Reaction.HOLD, "later", "z"), 3)
    assert latch.take(RAMP, 4)
    assert not latch.take(HOLD, 5)
    assert latch.trip is not None
    assert (latch.trip.verdict, latch.trip.tick) == (RAMP, 4)
    assert describe(latch.trip) == "R3 dead_man at tick 4: the dead-man switch is open"


def test_a_reset_needs_rest_the_cause_gone_and_the_dead_man_released() -> None:
    latch = StopLatch()
    assert latch.reset(PASS, dead_man=False, at_rest=True) == ""
    latch.take(RAMP, 1)
    assert "not at rest" in latch.reset(PASS, dead_man=False, at_rest=False)
    assert "the cause is still there: 3 ticks" in latch.reset(HOLD, dead_man=False, at_rest=True)
    assert "release" in latch.reset(PASS, dead_man=True, at_rest=True)
    assert latch.reaction is Reaction.RAMP
    assert latch.reset(PASS, dead_man=False, at_rest=True) == ""
    assert latch.trip is None
    assert describe(latch.trip) == "no stop"


def test_reactions_carry_the_codes_of_the_manual() -> None:
    assert [r.code for r in Reaction] == ["-", "R0", "R1", "R2", "R3", "R4"]
    assert [r for r in Reaction if r.stops] == [Reaction.HOLD, Reaction.RAMP, Reaction.OFF]
