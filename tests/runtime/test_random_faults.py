"""Drives that disobey, people who type and press, a bus that loses things, all at random; the plant judges.

python -m tests.runtime.test_random_faults FIRST LAST           runs more of them
python -m tests.runtime.test_random_faults FIRST LAST aimed     one or two faults, in every mode at every rate
"""

from __future__ import annotations

import itertools
import sys
from collections import Counter
from collections.abc import Sequence

import pytest

from .aimed_faults import MOMENTS, aimed, before, brought
from .campaign import RATES, Campaign
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


def main(first: int, last: int) -> None:
    modes: Counter[str] = Counter()
    for seed in range(first, last):
        campaign = Campaign(seed)
        for found in campaign.run():
            print(f"seed {seed}: {found}", flush=True)
        modes += campaign.modes
    print(f"{last - first} sessions; ticks by mode {dict(modes)}")


if __name__ == "__main__":
    if sys.argv[3:]:
        aim_at_all(int(sys.argv[1]), int(sys.argv[2]), sys.argv[4:] or MACHINES)
    else:
        main(int(sys.argv[1]), int(sys.argv[2]))
