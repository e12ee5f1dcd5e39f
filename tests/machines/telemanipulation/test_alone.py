"""An avatar without an operator's station, led by hands of its own plant."""

from __future__ import annotations

import numpy as np
from hapticd.experiments import hands
from hapticd.experiments.temper import Temper
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.session import build
from hapticd.runtime.live.lockstep import Lockstep, unswept

LED_S = 8.0
"""Both palms have been led about for three seconds by then."""

COPIED = ("q", "position", "goal", "commanded", "error", "wrench", "limits", "torque")
"""Fields of the log that are the arms' own arrays."""


def test_it_follows_the_hands_that_lead_it_and_never_stays_behind_for_want_of_energy() -> None:
    bench = Lockstep(build(config.load("avatar")))
    machine = bench.session.cycle.machine
    state = np.zeros(1, machine.state)
    machine.bind_state(state)
    said: list[str] = []
    with unswept():
        while bench.plant.time < LED_S:
            bench.tick()
            said += [str(event) for event in bench.outputs.events]
    machine.fill()
    for i, arm in enumerate(machine.arms):
        law, row = machine._laws[i], {name: state[0][name][i] for name in COPIED}
        of = {
            **{"q": arm.task.q, "position": arm.task.palm.position, "wrench": arm.force.wrench},
            **{"goal": law.goal, "commanded": law.commanded, "error": law.error},
            **{"limits": arm.avoidance.torque, "torque": law.torque},
        }
        assert {name: values.tolist() for name, values in row.items()} == {
            name: values.tolist() for name, values in of.items()
        }
    assert not any("stays behind" in text for text in said), said
    assert (np.linalg.norm(state[0]["goal"] - state[0]["commanded"], axis=1) < 1e-3).all()
    assert (np.linalg.norm(state[0]["position"] - state[0]["goal"], axis=1) < 0.05).all()
    assert (state[0]["share"] == 1.0).all()


def test_an_arm_that_halts_at_a_limit_is_still_kept_from_it() -> None:
    """Its hold begins without torque; what presses on the palm would throw the joint out of its range."""
    arm = build(config.load("avatar")).cycle.machine.arms[1]
    upper = np.array(arm.chain.upper)
    arm.task.q[:] = arm.chain.home
    arm.task.q[5] = upper[5] - 0.005
    arm.task.qd[:] = 0.0
    arm.estimate()
    arm.engage()
    arm.move(np.zeros(arm.n), 0.0)
    moved = arm.torque - arm.task.weight
    arm.halt()
    halted = arm.torque - arm.task.weight
    assert moved[5] < -5.0
    np.testing.assert_allclose(halted, moved, atol=1e-9)


def test_an_arm_presses_on_a_wall_no_harder_than_its_wrist_can_bear() -> None:
    """With 12 N m of the wrist's motor cut alone, the other joints turned it 30 mrad over its end."""
    session = hands.session(config.load("avatar"), 76025, 7.0, Temper(50.0, 10.0, 1.5))
    assert not session.stop, session.detail
    assert max(session.excess.values()) <= 0.0
