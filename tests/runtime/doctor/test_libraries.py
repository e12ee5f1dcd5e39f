"""Installed libraries against what the package asks for."""

from __future__ import annotations

import pytest
from hapticd.runtime.doctor.libraries import installed, library_lines
from hapticd.runtime.doctor.line import State

GOOD = {"numpy>=2": "2.4.6", "pin>=3.4": "3.4.0", 'uvloop>=0.21; sys_platform != "win32"': "0.21"}


def test_what_is_installed_here_is_enough() -> None:
    versions = installed()
    assert {"numpy>=2", "cffi>=1.17"} <= set(versions)
    assert not any("pytest" in requirement for requirement in versions)
    assert all(line.state is State.PASS for line in library_lines(versions))


def test_the_loop_has_a_line_of_its_own() -> None:
    loop, rest = library_lines(GOOD)
    assert (loop.check, loop.found) == ("uvloop", "uvloop 0.21")
    assert (rest.check, rest.found) == ("libraries", "numpy 2.4.6, pin 3.4.0")


@pytest.mark.parametrize(
    ("requirement", "version", "found"),
    [
        ("numpy>=2", "1.26.4", "numpy 1.26.4, numpy>=2 is needed"),
        ("pin>=3.4", "3.3.1", "pin 3.3.1"),
        ("pin>=3.10", "3.9", "pin 3.9"),  # numbers, not letters
        ("numpy>=2", None, "numpy is missing"),
    ],
)
def test_what_is_too_old_or_missing_fails(requirement: str, version: str | None, found: str) -> None:
    _, rest = library_lines({**GOOD, requirement: version})
    assert rest.state is State.FAIL
    assert found in rest.found
    assert "pip install" in rest.fix


@pytest.mark.parametrize("version", ["2.0", "2", "2.0.0rc1", "2.1.dev3", "10.0"])
def test_equal_and_newer_versions_pass(version: str) -> None:
    _, rest = library_lines({"numpy>=2": version})
    assert rest.state is State.PASS, rest
