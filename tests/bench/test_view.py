"""Many pages, one that never reads, and a view that is killed: the session does not know of them."""

from __future__ import annotations

from pathlib import Path

import pytest
from hapticd.bench.view import FIGURES, Session, session, summarise
from hapticd.runtime.recording.log import open_log
from hapticd.runtime.recording.replay import replay


@pytest.mark.live
def test_a_session_under_many_eyes_loses_no_record_and_replays(tmp_path: Path) -> None:
    log = tmp_path / "viewed.mcap"
    found = session("panda", 4.0, 20, log)
    assert found.summary["stop"] == ""
    assert found.frames > 20 * 10
    assert replay(open_log(str(log))).differing_ticks == 0


def test_a_ratio_is_of_medians_and_beside_the_spread_of_the_host() -> None:
    def at(us: float) -> Session:
        return Session({of: {which: us} for of, which in FIGURES.values()}, frames=3, pages=2)

    found = summarise([at(10.0), at(40.0), at(20.0)], [at(30.0), at(30.0), at(90.0)])
    for name in FIGURES:
        assert found[name] == {"bare_us": 20.0, "viewed_us": 30.0, "ratio": 1.5, "bare_spread": 4.0}
    assert (found["pages"], found["frames"]) == (2, 9)
