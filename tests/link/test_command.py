"""`hapticd link keygen` and `hapticd link test`."""

import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
from hapticd.link.channel import TO_AVATAR, TO_OPERATOR, Channel
from hapticd.link.credentials import load
from hapticd.link.echo import terms
from hapticd.link.stations import Role
from hapticd.runtime.command_line.cli import main

from .conftest import KEYS, Pair, Ticker


def test_keygen_makes_an_avatar_and_an_operator_and_says_what_to_copy_where(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    keys = tmp_path / "keys"
    assert main(["link", "keygen", str(keys)]) == 0
    said = capsys.readouterr().out
    for name in ("avatar", "operator"):
        assert f"{keys / name}: copy this folder to that station" in said
        assert load(keys / name).station == (name, Role(name))
    assert f"{keys / 'authority'}: stays here" in said
    assert main(["link", "keygen", str(keys)]) == 2
    assert "error [link-keys]" in capsys.readouterr().err


def test_keygen_adds_stations_of_any_role_for_as_long_as_is_wanted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    keys = tmp_path / "keys"
    roles = ["--operator", "anna", "--operator", "ben", "--observer", "wall", "--maintainer", "carl"]
    assert main(["link", "keygen", str(keys), *roles, "--days", "3", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert sorted(Path(folder).name for folder in found["folders"]) == ["anna", "ben", "carl", "wall"]
    assert load(keys / "wall").station.role is Role.OBSERVER
    assert found["authority"] == str(keys / "authority")


@pytest.mark.parametrize("name", ["Anna", "../up", "", "-x", "a b", "a" * 33])
def test_a_name_that_is_no_folder_is_refused_before_anything_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    assert main(["link", "keygen", str(tmp_path / "keys"), f"--operator={name}"]) == 2
    assert "is no name of a station" in capsys.readouterr().err
    assert not (tmp_path / "keys").exists()


def test_test_measures_plain_udp_the_link_and_a_flood(
    capsys: pytest.CaptureFixture[str],
) -> None:
    few = ["link", "test", "--rounds", "1", "--packets", "20", "--forged", "30"]
    assert main([*few, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["refused"] >= 20 * 30 and found["flooded"]["lost"] == 0
    for way in ("plain", "link", "flooded"):
        assert found[way]["sent"] == 20
        assert 0.0 < found[way]["p50_us"] <= found[way]["p99_us"] <= found[way]["max_us"]
    assert found["ratio_p50"] == pytest.approx(found["link"]["p50_us"] / found["plain"]["p50_us"], rel=0.02)


def test_a_session_that_is_measured_outlasts_the_turns_of_plain_udp() -> None:
    """Two rounds of a thousand packets at 1 kHz, and a host that stalls."""
    left, right = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    time = Ticker()
    both = Pair(
        Channel(left, KEYS, TO_AVATAR, terms(40), time),
        Channel(right, KEYS, TO_OPERATOR, terms(40), time),
        time,
    )

    def turn() -> bool:
        both.operator.send(bytes(40))
        there = both.avatar.receive()
        both.avatar.send(bytes(40))
        here = both.operator.receive()
        return here is not None and there is not None

    assert [turn() for _ in range(3)] == [False, True, True]
    time.wait(4.0)
    assert turn() and not both.operator.expired
    for end in both[:2]:
        end.close()


def test_a_missing_package_is_named_with_what_to_type(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [name for name in sys.modules if name.startswith("hapticd.link.")]:
        if not name.endswith((".errors", ".terms")):
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "cryptography", None)
    assert main(["link", "keygen", str(tmp_path / "keys")]) == 1
    assert "-m pip install 'hapticd[link]'" in capsys.readouterr().err


def test_ctrl_c_ends_a_measurement_with_a_line() -> None:
    command = [sys.executable, "-m", "hapticd.runtime", "link", "test", "--rounds", "1000"]
    child = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)
    children = Path(f"/proc/{child.pid}/task/{child.pid}/children")
    while not children.read_text():
        time.sleep(0.02)
    time.sleep(1.0)
    os.killpg(child.pid, signal.SIGINT)
    _, said = child.communicate(timeout=30)
    assert child.returncode == 130
    assert "Traceback" not in said and len(said.splitlines()) <= 2, said
