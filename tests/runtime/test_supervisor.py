"""A safety operator with a dead-man switch of their own, the key that overrides the one at the handle, and
the field that the scanner watches (giant III-D)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from random import Random

import pytest
from hapticd.configs import read_text
from hapticd.runtime.configuration.config import ConfigError, load, parse
from hapticd.runtime.configuration.session import build
from hapticd.runtime.core.modes import Command, Mode
from hapticd.sim.person import Deed, Switch

from .conftest import MACHINES, Bench, loaded

SUPERVISED = ('by = "dead-man"', 'by = "supervisor"')
ALONE = ('dead_man = [{ at = "0.3 s", pressed = true }]', "dead_man = []")
GENTLE = ('force = "40 N"', 'force = "0.5 N"')
"""A hand that nobody would call a pull."""
DETECTED = 2
"""Ticks from a switch that opens to the latch (docs/fault-matrix.md, row 14)."""


@pytest.fixture(params=MACHINES)
def bench(request: pytest.FixtureRequest) -> Bench:
    """Ready and at rest; nobody holds anything."""
    bench = Bench(SUPERVISED, ALONE, machine=request.param)
    bench.until(Mode.READY)
    bench.run(110)
    return bench


def overriding(bench: Bench) -> Bench:
    """Enabled by the safety operator's press alone, while nobody is in the field."""
    bench.plc.turn(Switch.OVERRIDE, True)
    bench.run(5)
    bench.plc.turn(Switch.SUPERVISOR, True)
    bench.until(Mode.ENGAGING)
    return bench


def test_a_press_starts_only_while_the_safety_operator_watches(bench: Bench) -> None:
    bench.press(True)
    bench.run(5)
    assert bench.mode is Mode.READY
    assert "the safety operator's dead-man switch is open" in bench.said[-1]
    bench.plc.turn(Switch.SUPERVISOR, True)  # the switch at the handle was closed before: no press
    bench.run(50)
    assert bench.mode is Mode.READY
    bench.press(False)
    bench.run(5)
    bench.press(True)
    bench.until(Mode.ENGAGING)


def test_who_holds_the_handle_may_stand_in_the_field(bench: Bench) -> None:
    bench.plc.scanner_clear = False
    bench.plc.turn(Switch.SUPERVISOR, True)
    bench.run(5)
    bench.press(True)
    bench.until(Mode.ENGAGING)
    bench.run(100)
    assert bench.mode is Mode.ENGAGING


def test_when_the_safety_operator_lets_go_it_stops_and_wants_a_new_press(bench: Bench) -> None:
    bench.plc.turn(Switch.SUPERVISOR, True)
    bench.run(5)
    bench.press(True)
    bench.until(Mode.ENGAGING)
    bench.run(50)
    bench.plc.supervisor = (True, False)
    bench.run(DETECTED)
    assert bench.reason == "supervisor"
    bench.until(Mode.STOPPED)
    bench.plc.supervisor = (True, True)
    bench.run(200, Command.RESET)
    assert bench.mode is Mode.STOPPED  # the switch at the handle is still held
    bench.press(False)
    bench.run(200, Command.RESET)
    bench.until(Mode.READY)
    bench.run(110)
    assert bench.mode is Mode.READY


OPENED: dict[str, tuple[Callable[[Bench], object], str]] = {
    "somebody enters the field": (lambda b: setattr(b.plc, "scanner_clear", False), "scanner"),
    "the safety operator lets go": (lambda b: b.plc.turn(Switch.SUPERVISOR, False), "supervisor"),
    "the key is turned back": (lambda b: b.plc.turn(Switch.OVERRIDE, False), "dead_man"),
    "one channel of the key": (lambda b: setattr(b.plc, "override", (False, True)), "dead_man"),
    "the controller falls silent": (lambda b: setattr(b.plc, "silent", True), "device_silent"),
}


@pytest.mark.parametrize("what", OPENED)
def test_under_the_override_the_scanner_stops(bench: Bench, what: str) -> None:
    happens, reason = OPENED[what]
    overriding(bench).run(50)
    happens(bench)
    bench.run(6 if reason == "device_silent" else DETECTED)
    assert bench.reason == reason
    bench.until(Mode.STOPPED, Mode.HOLDING, limit=600)


def test_a_machine_that_is_led_from_elsewhere_always_asks_the_scanner() -> None:
    bench = Bench(ALONE, ('by = "dead-man"', 'by = "dead-man"\nscanner = "always"'), machine="rhi")
    bench.until(Mode.READY)
    bench.run(110)
    bench.plc.scanner_clear = False
    bench.press(True)
    bench.run(20)
    assert bench.mode is Mode.READY
    bench.press(False)
    bench.plc.scanner_clear = True
    bench.run(20)
    bench.press(True)
    bench.until(Mode.ENGAGING)
    bench.plc.scanner_clear = False
    bench.run(DETECTED)
    assert bench.reason == "scanner"


def test_the_avatar_is_such_a_machine() -> None:
    assert load("avatar").config.arming.scanner == "always"


def test_with_somebody_in_the_field_the_override_starts_nothing(bench: Bench) -> None:
    bench.plc.scanner_clear = False
    bench.plc.turn(Switch.OVERRIDE, True)
    bench.run(5)
    bench.plc.turn(Switch.SUPERVISOR, True)
    bench.run(50)
    assert bench.mode is Mode.READY
    assert "somebody stands in the scanned field" in bench.said[-1]


def test_the_override_is_not_asked_where_no_safety_operator_is() -> None:
    bench = Bench(ALONE, machine="rhi")
    bench.until(Mode.READY)
    bench.run(110)
    bench.plc.turn(Switch.OVERRIDE, True)
    bench.plc.turn(Switch.SUPERVISOR, True)
    bench.run(50)
    assert bench.mode is Mode.READY
    bench.press(True)
    bench.until(Mode.ENGAGING)
    bench.run(20)
    bench.press(False)
    bench.run(DETECTED)
    assert bench.reason == "dead_man"


@pytest.mark.parametrize("seed", range(4))
def test_whatever_people_do_power_stands_only_while_they_consent(seed: int) -> None:
    """Switches, key and field at random; torque outlives the consent by detection and ramp at most."""
    rng = Random(seed)
    bench = Bench(SUPERVISED, ALONE, GENTLE, machine="rhi")
    plc, most, without, starts = bench.plc, bench.cycle.stops.ramp_limit, 0, 0

    def run(ticks: int, command: Command = Command.NONE) -> None:
        nonlocal without
        for tick in range(ticks):
            bench.run(1, command if tick == 0 else Command.NONE)
            hand = plc.scanner_clear if all(plc.override) else all(plc.dead_man)
            consent = all(plc.supervisor) and hand
            without = 0 if consent or bench.plant.safe else without + 1
            assert without <= most + DETECTED + 10, (seed, bench.said[-3:])

    run(1000)
    for _ in range(6):
        for switch in Switch:
            plc.turn(switch, False)
        plc.scanner_clear = True
        run(500, Command.RESET)
        order = [Switch.SUPERVISOR, rng.choice((Switch.OVERRIDE, Switch.DEAD_MAN)), rng.choice(list(Switch))]
        rng.shuffle(order)
        for switch in order:
            plc.turn(switch, True)
            run(rng.choice((2, 5, 40)))
        run(60)
        starts += bench.mode is Mode.ENGAGING
        for _ in range(rng.randrange(1, 4)):
            if rng.random() < 0.5:
                plc.scanner_clear = not plc.scanner_clear
            else:
                setattr(plc, rng.choice(list(Switch)).value, (rng.random() < 0.5, rng.random() < 0.5))
            run(rng.choice((1, 3, 250)))
        run(rng.choice((5, 300)), rng.choice((Command.NONE, Command.RESET)))
    assert starts


def test_a_person_at_the_keyboard_can_do_all_of_it(bench: Bench) -> None:
    for deed in (Deed.OVERRIDE, Deed.SUPERVISE):
        bench.plant.obey(deed)
        bench.run(5)
    bench.until(Mode.ENGAGING)
    bench.plant.obey(Deed.ENTER_FIELD)
    bench.run(DETECTED)
    assert bench.reason == "scanner"
    bench.until(Mode.STOPPED)
    for deed in (Deed.LEAVE_FIELD, Deed.LOOK_AWAY, Deed.ASK_FOR_A_HAND):
        bench.plant.obey(deed)
    bench.run(5)
    bench.run(200, Command.RESET)
    assert bench.mode is Mode.READY
    bench.plant.obey(Deed.SUPERVISE)
    bench.run(110)
    bench.plant.obey(Deed.PRESS)
    bench.until(Mode.ENGAGING)


def test_a_script_presses_for_the_safety_operator() -> None:
    script = ("seed = 1\n", 'seed = 1\nsupervisor = [{ at = "0.2 s", pressed = true }]\n')
    bench = Bench(SUPERVISED, script, machine="rhi")
    bench.until(Mode.ENGAGING)


def test_a_switch_that_nobody_asks_is_refused() -> None:
    script = ("seed = 1\n", 'seed = 1\nsupervisor = [{ at = "0.2 s", pressed = true }]\n')
    with pytest.raises(ConfigError, match="nobody asks the safety operator's dead-man switch"):
        build(loaded(script, machine="rhi"))


def test_a_real_bus_may_have_a_safety_operator_instead_of_a_command() -> None:
    text = read_text("rhi.toml").replace('kind = "simulated"', 'kind = "socketcan"\ninterface = "can0"')
    assert "a real machine must not arm by itself" in refused(text)
    assert "arming.by" not in refused(text.replace(*SUPERVISED))


def refused(text: str) -> str:
    """What is said against a configuration without its simulation."""
    text = text[: text.index("[simulation]")]
    found = replace(loaded(machine="rhi"), config=parse(text, "rhi.toml"), text=text)
    with pytest.raises(ConfigError) as error:
        build(found)
    return str(error.value)
