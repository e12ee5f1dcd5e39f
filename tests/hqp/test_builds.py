"""What is built for AVX2 solves as what is built for any machine of its kind, to the bit."""

import subprocess
import sys

import pytest
from hapticd.hqp._hqp import lib

SOLVE = """
import hashlib, sys
if {portable}:
    sys.modules["hapticd.hqp._hqp_avx2"] = None
import numpy as np
from hapticd.hqp import Solver, core
from hapticd.hqp.generate import KINDS, jump, problem

digest = hashlib.sha256()
for kind in KINDS:
    for seed in range(12):
        rng, levels = np.random.default_rng(seed), problem(kind, seed)
        solver = Solver(levels[0].n, [level.rows for level in levels])
        for _ in range(3):
            digest.update(solver.solve(levels).x.tobytes())
            jump(rng, levels)
print("avx2" in str(core.lib), digest.hexdigest())
"""


def run(portable: bool) -> list[str]:
    program = SOLVE.format(portable=portable)
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=120)
    return done.stdout.split() or [done.stderr]


@pytest.mark.skipif(not lib.hqp_has_avx2(), reason="this machine has no AVX2")
def test_both_builds_give_the_same_bits_and_the_fast_one_is_the_one_that_is_taken():
    (is_fast, fast), (is_other_fast, portable) = run(portable=False), run(portable=True)
    assert (is_fast, is_other_fast) == ("True", "False")
    assert fast == portable
