"""Drives that disobey, people who type and press, a bus that loses things, all at random; the plant judges.

python -m tests.runtime.test_random_faults FIRST LAST [MACHINE ...]        runs more of them
python -m tests.runtime.test_random_faults FIRST LAST aimed [MACHINE ...]  one or two each
"""

from __future__ import annotations

import itertools
import sys
from collections import Counter
from collections.abc import Sequence

import pytest

from .aimed_faults import MOMENTS, aimed, before, brought
from .campaign import GIVEN, RATES, Campaign
from .conftest import MACHINES


@pytest.mark.parametrize(
    ("machine", "rate", "moment", "seed"),
    [
        *zip(itertools.cycle(MACHINES), itertools.repeat("500 Hz"), MOMENTS, range(6)),
        *zip(itertools.cycle(reversed(MACHINES)), itertools.repeat("1 kHz"), MOMENTS, range(6)),
        *(("rhi", "4 kHz", moment, 6) for moment in ("ENGAGING", "reset")),
        ("giant", "4 kHz", "STOPPING", 6),
        ("giant", "500 Hz", "ACTIVE", 10),  # an encoder is wrong while its axis moves
        ("giant", "500 Hz", "ACTIVE", 18),
        ("panda", "1 kHz", "ENGAGING", 0),
        ("operator", "1 kHz", "STOPPING", 0),
        ("avatar", "1 kHz", "ACTIVE", 0),
    ],
)
def test_one_or_two_faults_in_any_mode_at_any_rate(machine: str, rate: str, moment: str, seed: int) -> None:
    aimed(brought(machine, rate, before(moment)), moment, seed)


@pytest.mark.parametrize("seed", range(6))
def test_whatever_happens_no_drive_keeps_power_and_nothing_starts_by_itself(seed: int) -> None:
    assert Campaign(seed).run() == []


def aim_at_all(first: int, last: int, machines: Sequence[str]) -> None:
    """The same numbers of sessions for each machine, rate and moment."""
    count, found = 0, 0
    for machine, rate in itertools.product(machines, RATES):
        for moment in MOMENTS:
            session = brought(machine, rate, before(moment))
            for seed in range(first, last):
                count += 1
                try:
                    aimed(session, moment, seed)
                except pytest.fail.Exception as failure:
                    found += 1
                    print(f"{moment}, seed {seed}: {failure}", flush=True)
            print(machine, rate, moment, f"{last - first} sessions, {found} found so far", flush=True)
    print(f"{count} sessions, {found} with something found")


def run_all(first: int, last: int, machines: Sequence[str]) -> None:
    """The same numbers of sessions for each machine; whatever rate the seed draws."""
    modes: Counter[str] = Counter()
    for machine in machines:
        for seed in range(first, last):
            campaign = Campaign(seed, machine)
            for found in campaign.run():
                print(f"seed {seed}: {found}", flush=True)
            modes += campaign.modes
        print(machine, f"{last - first} sessions", flush=True)
    print(f"ticks by mode {dict(modes)}")


if __name__ == "__main__":
    seeds, words = map(int, sys.argv[1:3]), sys.argv[3:]
    if words[:1] == ["aimed"]:
        aim_at_all(*seeds, words[1:] or tuple(GIVEN))
    else:
        run_all(*seeds, words or tuple(GIVEN))
