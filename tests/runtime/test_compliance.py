"""Links of whole machines that something pushes beside the hand at the handle."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest
from hapticd.runtime.core.modes import Mode

from ..machines.giant.own_tables import FED, OWN
from .conftest import Bench

ANCHOR = "[simulation]\n"
PUSH = '[[simulation.pushes]]\nat = "3.6 s"\nseconds = "0.6 s"\nframe = "joint_4"\nforce = "{} N"\n\n'
END = 4200


@dataclass
class Course:
    """What became of a session: places of joints, of the handle, pushes and estimates, a row a tick."""

    bench: Bench
    q: list[np.ndarray] = field(default_factory=list)
    commanded: list[np.ndarray] = field(default_factory=list)
    handle: list[np.ndarray] = field(default_factory=list)
    pushed: list[np.ndarray] = field(default_factory=list)
    external: list[np.ndarray] = field(default_factory=list)
    apart: float = 0.0


def course(machine: str, threshold: float | None, force: str | None) -> Course:
    """A session until the push is over; without a threshold nothing gives way.

    The giant is as its controller believes: what that is wrong by is taken for pushes, too.
    """
    section = "" if threshold is None else f'[compliance]\nthreshold = {threshold}\nrelax = "0.1 s"\n\n'
    own = section + (PUSH.format(force) if force else "")
    as_believed = [(OWN, ""), (FED, "")] if machine == "giant" else []
    bench = Bench((ANCHOR, own + ANCHOR), *as_believed, machine=machine)
    found, control = Course(bench), bench.cycle.machine.force_control
    while bench.tick_index < END:
        bench.run(1)
        arm = bench.plant.arm
        found.q.append(arm.q.copy())
        found.commanded.append(control.q.copy())
        found.handle.append(arm.position.copy())
        found.pushed.append(arm.push.copy())
        if control.compliance:
            found.external.append(control.compliance.external.copy())
        if bench.mode is Mode.ACTIVE:
            found.apart = max(found.apart, float(np.linalg.norm(control.coupling_error[:3])))
    return found


@pytest.fixture(scope="module")
def free() -> Course:
    """A giant that nothing pushes, as it is built in."""
    return course("giant", None, None)


def test_without_a_push_nothing_changes_by_a_bit(free: Course) -> None:
    compliant = course("giant", 0.15, None)
    assert compliant.bench.mode is Mode.ACTIVE
    np.testing.assert_array_equal(compliant.commanded, free.commanded)
    assert np.abs(compliant.external).max() < 2.0
    assert not any("gives way" in said for said in compliant.bench.said)


def test_a_push_on_a_link_is_felt_yielded_to_and_told(free: Course) -> None:
    """On the elbow, as hard as stops a machine that does not give way."""
    compliant, stiff = (course("giant", threshold, "100 -60 0") for threshold in (0.15, None))
    assert stiff.bench.reason == "not_following"
    bench = compliant.bench
    assert bench.mode is Mode.ACTIVE
    (said,) = [said for said in bench.said if "joint_2 gives way" in said]
    assert "that no hand at the handle explains" in said
    pushed, external = np.array(compliant.pushed), np.array(compliant.external)
    at = slice(3850, 4100)  # the push stands
    assert np.abs(pushed[at]).max() > 50.0
    np.testing.assert_allclose(external[at], pushed[at], atol=8.0)
    yielded = np.array(compliant.commanded)[4100] - np.array(free.commanded)[4100]
    assert yielded @ pushed[4100] > 1.0  # it went where it was pushed
    assert compliant.apart < 1e-3  # and took the twin along


def test_a_redundant_arm_gives_way_with_its_elbow_and_keeps_its_handle() -> None:
    stiff, compliant = (course("panda", threshold, "0 100 0") for threshold in (None, 0.05))
    assert compliant.bench.mode is Mode.ACTIVE
    assert any("gives way" in said for said in compliant.bench.said)
    joints, handle = (
        np.array(getattr(compliant, name))[END - 150] - np.array(getattr(stiff, name))[END - 150]
        for name in ("q", "handle")
    )
    assert joints @ compliant.pushed[END - 150] > 0.1  # further than springs and gains yield
    assert np.linalg.norm(handle) < 1e-4
