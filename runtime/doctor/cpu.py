"""The CPUs: frequency, sleep, isolation, interrupts, hardware threads."""

from __future__ import annotations

from ..timing.cpu_list import format_cpus
from ..timing.host import Host
from .line import Line, State

CPUS = "/sys/devices/system/cpu"
LONGEST_WAKE_UP_US = 20
"""A sleeping CPU that needs longer than this to wake up delays ticks."""


def governor(host: Host) -> Line:
    """The policy that chooses the CPUs' frequency."""
    why = "A CPU that slows down while it waits for the next tick computes that tick slowly."
    paths = host.find(f"{CPUS}/cpu*/cpufreq/scaling_governor")
    if not paths:
        return Line("governor", State.PASS, "the kernel does not change the frequency", why)
    slow = sorted({value for path in paths if (value := host.read(path) or "unknown") != "performance"})
    if not slow:
        return Line("governor", State.PASS, "performance", why)
    fix = f"echo performance | sudo tee {CPUS}/cpu*/cpufreq/scaling_governor"
    return Line("governor", State.WARN, ", ".join(slow), why, fix)


def sleep_states(host: Host) -> Line:
    """How long the deepest sleep takes to end that the kernel may choose (C-states)."""
    why = f"Waking from a deep sleep takes longer than {LONGEST_WAKE_UP_US} us and delays the tick by it."
    deepest, name = 0, ""
    limit = wake_up_limit_us(host)
    for path in host.find(f"{CPUS}/cpu*/cpuidle/state*"):
        latency = int(host.read(f"{path}/latency") or 0)
        if host.read(f"{path}/disable") == "0" and deepest < latency <= limit:
            deepest, name = latency, host.read(f"{path}/name") or path
    if not name:
        return Line("sleep_states", State.PASS, "no sleep that takes time to end", why)
    found = f"{name} takes {deepest} us to end"
    if deepest <= LONGEST_WAKE_UP_US:
        return Line("sleep_states", State.PASS, found, why)
    fix = (
        f"sudo sh -c 'for s in {CPUS}/cpu*/cpuidle/state*; do"
        f" [ $(cat $s/latency) -le {LONGEST_WAKE_UP_US} ] || echo 1 > $s/disable; done'"
    )
    return Line("sleep_states", State.WARN, found, why, fix)


def wake_up_limit_us(host: Host) -> float:
    """What /dev/cpu_dma_latency allows [us]; infinite where it cannot be read."""
    data = host.read_bytes("/dev/cpu_dma_latency")
    return int.from_bytes(data[:4], "little", signed=True) if data and len(data) >= 4 else float("inf")


def isolated_cpus(host: Host) -> Line:
    """CPUs that ordinary processes stay away from."""
    why = "On a CPU of its own the daemon shares neither caches nor time with other processes."
    isolated, online = host.cpus(f"{CPUS}/isolated"), host.cpus(f"{CPUS}/online")
    if isolated:
        quiet = isolated & host.cpus(f"{CPUS}/nohz_full")
        ticking = (
            "" if quiet == isolated else f"; the scheduler's tick runs on {format_cpus(isolated - quiet)}"
        )
        return Line("isolated_cpus", State.PASS, f"CPU {format_cpus(isolated)}{ticking}", why)
    if len(online) < 2:
        return Line(
            "isolated_cpus", State.WARN, "this host has one CPU only", why, "use a host with more CPUs"
        )
    return Line("isolated_cpus", State.WARN, "none", why, _isolate(max(online), online))


def loop_cpu(host: Host, wanted: int | None) -> Line:
    """The processor that a configuration binds the daemon to."""
    why = "Only on an isolated CPU is the daemon alone; [loop] cpu of the configuration takes it there."
    isolated, online = host.cpus(f"{CPUS}/isolated"), host.cpus(f"{CPUS}/online")
    if wanted is not None and wanted not in online:
        fix = f"write cpu = {max(isolated or online, default=0)} below [loop]"
        return Line("loop_cpu", State.FAIL, f"this host has no CPU {wanted}", why, fix)
    if wanted is None and not isolated:
        return Line("loop_cpu", State.PASS, "any; none is isolated", why)
    if wanted in isolated:
        return Line("loop_cpu", State.PASS, f"CPU {wanted}", why)
    found = "the configuration names none" if wanted is None else f"CPU {wanted} is not isolated"
    fix = f"write cpu = {max(isolated)} below [loop]" if isolated else _isolate(wanted, online)
    return Line("loop_cpu", State.WARN, found, why, fix)


def _isolate(cpu: int | None, online: set[int]) -> str:
    parameters = (
        f"isolcpus=managed_irq,domain,{cpu} nohz_full={cpu} rcu_nocbs={cpu}"
        f" irqaffinity={format_cpus(online - {cpu})}"
    )
    return (
        f"echo 'GRUB_CMDLINE_LINUX_DEFAULT=\"$GRUB_CMDLINE_LINUX_DEFAULT {parameters}\"'"
        " | sudo tee /etc/default/grub.d/hapticd.cfg && sudo update-grub && sudo reboot"
    )


def irq_affinity(host: Host) -> Line:
    """Interrupts that may run on isolated CPUs."""
    why = "An interrupt on the daemon's CPU delays the tick that it falls into."
    isolated, online = host.cpus(f"{CPUS}/isolated"), host.cpus(f"{CPUS}/online")
    if not isolated:
        return Line("irq_affinity", State.PASS, "no CPU is isolated, so none can be disturbed", why)
    if any(host.read(path) == "irqbalance" for path in host.find("/proc/[0-9]*/comm")):
        fix = "sudo systemctl disable --now irqbalance"
        return Line("irq_affinity", State.WARN, "irqbalance moves interrupts everywhere", why, fix)
    there = []
    for path in host.find("/proc/irq/[0-9]*"):
        if host.find(f"{path}/*/"):  # a folder with the handler's name: the interrupt is in use
            cpus = host.cpus(f"{path}/effective_affinity_list") or host.cpus(f"{path}/smp_affinity_list")
            if cpus & isolated:
                there.append(int(path.rsplit("/", 1)[1]))
    if not there:
        return Line("irq_affinity", State.PASS, f"no interrupt runs on CPU {format_cpus(isolated)}", why)
    numbers = " ".join(map(str, sorted(there)))
    fix = (
        f"for i in {numbers}; do echo {format_cpus(online - isolated)}"
        " | sudo tee /proc/irq/$i/smp_affinity_list; done"
    )
    found = f"interrupts {numbers} run on CPU {format_cpus(isolated)}"
    return Line("irq_affinity", State.WARN, found, why, fix)


def hardware_threads(host: Host) -> Line:
    """Simultaneous multithreading."""
    why = "Two hardware threads share one core: what runs on the other one slows the tick down."
    if host.read(f"{CPUS}/smt/active") != "1":
        return Line("hardware_threads", State.PASS, "one per core", why)
    fix = f"echo off | sudo tee {CPUS}/smt/control    # for good: nosmt on the kernel's command line"
    return Line("hardware_threads", State.WARN, "several per core", why, fix)
