"""Damaged files are refused with an error, or are no worse than the original.

Nothing falls, nothing hangs, nothing slips in.

``HAPTICD_MUTANTS=2000`` tries more of each file, ``HAPTICD_MUTANT_SEED`` others; `make mutants` does both.
"""

import json
import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
from hapticd.configs import read_text

from . import mutants, oracle

COUNT = int(os.environ.get("HAPTICD_MUTANTS", "200"))
SEED = int(os.environ.get("HAPTICD_MUTANT_SEED", "0"))


class Runner:
    """The process that loads files; another one where it dies."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None

    def __call__(self, path: Path) -> dict[str, str]:
        process = self._process
        if process is None:
            command = [sys.executable, str(Path(__file__).with_name("run_files.py"))]
            pipe = subprocess.PIPE
            process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, text=True)
            self._process = process
        assert process.stdin is not None and process.stdout is not None
        process.stdin.write(f"{path}\n")
        process.stdin.flush()
        answer = process.stdout.readline()
        if answer:
            return dict(json.loads(answer))
        self.close()
        return {"verdict": "died", "why": f"exit {process.returncode}"}

    def close(self) -> None:
        if self._process is not None:
            process, self._process = self._process, None
            process.communicate()


@pytest.fixture(scope="module")
def runner():  # type: ignore[no-untyped-def]
    runner = Runner()
    yield runner
    runner.close()


@pytest.mark.parametrize("machine", ["giant", "rhi"])
@pytest.mark.parametrize("kind", ["urdf", "toml"])
@pytest.mark.slow
def test_no_mutant_falls_hangs_or_slips_in(kind: str, machine: str, runner: Runner, tmp_path: Path) -> None:
    files = {name: read_text(f"{machine}.{name}").encode() for name in ("urdf", "toml")}
    for name, data in files.items():
        (tmp_path / f"{machine}.{name}").write_bytes(data)
    mutations = mutants.URDF if kind == "urdf" else mutants.TOML
    verdicts: Counter[str] = Counter()
    bad = []
    for seed in range(SEED, SEED + COUNT):
        data = mutants.mutant(files[kind], mutations, seed)
        (tmp_path / f"{machine}.{kind}").write_bytes(data)
        found = runner(tmp_path / f"{machine}.toml")
        verdicts[found["verdict"]] += 1
        if found["verdict"] == "ran":
            wrong = oracle.judge_urdf(data) if kind == "urdf" else oracle.judge_toml(data, files[kind])
            if wrong:
                bad.append((seed, "accepted", wrong))
        elif found["verdict"] != "refused" or (not found["why"].isprintable() and "\n" not in found["why"]):
            bad.append((seed, found["verdict"], found["why"]))
    assert not bad, f"{len(bad)} of {COUNT}: " + "\n".join(map(str, bad[:20]))
    assert verdicts["refused"] > COUNT / 3  # the mutations bite
    assert verdicts["ran"] > COUNT / 50  # and not everything is refused


@pytest.mark.parametrize("machine", ["giant", "rhi"])
def test_the_oracle_finds_nothing_wrong_with_the_built_in_files(machine: str) -> None:
    urdf, toml = (read_text(f"{machine}.{kind}").encode() for kind in ("urdf", "toml"))
    assert oracle.judge_urdf(urdf) == "" and oracle.judge_toml(toml, toml) == ""


def test_a_seed_makes_one_mutant() -> None:
    data = read_text("rhi.urdf").encode()
    for seed in range(30):
        first = mutants.mutant(data, mutants.URDF, seed)
        assert first == mutants.mutant(data, mutants.URDF, seed) != data


@pytest.mark.parametrize("twin", ["door", "excavator", "panda"])
@pytest.mark.slow
def test_no_mutant_of_a_twin_falls_or_hangs(twin: str, runner: Runner, tmp_path: Path) -> None:
    original, path = read_text(f"twins/{twin}.toml").encode(), tmp_path / "twin.toml"
    verdicts: Counter[str] = Counter()
    bad = []
    for seed in range(SEED, SEED + COUNT // 2):
        path.write_bytes(mutants.mutant(original, mutants.TOML, seed))
        found = runner(Path(f"giant with {path}"))
        verdicts[found["verdict"]] += 1
        if found["verdict"] not in ("ran", "refused"):
            bad.append((seed, found["verdict"], found["why"]))
    assert not bad, f"{len(bad)}: " + "\n".join(map(str, bad[:20]))
    assert verdicts["refused"] > 20 and verdicts["ran"] > 5
