"""Every check on hosts that pass, and on hosts that do not: with the command that mends them."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hapticd.runtime.doctor import cpu, kernel, permissions
from hapticd.runtime.doctor.line import Line, State
from hapticd.runtime.doctor.report import CHECKS
from hapticd.runtime.timing.host import Host

MakeHost = Callable[..., Host]
Files = dict[str, str | bytes]
CPUS = "/sys/devices/system/cpu"
CLOCK = "/sys/devices/system/clocksource/clocksource0"
FAIR = "/sys/kernel/debug/sched/fair_server"
SWAPS = "Filename Type Size Used Priority\n"


def limits(realtime: str, memory: str) -> Files:
    return {
        "/proc/self/limits": "Limit                     Soft Limit           Hard Limit           Units\n"
        f"Max locked memory         {memory:20} 99999999             bytes\n"
        f"Max realtime priority     {realtime:20} 99\n",
        "/proc/self/status": "Name:\thapticd\nCapEff:\t0000000000000000\n",
    }


def capabilities(mask: int) -> Files:
    return {**limits("0", "8388608"), "/proc/self/status": f"CapPrm:\t0\nCapEff:\t{mask:016x}\n"}


def state(number: int, latency: int, disable: int = 0) -> Files:
    folder = f"{CPUS}/cpu0/cpuidle/state{number}"
    return {
        f"{folder}/latency": f"{latency}\n",
        f"{folder}/disable": f"{disable}\n",
        f"{folder}/name": f"C{number}",
    }


def dma_latency(microseconds: int) -> Files:
    return {"/dev/cpu_dma_latency": microseconds.to_bytes(4, "little", signed=True)}


def irq(number: int, cpus: str, effective: str = "") -> Files:
    folder = f"/proc/irq/{number}"
    return {
        f"{folder}/smp_affinity_list": cpus,
        f"{folder}/effective_affinity_list": effective,
        f"{folder}/eth0/none": "",
    }


def thread(pid: int, name: str, priority: int) -> Files:
    fields = ["S", *["0"] * 36, str(priority), "1", "0"]
    return {f"/proc/{pid}/comm": f"{name}\n", f"/proc/{pid}/stat": f"{pid} ({name}) {' '.join(fields)}\n"}


PREEMPT_RT: Files = {"/sys/kernel/realtime": "1\n"}
ISOLATED: Files = {f"{CPUS}/isolated": "3\n", f"{CPUS}/online": "0-3\n", f"{CPUS}/nohz_full": "3\n"}

PASSES: list[tuple[Callable[[Host], Line], Files, str]] = [
    (
        kernel.preempt_rt,
        {"/sys/kernel/realtime": "1\n", "/proc/sys/kernel/osrelease": "6.1.0-rt"},
        "6.1.0-rt",
    ),
    (kernel.preempt_rt, {"/proc/sys/kernel/version": "#1 SMP PREEMPT_RT Debian"}, "PREEMPT_RT"),
    (kernel.timer_threads, thread(18, "ktimers/0", 1), "in the interrupt"),  # not PREEMPT_RT
    (kernel.timer_threads, {**PREEMPT_RT, **thread(18, "ktimers/0", 81)}, "priority 81, the daemon's is 80"),
    (
        kernel.timer_threads,
        {
            **PREEMPT_RT,
            **thread(18, "ktimers/0", 81),
            **thread(999, "ktimers/evil", 0),
            **thread(998, "ktimers", 0),
        },
        "priority 81",
    ),
    (kernel.rt_throttling, {"/proc/sys/kernel/sched_rt_runtime_us": "-1\n"}, "off"),
    (kernel.rt_throttling, {}, "does not throttle"),
    (kernel.fair_server, {"/proc/sys/kernel/osrelease": "6.1.0-rt-amd64"}, "has none"),
    (kernel.fair_server, {"/proc/sys/kernel/osrelease": "6.12.1", f"{FAIR}/cpu0/runtime": "0\n"}, "off"),
    (kernel.clocksource, {f"{CLOCK}/current_clocksource": "tsc\n"}, "tsc"),
    (kernel.clocksource, {f"{CLOCK}/current_clocksource": "arch_sys_counter\n"}, "arch_sys_counter"),
    (kernel.swap, {"/proc/swaps": SWAPS}, "none"),
    (permissions.fifo, limits("90", "8388608"), "priority 90 allowed, 80 used"),
    (permissions.fifo, capabilities(1 << 23), "CAP_SYS_NICE"),
    (permissions.memlock, limits("0", "unlimited"), "unlimited"),
    (permissions.memlock, capabilities(1 << 14), "CAP_IPC_LOCK"),
    (cpu.governor, {}, "does not change the frequency"),
    (cpu.governor, {f"{CPUS}/cpu0/cpufreq/scaling_governor": "performance\n"}, "performance"),
    (cpu.sleep_states, {}, "no sleep"),
    (cpu.sleep_states, {**state(0, 0), **state(1, 2), **state(2, 400, disable=1)}, "C1 takes 2 us"),
    (cpu.sleep_states, {**state(1, 2), **state(2, 400), **dma_latency(10)}, "C1 takes 2 us"),
    (cpu.sleep_states, {**state(1, 2), **dma_latency(0)}, "no sleep"),
    (cpu.isolated_cpus, ISOLATED, "CPU 3"),
    (cpu.irq_affinity, {}, "no CPU is isolated"),
    (cpu.irq_affinity, {**ISOLATED, **irq(9, "0-3", "1"), **irq(10, "0-2")}, "no interrupt runs on CPU 3"),
    (cpu.irq_affinity, {**ISOLATED, "/proc/irq/11/smp_affinity_list": "3"}, "no interrupt"),  # not in use
    (cpu.hardware_threads, {f"{CPUS}/smt/active": "0\n"}, "one per core"),
    (cpu.hardware_threads, {}, "one per core"),
]

PROBLEMS: list[tuple[Callable[[Host], Line], Files, State, str, str]] = [
    (
        kernel.preempt_rt,
        {"/proc/sys/kernel/osrelease": "6.1.0-amd64", "/proc/sys/kernel/version": "#1 SMP PREEMPT_DYNAMIC"},
        State.FAIL,
        "Linux 6.1.0-amd64 without PREEMPT_RT",
        "sudo apt install linux-image-rt-",
    ),
    (
        kernel.timer_threads,
        {
            **PREEMPT_RT,
            **thread(18, "ktimers/0", 81),
            **thread(28, "ktimers/1", 1),
            **thread(38, "ktimers/2", 80),
        },
        State.WARN,
        "priority 1, the daemon's is 80 (CPU 1-2)",
        "for p in $(pgrep ^ktimers/); do sudo chrt --fifo --pid 81 $p; done",
    ),
    (
        kernel.timer_threads,
        {**PREEMPT_RT, **thread(17, "ksoftirqd/0", 0)},
        State.WARN,
        "no thread ktimers/N is visible",
        "/hapticd doctor ",
    ),
    (
        kernel.rt_throttling,
        {"/proc/sys/kernel/sched_rt_runtime_us": "950000", "/proc/sys/kernel/sched_rt_period_us": "1000000"},
        State.WARN,
        "95% of each 1 s",
        "kernel.sched_rt_runtime_us = -1",
    ),
    (
        kernel.rt_throttling,
        {"/proc/sys/kernel/sched_rt_runtime_us": "0"},
        State.FAIL,
        "0% of each 1 s",
        "kernel.sched_rt_runtime_us = -1",
    ),
    (
        kernel.fair_server,
        {
            "/proc/sys/kernel/osrelease": "6.12.117+deb12-rt-amd64",
            f"{FAIR}/cpu0/runtime": "0\n",
            f"{FAIR}/cpu1/runtime": "50000000\n",
        },
        State.WARN,
        "50 ms of each second on 1 CPUs",
        f"for f in {FAIR}/cpu*/runtime; do printf 0 > $f; done",
    ),
    (kernel.fair_server, {"/proc/sys/kernel/osrelease": "7.0"}, State.WARN, "root alone", "printf 0 > $f"),
    (
        kernel.clocksource,
        {f"{CLOCK}/current_clocksource": "hpet", f"{CLOCK}/available_clocksource": "tsc hpet acpi_pm"},
        State.FAIL,
        "hpet, a slow one",
        f"echo tsc | sudo tee {CLOCK}/current_clocksource",
    ),
    (
        kernel.clocksource,
        {f"{CLOCK}/current_clocksource": "hpet", f"{CLOCK}/available_clocksource": "hpet acpi_pm"},
        State.FAIL,
        "hpet, a slow one",
        "dmesg | grep -i tsc",
    ),
    (
        kernel.swap,
        {"/proc/swaps": SWAPS + "/dev/sda2 partition 1000 0 -2\n/swapfile file 1000 0 -3\n"},
        State.WARN,
        "/dev/sda2, /swapfile",
        "sudo swapoff -a",
    ),
    (permissions.fifo, limits("0", "0"), State.FAIL, "priority 0 allowed, 80 needed", "- rtprio 90"),
    (permissions.fifo, limits("79", "0"), State.FAIL, "priority 79 allowed", "- rtprio 90"),
    (permissions.fifo, capabilities(1 << 14), State.FAIL, "priority 0 allowed", "- rtprio 90"),
    (permissions.memlock, limits("90", "8388608"), State.FAIL, "at most 8 MiB", "- memlock unlimited"),
    (permissions.memlock, capabilities(1 << 23), State.FAIL, "at most 8 MiB", "- memlock unlimited"),
    (
        cpu.governor,
        {
            f"{CPUS}/cpu0/cpufreq/scaling_governor": "performance",
            f"{CPUS}/cpu1/cpufreq/scaling_governor": "powersave",
        },
        State.WARN,
        "powersave",
        f"echo performance | sudo tee {CPUS}/cpu*/cpufreq/scaling_governor",
    ),
    (
        cpu.sleep_states,
        {**state(1, 2), **state(2, 133), **dma_latency(2_000_000_000)},
        State.WARN,
        "C2 takes 133 us to end",
        "-le 20 ] || echo 1 > $s/disable",
    ),
    (
        cpu.isolated_cpus,
        {f"{CPUS}/isolated": "\n", f"{CPUS}/online": "0-3\n"},
        State.WARN,
        "none",
        "isolcpus=managed_irq,domain,3 nohz_full=3 rcu_nocbs=3 irqaffinity=0-2",
    ),
    (cpu.isolated_cpus, {f"{CPUS}/online": "0\n"}, State.WARN, "one CPU only", "more CPUs"),
    (
        cpu.irq_affinity,
        {**ISOLATED, **irq(9, "0-3", "3"), **irq(10, "0-3"), **irq(11, "0-2", "1")},
        State.WARN,
        "interrupts 9 10 run on CPU 3",
        "for i in 9 10; do echo 0-2 | sudo tee /proc/irq/$i/smp_affinity_list; done",
    ),
    (
        cpu.irq_affinity,
        {**ISOLATED, "/proc/812/comm": "irqbalance\n"},
        State.WARN,
        "irqbalance",
        "sudo systemctl disable --now irqbalance",
    ),
    (
        cpu.hardware_threads,
        {f"{CPUS}/smt/active": "1\n"},
        State.WARN,
        "several per core",
        f"echo off | sudo tee {CPUS}/smt/control",
    ),
]


@pytest.mark.parametrize(("check", "files", "found"), PASSES)
def test_a_host_that_passes_says_what_it_has(
    make_host: MakeHost, check: Callable[[Host], Line], files: Files, found: str
) -> None:
    line = check(make_host(files))
    assert line.state is State.PASS, line
    assert found in line.found
    assert line.fix == ""


@pytest.mark.parametrize(("check", "files", "state", "found", "fix"), PROBLEMS)
def test_a_host_that_does_not_pass_is_told_what_to_type(
    make_host: MakeHost, check: Callable[[Host], Line], files: Files, state: State, found: str, fix: str
) -> None:
    line = check(make_host(files))
    assert line.state is state, line
    assert found in line.found
    assert fix in line.fix
    assert line.why.endswith(".")


def test_every_check_is_tried_both_ways() -> None:
    assert {check for check, *_ in PASSES} == {check for check, *_ in PROBLEMS} == set(CHECKS)


def test_an_isolated_cpu_with_the_schedulers_tick_is_named(make_host: MakeHost) -> None:
    line = cpu.isolated_cpus(make_host({**ISOLATED, f"{CPUS}/isolated": "2-3\n"}))
    assert line.found == "CPU 2-3; the scheduler's tick runs on 2"


@pytest.mark.parametrize(
    ("isolated", "wanted", "state", "found", "fix"),
    [
        ("3", 3, State.PASS, "CPU 3", ""),
        ("3", None, State.WARN, "names none", "write cpu = 3 below [loop]"),
        ("3", 1, State.WARN, "CPU 1 is not isolated", "write cpu = 3 below [loop]"),
        ("3", 7, State.FAIL, "no CPU 7", "write cpu = 3 below [loop]"),
        ("", 2, State.WARN, "CPU 2 is not isolated", "nohz_full=2 rcu_nocbs=2 irqaffinity=0-1,3"),
        ("", 7, State.FAIL, "no CPU 7", "write cpu = 3 below [loop]"),
        ("", None, State.PASS, "any", ""),
    ],
)
def test_a_configuration_may_name_an_isolated_processor(
    make_host: MakeHost, isolated: str, wanted: int | None, state: State, found: str, fix: str
) -> None:
    line = cpu.loop_cpu(make_host({f"{CPUS}/isolated": isolated, f"{CPUS}/online": "0-3"}), wanted)
    assert line.state is state
    assert found in line.found
    assert fix in line.fix


@pytest.mark.parametrize("check", CHECKS)
def test_a_host_that_tells_nothing_breaks_no_check(
    make_host: MakeHost, check: Callable[[Host], Line]
) -> None:
    assert check(make_host({})).found


@pytest.mark.parametrize("check", CHECKS)
def test_this_host_is_examined_without_an_error(check: Callable[[Host], Line]) -> None:
    assert check(Host()).found
