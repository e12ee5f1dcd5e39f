"""Opening the bus that a configuration names, at either end."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from math import inf
from typing import Any

from ...configs.quantities import BitRate
from ...devices.adapter import Adapter
from ...devices.errors import AdapterError, NoSocketCanError
from ...devices.python_can import RESERVED, example_channel, knows, python_can
from ...devices.socket_adapter import BITRATE, DATA_BITRATE, socketcan, up_command
from ..core.sections import Bus, Config, PythonCanBus, SimulatedBus, SocketCanBus
from ..errors import ConfigError, Finding
from ..invocation import program
from ..timing.host import Host
from .config import Loaded
from .toml_lines import key_lines, line_of

NamedBus = SocketCanBus | PythonCanBus
"""A bus that anybody may open; the simulated one is between the daemon and its plant."""
SENT_US, RECEIVED_US = 27.0, 15.0
"""What a frame costs through python-can, over udp_multicast on an ordinary virtual machine [us]."""
LARGEST_SHARE = 0.15
"""Share of a period that python-can may take without making ticks late."""
_ENDLESS = (inf, -inf)


def open_bus(bus: NamedBus, machine: str, host: Host | None = None) -> Adapter:
    """One end of a bus.

    Args:
        bus: its section of the configuration.
        machine: the configuration, as a person names it.
        host: whose interfaces are looked at; this one, where it is None.

    Raises:
        AdapterError: it cannot be opened, or runs at other bit rates than the configuration says.
    """
    if isinstance(bus, PythonCanBus):
        bitrate, data_bitrate = whole(bus.bitrate), whole(bus.data_bitrate)
        return python_can(bus.interface, bus.channel, bitrate, data_bitrate, bus.settings)
    try:
        adapter = socketcan(bus.interface, *proposed_rates(bus))
    except NoSocketCanError as error:
        end = f"{program()} plant {shlex.quote(machine)} --interface udp_multicast --channel 239.74.163.2"
        raise AdapterError(error.bus, error.reason, f"{error.remedy}, whose other end is: {end}") from error
    if bus.bitrate or bus.data_bitrate:
        links = [link for link in (host or Host()).links() if link.get("ifname") == bus.interface]
        wrong = wrong_rates(links[0], bus) if links else ""
        if wrong:
            adapter.close()
            raise AdapterError(bus.interface, wrong, f"Type: {restart_command(bus)}")
    return adapter


def chosen_bus(
    loaded: Loaded,
    interface: str | None,
    channel: str | None,
    rates: Mapping[str, BitRate | None],
    settings: Mapping[str, Any],
) -> NamedBus:
    """The bus of a configuration, or the one that a person names instead of it.

    Args:
        loaded: the configuration.
        interface: of SocketCAN or of python-can; None where none is named.
        channel: of python-can; None for SocketCAN.
        rates: bitrate and data_bitrate; None as the bus has it.
        settings: of an interface of python-can.

    Raises:
        ConfigError: neither names a bus, or what is named does not fit together.
    """
    given = channel is not None or any(rates.values()) or bool(settings)
    bus = loaded.config.bus
    if interface is None and given:
        fix = "add --interface, or leave them out to take the bus of the configuration"
        raise ConfigError("--channel, --bitrate, --set", [Finding(0, "", "need an interface", fix)])
    if interface is None:
        if isinstance(bus, SimulatedBus):
            problem = "is simulated: the daemon starts its plant itself"
            fix = "name a bus with --interface, e.g. --interface vcan0 (and write it under [bus], too)"
            raise ConfigError(loaded.source, [_finding(loaded, "bus", problem, fix)])
        return bus
    if channel is None:
        if knows(interface):
            problem = f"is missing: {interface} is an interface of python-can, which has channels"
            raise ConfigError("--channel", [Finding(0, "", problem, f"add {_channel_option(interface)}")])
        if settings:
            fix = "add --channel; SocketCAN takes no settings"
            raise ConfigError("--set", [Finding(0, "", "needs a channel of python-can", fix)])
        return SocketCanBus(interface=interface, **rates)
    named = PythonCanBus(interface=interface, channel=channel, settings=dict(settings), **rates)
    found = check_bus(named)
    if found:
        raise ConfigError("--set", [Finding(0, key, problem, fix) for key, problem, fix in found])
    return named


def _channel_option(interface: str) -> str:
    example = example_channel(interface)
    return f"e.g. --channel {example}" if example else "--channel CH; python-can's documentation names them"


def check_bus(bus: Bus) -> list[tuple[str, str, str]]:
    """What no host can make right: findings (key, problem, fix) in a [bus] section."""
    found = []
    if isinstance(bus, SocketCanBus) and knows(bus.interface):
        example = example_channel(bus.interface) or "..."
        fix = f'write kind = "python-can" and channel = "{example}"'
        found.append(("bus.interface", f"{bus.interface} is an interface of python-can", fix))
    if isinstance(bus, PythonCanBus):
        for key, value in bus.settings.items():
            name = f"bus.settings.{key}"
            if key in ("interface", "channel", "bitrate", "data_bitrate"):
                found.append((name, "has a key of its own", f"write {key} under [bus]"))
            elif key in RESERVED:
                found.append((name, "is not to be chosen: the wire is CAN FD", "leave it out"))
            elif not isinstance(value, bool | int | float | str) or value != value or value in _ENDLESS:
                fix = "give a text, a finite number, true or false"
                found.append((name, f"{value!r} is not a setting", fix))
    return found


def slowness(bus: Bus, devices: int, loop_rate: float) -> tuple[str, str] | None:
    """Whether frames cost too much of a tick, and what to do; python-can moves them one by one.

    Args:
        bus: its section of the configuration.
        devices: how many there are on it.
        loop_rate: of the daemon [Hz].
    """
    cost = devices * RECEIVED_US + 2.0 * SENT_US  # SYNC, and another output frame
    if not isinstance(bus, PythonCanBus) or cost * loop_rate <= LARGEST_SHARE * 1e6:
        return None
    found = f"python-can takes about {cost:.0f} us of a tick of {1e6 / loop_rate:.0f} us"
    return found, f"give a [loop] rate of at most {LARGEST_SHARE * 1e6 / cost:.0f} Hz, or use SocketCAN"


def bus_warnings(bus: Bus, config: Config) -> list[str]:
    """What a person should know of a bus before a machine runs on it."""
    slow = slowness(bus, len(config.devices), config.loop.rate)
    return ["; ".join(slow)] if slow else []


def proposed_rates(bus: SocketCanBus) -> tuple[int, int]:
    """Bit rates that proposed commands set [bit/s]: those of the configuration, where it gives any."""
    return whole(bus.bitrate) or BITRATE, whole(bus.data_bitrate) or DATA_BITRATE


def restart_command(bus: SocketCanBus) -> str:
    """The command that gives an interface of the kernel the bit rates of its configuration."""
    return f"sudo ip link set {bus.interface} down; {up_command(bus.interface, *proposed_rates(bus))}"


def wrong_rates(link: dict[str, Any], bus: SocketCanBus) -> str:
    """How an interface's bit rates differ from the configuration's; "" where they agree or none are told.

    Args:
        link: the interface, as ``ip -json -details link`` tells it.
        bus: its section of the configuration.
    """
    wrong = [
        f"{name} {rate(told)}, not {rate(wanted)}"
        for name, told, wanted in (
            ("bitrate", told_rate(link, "bittiming"), bus.bitrate),
            ("data_bitrate", told_rate(link, "data_bittiming"), bus.data_bitrate),
        )
        if told and wanted and told != round(wanted)
    ]
    return f"has {' and '.join(wrong)} as [bus] says" if wrong else ""


def told_rate(link: dict[str, Any], timing: str) -> int | None:
    """A bit rate of an interface [bit/s], as the kernel tells it; None where it has none."""
    told = link.get("linkinfo", {}).get("info_data", {}).get(timing, {}).get("bitrate")
    return None if told is None else int(told)


def rate(bits_per_second: float) -> str:
    """A bit rate for people."""
    return f"{bits_per_second / 1e6:g} Mbit/s"


def whole(rate: float | None) -> int | None:
    """A bit rate as python-can and the kernel take it [bit/s]."""
    return None if rate is None else round(rate)


def _finding(loaded: Loaded, key: str, problem: str, fix: str) -> Finding:
    return Finding(line_of(key, key_lines(loaded.text)), key, problem, fix)
