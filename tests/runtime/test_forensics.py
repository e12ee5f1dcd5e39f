"""Late ticks are told from punctual ones, and their cause is found."""

import time

import msgspec
import pytest
from hapticd.runtime.core.stages import Stage, Stages
from hapticd.runtime.timing.forensics import Forensics, LateTick, cause
from hapticd.runtime.timing.watch import Watch

PERIOD_NS = 1_000_000


def tick(stages: Stages, slow: Stage | None = None, seconds: float = 2e-3) -> None:
    stages.begin()
    for stage in Stage:
        if stage is slow:
            time.sleep(seconds)
        stages.mark(stage)


def look(
    lateness_ns: int = 1000, skipped: int = 0, waited: int = 0, slow: Stage | None = None
) -> LateTick | None:
    stages, watch = Stages(), Watch()
    forensics = Forensics(PERIOD_NS)
    tick(stages, slow)
    return forensics.look(7, skipped, waited, lateness_ns, stages, watch)


def test_a_punctual_tick_is_not_worth_a_word() -> None:
    assert look() is None
    assert look(lateness_ns=200_000) is None


@pytest.mark.parametrize("late", [{"lateness_ns": 300_000}, {"skipped": 1}, {"slow": Stage.SOLVE}])
def test_late_skipped_and_overlong_ticks_are_looked_at(late: dict[str, int]) -> None:
    found = look(**late)  # type: ignore[arg-type]
    assert found is not None and found.tick == 7 and found.cause


def test_a_slow_stage_is_named() -> None:
    found = look(slow=Stage.ASSEMBLE)
    assert found is not None
    assert found.cause.startswith("stage assemble")
    assert found.stages_us["assemble"] > 1900
    assert found.stages_us["solve"] < 1900


def test_the_callback_that_ran_before_it_is_named() -> None:
    stages, watch = Stages(), Watch()
    forensics = Forensics(PERIOD_NS)

    def blocking() -> None:
        time.sleep(2e-3)

    watch.time(blocking)
    tick(stages)
    found = forensics.look(3, 1, 0, 900_000, stages, watch)
    assert found is not None
    assert found.cause.startswith("runtime/test_forensics.py:") and "blocking" in found.cause
    assert found.callbacks[0][1] > 1900
    tick(stages)
    assert forensics.look(4, 0, 0, 0, stages, watch) is None


def test_page_faults_are_counted_from_tick_to_tick() -> None:
    stages, watch = Stages(), Watch()
    forensics = Forensics(PERIOD_NS)
    pages = bytearray(64 << 20)
    pages[::4096] = b"x" * len(pages[::4096])
    tick(stages)
    found = forensics.look(1, 1, 0, 0, stages, watch)
    assert found is not None and found.minor_faults > 100


BASE = LateTick(
    tick=1,
    skipped=2,
    waited=0,
    lateness_us=100.0,
    compute_us=150.0,
    stages_us={"solve": 100.0, "send": 20.0},
    callbacks=[],
    minor_faults=0,
    major_faults=0,
    preempted=0,
    stolen_us=0.0,
    cause="",
)


@pytest.mark.parametrize(
    ("seen", "expected"),
    [
        ({"waited": 2}, "the simulated plant had not answered"),
        ({"callbacks": [("a.py:1 f", 300.0), ("b.py:2 g", 1500.0)], "preempted": 1}, "b.py:2 g"),
        ({"callbacks": [("a.py:1 f", 30.0)], "major_faults": 2}, "pages had to be read from disk"),
        ({"stages_us": {"solve": 900.0}, "stolen_us": 10.0}, "stage solve"),
        ({"stages_us": {"send": 900.0}, "preempted": 3}, "stage send, preempted by another process"),
        ({"stolen_us": 1e4, "preempted": 1}, "the hypervisor took the processor away"),
        ({"preempted": 1}, "another process had the processor"),
        ({}, "the kernel woke it late"),
        ({"skipped": 0, "compute_us": 950.0}, "its own work"),
    ],
)
def test_causes(seen: dict[str, object], expected: str) -> None:
    assert cause(msgspec.structs.replace(BASE, **seen), 1000.0) == expected
