"""Short recordings of built-in machines, made once."""

from collections.abc import Callable
from pathlib import Path

import pytest
from hapticd.runtime.configuration.config import load
from hapticd.runtime.live import lockstep_run


@pytest.fixture(scope="session")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The recording of the first second and a half of a machine's session."""
    made: dict[str, Path] = {}

    def record(machine: str) -> Path:
        if machine not in made:
            path = tmp_path_factory.mktemp("log") / f"{machine}.mcap"
            path.touch()
            lockstep_run.run(load(machine), path, 1.5, live=False)
            made[machine] = path
        return made[machine]

    return record
