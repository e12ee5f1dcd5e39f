"""Settings that the kernel may refuse, and the choice whether to spin."""

import os
import signal
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
from hapticd.runtime.core.stages import Stage, Stages
from hapticd.runtime.timing import realtime
from hapticd.runtime.timing import vitals as vitals_module
from hapticd.runtime.timing.realtime import Granted, automatic_spin_ns, isolated_cpus, leave_cpu
from hapticd.runtime.timing.vitals import VitalSigns


@pytest.mark.parametrize(("text", "cpus"), [("\n", set()), ("3\n", {3}), ("1-2,5\n", {1, 2, 5})])
def test_isolated_processors_are_read_from_the_kernel_s_list(
    tmp_path: Path, text: str, cpus: set[int]
) -> None:
    path = tmp_path / "isolated"
    path.write_text(text)
    assert isolated_cpus(path) == cpus
    assert isolated_cpus(tmp_path / "none") == set()


def test_spinning_needs_fifo_and_a_processor_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(realtime, "isolated_cpus", lambda: {3})
    assert automatic_spin_ns(Granted(), 3) == realtime.SPIN_NS
    assert automatic_spin_ns(Granted(), 2) == 0
    assert automatic_spin_ns(Granted(), None) == 0
    assert automatic_spin_ns(Granted(fifo=False), 3) == 0
    assert automatic_spin_ns(Granted(cpu=False), 3) == 0


def in_child(work: str) -> int:
    """Exit status of a child process that runs Python statements."""
    child = os.fork()
    if child == 0:
        try:
            exec(work)
        except BaseException:
            os._exit(1)
        os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def test_a_processor_that_does_not_exist_is_refused_with_the_fix_and_the_rest_is_still_asked_for() -> None:
    work = """
from hapticd.runtime.timing.realtime import become_realtime
granted = become_realtime(1, 4095)
assert not granted.cpu
assert any("processor 4095" in text and "[loop] cpu" in text for text in granted.lost)
assert granted.fifo == (not any("SCHED_FIFO" in text for text in granted.lost))
"""
    assert in_child(work) == 0


def test_the_wish_to_stay_awake_is_held_until_the_process_ends(tmp_path: Path) -> None:
    limit = tmp_path / "cpu_dma_latency"
    assert not realtime.stay_awake(limit)
    limit.write_bytes(b"")
    work = f"""
import os
from pathlib import Path
from hapticd.runtime.timing.realtime import stay_awake
assert stay_awake(Path({str(limit)!r}))
held = [os.path.realpath(f"/proc/self/fd/{{fd}}") for fd in os.listdir("/proc/self/fd")]
assert {str(limit)!r} in held
"""
    assert in_child(work) == 0
    assert limit.read_bytes() == bytes(4)


def test_other_processes_leave_the_loop_s_processor() -> None:
    cpus = sorted(os.sched_getaffinity(0))
    if len(cpus) < 2:
        pytest.skip("one processor only")
    child = os.fork()
    if child == 0:
        signal.pause()
    try:
        leave_cpu(child, cpus[0])
        assert os.sched_getaffinity(child) == set(cpus[1:])
        leave_cpu(child, None)
        assert os.sched_getaffinity(child) == set(cpus[1:])
    finally:
        os.kill(child, 9)
        os.waitpid(child, 0)


def test_stages_add_up_and_the_log_s_stays_until_its_next_end() -> None:
    stages = Stages()
    start = stages.begin()
    for stage in (Stage.RECEIVE, Stage.SAFETY, Stage.SOLVE, Stage.SAFETY):
        stages.mark(stage)
    ns = stages.ns
    assert sum(ns) == stages.elapsed_ns > 0
    assert ns[Stage.MODEL] == 0
    assert stages.packed == b"".join(n.to_bytes(4, "little") for n in ns)
    stages.mark(Stage.LOG)
    log = stages.ns[Stage.LOG]
    assert log > 0
    assert stages.begin() > start
    assert stages.ns == (*[0] * 10, log)
    time.sleep(2e-3)
    durations = []
    for _ in range(100):
        stages.mark(Stage.LOG)
        durations.append(stages.ns[Stage.LOG])
    assert durations[0] > 2_000_000
    assert min(durations) < 2_000_000  # of its last run, not of all together


def test_memory_settles_after_a_time_however_rare_the_looks_are(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 0
    monkeypatch.setattr(vitals_module, "lib", SimpleNamespace(rt_now=lambda: now))
    vitals = VitalSigns()
    work = vitals.watch()
    work.send(None)
    early = bytearray(b"x" * (16 << 20))
    work.send(None)
    assert vitals.found.rss_growth_kib > 15_000
    work.send(None)
    now = round(1e9 * vitals_module.SETTLED_S)
    work.send(None)
    assert vitals.found.rss_growth_kib < 1_000  # counted from here on
    late = bytearray(b"x" * (16 << 20))
    work.send(None)
    work.send(None)
    assert vitals.found.rss_growth_kib > 15_000
    work.close()
    assert len(early) == len(late)


def test_vital_signs_see_memory_that_grows_and_faults_since_arming() -> None:
    vitals = VitalSigns()
    pages = bytearray(16 << 20)
    vitals.look()
    assert vitals.found.minor_faults == 0  # not armed yet
    vitals.armed()
    more = bytearray(b"x" * (32 << 20))
    vitals.armed()  # the first time counts
    vitals.look()
    assert vitals.found.rss_growth_kib > 30_000
    assert vitals.found.minor_faults > 0
    assert vitals.found.threads >= 1
    assert len(pages) + len(more) == 48 << 20
