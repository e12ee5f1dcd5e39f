"""The whole report: text for people, JSON for programs, exit status for both."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest
from hapticd.runtime.command_line.cli import main
from hapticd.runtime.doctor.line import Line, State
from hapticd.runtime.doctor.report import CHECKS, as_json, as_text, fit

PASS = Line("clocksource", State.PASS, "tsc", "Why not.")
WARN = Line("swap", State.WARN, "/dev/sda2", "Swapping takes milliseconds.", "sudo swapoff -a")
FAIL = Line("fifo", State.FAIL, "priority 0", "Others may keep the CPU.", "sudo something")


def test_only_what_does_not_pass_is_explained() -> None:
    assert as_text([PASS, WARN]).splitlines() == [
        "pass  clocksource  tsc",
        "warn  swap         /dev/sda2",
        "        Swapping takes milliseconds.",
        "        sudo swapoff -a",
        "1 pass, 1 warn, 0 fail",
    ]


def test_warnings_are_allowed_and_failures_are_not() -> None:
    assert fit([PASS, WARN])
    assert not fit([PASS, FAIL])


def test_json_has_every_line_and_the_counts() -> None:
    told = msgspec.json.decode(as_json([PASS, WARN, FAIL]))
    assert (told["passed"], told["warned"], told["failed"]) == (1, 1, 1)
    assert told["lines"][2] == {
        "check": "fifo",
        "state": "fail",
        "found": "priority 0",
        "why": "Others may keep the CPU.",
        "fix": "sudo something",
    }


def test_the_command_examines_this_host(capsys: pytest.CaptureFixture[str]) -> None:
    status = main(["doctor", "--json"])
    told = msgspec.json.decode(capsys.readouterr().out)
    assert status == (1 if told["failed"] else 0)
    assert len(told["lines"]) >= len(CHECKS) + 3
    assert main(["doctor"]) == status
    assert f"{told['failed']} fail" in capsys.readouterr().out


def test_a_configuration_names_the_processor_and_the_interface(
    write_config: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_config(
        ('kind = "simulated"', 'kind = "socketcan"\ninterface = "nocan9"'),
        ('rate = "1 kHz"', 'rate = "1 kHz"\ncpu = 4095'),
    )
    assert main(["doctor", str(path), "--json"]) == 1
    lines = {line["check"]: line for line in msgspec.json.decode(capsys.readouterr().out)["lines"]}
    assert lines["can_nocan9"]["state"] == "fail"
    assert lines["loop_cpu"]["found"] == "this host has no CPU 4095"


def test_a_configuration_that_is_wrong_is_bad_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "no_such_machine"]) == 2
    assert "built in: avatar, giant" in capsys.readouterr().err
