"""``hapticd plant``: a simulated machine at the other end of a bus."""

from __future__ import annotations

import argparse

from .arguments import Commands, add_twin, bit_rate, chosen, name, setting


def add_plant(commands: Commands) -> None:
    """Add `hapticd plant`."""
    plant = commands.add_parser(
        "plant",
        help="simulate a machine at the other end of a bus",
        description="Simulate a machine's devices on the bus that its configuration names under [bus], or on "
        "another one; never on a real machine's. A bus of python-can has a channel, SocketCAN has none.",
    )
    plant.add_argument(
        "config", type=name, metavar="CONFIG", help="a TOML file with [simulation], or a built-in machine"
    )
    add_twin(plant)
    plant.add_argument(
        "--interface", type=name, metavar="IF", help="e.g. vcan0, or of python-can: udp_multicast, pcan, ..."
    )
    plant.add_argument(
        "--channel", type=name, metavar="CH", help="of python-can, e.g. 239.74.163.2 or PCAN_USBBUS1"
    )
    plant.add_argument("--bitrate", type=bit_rate, metavar="RATE", help='e.g. "1 Mbit/s"')
    plant.add_argument("--data-bitrate", type=bit_rate, metavar="RATE", help='e.g. "5 Mbit/s"')
    plant.add_argument(
        "--set",
        type=setting,
        action="append",
        default=[],
        metavar="KEY=VALUE",
        dest="settings",
        help="a setting of python-can's interface; more than once where there are several",
    )
    plant.set_defaults(handler=run, json=False)


def run(options: argparse.Namespace) -> int:
    """Serve the bus until Ctrl-C; the exit status."""
    from ..configuration import config
    from ..configuration.bus import chosen_bus
    from ..live.plant_process import serve_interface

    loaded = config.load(chosen(options))
    rates = {"bitrate": options.bitrate, "data_bitrate": options.data_bitrate}
    bus = chosen_bus(loaded, options.interface, options.channel, rates, dict(options.settings))
    return serve_interface(loaded, bus)
