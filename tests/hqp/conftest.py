import pytest
from hapticd.bench.recorded import load, shipped


@pytest.fixture(scope="session")
def recordings():
    """The recorded problems of the giant by name, and the two ticks on which other solvers cycle."""
    return {recording.name: recording for recording in map(load, shipped())}
