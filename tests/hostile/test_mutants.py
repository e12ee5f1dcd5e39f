"""Damaged files are refused with an error, or are no worse than the original.

Nothing falls, nothing hangs, nothing slips in.

``HAPTICD_MUTANTS=2000`` tries more of each file, ``HAPTICD_MUTANT_SEED`` others; `make mutants` does both.
"""

import json
import os
import random
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
from hapticd.configs import read_text

from . import additions, mutants, oracle

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


MODELS = {"operator": "bimanual", "avatar": "bimanual", "panda_rhi": "panda"}
"""Machines whose models have other names."""
FULL = {"giant": additions.giant(), "operator": additions.operator()}
"""Configurations with what the built-in ones leave out."""
BUILT_IN = {
    name: read_text(f"{name}.toml").encode()
    for name in ("giant", "rhi", "panda", "panda_rhi", "operator", "avatar")
}
FEW = max(COUNT // 5, 40)


def configuration(machine: str) -> bytes:
    """Of a machine, or of "full" and a machine."""
    return FULL[machine.removeprefix("full ")] if machine.startswith("full ") else BUILT_IN[machine]


@pytest.mark.parametrize(
    ("kind", "machine", "count"),
    [
        *(("urdf", machine, COUNT) for machine in ("giant", "rhi")),
        *(("urdf", machine, FEW) for machine in ("panda", "operator")),
        *(("toml", machine, COUNT) for machine in BUILT_IN),
        *(("toml", f"full {machine}", FEW) for machine in FULL),
    ],
)
@pytest.mark.slow
def test_no_mutant_falls_hangs_or_slips_in(
    kind: str, machine: str, count: int, runner: Runner, tmp_path: Path
) -> None:
    name = machine.removeprefix("full ")
    model = MODELS.get(name, name)
    files = {f"{name}.toml": configuration(machine), f"{model}.urdf": read_text(f"{model}.urdf").encode()}
    for file, data in files.items():
        (tmp_path / file).write_bytes(data)
    file, mutations = (f"{model}.urdf", mutants.URDF) if kind == "urdf" else (f"{name}.toml", mutants.TOML)
    verdicts: Counter[str] = Counter()
    bad = []
    for seed in range(SEED, SEED + count):
        data = mutants.mutant(files[file], mutations, seed)
        (tmp_path / file).write_bytes(data)
        found = runner(tmp_path / f"{name}.toml")
        verdicts[found["verdict"]] += 1
        if found["verdict"] == "ran":
            wrong = oracle.judge_urdf(data) if kind == "urdf" else oracle.judge_toml(data, files[file])
            if wrong:
                bad.append((seed, "accepted", wrong))
        elif found["verdict"] != "refused" or (not found["why"].isprintable() and "\n" not in found["why"]):
            bad.append((seed, found["verdict"], found["why"]))
    assert not bad, f"{len(bad)} of {count}: " + "\n".join(map(str, bad[:20]))
    assert verdicts["refused"] > count / 3  # the mutations bite
    assert verdicts["ran"] > count / 50  # and not everything is refused


@pytest.mark.parametrize("machine", [*BUILT_IN, *(f"full {machine}" for machine in FULL)])
def test_the_oracle_finds_nothing_wrong_with_files_that_are_right(machine: str) -> None:
    toml, name = configuration(machine), machine.removeprefix("full ")
    assert oracle.judge_toml(toml, toml) == ""
    assert oracle.judge_urdf(read_text(f"{MODELS.get(name, name)}.urdf").encode()) == ""


@pytest.mark.parametrize(
    ("machine", "old", "new", "wrong"),
    [
        ("panda", "joint_2 = 1.0", "joint_2 = 1e4", "out of range"),
        ("full giant", 'margin = "20 mm"', 'margin = "0 mm"', "nothing"),
        ("panda", 'd_gain = "72 N m s/rad"', 'd_gain = "0 N m s/rad"', "nothing"),
        ("panda", 'turned = "0 0 0 rad"\n', "", "lacks ['turned']"),
        ("panda", 'upper = "inf inf inf m"\n', "", "arm.boxes[1] lacks ['upper']"),
        ("rhi", 'margin = "0.15 rad"', 'margin = "0 rad"', "nothing"),
        ("avatar", 'damping = "110 N s/m"', 'damping = "0 N s/m"', "nothing"),
        ("avatar", 'palm = "0.085 0 0.135 m"', 'palm = "0.085 0 m"', "3 numbers"),
        ("operator", 'delay = "0 ms"', 'delay = "20 s"', "out of the key's range"),
        ("operator", 'fade = "3 s"', 'fade = "2 s"', "out of the key's range"),
        ("full giant", "coupling = 0.002", "coupling = 2", "out of range"),
        ("full giant", 'seconds = "0.5 s"', "", "lacks ['seconds']"),
    ],
)
def test_the_oracle_sees_what_is_wrong(machine: str, old: str, new: str, wrong: str) -> None:
    right = configuration(machine)
    assert old.encode() in right
    assert wrong in oracle.judge_toml(right.replace(old.encode(), new.encode(), 1), right)


def test_a_seed_makes_one_mutant() -> None:
    data = read_text("rhi.urdf").encode()
    for seed in range(30):
        first = mutants.mutant(data, mutants.URDF, seed)
        assert first == mutants.mutant(data, mutants.URDF, seed) != data


def test_a_mutant_that_is_nested_twice_is_one() -> None:
    """A tree too deep to be written again stays as it was."""
    data, deep = read_text("giant.urdf").encode(), 0
    for seed in range(400):
        rng = random.Random(seed)
        once = mutants._nest(rng, data)
        deep += mutants._nest(rng, once) == once
    assert deep > 0


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
