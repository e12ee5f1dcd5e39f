"""Hosts made of files in a temporary folder."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from hapticd.runtime.timing.host import Host

MakeHost = Callable[[dict[str, str | bytes]], Host]


@pytest.fixture
def make_host(tmp_path: Path) -> MakeHost:
    """A host with these files and no others."""

    def make(files: dict[str, str | bytes]) -> Host:
        for path, content in files.items():
            file = tmp_path / path.lstrip("/")
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(content if isinstance(content, bytes) else content.encode())
        return Host(tmp_path)

    return make
