"""What happens is a code with values; its English comes from one catalogue, where somebody reads it."""

from __future__ import annotations

import ast
import re
import string
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest
from hapticd.runtime.core.events import Event, EventKind, Severity
from hapticd.runtime.core.modes import Command, Mode
from hapticd.safety import Reaction, Trip, Verdict

from .conftest import Bench

ROOT = Path(__file__).parents[2]
STOP = Trip(Verdict(Reaction.RAMP, "dead_man", "the dead-man switch is open"), 4)


def named(kind: EventKind) -> set[str]:
    """The values that the English of a kind names."""
    return {name for _, name, _, _ in string.Formatter().parse(kind.words) if name}


def made() -> Iterator[tuple[str, set[str]]]:
    """Kind and values of every event that the runtime makes."""
    for path in (ROOT / "runtime").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Call) and ast.unparse(node.func).startswith("EventKind."):
                assert not node.args, f"{path}:{node.lineno}"
                yield ast.unparse(node.func).partition(".")[2], {str(word.arg) for word in node.keywords}


def test_every_event_is_made_with_the_values_that_its_english_names() -> None:
    stops = {EventKind.TRIPPED.name, EventKind.ENDING.name}  # those of a trip
    kinds = dict(made())
    assert stops | set(kinds) == {kind.name for kind in EventKind}
    for name, values in made():
        assert values == named(EventKind[name]), name


@pytest.mark.parametrize("kind", [EventKind.TRIPPED, EventKind.ENDING])
def test_a_stop_reads_as_its_trip_does(kind: EventKind) -> None:
    event = kind(mode="STOPPING", **STOP.values)
    assert str(event) == "STOPPING: R3 dead_man at tick 4: the dead-man switch is open"
    assert event.values["reason"] == STOP.verdict.reason


def test_codes_are_names_that_stay() -> None:
    codes = [kind.code for kind in EventKind]
    assert len(set(codes)) == len(codes)
    assert all(re.fullmatch(r"[a-z]+(_[a-z]+)*", code) for code in codes)


def test_an_event_reads_the_same_on_the_other_side_of_the_ring() -> None:
    event = EventKind.NOT_STARTED(why=["the machine moves", "a stop is latched; reset it first"])
    assert str(event) == "not started: the machine moves; a stop is latched; reset it first"
    assert str(EventKind.BUS_LOSSES(losses=["3 unsent", "1 stale"])) == "bus: 3 unsent, 1 stale"
    copy = msgspec.json.decode(msgspec.json.encode(event), type=Event)
    assert copy == event and str(copy) == str(event)
    assert copy.severity is Severity.REFUSAL


def test_the_document_lists_every_event_as_people_read_it() -> None:
    section = (ROOT / "docs" / "errors.md").read_text().partition("\n## Events\n")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| `(\w+)` \| (\w+) \| (.+) \|$", section, re.MULTILINE)
    assert rows == [(kind.code, kind.severity.value, reading(kind)) for kind in EventKind]
    meanings = re.findall(r"^\* `(\w+)`: ", section, re.MULTILINE)
    assert meanings == list(Severity)


def reading(kind: EventKind) -> str:
    """The English of a kind, with its values as capital letters."""
    return re.sub(r"\{(\w+)[^}]*\}", lambda value: value[1].upper(), kind.words)


def test_ticks_put_nothing_into_words(engaging: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(Event, "__str__", lambda _: pytest.fail("words in a tick"))
        engaging.run(1, Command.STOP)
        engaging.until(Mode.STOPPED)
    assert [event.code for event in engaging.events[-2:]] == ["tripped", "switched_off"]
    stop = engaging.events[-2]
    assert stop.severity is Severity.STOP
    assert (stop.values["mode"], stop.values["reaction"], stop.values["reason"]) == (
        "STOPPING", "R3", "operator",
    )  # fmt: skip


def test_the_end_of_a_session_is_not_told_as_a_stop_by_safety(engaging: Bench) -> None:
    engaging.run(1, Command.END)
    (event,) = (event for event in engaging.events if event.values.get("reason") == "end")
    assert (event.code, event.severity) == ("ending", Severity.NOTE)
