"""What is promised of interpreters and compilers is what the workflow tries."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
TARGETS = set(re.findall(r"^([a-z][a-z-]*):", (ROOT / "Makefile").read_text(), re.MULTILINE))
MAKE = re.compile(r"\bmake ([a-z-]+)")


@pytest.fixture(scope="module")
def jobs() -> dict[str, Any]:
    (path,) = (ROOT / ".github" / "workflows").glob("*.yml")
    found: dict[str, Any] = yaml.safe_load(path.read_text())["jobs"]
    return found


def matrix(job: dict[str, Any], key: str) -> list[str]:
    values: list[str] = job["strategy"]["matrix"][key]
    return values


def test_every_interpreter_that_is_promised_is_tried_and_no_other(jobs: dict[str, Any]) -> None:
    classified = re.findall(r"Python :: (3\.\d+)", "\n".join(PROJECT["classifiers"]))
    assert matrix(jobs["test"], "python") == classified == [f"3.{minor}" for minor in range(11, 15)]
    assert PROJECT["requires-python"] == f">={classified[0]}"
    assert all(type(version) is str for version in matrix(jobs["test"], "python"))  # 3.10 is a number


def test_set_up_looks_for_every_interpreter_that_is_promised(jobs: dict[str, Any]) -> None:
    (candidates,) = re.findall(r"^for candidate in (.*);", (ROOT / "setup.sh").read_text(), re.MULTILINE)
    assert re.findall(r"python(3\.\d+)", candidates) == matrix(jobs["test"], "python")[::-1]


def test_both_compilers_build_and_check_the_core(jobs: dict[str, Any]) -> None:
    for job in jobs.values():
        assert matrix(job, "compiler") == ["gcc", "clang"]
        assert job["env"]["CC"] == "${{ matrix.compiler }}"


def test_the_workflow_runs_what_a_merge_must_pass_by_targets_that_exist(jobs: dict[str, Any]) -> None:
    runs = [step["run"] for job in jobs.values() for step in job["steps"] if "run" in step]
    merge = MAKE.findall((ROOT / ".ci" / "run").read_text())
    assert MAKE.findall("\n".join(runs)) == merge
    assert set(merge) <= TARGETS


def test_the_python_of_a_job_is_the_one_that_make_takes(jobs: dict[str, Any]) -> None:
    (path,) = (ROOT / ".github" / "workflows").glob("*.yml")
    assert yaml.safe_load(path.read_text())["env"]["PYTHON"] == "python"
    for job in jobs.values():
        (given,) = (step["with"]["python-version"] for step in job["steps"] if "with" in step)
        assert given in ("${{ matrix.python }}", PROJECT["requires-python"].removeprefix(">="))
