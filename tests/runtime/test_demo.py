"""What `hapticd demo` makes of its word."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import pytest
from hapticd.configs.demonstrations import DEMONSTRATIONS
from hapticd.runtime.command_line import cli, run_command
from hapticd.runtime.command_line.arguments import chosen
from hapticd.runtime.configuration import config

MACHINES = sorted(name for name, words in DEMONSTRATIONS.items() if words[0] == "demo")


@pytest.fixture
def began(monkeypatch: pytest.MonkeyPatch) -> list[argparse.Namespace]:
    """Sessions that would have begun."""
    found: list[argparse.Namespace] = []
    monkeypatch.setattr(run_command, "run", lambda options: found.append(options) or 0)
    return found


@pytest.mark.parametrize("name", MACHINES)
def test_a_scenario_is_a_machine_in_a_demonstration(name: str, began: list[argparse.Namespace]) -> None:
    assert cli.main(["demo", name, "--log", "mine.mcap"]) == 0
    (options,) = began
    assert options.demo and options.view and str(options.log) == "mine.mcap"
    twin = DEMONSTRATIONS[name][-1] if "--twin" in DEMONSTRATIONS[name] else None
    assert options.twin == twin
    loaded = config.load(chosen(options))
    assert Path(loaded.source).stem == "_".join(filter(None, (options.config, twin)))


def test_a_scenario_without_a_twin_of_its_own_takes_one(began: list[argparse.Namespace]) -> None:
    assert cli.main(["demo", "walk", "--twin", "mass"]) == 0
    assert (began[0].config, began[0].twin) == ("giant", "mass")


def test_machines_are_demonstrations_too(began: list[argparse.Namespace]) -> None:
    assert cli.main(["demo", "panda"]) == 0 and cli.main(["demo"]) == 0
    assert [options.config for options in began] == ["panda", "giant"]


def test_both_stations_are_demonstrations_of_their_own(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Any
) -> None:
    live_pair = pytest.importorskip("hapticd.machines.telemanipulation.live_pair")
    monkeypatch.chdir(tmp_path)
    asked: list[tuple[Any, ...]] = []
    monkeypatch.setattr(live_pair, "live_pair", lambda *words: asked.append(words) or 0)
    assert cli.main(["demo", "bimanual"]) == 0
    assert cli.main(["bimanual", "--live", "--view", "--logs", "other"]) == 0
    assert [words[-1] for words in asked] == [("demo",), ("run", "--view")]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["demo", "dor"], "there is no demonstration 'dor'; did you mean 'door'?"),
        (["demo", "bimanual", "--twin", "door"], "'bimanual' takes no --twin"),
        (["demo", "door", "--twin", "mass"], "'door' takes no --twin"),
        (["bimanual", "--view"], "give --live, too"),
    ],
)
def test_what_cannot_be_shown_is_refused(
    words: list[str], said: str, began: list[argparse.Namespace], capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(words) == 2
    assert said in capsys.readouterr().err and not began
