import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ALLOCATORS = ("malloc", "calloc", "realloc", "aligned_alloc")
COUNTING = ["-O2", "-DCOUNT_ALLOCATIONS", *(f"-Wl,--wrap={name}" for name in ALLOCATORS)]
SANITIZED = ["-O0", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]


def compile_c(folder, flags, *arguments):
    compiler = shlex.split(os.environ.get("CC", "cc"))
    options = ["-std=c11", "-ffp-contract=off", f"-I{ROOT / 'csrc'}", *flags]
    command = [*compiler, *options, *arguments]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode and ("lasan" in done.stderr or "lubsan" in done.stderr):
        pytest.skip("this compiler comes without sanitizers")
    assert done.returncode == 0, done.stderr


def core_objects(folder, flags):
    sources = [*(ROOT / "csrc").glob("hqp*.c"), *(ROOT / "csrc" / "extended").glob("*.c")]
    compile_c(folder, flags, "-c", *sorted(sources))
    return sorted(folder.glob("*.o"))


def program(folder, name, flags, objects):
    """A program of the core's objects and the C file of this name beside this one."""
    compile_c(folder, flags, ROOT / "tests" / "hqp" / f"{name}.c", *objects, "-lm", "-o", name)
    return folder / name


def run(*command):
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def sanitized(tmp_path_factory):
    """The core's objects under AddressSanitizer and UndefinedBehaviorSanitizer."""
    return core_objects(tmp_path_factory.mktemp("sanitized"), SANITIZED)


@pytest.fixture(scope="module")
def counting(tmp_path_factory):
    """The core's objects, whose allocations are counted."""
    return core_objects(tmp_path_factory.mktemp("counting"), COUNTING)


def test_rough_data_never_allocate_crash_or_differ(tmp_path, counting):
    done = run(program(tmp_path, "core", COUNTING, counting), "3000")
    assert (done.returncode, done.stdout) == (0, "passed\n"), done.stdout


def test_sanitizers_find_nothing(tmp_path, sanitized):
    done = run(program(tmp_path, "core", SANITIZED, sanitized), "600")
    assert (done.returncode, done.stdout, done.stderr) == (0, "passed\n", "")


def test_rough_qps_never_allocate_crash_or_differ(tmp_path, counting):
    done = run(program(tmp_path, "qp", COUNTING, counting), "20000")
    assert (done.returncode, done.stdout) == (0, "passed\n"), done.stdout


def test_sanitizers_find_nothing_in_qps(tmp_path, sanitized):
    done = run(program(tmp_path, "qp", SANITIZED, sanitized), "5000")
    assert (done.returncode, done.stdout, done.stderr) == (0, "passed\n", "")


def test_valgrind_finds_no_uninitialised_value_and_no_leak(tmp_path):
    valgrind = shutil.which("valgrind")
    if not valgrind:
        pytest.skip("valgrind is not installed")
    core = program(tmp_path, "core", ["-O1", "-g"], core_objects(tmp_path, ["-O1", "-g"]))
    done = run(valgrind, "--quiet", "--error-exitcode=9", "--leak-check=full", core, "60")
    assert (done.returncode, done.stdout) == (0, "passed\n"), done.stderr


def test_the_fuzz_target_plays_its_seeds_and_survives_any_bytes(tmp_path, sanitized):
    target = program(tmp_path, "fuzz", [*SANITIZED, "-DREPLAY"], sanitized)
    seeds, any_bytes = tmp_path / "seeds", tmp_path / "any"
    seeds.mkdir()
    any_bytes.mkdir()
    run(sys.executable, ROOT / "tests" / "hqp" / "seeds.py", seeds)
    done = run(target, *sorted(seeds.iterdir()))
    assert done.stdout == "228 inputs: 55 refused, 686 solved, 0 remarks\n", done.stderr
    for size in range(300):
        pattern = bytes((size * 131 + 89 * k * k + k) % 256 for k in range(size))
        (any_bytes / str(size)).write_bytes(pattern)
    done = run(target, *any_bytes.iterdir())
    assert done.returncode == 0 and done.stdout.startswith("300 inputs: "), done.stderr
