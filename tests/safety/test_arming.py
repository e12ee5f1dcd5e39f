"""A press arms, a level never does."""

import pytest
from hapticd.safety import DeadMan, refusals

READY = {
    "operational": True,
    "faults": 0,
    "latched": False,
    "e_stop": False,
    "sto": False,
    "permitted": True,
    "sensors_valid": True,
    "field_clear": True,
    "recorded": True,
    "inside_limits": True,
}


def test_a_switch_that_is_held_from_the_start_is_no_press() -> None:
    switch = DeadMan()
    assert [switch.pressed_anew(p) for p in (True, True, False, True, True, False, False, True)] == [
        False, False, False, True, False, False, False, True,
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"operational": False}, "answer"),
        ({"faults": 2}, "2 devices"),
        ({"latched": True}, "latched"),
        ({"e_stop": True}, "emergency"),
        ({"sto": True}, "PLC"),
        ({"permitted": False}, "commanded"),
        ({"sensors_valid": False}, "force-torque"),
        ({"field_clear": False}, "scanned field"),
        ({"recorded": False}, "recorder"),
        ({"inside_limits": False}, "outside"),
    ],
)
def test_every_missing_condition_refuses_and_says_so(change: dict[str, object], word: str) -> None:
    assert refusals(**READY) == []
    (found,) = refusals(**(READY | change))
    assert word in found


def test_all_refusals_are_named_at_once() -> None:
    nothing = dict.fromkeys(READY, False) | {"faults": 1, "latched": True, "e_stop": True, "sto": True}
    assert len(refusals(**nothing)) == 10
