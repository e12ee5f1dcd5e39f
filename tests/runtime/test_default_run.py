"""The default run touches every limit of HapticGiant, Fig. 6, and passes none of them."""

import msgspec
import numpy as np
import pytest
from hapticd.runtime.configuration import config
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.live import lockstep_run
from hapticd.runtime.recording.log import Log, open_log
from hapticd.runtime.recording.replay import replay
from hapticd.runtime.recording.summary import Report, table

pytestmark = pytest.mark.slow

REACHED = {
    "joint 2": "upper",
    "joint 4": "upper",
    "joint 6": "lower",
    "tilt (singularity)": "lower",
    "handle x": "upper",
    "elbow x": "upper",
    "PPU x": "upper",
    "PPU y": "upper",
}
EXCESS = {"rad": 5e-3, "m": 3e-3}
EXCESS_PPU = 15e-3


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> tuple[Report, Log]:
    path = tmp_path_factory.mktemp("log") / "giant.mcap"
    loaded = config.load("giant")
    outcome = lockstep_run.run(loaded, path, None, False)
    assert outcome.status == 0
    assert outcome.report is not None
    return outcome.report, open_log(str(path))


def test_every_limit_of_the_figure_is_reached(session: tuple[Report, Log]) -> None:
    report, _ = session
    limits = {limit.name: limit for limit in report.limits}
    for name, end in REACHED.items():
        assert limits[name].touched == end, name
    assert limits["joint 1"].high - limits["joint 1"].low > 2 * np.pi  # the full turn


def test_no_limit_is_exceeded_by_more_than_it_may(session: tuple[Report, Log]) -> None:
    report, _ = session
    for limit in report.limits:
        if limit.excess is not None:
            assert limit.excess < (EXCESS_PPU if limit.name.startswith("PPU") else EXCESS[limit.unit]), (
                limit.name
            )


def test_the_handle_stays_on_the_twin(session: tuple[Report, Log]) -> None:
    report, _ = session
    figures = {figure.name: figure for figure in report.figures}
    assert figures["handle to twin"].max < 3.0 and figures["handle to twin"].unit == "mm"
    assert figures["handle to twin, turned"].max < 5.0 and figures["handle to twin, turned"].unit == "mrad"


def test_the_session_runs_through_without_a_stop(session: tuple[Report, Log]) -> None:
    report, log = session
    assert report.stop == ""
    assert report.modes["ACTIVE"] > 26_000
    assert report.frames_missing == 0
    status = [
        int(record.fixed["state"]["status"])
        for record in log.records()
        if record.fixed["mode"] == Mode.ACTIVE
    ]
    assert set(status) == {0}  # every solve ended with an answer to stand by


def test_the_operator_is_free_where_nothing_is_in_the_way_and_feels_every_limit(
    session: tuple[Report, Log],
) -> None:
    _, log = session
    force = np.array([np.linalg.norm(r.fixed["state"]["wrench"][:3]) for r in log.records()])
    assert force[4000:12_000].mean() < 8.0  # the round walk
    for start, end in ((13_300, 14_900), (15_000, 15_900), (21_300, 22_200), (27_500, 28_600)):
        assert force[start:end].max() > 30.0


def test_the_recording_replays_bit_for_bit(session: tuple[Report, Log]) -> None:
    _, log = session
    assert replay(log).differing_ticks == 0


def test_the_summary_shows_people_what_happened(session: tuple[Report, Log]) -> None:
    report, _ = session
    text = table(report)
    for word in ("HQP iterations", "modes", "worst excess", "handle to twin"):
        assert word in text
    line = next(line for line in text.splitlines() if line.startswith("joint 4"))
    assert "upper" in line and "mrad" in line


def test_times_are_shown_where_there_was_a_clock(session: tuple[Report, Log]) -> None:
    report, _ = session
    assert "tick took" not in table(report)
    timed = msgspec.structs.replace(report, compute_us={**report.compute_us, "p99": 123.4, "max": 456.7})
    row = next(line for line in table(timed).splitlines() if line.startswith("tick took"))
    assert row.split()[-3:] == ["123.4", "0.0", "456.7"]
