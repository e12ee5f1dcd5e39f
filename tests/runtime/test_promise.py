"""The last line of a session: what was seen of what is promised, and whether the host kept up."""

from __future__ import annotations

import msgspec
import pytest
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.session import build
from hapticd.runtime.errors import ConfigError
from hapticd.runtime.live.never_active import NeverActive
from hapticd.runtime.live.promise import verdict
from hapticd.runtime.recording.summary import LimitReport, Report, Summary

from .conftest import loaded


def report(machine: str, ticks: int = 30_000, skipped: int = 0, **changes: str) -> Report:
    """A session that touched everything that the machine's configuration promises."""
    found = loaded(machine=machine)
    session = build(found)
    limits = session.system.limits(found.config)
    simulation = found.config.simulation
    assert simulation
    touched = {**simulation.touches, **changes}
    entries = [
        LimitReport(s.name, s.unit, 0.0, 0.0, s.lower, s.upper, touched.get(s.name, ""), 1e-3)
        for s in limits.specs
    ]
    empty = Summary.of(session).report(0)
    return msgspec.structs.replace(
        empty, ticks=ticks, skipped=skipped, limits=entries, modes={"ACTIVE": ticks}
    )


def test_a_whole_walk_on_a_host_that_kept_up(machine: str) -> None:
    found = loaded(machine=machine)
    count = len(found.config.simulation.touches)  # type: ignore[union-attr]
    shown, line = verdict(found, report(machine, skipped=30), lockstep=False)
    assert shown
    assert line == (
        f"verdict: the whole walk of 30 s, {count} of {count} limits touched, none passed;"
        " this host kept up (0.1 % of the ticks skipped)"
    )


def test_a_host_that_is_too_busy_is_told_what_to_do(machine: str) -> None:
    shown, line = verdict(loaded(machine=machine), report(machine, skipped=30_000), lockstep=False)
    assert shown
    assert (
        "this host was too busy, or the session suspended (50 % of the ticks skipped): close other programs"
        in line
    )
    assert line.endswith("or run with --lockstep")


def test_a_limit_that_was_not_met_on_the_whole_walk_is_named(machine: str) -> None:
    found = loaded(machine=machine)
    name, end = next(iter(found.config.simulation.touches.items()))  # type: ignore[union-attr]
    other = {"upper": "lower", "lower": "upper"}[end]
    shown, line = verdict(found, report(machine, **{name: other}), lockstep=True)
    assert not shown
    assert f"(not touched: {name} {end})" in line
    assert verdict(found, report(machine, **{name: "both"}), lockstep=True)[0]


def test_a_walk_that_was_cut_short_promised_nothing(machine: str) -> None:
    found = loaded(machine=machine)
    name = next(iter(found.config.simulation.touches))  # type: ignore[union-attr]
    shown, line = verdict(found, report(machine, ticks=4200, **{name: ""}), lockstep=True)
    assert shown
    assert line.startswith("verdict: 4.2 s of a walk of 30 s")


def test_a_limit_that_was_passed_is_named(machine: str) -> None:
    made = report(machine)
    first = made.limits[0]
    limits = [msgspec.structs.replace(first, excess=6e-3), *made.limits[1:]]
    shown, line = verdict(
        loaded(machine=machine), msgspec.structs.replace(made, limits=limits), lockstep=True
    )
    assert not shown
    assert f"{first.name} passed" in line


def test_limits_near_to_each_other_are_passed_by_less(machine: str) -> None:
    made = report(machine)
    narrow = msgspec.structs.replace(made.limits[0], lower=0.0, upper=0.02, excess=3e-4)
    limits = [narrow, *made.limits[1:]]
    shown, line = verdict(
        loaded(machine=machine), msgspec.structs.replace(made, limits=limits), lockstep=True
    )
    assert not shown and f"{narrow.name} passed" in line


def test_a_limit_that_does_not_exist_cannot_be_promised(machine: str) -> None:
    made = loaded(("[simulation.touches]", '[simulation.touches]\n"joint 9" = "upper"'), machine=machine)
    with pytest.raises(ConfigError, match="the machine has no limit 'joint 9'"):
        build(made)


def test_the_default_configurations_promise_what_their_hands_do() -> None:
    for machine, count in (("giant", 8), ("rhi", 4)):
        simulation = config.load(machine).config.simulation
        assert simulation and len(simulation.touches) == count


def test_a_person_who_led_the_hand_is_not_held_to_the_script(machine: str) -> None:
    found = loaded(machine=machine)
    name, _ = next(iter(found.config.simulation.touches.items()))  # type: ignore[union-attr]
    led = msgspec.structs.replace(report(machine, **{name: ""}), led=True)
    assert verdict(found, led, lockstep=True) == (True, "verdict: a person led the hand, no limit passed")
    beyond = [msgspec.structs.replace(led.limits[0], excess=0.1), *led.limits[1:]]
    passed = verdict(found, msgspec.structs.replace(led, limits=beyond), lockstep=True)
    assert passed == (False, f"verdict: a person led the hand, {led.limits[0].name} passed")


@pytest.mark.parametrize("excused", [True, False])
def test_a_machine_that_never_became_active_showed_nothing(machine: str, excused: bool) -> None:
    waited = msgspec.structs.replace(report(machine, ticks=300), modes={"READY": 300})
    idle = NeverActive("nobody pressed", excused)
    shown, line = verdict(loaded(machine=machine), waited, True, idle)
    assert shown is excused
    assert line == "verdict: the machine never became active: nobody pressed"
