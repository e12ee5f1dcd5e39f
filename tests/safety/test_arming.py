"""A press arms, a level never does."""

import pytest
from hapticd.safety import DeadMan, Permission, refusals

READY = {
    "operational": True,
    "faults": 0,
    "unfit": "",
    "latched": False,
    "resetting": False,
    "e_stop": False,
    "sto": False,
    "permitted": True,
    "sensors_valid": True,
    "supervised": True,
    "guarded": False,
    "field_clear": True,
    "recorded": True,
    "inside_limits": True,
    "at_rest": True,
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
        ({"unfit": "joint_2 reports fault"}, "joint_2 reports fault"),
        ({"latched": True}, "latched"),
        ({"resetting": True}, "a reset is under way"),
        ({"e_stop": True}, "emergency"),
        ({"sto": True}, "PLC"),
        ({"permitted": False}, "commanded"),
        ({"sensors_valid": False}, "force-torque"),
        ({"supervised": False}, "safety operator"),
        ({"field_clear": False, "guarded": True}, "scanned field"),
        ({"recorded": False}, "recorder"),
        ({"inside_limits": False}, "outside"),
        ({"at_rest": False}, "moves"),
    ],
)
def test_every_missing_condition_refuses_and_says_so(change: dict[str, object], word: str) -> None:
    assert refusals(**READY) == []
    (found,) = refusals(**(READY | change))
    assert word in found


def test_all_refusals_are_named_at_once() -> None:
    nothing = dict.fromkeys(READY, False) | {"faults": 1, "latched": True, "e_stop": True, "sto": True}
    assert len(refusals(**nothing | {"unfit": "a drive", "guarded": True})) == 13


def test_a_permission_is_given_by_command_revoked_and_expires() -> None:
    permission = Permission(needed=True, lifetime=2)
    assert not permission.given and not permission.revoke() and not permission.expired()
    permission.give()
    assert permission.given and permission.revoke() and not permission.given
    permission.give()
    assert [permission.expired() for _ in range(4)] == [False, False, True, False]
    assert not permission.given
    permission.give()
    permission.expired()
    permission.give()  # its time begins anew
    assert [permission.expired() for _ in range(3)] == [False, False, True]


def test_a_permission_that_nobody_must_give_always_stands() -> None:
    permission = Permission(needed=False, lifetime=1)
    assert not any(permission.expired() for _ in range(5))
    assert not permission.revoke()
    assert permission.given
