from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def recordings():
    """The recorded problems of the giant by name, and the two ticks on which other solvers cycle."""
    spec = spec_from_file_location("recorded", ROOT / "bench" / "recorded.py")
    recorded = module_from_spec(spec)
    spec.loader.exec_module(recorded)
    names = ("cartesian", "excavator", "door", "cycling")
    return {name: recorded.load(recorded.DATA / f"hqp_{name}.npz") for name in names}
