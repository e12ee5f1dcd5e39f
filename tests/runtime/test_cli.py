"""The command line: exit status, help, errors for people and for programs."""

import argparse
import os
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import msgspec
import pytest
from hapticd.configs import read_text
from hapticd.runtime.command_line.arguments import Parser, file, new_configuration
from hapticd.runtime.command_line.cli import commands, main
from hapticd.runtime.command_line.outputs import folder, picture
from hapticd.runtime.invocation import program
from hapticd.runtime.recording.log import open_log


def test_help_teaches(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["--help"])
    assert end.value.code == 0
    text = capsys.readouterr().out
    for word in (
        "run",
        "replay",
        "check",
        "examples",
        "exit status",
        "not a certified safety device",
        "Ctrl-C",
        "130",
        "143",
        "129",
    ):
        assert word in text


@pytest.mark.parametrize(
    "arguments",
    [[], ["walk"], ["run"], ["run", "giant", "--duration", "0"], ["run", "giant", "--duration", "nan"]],
)
def test_bad_usage_exits_with_2(arguments: list[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(arguments)
    assert end.value.code == 2


@pytest.mark.parametrize("words", [["rn"], ["run", "giant", "--durtion", "3"], ["check"]])
def test_who_asked_for_json_is_answered_in_json_of_bad_usage_too(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main([*words, "--json"])
    printed, shown = capsys.readouterr()
    answer = msgspec.json.decode(printed)
    assert answer["error"] == "usage"
    assert shown.endswith(f"error: {answer['message']}\n")


NAMED = (
    ["run"],
    ["check"],
    ["replay"],
    ["doctor"],
    ["plant"],
    ["experiment"],
    ["bench", "tick"],
    ["bench", "solve", "--data"],
    ["run", "giant", "--log"],
    ["plant", "giant", "--interface"],
    ["plant", "giant", "--interface", "pcan", "--channel"],
    ["experiment", "rhi_fig9", "--out"],
)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["rnu", "giant"], "no command 'rnu'; did you mean 'run'?"),
        (["xyz"], "no command 'xyz'; known: run, "),
        (["run", "giant", "--duratoin", "3"], "no option '--duratoin'; did you mean '--duration'?"),
        (["run", "giant", "--dur", "3"], "no option '--dur'; did you mean '--duration'?"),
        (["bench", "jitter", "--sec", "3"], "no option '--sec'; did you mean '--seconds'?"),
        *(([*words, ""], "the name is empty") for words in NAMED),
        (["run", "giant", "--twin", "mass,,door"], "--twin: the name is empty"),
        (["replay", "--verfy=yes"], "no option '--verfy'; did you mean '--verify'?"),
        (["run", "giant", "rhi"], "'rhi' is one word too many"),
        (["bench", "slove"], "no benchmark 'slove'; did you mean 'solve'?"),
        (["--lockstep", "run", "giant"], "no option '--lockstep'"),
        (["run", "giant", "--duration", "1e300"], "'1e300' is not a number above 0 and up to 1e+07"),
        (["bench", "jitter", "--rate", "1e9"], "'1e9' is not a number above 0 and up to 100000"),
        (["bench", "nasty", "--count", "9" * 30], "is not a whole number from 1 to"),
        (["bench", "nasty", "--count", "-1"], "'-1' is not a whole number"),
        (["bench", "solve", "--plot", "x.xyz"], "should end with one of .svg, .png, .pdf"),
        (["bench", "solve", "--plot", "/proc/nonexist/x.svg"], "cannot write '/proc/nonexist/x.svg'"),
        (["bench", "jitter", "--plot", "/proc/x.svg"], "cannot write '/proc/x.svg'"),
        (["experiment", "rhi_fig6", "--out", "/proc/x"], "cannot write '/proc/x'"),
    ],
)
def test_a_wrong_word_is_named_before_any_work_with_what_was_meant(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hapticd.bench.command.import_module", None)  # no work can begin
    with pytest.raises(SystemExit) as end:
        main(arguments)
    assert end.value.code == 2
    assert said in capsys.readouterr().err


def test_every_option_of_a_folder_or_plot_is_checked_when_it_is_read() -> None:
    """A path that a command writes must not wait for the command's end to be refused."""
    checked = {"--plot": {picture}, "--picture": {picture}, "--out": {folder, new_configuration, file}}
    for parser in parsers(commands()):
        for action in parser._actions:
            for option in action.option_strings:
                assert option not in checked or action.type in checked[option], option


def parsers(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    yield parser
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for each in action.choices.values():
                yield from parsers(each)


def test_a_help_fits_the_terminal_but_for_commands_and_no_percent_sign_is_doubled(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for columns, kept in ((80, f"  {program()} "), (60, " ")):  # what is kept whole is written for 80
        monkeypatch.setenv("COLUMNS", str(columns))
        for parser in parsers(commands()):
            lines = [line for line in parser.format_help().splitlines() if not line.startswith(kept)]
            assert not [line for line in lines if len(line) > columns or "%%" in line], parser.prog


def test_paragraphs_are_filled_and_what_is_indented_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "32")
    text = "one two three four five six\nseven eight\n\n  a = 1    # a line to copy\n  b = 2"
    shown = Parser(prog="p", description=text).format_help()
    expected = "one two three four five six\nseven eight\n\n  a = 1    # a line to copy\n  b = 2\n"
    assert expected in shown


def test_rounds_without_ticks_and_rates_that_do_not_fit_are_refused_before_the_first(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["bench", "jitter", "--rate", "0.001"]) == 2
    assert "give more --seconds" in capsys.readouterr().err
    assert main(["bench", "tick", "giant", "--rate", "1000", "20000"]) == 2
    err = capsys.readouterr().err
    assert "giant does not run at 20000 Hz" in err and "round" not in err


def test_an_error_about_a_file_as_a_whole_names_no_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("nope", str(tmp_path / "nope.toml"), str(tmp_path)):
        assert main(["check", name]) == 2
        assert f": {name}: " in capsys.readouterr().err


def test_closed_streams_full_disks_and_readers_that_leave_end_without_a_traceback(tmp_path: Path) -> None:
    def run(redirect: str, *words: str) -> tuple[int, str]:
        command = f"{shlex.join([sys.executable, '-m', 'hapticd.runtime', *words])} {redirect}"
        done = subprocess.run(
            ["bash", "-c", command], capture_output=True, text=True, cwd=tmp_path, timeout=60
        )
        assert "Traceback" not in done.stderr and "Exception" not in done.stderr
        return done.returncode, done.stderr

    for words in (["check", "giant"], ["--help"], ["run", "--help"], ["--version"]):
        assert run("> /dev/full", *words) == (
            1,
            "hapticd: error [file]: standard output, or a file that was being written: "
            "No space left on device\n",
        )
    assert run("| true", "--help")[1] == ""
    assert run("> /dev/full", "run", "nope", "--json")[0] == 2
    assert run("| true", "check", "giant")[1] == ""
    assert run(">&- <&-", "check", "giant") == (0, "")
    assert run("2>&-", "check", "nope") == (2, "")
    status, said = run(">&-", "check", "giant", "--json")
    assert status == 2 and "standard output is closed" in said
    assert run(">&- 2>&- <&-", "run", "rhi", "--lockstep", "--duration", "0.3", "--log", "x.mcap")[0] == 0
    assert (
        sum(1 for _ in open_log(str(tmp_path / "x.mcap")).records()) == 301
    )  # nothing else was written to it


def test_the_replay_that_is_proposed_works_where_it_is_proposed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "a b" / "it's.mcap"
    log.parent.mkdir()
    assert main(["run", "rhi", "--lockstep", "--duration", "0.2", "--log", str(log)]) == 0
    (line,) = (line for line in capsys.readouterr().out.splitlines() if line.startswith("replay: "))
    bare = {"PATH": "/usr/bin:/bin"}
    command = line.removeprefix("replay: ")
    done = subprocess.run(["sh", "-c", command], capture_output=True, text=True, env=bare, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")
    assert "0 differ" in done.stdout


def test_check_approves_the_built_in_giant(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "giant"]) == 0
    assert "no findings. 12 devices, 13 frames a tick, 8 joints, 1000 Hz" in capsys.readouterr().out
    assert main(["check", "giant", "--json"]) == 0
    assert msgspec.json.decode(capsys.readouterr().out)["findings"] == []


def test_check_names_a_mistake(write_config: Callable[..., Path], capsys: pytest.CaptureFixture[str]) -> None:
    path = write_config(('rate = "1 kHz"', 'rat = "1 kHz"'))
    assert main(["check", str(path)]) == 2
    assert f'{path}:11: loop.rat: unknown key; did you mean "rate"?' in capsys.readouterr().err
    assert main(["check", str(path), "--json"]) == 2
    (finding,) = msgspec.json.decode(capsys.readouterr().out)["findings"]
    assert (finding["line"], finding["key"]) == (11, "loop.rat")


def test_a_file_cannot_steer_the_terminal_that_its_mistakes_are_shown_on(
    write_config: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_config(('rate = "1 kHz"', '"ra\\u001b[2Jte\\u0007" = "1 kHz"'))
    assert main(["check", str(path)]) == 2
    said = capsys.readouterr().err
    assert "\\x1b[2J" in said and all(line.isprintable() for line in said.splitlines())


def test_a_path_that_the_terminal_cannot_show_ends_no_session(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "hapticd.runtime", "run", "rhi", "--lockstep", "--duration", "0.2"]
    done = subprocess.run(
        [*command, "--log", "prüfung-\udcff.mcap"],
        capture_output=True,
        check=False,
        cwd=tmp_path,
        env={**os.environ, "PYTHONIOENCODING": "ascii"},
    )
    assert done.returncode == 0, done.stderr
    assert b"log: pr\\xfcfung-\\udcff.mcap" in done.stdout


def test_help_fits_eighty_columns(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    commands = ("run", "replay", "check", "doctor", "plant", "experiment", "bench")
    for command in ((), *((name,) for name in commands)):
        with pytest.raises(SystemExit):
            main([*command, "--help"])
        assert max(map(len, capsys.readouterr().out.splitlines())) < 80, command


@pytest.mark.parametrize("command", ["bimanual", "hands", "calibrate", "identify", "init", "mount", "study"])
def test_help_of_every_command_is_short(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main([command, "--help"])
    assert 300 < len(capsys.readouterr().out) < 10_000


def test_the_summary_says_how_to_replay_from_where_the_person_stands(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    script = Path(sys.executable).parent / "hapticd"
    monkeypatch.setenv("PATH", "/nowhere")
    command = [str(script), "run", "rhi", "--lockstep", "--duration", "0.2", "--log", "a b.mcap"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    (line,) = [line for line in done.stdout.splitlines() if line.startswith("replay: ")]
    again = subprocess.run(
        shlex.split(line.removeprefix("replay: ")), capture_output=True, check=False, cwd=tmp_path
    )
    assert again.returncode == 0, again.stderr
    monkeypatch.setenv("PATH", str(script.parent))
    command[-1] = "c.mcap"
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert "replay: hapticd replay c.mcap --verify" in done.stdout


def test_check_names_a_mistake_in_the_model(
    write_config: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    model = read_text("giant.urdf").replace('<axis xyz="0 0 1" />', '<axis xyz="0 0 2" />', 1)
    path = write_config(model=model)
    assert main(["check", str(path)]) == 2
    assert "the axis has length 2" in capsys.readouterr().err
    assert main(["check", str(path), "--json"]) == 2
    (finding,) = msgspec.json.decode(capsys.readouterr().out)["findings"]
    assert finding["line"] > 0 and finding["fix"]


@pytest.mark.parametrize("how", [[], ["--lockstep"]])
def test_a_bad_configuration_runs_nothing_and_leaves_no_log(
    write_config: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str], how: list[str]
) -> None:
    path = write_config(('gain = "3 1/s"', 'gain = "nan 1/s"'))
    log = tmp_path / "none.mcap"
    assert main(["run", str(path), "--log", str(log), *how]) == 2
    assert "error [config]" in capsys.readouterr().err
    assert not log.exists()


def test_a_log_that_cannot_be_written_is_refused_before_anything_starts(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["run", "giant", "--log", "/proc/none/x.mcap", "--json"]) == 2
    out = capsys.readouterr()
    assert msgspec.json.decode(out.out)["error"] == "log-path"
    assert "there is no folder /proc/none for the log; type: mkdir -p /proc/none" in out.err


def test_a_folder_that_a_slip_of_the_pen_names_is_not_made(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "my logs" / "x.mcap"
    assert main(["run", "rhi", "--lockstep", "--duration", "0.1", "--log", str(log)]) == 2
    assert not log.parent.exists()
    subprocess.run(capsys.readouterr().err.partition("type: ")[2], shell=True, check=True)
    assert main(["run", "rhi", "--lockstep", "--duration", "0.1", "--log", str(log)]) == 0


def test_check_takes_a_model_alone_and_other_commands_say_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "m.urdf"
    model.write_text(read_text("giant.urdf"))
    assert main(["check", str(model)]) == 0
    assert capsys.readouterr().out == f"{model}: no findings. 8 joints\n"
    assert main(["doctor", str(model)]) == 2
    said = capsys.readouterr().err
    assert f"{model}:1: is XML, as models are; give the TOML file that names it" in said
    command = shlex.split(said.partition("checked by: ")[2])
    assert main(command[1:] if "-m" not in command else command[3:]) == 0
    model.write_text(model.read_text().replace('<axis xyz="0 0 1" />', '<axis xyz="0 0 2" />', 1))
    capsys.readouterr()
    assert main(["check", str(model), "--json"]) == 2
    (finding,) = msgspec.json.decode(capsys.readouterr().out)["findings"]
    assert "the axis has length 2" in finding["problem"]
    assert main(["check", str(tmp_path / "none.urdf")]) == 2
    assert "cannot be read" in capsys.readouterr().err


def test_replay_takes_the_newest_recording(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["replay", "--verify"]) == 2
    assert "no recording in log/" in capsys.readouterr().err
    for duration in ("0.2", "0.3"):
        assert main(["run", "giant", "--lockstep", "--duration", duration]) == 0
    capsys.readouterr()
    assert main(["replay", "--verify", "--json"]) == 0
    assert msgspec.json.decode(capsys.readouterr().out)["ticks"] > 290


@pytest.mark.parametrize("how", [[], ["--lockstep"]])
def test_a_configuration_that_does_not_fit_its_model_leaves_no_log(
    write_config: Callable[..., Path], tmp_path: Path, how: list[str]
) -> None:
    path = write_config(('rate = "1 kHz"', 'rate = "100 Hz"'))
    log = tmp_path / "none.mcap"
    assert main(["run", str(path), "--log", str(log), *how]) == 2
    assert not log.exists()


def test_lockstep_prints_the_summary_and_writes_the_log(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "b.mcap"
    assert main(["run", "giant", "--lockstep", "--duration", "0.5", "--log", str(log)]) == 0
    out = capsys.readouterr().out
    assert "ticks at 1000 Hz" in out and "times real time" in out
    assert f"log: {log}\n" in out and f"replay {log} --verify" in out
    again = ["run", "giant", "--lockstep", "--duration", "0.5", "--json", "--log"]
    recorded = log.read_bytes()
    assert main([*again, str(log.parent)]) == 2
    assert "is a folder" in capsys.readouterr().out
    assert main([*again, str(log / "c.mcap")]) == 2
    assert f"cannot write the log {log / 'c.mcap'}: Not a directory" in capsys.readouterr().out
    assert main([*again, str(log)]) == 2  # a recording is never overwritten
    assert msgspec.json.decode(capsys.readouterr().out)["error"] == "log-path"
    assert log.read_bytes() == recorded
    log = tmp_path / "c.mcap"
    assert main([*again, str(log)]) == 0
    report = msgspec.json.decode(capsys.readouterr().out)
    assert report["status"] == 0 and report["log"] == str(log) and report["speed_x"] > 0.0


def test_a_machine_that_does_not_come_up_exits_with_1(
    write_config: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from hapticd.sim.nodes import SimNodes

    build = SimNodes.__init__

    def without_imu(self: SimNodes, *arguments: object) -> None:
        build(self, *arguments)  # type: ignore[arg-type]
        self["imu_handle"].silent = True

    monkeypatch.setattr(SimNodes, "__init__", without_imu)
    assert main(["run", str(write_config()), "--lockstep", "--log", str(tmp_path / "x.mcap")]) == 1


def test_replaying_something_else_exits_with_2(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "x.mcap").write_bytes(b"hello")
    assert main(["replay", str(tmp_path / "x.mcap"), "--json"]) == 2
    out = capsys.readouterr()
    assert msgspec.json.decode(out.out)["error"] == "log"
    assert "is not an MCAP file" in out.err


def test_a_plant_needs_an_interface_that_exists(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plant", "giant", "--interface", "nocan9"]) == 1
    assert "hapticd: error [device]: nocan9: " in capsys.readouterr().err
