"""Punctuality beside others, and the cost of the live tick."""

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hapticd.bench import jitter, tick
from hapticd.bench.jitter import Round
from hapticd.bench.recorded import BenchError
from hapticd.runtime.command_line.cli import main
from hapticd.runtime.configuration import config
from hapticd.runtime.core.stages import Stage

FIGURES = {"p50_us", "p99_us", "p999_us", "max_us", "missed"}


def test_quantiles_of_a_round_are_those_of_its_latenesses() -> None:
    rng = np.random.default_rng(1)
    us = np.sort(np.round(rng.exponential(20.0, 5000)))
    values, counts = np.unique(us, return_counts=True)
    made = Round([(float(v), int(n)) for v, n in zip(values, counts, strict=True)], float(us[-1]), 3)
    for q in (0.5, 0.99, 0.999, 1.0):
        assert made.quantile(q) == us[int(np.ceil(q * len(us))) - 1]
    assert made.figures() == {
        "p50_us": made.quantile(0.5),
        "p99_us": made.quantile(0.99),
        "p999_us": made.quantile(0.999),
        "max_us": us[-1],
        "missed": 3,
    }


def test_no_quantile_is_later_than_the_latest_tick() -> None:
    """The lateness of a bucket is its upper edge."""
    assert Round([(10.0, 9), (244.0, 1)], 240.0, 0).quantile(1.0) == 240.0


CYCLICTEST = """# /dev/cpu_dma_latency set to 0us
# Histogram
000008 000010
000009 000085
001500 000004
# Total: 000000099
# Min Latencies: 00008
# Avg Latencies: 00009
# Max Latencies: 120345
# Histogram Overflows: 00001
"""


def test_cyclictest_s_histogram_is_read_with_its_overflows(monkeypatch: pytest.MonkeyPatch) -> None:
    def ran(command: list[str], **_: Any) -> subprocess.CompletedProcess[str]:
        assert {"-i1000", "-l100"} <= set(command)
        return subprocess.CompletedProcess(command, 0, CYCLICTEST, "")

    monkeypatch.setattr(jitter, "run_tied", ran)
    found = jitter.cyclictest(1000.0, 100)
    assert found.latenesses == [(8.0, 10), (9.0, 85), (1500.0, 4)]
    assert (found.largest, found.missed) == (120345.0, 5)


PROGRAM = """#!/bin/sh
case "$*" in *-p80*) echo "Unable to change scheduling policy!" >&2; exit 1;; esac
cat <<'END'
{output}
END
"""


def test_cyclictest_runs_without_the_privileges_that_the_others_lack(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = tmp_path / "cyclictest"
    program.write_text(PROGRAM.format(output=CYCLICTEST))
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    found = jitter.cyclictest(1000.0, 100)
    assert found.largest == 120345.0
    assert found.warnings == ["cyclictest, too, ran without SCHED_FIFO and locked memory"]


def test_all_contenders_are_measured_in_turn(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--rate", "500", "--rounds", "1", "--seconds", "0.2"]
    assert main(["bench", "jitter", *options, "--json"]) == 0
    out = capsys.readouterr()
    report = json.loads(out.out)
    assert (report.pop("rate_hz"), report.pop("rounds")) == (500.0, 1)
    assert {"c_loop", "hapticd", "hapticd_spin", "asyncio"} <= set(report) <= set(jitter.LABELS)
    assert all(set(figures) == FIGURES for figures in report.values())
    assert "round 1 of 1" in out.err
    assert ("cyclictest" in report) != ("rt-tests" in out.err)


def test_the_table_compares_with_the_c_loop_where_cyclictest_is_missing() -> None:
    made = Round([(10.0, 99), (50.0, 1)], 50.0, 0)
    twice = Round([(20.0, 98), (100.0, 2)], 100.0, 1)
    table = jitter.table(jitter.summarise({"c_loop": [made, made, twice], "hapticd": [twice]}))
    assert "p99 / c_loop" in table and max(map(len, table.splitlines())) <= 80
    assert table.splitlines()[2].split()[-1] == "10.00"


def test_the_picture_is_drawn(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    path = tmp_path / "jitter.svg"
    jitter.draw({"hapticd": [Round([(1.0, 90), (20.0, 10)], 20.0, 0)]}, 1000.0, path)
    assert path.read_text().startswith("<?xml")


def test_a_configuration_gets_another_rate_and_steps_of_the_plant_to_match(tmp_path: Path) -> None:
    loaded = config.load("giant")
    for rate, substeps in ((1000.0, 3), (2000.0, 2), (4000.0, 1)):
        made = config.load(str(tick.at_rate(loaded, rate, tmp_path))).config
        assert made.loop.rate == rate
        assert made.simulation is not None and made.simulation.giant.substeps == substeps


def test_the_live_tick_is_measured_by_stage(capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--rate", "500", "--rounds", "1", "--seconds", "0.8"]
    assert main(["bench", "tick", *options, "--json"]) == 0
    reports = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [report["rate_hz"] for report in reports] == [500.0]
    for report in reports:
        assert {"ticks", "missed", "c_loop_missed"} <= set(report)
        assert set(report["compute_us"]) == {"mean", "p50", "p99", "p999", "max"}
        assert set(report["stages_us"]) == {stage.name.lower() for stage in Stage}
        assert all(set(stage) == {"mean", "p99"} for stage in report["stages_us"].values())
        assert report["ticks"] + report["missed"] >= 0.8 * report["rate_hz"]
    assert "compute" in tick.table(reports[0])


def test_a_daemon_that_fails_is_an_error_with_its_words(tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text("system = 1\n")
    with pytest.raises(BenchError, match="ended with 2"):
        tick.daemon(tmp_path / "bad.toml", 1.0)
