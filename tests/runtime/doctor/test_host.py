"""The door to the system: files that may be missing, network links."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path

import pytest
from hapticd.runtime.timing.host import Host


def test_a_file_is_read_without_white_space_and_may_be_missing(make_host: Callable[..., Host]) -> None:
    host = make_host({"/proc/sys/kernel/osrelease": "6.12.1-rt\n"})
    assert host.read("/proc/sys/kernel/osrelease") == "6.12.1-rt"
    assert host.read("/proc/sys/kernel/version") is None
    assert host.read("/proc/sys") is None  # a folder


def test_paths_are_found_below_the_root_and_sorted(make_host: Callable[..., Host]) -> None:
    host = make_host({"/sys/cpu1/x": "", "/sys/cpu0/x": "", "/sys/other": ""})
    assert host.find("/sys/cpu*/x") == ["/sys/cpu0/x", "/sys/cpu1/x"]


def test_links_come_from_ip(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    links = [{"ifname": "can0", "mtu": 72}]
    program = tmp_path / "ip"
    program.write_text(f"#!/bin/sh\n[ \"$*\" = '-json -details link show' ] && echo '{json.dumps(links)}'\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    assert Host().links() == links


@pytest.mark.parametrize("script", ["exit 1", "echo no json"])
def test_without_a_usable_ip_there_are_no_links(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, script: str
) -> None:
    program = tmp_path / "ip"
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    assert Host().links() == []
    monkeypatch.setenv("PATH", "")
    assert Host().links() == []
