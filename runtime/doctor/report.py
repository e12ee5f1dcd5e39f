"""All checks in one go, as text and as JSON."""

from __future__ import annotations

import textwrap
from collections import Counter
from collections.abc import Callable

import msgspec

from ..core.sections import Config, SimulatedBus
from ..timing.host import Host
from . import cpu, kernel, permissions
from .can import can_lines
from .libraries import library_lines
from .line import Line, State

CHECKS: tuple[Callable[[Host], Line], ...] = (
    kernel.preempt_rt,
    kernel.timer_threads,
    kernel.rt_throttling,
    kernel.fair_server,
    permissions.fifo,
    permissions.memlock,
    cpu.governor,
    cpu.sleep_states,
    cpu.isolated_cpus,
    cpu.irq_affinity,
    cpu.hardware_threads,
    kernel.clocksource,
    kernel.swap,
)


def examine(host: Host, versions: dict[str, str | None], config: Config | None = None) -> list[Line]:
    """Every check's line; with a configuration, of its processor and its CAN interface alone."""
    lines = [check(host) for check in CHECKS]
    bus, devices, rate = None, 0, 0.0
    if config:
        lines.append(cpu.loop_cpu(host, config.loop.cpu))
        bus = None if isinstance(config.bus, SimulatedBus) else config.bus
        devices, rate = len(config.devices), config.loop.rate
    return lines + can_lines(host.links(), bus, devices, rate) + library_lines(versions)


def fit(lines: list[Line]) -> bool:
    """Whether nothing fails."""
    return all(line.state is not State.FAIL for line in lines)


def as_json(lines: list[Line]) -> str:
    """The lines, and how many came out how."""
    counts = Counter(line.state for line in lines)
    return msgspec.json.encode(
        {
            "lines": lines,
            "passed": counts[State.PASS],
            "warned": counts[State.WARN],
            "failed": counts[State.FAIL],
        }
    ).decode()


def as_text(lines: list[Line]) -> str:
    """A line for each check; below those that do not pass, why it matters and what to type."""
    width = max(len(line.check) for line in lines)
    text = []
    for line in lines:
        text.append(f"{line.state.value:5} {line.check:{width}}  {line.found}")
        if line.state is not State.PASS:
            text += textwrap.wrap(line.why, 100, initial_indent="        ", subsequent_indent="        ")
            text.append(f"        {line.fix}")
    counts = Counter(line.state for line in lines)
    passed, warned, failed = (counts[state] for state in State)
    text.append(f"{passed} pass, {warned} warn, {failed} fail")
    return "\n".join(text)
