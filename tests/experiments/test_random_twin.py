"""Random chains as digital twins: what they are, and that a machine renders them."""

import msgspec
import numpy as np
import pytest
from hapticd.experiments.hands import session
from hapticd.experiments.random_twin import with_random_chain
from hapticd.experiments.temper import Temper
from hapticd.machines.rendering.sections import ChainTwin
from hapticd.machines.rendering.twin import added, chain_twin, remarks
from hapticd.runtime.configuration.config import Loaded, load
from hapticd.runtime.errors import ConfigError

MACHINE = load("giant")


def chain(loaded: Loaded) -> ChainTwin:
    twin = loaded.config.giant.twin  # type: ignore[attr-defined]
    assert isinstance(twin, ChainTwin)
    return twin


def lightest(section: ChainTwin, rng: np.random.Generator) -> tuple[float, float]:
    """What the end weighs least in random postures and directions: how it yields to a wrench from rest."""
    twin, least = chain_twin(section), [np.inf, np.inf]
    for _ in range(40):
        twin.q[:] = rng.uniform(np.maximum(twin.limits.lower, -3), np.minimum(twin.limits.upper, 3))
        twin.place()
        twin.update(np.zeros(6))
        force = twin.force.copy()
        for _ in range(40):
            for part in (0, 1):
                wrench = np.zeros(6)
                wrench[3 * part : 3 * part + 3] = u = _unit(rng)
                twin.update(wrench)
                yields = (twin.J @ np.linalg.solve(twin.M, twin.force - force))[3 * part : 3 * part + 3] @ u
                least[part] = min(least[part], 1.0 / yields if yields > 1e-9 else np.inf)
    return least[0], least[1]


def _unit(rng: np.random.Generator) -> np.ndarray:
    u = rng.normal(size=3)
    return np.asarray(u / np.linalg.norm(u))


def test_chains_are_of_all_sorts_and_repeat() -> None:
    sections = [chain(with_random_chain(MACHINE, seed)) for seed in range(12)]
    assert len({len(section.joints) for section in sections}) > 3
    kinds = {type(joint).__name__ for section in sections for joint in section.joints.values()}
    assert len(kinds) == 2
    assert chain(with_random_chain(MACHINE, 5)) == sections[5]


@pytest.mark.parametrize("seed", range(5))
def test_the_end_of_no_chain_is_lighter_than_what_can_be_rendered(seed: int) -> None:
    section = chain(with_random_chain(MACHINE, 40 + seed))
    mass, inertia = lightest(section, np.random.default_rng(seed))
    # postures between those that were looked at may be a little lighter
    assert mass > 0.85 * section.least_mass
    assert inertia > 0.85 * section.least_inertia


def test_what_is_added_is_said_and_can_be_refused() -> None:
    section = chain(with_random_chain(MACHINE, 1))
    mass, _ = added(section)
    assert mass > 1.0
    assert f"{mass:.2g} kg" in remarks({"chain": section})[0]
    bare = msgspec.structs.replace(section, least_mass=0.0, least_inertia=0.0)
    assert (added(bare), remarks({"chain": bare})) == ((0.0, 0.0), [])
    rng = np.random.default_rng(1)
    assert lightest(bare, rng)[0] < 0.5 < 1.0 < lightest(section, rng)[0]


@pytest.mark.parametrize("twin", ["door", "excavator", "panda"])
def test_the_built_in_chains_are_heavy_enough(twin: str) -> None:
    assert added(chain(load(f"giant with {twin}"))) == (0.0, 0.0)


@pytest.mark.parametrize(("machine", "seed"), [("giant", 1), ("giant", 3), ("panda", 2)])
def test_a_hand_stops_no_random_chain(machine: str, seed: int) -> None:
    ended = session(load(machine), seed, 6.0, Temper(force=30.0, torque=5.0, speed=1.0), chains=True)
    assert ended.stop == "", ended.detail
    assert all(ended.excess[name] < 0.01 for name in ended.excess if name.startswith("twin"))


def test_a_machine_that_renders_no_twin_says_so() -> None:
    with pytest.raises(ConfigError, match="renders no twin"):
        with_random_chain(load("rhi"), 1)
