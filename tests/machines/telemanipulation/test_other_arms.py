"""Nothing asks the arms of both stations to be alike: arms of six joints lead Pandas, and follow them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hapticd.configs import read_text
from hapticd.machines.telemanipulation.pair_run import pair_run
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.config import Loaded
from hapticd.runtime.recording.log import open_log
from hapticd.runtime.recording.replay import replay as replayed
from hapticd.sim.network_model import Conditions, NetworkModel

from .pairs import Both, still
from .six_joints import led_by, six_joints, told, with_values

WAY = np.array([0.05, 0.01, -0.03])
STAYS, ARRIVES, ENDS = 3.8, 4.4, 5.0


def moved(loaded: Loaded) -> Loaded:
    """A station whose hands go a little way, once both lead and follow."""
    loaded = still(loaded)
    simulation = loaded.config.simulation
    first = simulation.hand.path[0]
    there = {
        name: type(value)((np.array(value) + WAY).tolist())
        for name, value in (("position", first.position), ("left", first.left))
    }
    path = [_at(first, time, {}) for time in (0.0, STAYS - 0.2, STAYS - 0.1, STAYS)]
    path += [_at(first, time, there) for time in (ARRIVES, ARRIVES + 0.1, ARRIVES + 0.2, 100.0)]
    hand = msgspec.structs.replace(simulation.hand, path=tuple(path))
    changed = msgspec.structs.replace(simulation, hand=hand)
    return replace(loaded, config=msgspec.structs.replace(loaded.config, simulation=changed))


def _at(first: object, time: float, there: dict[str, object]) -> object:
    return msgspec.structs.replace(first, at=type(first.at)(time), **there)


def stations(six: str) -> tuple[Loaded, Loaded]:
    """Operator and avatar, one of which has six joints an arm; the avatar fades in fast."""
    changed, model = six_joints(six, read_text("bimanual.urdf"))
    if six == "operator":
        operator, avatar = changed, told(config.load("avatar"), config.load("avatar").text, model)
    else:
        operator, avatar = led_by(config.load("operator"), model), changed
    return operator, told(avatar, with_values(avatar.text, "avatar.impedance", {"fade": "0.2 s"}), model)


@pytest.mark.parametrize("six", ["operator", pytest.param("avatar", marks=pytest.mark.slow)])
def test_an_arm_of_six_joints_leads_pandas_or_follows_them_and_both_replay(tmp_path: Path, six: str) -> None:
    operator, avatar = map(moved, stations(six))
    pair = Both(operator, avatar, NetworkModel(Conditions(0.002, 0.001, 0.01), 3))
    assert [machine.arms[0].n for machine in pair.machines] == ([6, 7] if six == "operator" else [7, 6])
    begin = [pair.palms(i)[1] for i in range(2)]
    logs = [tmp_path / f"{name}.mcap" for name in ("operator", "avatar")]
    outcomes, _ = pair_run(pair, [operator, avatar], logs, ENDS, False)
    assert [outcome.status for outcome in outcomes] == [0, 0]
    for i in range(2):
        lead, follow = pair.palms(i)
        assert np.linalg.norm(follow - begin[i] - WAY) < 15e-3 and np.linalg.norm(lead - follow) < 12e-3
    for log in logs:
        found = replayed(open_log(str(log)))
        assert found.ticks > 1e3 * ENDS and found.differing_ticks == 0
    foreseen = [model is not None for model in pair.machines[0]._models]
    assert foreseen == [six == "operator"] * 2


def test_what_is_not_foreseen_is_said() -> None:
    operator, avatar = stations("avatar")
    pair = Both(still(operator), still(avatar), NetworkModel(Conditions(), 1))
    pair.go(0.5)
    said = "operator: left avatar arm: its limits are not foreseen: 6 joints; a Panda has 7"
    assert any(each.startswith(said) for each in pair.said), pair.said
