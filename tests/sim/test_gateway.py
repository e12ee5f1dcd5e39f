"""Gateways of two stations: what one is told the other reports, with its age, and nothing without sense."""

from __future__ import annotations

from math import nan

import numpy as np
import pytest
from hapticd.devices.cia301 import AlState
from hapticd.devices.network import Network
from hapticd.devices.remote_avatar import RemoteAvatar
from hapticd.devices.remote_operator import RemoteOperator
from hapticd.sim.gateway import AVATAR_SAYS, NEVER, OPERATOR_SAYS, Exchange, SimGateway
from hapticd.sim.network_model import Conditions, NetworkModel
from hapticd.sim.nodes import SimNodes

DT = 1e-3


class Two:
    """Two stations of two arms each."""

    def __init__(self) -> None:
        self.network = NetworkModel(Conditions(0.003), 1)
        self.nodes, self.ends = [], []
        for kind, port in zip((RemoteAvatar, RemoteOperator), self.network.ports, strict=True):
            nodes = SimNodes(Network([kind(name=f"arm_{i}", node=i + 1) for i in range(2)])).of(SimGateway)
            for node in nodes:
                node.al_state = AlState.OP
            end = Exchange(nodes)
            end.port = port
            self.nodes.append(nodes)
            self.ends.append(end)

    def step(self, count: int = 1) -> None:
        for _ in range(count):
            for end in self.ends:
                end.step(DT)
            self.network.advance(DT)


def test_what_one_is_told_the_other_reports_with_its_age() -> None:
    two = Two()
    rng = np.random.default_rng(1)
    pose, wrench = rng.normal(size=7).astype("f4"), rng.normal(size=6).astype("f4")
    (leads, _), (follows, other) = two.nodes
    leads.fields["pose"][:], leads.fields["own_flags"][:] = pose, 0x0305
    follows.fields["wrench"][:], follows.fields["own_energy"][:] = wrench, 2.5
    assert follows.age == NEVER
    two.step(5)
    assert (follows.fields["pose"] == pose).all() and follows.flags == 0x0305
    assert (leads.fields["wrench"] == wrench).all() and leads.energy == 2.5
    assert not other.fields["pose"].any()
    assert follows.age == pytest.approx(0.003, abs=1.1 * DT)


def test_a_station_without_its_daemon_says_nothing_and_what_it_said_grows_old() -> None:
    two = Two()
    two.step(5)
    two.nodes[0][1].al_state = AlState.SAFEOP
    two.step(50)
    assert two.nodes[1][0].age == pytest.approx(0.05, abs=5e-3)
    assert two.nodes[0][0].age < 5e-3, "the other direction goes on"


@pytest.mark.parametrize("payload", [b"", bytes(2 * OPERATOR_SAYS.itemsize - 1), bytes(500)])
def test_what_has_another_length_is_dropped_and_counted(payload: bytes) -> None:
    two = Two()
    two.nodes[0][0].al_state = AlState.SAFEOP  # somebody else speaks in its place
    two.step(1)
    two.network.ports[0].send(payload)
    two.step(5)
    assert two.ends[1].dropped >= 1 and two.nodes[1][0].age > NEVER - 0.1


def test_numbers_that_are_none_are_reported_by_nobody() -> None:
    two = Two()
    two.nodes[1][0].fields["wrench"][2] = nan
    two.step(10)
    reported = two.nodes[0][0]
    assert np.isfinite(reported.fields["wrench"]).all()
    assert two.ends[0].dropped > 0 and reported.age > 5e-3


def test_packets_of_both_directions_have_one_size_an_arm() -> None:
    assert OPERATOR_SAYS.itemsize == AVATAR_SAYS.itemsize == 58
