"""The wrench of the operator, foretold."""

import numpy as np
import pytest
from hapticd.control.handle_lead import FILTER, HandleLead

DT = 1e-3
AHEAD = 2.5e-3


@pytest.mark.parametrize("frequency", [1.0, 5.0, 10.0, 30.0])
def test_a_periodic_wrench_comes_as_early_and_as_large_as_the_lead_says(frequency: float) -> None:
    lead, w = HandleLead(DT, AHEAD), 2.0 * np.pi * frequency
    t = DT * np.arange(2000)
    seen = []
    for phase in w * t:
        lead.update(np.full(6, np.cos(phase)))
        seen.append(lead.wrench.copy())
    whole = np.array(seen)[1000:]  # whole periods, after it settled
    answer = 2.0 * np.exp(-1j * w * t[1000:]) @ whole / 1000
    # F (1 + T s / (1 + s / w0)), whose low-pass is sampled: a tick at 10 Hz is 3.6 degrees
    expected = 1.0 + AHEAD * 1j * w / (1.0 + 1j * frequency / FILTER)
    assert np.abs(answer - expected).max() < 0.07 * abs(expected - 1.0) + 1e-9
    assert 0.0 < np.angle(answer[0]) < w * AHEAD and abs(answer[0]) > 1.0


def test_a_wrench_that_stays_is_what_it_is_and_nothing_is_left_of_it_after_a_reset() -> None:
    lead, pull = HandleLead(DT, AHEAD), np.array([3.0, -2.0, 1.0, 0.3, 0.0, -0.1])
    lead.update(pull)
    assert (np.abs(lead.wrench[:4]) > np.abs(pull[:4])).all()
    for _ in range(500):
        lead.update(pull)
    assert lead.wrench == pytest.approx(pull, rel=1e-9)
    lead.reset()
    lead.update(np.zeros(6))
    assert not lead.wrench.any()
