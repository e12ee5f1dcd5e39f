"""Sessions of the giant with each built-in chain: they end, keep their limits, and are what they say."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hapticd.control.chain import LOCKED
from hapticd.experiments import giant_fig8, giant_fig9
from hapticd.experiments.rendered import Trace, Watch, consistency, excess, with_rule
from hapticd.runtime.configuration import config
from hapticd.runtime.live import lockstep_run
from hapticd.runtime.live.promise import verdict
from hapticd.runtime.recording import replay as replaying
from hapticd.runtime.recording.log import open_log

CONFIGURED: Any = config.load("giant").config
RULES = {CONFIGURED.giant.force_control.detection, "gauss"}
SECONDS = {"door": 24.0, "excavator": 30.0, "panda": 28.0}
"""What their scripts last."""
EXCESS = 1e-2
"""Most that a joint of the twin may pass its limits by [rad]."""
DEVIATION = 1e-3
"""Most that a commanded acceleration may differ from that of the constrained multibody system, relative."""


@pytest.mark.slow
@pytest.mark.parametrize("rule", sorted(RULES))
@pytest.mark.parametrize("twin", SECONDS)
def test_a_session_with_a_twin(twin: str, rule: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    loaded = with_rule(config.load(f"giant with {twin}"), rule)
    outcome = lockstep_run.run(loaded, tmp_path / "log.mcap", SECONDS[twin], live=False)
    report = outcome.report
    assert (outcome.status, outcome.message) == (0, "") and report is not None
    shown, line = verdict(loaded, report, lockstep=True)
    assert shown, line  # every limit that the twin's file promises was touched, and none was passed

    watches: list[Watch] = []
    build = replaying.build

    def watched(loaded: config.Loaded) -> Any:
        session = build(loaded)
        watches.append(Watch(session))
        return session

    monkeypatch.setattr(replaying, "build", watched)
    found = replaying.replay(open_log(str(tmp_path / "log.mcap")))
    assert found.differing_ticks == 0 and found.ticks >= 1000 * SECONDS[twin]

    trace = watches[0].trace(0.305, "")
    assert excess(trace) <= EXCESS
    if rule == "gauss":
        assert trace.same.mean() > 0.99
        assert consistency(trace) <= DEVIATION
        assert not trace.pulling.any()  # a limit pushes, it never pulls
        assert (trace.tight > 0).any()
    {"door": door, "excavator": excavator}.get(twin, lambda trace: None)(trace)


def excavator(trace: Trace) -> None:
    """Fig. 8: t_a to t_e in the paper's order, and at t_a the stick speeds up."""
    found = giant_fig8.moments(trace)
    times = list(found.values())
    assert None not in times and times == sorted(times) and len(set(times)) == 5  # type: ignore[type-var]
    assert found["t_a"] is not None
    before, after = giant_fig8.speeds(trace, found["t_a"])
    assert before > 0.1 and after > 1.5 * before


def door(trace: Trace) -> None:
    """Fig. 9: its five phases."""
    found = giant_fig9.phases(trace, float(trace.velocity[0]))
    times = [time for time in found.values() if time is not None]
    assert len(times) == 5 and times == sorted(times)
    a, b, c, d, e = times
    hinge, handle = trace.q[:, 0], trace.q[:, 1]
    before = trace.part(a, b)
    assert before.torque[:, 0].max() > 40.0 and before.torque[:, 0].min() < -40.0  # pushed and pulled in vain
    assert np.abs(before.q[:, 0]).max() < 1e-4
    pulled = trace.part(b, c)
    pulled = pulled.part(b, float(pulled.t[pulled.torque[:, 0] > 0.0][0]))
    assert pulled.q[:, 1].max() > 0.35 and np.abs(pulled.q[:, 0]).max() < 1e-4  # pressed, but pulled
    assert handle[trace.t >= c][0] > 0.35 and trace.part(c, d).q[:, 0].max() > 1.19  # it opens
    shutting = trace.part(e, float(trace.t[-1]))
    assert shutting.qd[:, 0].min() == pytest.approx(-0.8, abs=1e-6)  # no faster than its closer lets it
    assert hinge[-1] < 1e-3 and trace.held[-1, 0] == LOCKED


@pytest.mark.slow
def test_an_arm_renders_a_chain(tmp_path: Path) -> None:
    loaded = config.load("panda with excavator")
    outcome = lockstep_run.run(loaded, tmp_path / "log.mcap", 9.0, live=False)
    assert (outcome.status, outcome.message) == (0, "") or "touched" in outcome.message
    assert outcome.report is not None and not outcome.report.stop
    rows = {row.name: row for row in outcome.report.limits}
    assert rows["twin bucket"].touched == "upper" and rows["twin boom"].touched == "lower"
    assert all(row.excess is None or row.excess < EXCESS for row in outcome.report.limits)
    assert replaying.replay(open_log(str(tmp_path / "log.mcap"))).differing_ticks == 0
