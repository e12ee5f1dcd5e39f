"""The bus that a configuration or a person names."""

from __future__ import annotations

import shlex
import shutil
import textwrap
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import can
import pytest
from hapticd.configs import read_text
from hapticd.devices.errors import AdapterError, NoSocketCanError
from hapticd.devices.python_can import PythonCanAdapter
from hapticd.devices.socket_adapter import unix_pair
from hapticd.runtime.command_line import cli
from hapticd.runtime.configuration import bus as module
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.bus import bus_warnings, open_bus
from hapticd.runtime.configuration.config import Loaded
from hapticd.runtime.configuration.session import build
from hapticd.runtime.core.sections import PythonCanBus, SocketCanBus
from hapticd.runtime.errors import ConfigError
from hapticd.runtime.invocation import script_path
from hapticd.runtime.timing.host import Host

REAL = (('on_overrun = "record"', 'on_overrun = "stop"'), ('by = "dead-man"', 'by = "command"'))


class Linked(Host):
    """A host with a CAN FD interface of 1 and 5 Mbit/s."""

    def links(self) -> list[dict[str, Any]]:
        data = {"bittiming": {"bitrate": 1_000_000}, "data_bittiming": {"bitrate": 5_000_000}}
        return [{"ifname": "can0", "linkinfo": {"info_kind": "can", "info_data": data}}]


def loaded_with(write_config: Callable[..., Path], bus: str) -> Loaded:
    return config.load(str(write_config(('kind = "simulated"', bus), *REAL)))


SOCKETCAN = 'kind = "socketcan"\ninterface = "can0"\nbitrate = "{}"\ndata_bitrate = "5 Mbit/s"\n'


@pytest.mark.parametrize(("rate", "fits"), [("1 Mbit/s", True), ("1000 kbit/s", True), ("500 kbit/s", False)])
def test_an_interface_with_other_bit_rates_is_refused_with_the_command(
    monkeypatch: pytest.MonkeyPatch, write_config: Callable[..., Path], rate: str, fits: bool
) -> None:
    here, there = unix_pair()
    opened: list[tuple[Any, ...]] = []
    monkeypatch.setattr(module, "socketcan", lambda *given: opened.append(given) or here)
    bus = loaded_with(write_config, SOCKETCAN.format(rate)).config.bus
    assert isinstance(bus, SocketCanBus)
    if fits:
        assert open_bus(bus, "giant", Linked()) is here
    else:
        with pytest.raises(AdapterError) as refused:
            open_bus(bus, "giant", Linked())
        assert str(refused.value) == (
            "can0: has bitrate 1 Mbit/s, not 0.5 Mbit/s as [bus] says. Type: sudo ip link set can0 down; "
            "sudo ip link set can0 up type can bitrate 500000 dbitrate 5000000 fd on"
        )
        assert here.closed
    assert opened == [("can0", 1_000_000 if fits else 500_000, 5_000_000)]  # for what its errors propose
    here.close()
    there.close()


def test_settings_of_python_can_go_from_the_file_to_the_interface(write_config: Callable[..., Path]) -> None:
    bus = loaded_with(
        write_config,
        'kind = "python-can"\ninterface = "virtual"\nchannel = "x"\nsettings = { rx_queue_size = 3 }\n',
    ).config.bus
    assert isinstance(bus, PythonCanBus)
    adapter = open_bus(bus, "giant")
    assert isinstance(adapter, PythonCanAdapter)
    assert adapter._bus.queue.maxsize == 3  # type: ignore[attr-defined]
    assert adapter._bus.protocol is can.CanProtocol.CAN_FD
    adapter.close()


def test_the_example_of_the_manual_is_a_machine() -> None:
    manual = (Path(__file__).parents[2] / "docs" / "devices.md").read_text()
    example = manual.partition("# my_machine.toml")[2].partition("    hapticd plant")[0]
    machine = tomllib.loads(read_text("giant.toml"))
    for table, keys in tomllib.loads("#" + textwrap.dedent("    " + example)).items():
        if table == "bus":
            machine["bus"] = keys
        else:
            update(machine[table], keys)
    giant = config.load("giant")
    made = config.of_tree(machine, giant.text, "")
    build(Loaded("", made, giant.text, "", giant.model_text, giant.model_source))
    assert bus_warnings(made.bus, made) == []


def update(tree: dict[str, Any], changes: dict[str, Any]) -> None:
    for key, value in changes.items():
        if isinstance(value, dict):
            update(tree[key], value)
        else:
            tree[key] = value


@pytest.mark.parametrize(("rate", "warned"), [("1 kHz", True), ("500 Hz", False)])
def test_a_rate_that_python_can_hardly_carries_is_warned_of(
    write_config: Callable[..., Path], rate: str, warned: bool
) -> None:
    bus = 'kind = "python-can"\ninterface = "udp_multicast"\nchannel = "x"\n'
    changes = (('kind = "simulated"', bus), ('rate = "1 kHz"', f'rate = "{rate}"'), *REAL)
    machine = config.load(str(write_config(*changes))).config
    said = bus_warnings(machine.bus, machine)
    assert bool(said) == warned
    assert not warned or "give a [loop] rate of at most 641 Hz, or use SocketCAN" in said[0]
    simulated = config.load("giant").config
    assert bus_warnings(simulated.bus, simulated) == []
    assert bus_warnings(machine.bus, simulated)  # the plant may serve another bus than its configuration's


@pytest.mark.parametrize(
    ("settings", "match"),
    [
        (
            "{ bitrate = 5 }",
            r"machine\.toml:\d+: bus\.settings\.bitrate: has a key of its own; write bitrate",
        ),
        ("{ fd = false }", r"bus\.settings\.fd: is not to be chosen: the wire is CAN FD; leave it out"),
        ("{ receive_own_messages = true }", r"receive_own_messages: is not to be chosen"),
        ("{ port = nan }", r"bus\.settings\.port: nan is not a setting; give a text, a finite number"),
        ("{ port = -inf }", r"bus\.settings\.port: -inf is not a setting"),
        ("{ port = [1] }", r"bus\.settings\.port: \[1\] is not a setting"),
        ("{ port = { a = 1 } }", r"bus\.settings\.port: \{'a': 1\} is not a setting"),
        ("{ port = 1979-05-27 }", r"is not a setting"),
    ],
)
def test_settings_that_no_interface_may_have_are_named_with_their_line(
    write_config: Callable[..., Path], settings: str, match: str
) -> None:
    bus = f'kind = "python-can"\ninterface = "udp_multicast"\nchannel = "x"\nsettings = {settings}\n'
    with pytest.raises(ConfigError, match=match) as wrong:
        build(loaded_with(write_config, bus))
    line = Path(wrong.value.source).read_text().splitlines()[wrong.value.findings[0].line - 1]
    assert line.startswith("settings") or line == "[bus]"


@pytest.mark.parametrize(
    ("bus", "match"),
    [
        ('kind = "socketcan"\ninterface = "can0"\nbitrate = 1000000\n', r"1000000 has no unit; write e\.g\."),
        (
            'kind = "socketcan"\ninterface = "can0"\nbitrate = "1 MHz"\n',
            r"not a unit of bit rate; use one of bit/s",
        ),
        ('kind = "socketcan"\ninterface = "can0"\nbitrate = "1 Gbit/s"\n', r"not a unit of bit rate"),
        ('kind = "socketcan"\ninterface = "can0"\nbitrate = "100 Mbit/s"\n', r"out of range"),
        ('kind = "socketcan"\ninterface = "can0"\nbitrate = "0 bit/s"\n', r"out of range"),
    ],
)
def test_bit_rates_are_quantities(write_config: Callable[..., Path], bus: str, match: str) -> None:
    with pytest.raises(ConfigError, match=match):
        loaded_with(write_config, bus)


def plant(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *arguments: str
) -> tuple[int, str, list[Any]]:
    """Exit status, what was said, and the buses that were to be served."""
    served: list[Any] = []
    monkeypatch.setattr(
        "hapticd.runtime.live.plant_process.serve_interface", lambda loaded, bus: served.append(bus) or 0
    )
    status = cli.main(["plant", *arguments])
    return status, capsys.readouterr().err, served


def test_the_plant_serves_the_bus_of_the_configuration(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], write_config: Callable[..., Path]
) -> None:
    bus = 'kind = "python-can"\ninterface = "udp_multicast"\nchannel = "239.0.0.1"\nsettings = { port = 4 }\n'
    path = write_config(('kind = "simulated"', bus), *REAL)
    assert plant(monkeypatch, capsys, str(path)) == (
        0,
        "",
        [PythonCanBus(interface="udp_multicast", channel="239.0.0.1", settings={"port": 4})],
    )


def test_the_plant_serves_another_bus_where_a_person_names_one(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["giant", "--interface", "vcan0", "--bitrate", "1 Mbit/s"]
    (bus,) = plant(monkeypatch, capsys, *options)[2]
    assert bus == SocketCanBus(interface="vcan0", bitrate=1e6)
    options = ["giant", "--interface", "pcan", "--channel", "PCAN_USBBUS1", "--data-bitrate", "5 Mbit/s"]
    (bus,) = plant(monkeypatch, capsys, *options, "--set", "auto_reset=true", "--set", "name=a=b")[2]
    assert (bus.interface, bus.channel, bus.data_bitrate) == ("pcan", "PCAN_USBBUS1", 5e6)
    assert bus.settings == {"auto_reset": True, "name": "a=b"}


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (
            [],
            r"bus: is simulated: the daemon starts its plant itself; name a bus with --interface",
        ),
        (["--channel", "x"], "need an interface; add --interface"),
        (["--bitrate", "1 Mbit/s"], "need an interface"),
        (["--interface", "can0", "--set", "port=1"], "needs a channel of python-can; add --channel"),
        (
            ["--interface", "udp_multicast"],
            "--channel: is missing: udp_multicast is an interface of python-can, which has channels; "
            "add e.g. --channel 239.74.163.2",
        ),
        (["--interface", "neousys"], "add --channel CH; python-can's documentation names them"),
        (["--interface", "virtual", "--channel", "x", "--set", "fd=false"], "fd: is not to be chosen"),
    ],
)
def test_what_does_not_fit_together_is_said(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], options: list[str], says: str
) -> None:
    status, said, served = plant(monkeypatch, capsys, "giant", *options)
    assert (status, served) == (2, [])
    assert says in said


@pytest.mark.parametrize("options", [["--bitrate", "1"], ["--set", "port"], ["--set", "=1"]])
def test_options_that_are_none_are_bad_usage(capsys: pytest.CaptureFixture[str], options: list[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        cli.main(["plant", "giant", "--interface", "can0", *options])
    assert ended.value.code == 2
    assert options[0] in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--interface", "nocan9"], ('"udp_multicast"', "no such interface")),
        (["--interface", "pcam", "--channel", "x"], ('Did you mean "pcan"?',)),
        (["--interface", "udp_multicast", "--channel", "x", "--set", "prot=1"], ('Did you mean "port"?',)),
        (["--interface", "slcan", "--channel", "x"], ("no CAN FD",)),
    ],
)
def test_a_bus_that_cannot_be_served_says_what_works(
    capsys: pytest.CaptureFixture[str], options: list[str], says: tuple[str, ...]
) -> None:
    assert cli.main(["plant", "giant", *options]) == 1
    said = capsys.readouterr().err
    assert "error [device]" in said
    assert any(text in said for text in says), said


def test_an_interface_of_python_can_is_not_sought_in_the_kernel(
    write_config: Callable[..., Path],
) -> None:
    bus = 'kind = "socketcan"\ninterface = "udp_multicast"\n'
    with pytest.raises(ConfigError, match=r'bus\.interface: .*write kind = "python-can" and channel = "239'):
        build(loaded_with(write_config, bus))


def test_the_plant_that_is_proposed_where_there_is_no_socketcan_can_be_typed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def none(interface: str, *_: int) -> None:
        raise NoSocketCanError(interface, "this kernel has no SocketCAN", "Type: sudo modprobe can-raw")

    monkeypatch.setattr(module, "socketcan", none)
    with pytest.raises(AdapterError) as refused:
        open_bus(SocketCanBus(interface="can0"), "my machine.toml")
    command = shlex.split(str(refused.value).partition("whose other end is: ")[2])
    assert Path(shutil.which(command[0]) or "").samefile(script_path() or "")
    assert command[1:3] == ["plant", "my machine.toml"]
    (bus,) = plant(monkeypatch, capsys, "giant", *command[3:])[2]
    assert bus == PythonCanBus(interface="udp_multicast", channel="239.74.163.2")
