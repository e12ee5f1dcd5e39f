"""Writes seeds for the fuzz target: small problems of every nasty kind, and what a sequence of solves may do.

    python seeds.py FOLDER

The encoding is that of fuzz.c.
"""

import struct
import sys
from pathlib import Path

from hapticd.hqp.generate import KINDS, problem

MOST_N, MOST_LEVELS, MOST_ROWS = 6, 4, 4
SOLVE, RESOLVE, RESET = range(3)
NAN, INFINITY, ONE = b"\x1c", b"\x1e", b"\x02"  # selectors of fuzz.c's `telling`


def number(value):
    """One double: the selector of raw bytes, and these."""
    return b"\xff" + struct.pack("<d", value)


def cut(levels):
    """The first MOST_ROWS rows of each part: A, b, C, lb, ub."""
    return [tuple(part[:MOST_ROWS] for part in (lv.A, lv.b, lv.C, lv.lb, lv.ub)) for lv in levels]


def encode(levels, operations):
    """A problem with automatic settings, its first solve without a change, and the operations."""
    n = levels[0][0].shape[1]
    head = bytes([n - 1, len(levels) - 1, 0])
    rows = bytes(len(part) for A, _, C, _, _ in levels for part in (A, C))
    entries = b"".join(number(value) for level in levels for part in level for value in part.flat)
    return head + rows + entries + bytes(2) + b"".join(operations)


def operation(what, first, changes):
    """One of SOLVE, RESOLVE, RESET after changes of (level after the first, part, entry, selector)."""
    changed = b"".join(bytes(change[:3]) + change[3] for change in changes)
    return bytes([what, 16 * first, len(changes)]) + changed


def sequences():
    """A drifting bound, a NaN that comes and goes, a reset, a resolve."""
    drift = [operation(SOLVE, 0, [(0, 3, k, b"\x40"), (0, 4, k, b"\xe0")]) for k in range(3)]
    refused = [operation(SOLVE, 0, [(0, 2, 0, NAN)]), operation(SOLVE, 0, [(0, 2, 0, ONE)])]
    unbounded = [operation(SOLVE, 0, [(0, 4, 0, INFINITY)]), operation(RESET, 0, [])]
    later = [operation(RESOLVE, 1, [(0, 1, 0, b"\xa0"), (0, 1, 1, b"\x50")]), operation(RESOLVE, 0, [])]
    return drift, refused, unbounded, later


def write(folder):
    """One file for each kind, size and sequence; returns how many."""
    count = 0
    for kind in KINDS:
        for seed, (n, levels) in enumerate([(2, 2), (4, 3), (MOST_N, MOST_LEVELS)]):
            small = cut(problem(kind, seed, n, levels))
            for operations in sequences():
                (folder / f"{kind}-{count}").write_bytes(encode(small, operations))
                count += 1
    return count


if __name__ == "__main__":
    print(write(Path(sys.argv[1])), "seeds")
