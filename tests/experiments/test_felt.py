"""What a hand feels of the giant's twin."""

from hapticd.experiments.felt import felt
from hapticd.machines.giant.config import GiantConfig
from hapticd.runtime.configuration import config


def test_the_giants_mass_is_felt_as_it_is_and_gives_nothing_back() -> None:
    loaded = config.load("giant")
    assert isinstance(loaded.config, GiantConfig)
    for along in felt(loaded, loaded.config):
        assert along.true_up_to() > 5.0
        assert along.resistance[along.frequency < 8.0].min() > -10.0
