import os
import shlex
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ALLOCATORS = ("malloc", "calloc", "realloc", "aligned_alloc")
COUNTING = ["-DCOUNT_ALLOCATIONS", *(f"-Wl,--wrap={name}" for name in ALLOCATORS)]
SANITIZED = ["-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]


def run(tmp_path, flags, *arguments):
    compiler = shlex.split(os.environ.get("CC", "cc"))
    sources = [str(ROOT / "tests" / "hqp" / "core.c"), *map(str, sorted((ROOT / "csrc").glob("hqp*.c")))]
    program = tmp_path / "core"
    options = ["-std=c11", "-O2", "-ffp-contract=off", f"-I{ROOT / 'csrc'}", *flags]
    subprocess.run([*compiler, *options, *sources, "-lm", "-o", program], check=True)
    return subprocess.run([program, *arguments], capture_output=True, text=True)


def test_rough_data_never_allocate_crash_or_differ(tmp_path):
    done = run(tmp_path, COUNTING, "3000")
    assert (done.returncode, done.stdout) == (0, "passed\n"), done.stdout


def test_sanitizers_find_nothing(tmp_path):
    done = run(tmp_path, SANITIZED, "600")
    if "sanitizer" in done.stderr and "not supported" in done.stderr:
        pytest.skip("no sanitizers here")
    assert (done.returncode, done.stdout, done.stderr) == (0, "passed\n", "")
