"""CAN interfaces: up, CAN FD, bit timing, error state, queue; as ``ip -json -details link`` tells them."""

from __future__ import annotations

from typing import Any

from .line import Line, State

WHY = "The daemon's frames need CAN FD; a bus that is down, passive or wrongly timed loses them."
NOMINAL, DATA = 1_000_000, 5_000_000
"""Bit rates that the proposed commands set [bit/s]."""
CANFD_MTU = 72
SAMPLE_POINTS = (0.7, 0.9)
"""Where in a bit the usual controllers sample; outside, devices of other makers often disagree."""
SHORTEST_QUEUE = 64
"""Frames that may wait to be sent: one tick's, at bring-up, of the largest machine the wire can carry."""


def can_lines(links: list[dict[str, Any]], wanted: str | None) -> list[Line]:
    """A line for the interface that a configuration wants, or else for each that there is."""
    found = [link for link in links if kind(link) in ("can", "vcan", "vxcan")]
    if wanted is not None:
        found = [link for link in found if link["ifname"] == wanted]
        if not found:
            fix = f"plug the adapter in, then: {up(wanted)}    # a virtual one: {up_virtual(wanted)}"
            return [Line(f"can_{wanted}", State.FAIL, "there is no such CAN interface", WHY, fix)]
    if not found:
        return [Line("can", State.PASS, "no interface; the simulated plant needs none", WHY)]
    return [can_line(link) for link in found]


def can_line(link: dict[str, Any]) -> Line:
    """The worst that can be said of one interface."""
    name = str(link["ifname"])
    virtual = kind(link) != "can"
    restart = f"sudo ip link set {name} down; {f'sudo ip link set {name} mtu 72 up' if virtual else up(name)}"
    state, text, fix = State.PASS, _timing(link), ""
    for judged, problem, remedy in (
        (State.FAIL, _dead(link), restart),
        (State.FAIL, _not_fd(link), restart),
        (State.WARN, _errors(link), f"check cable, termination and bit rates, then: {restart}"),
        (
            State.WARN,
            _sampling(link),
            f"{restart.replace(' fd on', ' sample-point 0.8 dsample-point 0.75 fd on')}",
        ),
        (State.WARN, _queue(link), f"sudo ip link set {name} txqueuelen 1000"),
    ):
        if problem:
            state, text, fix = judged, problem, remedy
            break
    return Line(f"can_{name}", state, text, WHY, fix)


def up(name: str) -> str:
    """The command that brings a CAN FD interface up."""
    return f"sudo ip link set {name} up type can bitrate {NOMINAL} dbitrate {DATA} fd on"


def up_virtual(name: str) -> str:
    """The command that makes a virtual CAN FD interface."""
    return f"sudo ip link add dev {name} type vcan && sudo ip link set {name} mtu {CANFD_MTU} up"


def kind(link: dict[str, Any]) -> str:
    """Kind of a link: "can", "vcan", ...; "" where it has none."""
    return str(link.get("linkinfo", {}).get("info_kind", ""))


def _data(link: dict[str, Any]) -> dict[str, Any]:
    data: dict[str, Any] = link.get("linkinfo", {}).get("info_data", {})
    return data


def _dead(link: dict[str, Any]) -> str:
    if "UP" not in link.get("flags", []):
        return "is down"
    state = _data(link).get("state", "")
    return "is off the bus after too many errors" if state == "BUS-OFF" else ""


def _not_fd(link: dict[str, Any]) -> str:
    return "" if link.get("mtu") == CANFD_MTU else f"is not in CAN FD mode (mtu {link.get('mtu')})"


def _errors(link: dict[str, Any]) -> str:
    state = _data(link).get("state", "ERROR-ACTIVE")
    if state == "ERROR-ACTIVE":
        return ""
    counter = _data(link).get("berr_counter", {})
    return f"{state}: {counter.get('tx', '?')} errors sending, {counter.get('rx', '?')} receiving"


def _sampling(link: dict[str, Any]) -> str:
    for timing in ("bittiming", "data_bittiming"):
        point = float(_data(link).get(timing, {}).get("sample_point", SAMPLE_POINTS[0]))
        if not SAMPLE_POINTS[0] <= point <= SAMPLE_POINTS[1]:
            return f"samples at {point:.1%} of a bit ({_timing(link)})"
    return ""


def _queue(link: dict[str, Any]) -> str:
    length = int(link.get("txqlen", SHORTEST_QUEUE))
    return "" if length >= SHORTEST_QUEUE else f"only {length} frames may wait to be sent"


def _timing(link: dict[str, Any]) -> str:
    if kind(link) != "can":
        return "up, virtual, CAN FD"
    data = _data(link)
    parts = []
    for name in ("bittiming", "data_bittiming"):
        timing = data.get(name, {})
        rate, point = timing.get("bitrate"), timing.get("sample_point")
        if rate:
            parts.append(f"{rate / 1e6:g} Mbit/s at {float(point or 0.0):.1%}")
    return f"{data.get('state', 'up')}, {' and '.join(parts)}"
