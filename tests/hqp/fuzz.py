"""Fuzzes the solver's C interface with libFuzzer under AddressSanitizer and UndefinedBehaviorSanitizer.

    python tests/hqp/fuzz.py [--seconds S | --runs N] [--corpus FOLDER]

Exit status 0: no promise broken; 1: a finding, whose input is kept beside the corpus; 2: no clang.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from seeds import write

ROOT = Path(__file__).parents[2]
FLAGS = ["-std=c11", "-g", "-O2", "-ffp-contract=off", "-fno-sanitize-recover=all"]
SANITIZERS = "-fsanitize=fuzzer,address,undefined"
LONGEST_INPUT, SLOWEST_S = 256, 10


def main():
    """Build, write seeds, run; says how many inputs were executed."""
    options = arguments()
    corpus = options.corpus / "corpus"
    corpus.mkdir(parents=True, exist_ok=True)
    program = build(options.corpus)
    if not any(corpus.iterdir()):
        print(write(corpus), "seeds")
    budget = f"-runs={options.runs}" if options.runs else f"-max_total_time={options.seconds}"
    limits = [f"-timeout={SLOWEST_S}", f"-max_len={LONGEST_INPUT}", "-print_final_stats=1"]
    command = [program, budget, *limits, f"-artifact_prefix={options.corpus}/", corpus]
    with (options.corpus / "fuzz.log").open("w") as log:
        status = subprocess.run(command, stderr=log, check=False).returncode
    said = (options.corpus / "fuzz.log").read_text()
    executed = re.findall(r"stat::number_of_executed_units: (\d+)", said)
    if status or not executed:
        print(said[-4000:])
        raise SystemExit(f"fuzz: a finding; see {options.corpus}/crash-*, timeout-*, fuzz.log")
    rate = re.findall(r"stat::average_exec_per_sec: +(\d+)", said)[-1]
    print(f"{int(executed[-1])} executions, {rate} a second, no finding")


def arguments():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    budget = parser.add_mutually_exclusive_group()
    budget.add_argument("--seconds", type=int, default=60, help="default: 60")
    budget.add_argument("--runs", type=int, help="number of inputs instead of a time")
    parser.add_argument("--corpus", type=Path, default=ROOT / "build" / "fuzz", help="kept from run to run")
    return parser.parse_args()


def build(folder):
    """Compile the target; ends with status 2 where clang or its libFuzzer is missing."""
    names = [os.environ.get("CLANG", "clang"), *(f"clang-{version}" for version in range(22, 13, -1))]
    clang = next(filter(None, map(shutil.which, names)), None)
    if not clang:
        print("fuzz: no clang found; e.g.: sudo apt install clang  (or name one: CLANG=...)", file=sys.stderr)
        raise SystemExit(2)
    parts = (path for part in ("hqp*.c", "extended/*.c") for path in sorted((ROOT / "csrc").glob(part)))
    sources = [ROOT / "tests" / "hqp" / "fuzz.c", *parts]
    program = folder / "fuzz"
    command = [clang, *FLAGS, SANITIZERS, f"-I{ROOT / 'csrc'}", *sources, "-lm", "-o", program]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        print(done.stderr, file=sys.stderr)
        print("fuzz: clang cannot build the target; it needs libFuzzer, e.g.:", end=" ", file=sys.stderr)
        print("sudo apt install libclang-rt-dev", file=sys.stderr)
        raise SystemExit(2)
    return program


if __name__ == "__main__":
    main()
