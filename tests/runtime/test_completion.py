"""What the Tab key offers, asked of the shell itself."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from hapticd.runtime.command_line.cli import main
from hapticd.runtime.configuration.known import built_in, demonstrations, twins


@pytest.fixture(scope="module")
def script(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("completion") / "hapticd.bash"
    with pytest.MonkeyPatch.context() as patch, path.open("w") as file:
        patch.setattr("sys.stdout", file)
        assert main(["completion", "bash"]) == 0
    return path


def offered(script: Path, *words: str) -> list[str]:
    """What bash offers for the last of the words, among the files of a folder with one configuration."""
    (script.parent / "mine.toml").touch()
    ask = (
        f'source {script}; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _shtab_hapticd; '
        'printf "%s\\n" "${COMPREPLY[@]}"'
    )
    told = subprocess.run(
        ["bash", "-c", ask, "bash", "hapticd", *words],
        capture_output=True, text=True, cwd=script.parent, check=True,
    )  # fmt: skip
    return told.stdout.split()


def test_a_command_is_completed(script: Path) -> None:
    assert offered(script, "re") == ["replay", "report"]


def test_machines_and_files_are_offered_where_a_configuration_is_due(script: Path) -> None:
    assert set(offered(script, "run", "")) == {*built_in(), "mine.toml", script.name}
    assert offered(script, "run", "gi") == [name for name in built_in() if name.startswith("gi")]
    assert offered(script, "check", "mi") == ["mine.toml"]
    assert set(demonstrations()) <= set(offered(script, "demo", ""))


def test_options_and_their_values(script: Path) -> None:
    assert set(offered(script, "run", "giant", "--l")) == {"--log", "--lockstep"}
    assert set(twins()) <= set(offered(script, "run", "giant", "--twin", ""))


def test_commands_of_commands(script: Path) -> None:
    assert "keygen" in offered(script, "link", "key")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish", "tcsh"])
def test_every_shell_gets_a_script(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", shell]) == 0
    assert "hapticd" in capsys.readouterr().out


def test_another_shell_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["completion", "bsh"])
    assert "did you mean 'bash'?" in capsys.readouterr().err
