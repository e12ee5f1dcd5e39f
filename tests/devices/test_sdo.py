from __future__ import annotations

from collections.abc import Generator
from typing import TypeVar

import pytest
from hapticd.devices import sdo
from hapticd.devices.device import Device
from hapticd.devices.errors import SdoAbortError, SdoProtocolError
from hapticd.sim.objects import Objects

T = TypeVar("T")


def exchange(transfer: Generator[bytes, bytes, T], script: list[tuple[str, str]]) -> T:
    """Runs a transfer against a list of (expected request, response)."""
    request = next(transfer)
    for expected, response in script:
        assert request == bytes.fromhex(expected)
        try:
            request = transfer.send(bytes.fromhex(response))
        except StopIteration as stop:
            assert (expected, response) == script[-1]
            return stop.value  # type: ignore[no-any-return]
    raise AssertionError(f"one request too many: {request.hex()}")


def serve(transfer: Generator[bytes, bytes, T], device: Device) -> T:
    """Runs a transfer against the SDO server of a simulated device."""
    answers: list[bytes] = []
    objects = Objects(device, lambda can_id, data: answers.append(data), lambda: None)
    try:
        request = next(transfer)
        while True:
            objects.request(request)
            request = transfer.send(answers.pop())
    except StopIteration as stop:
        return stop.value  # type: ignore[no-any-return]


@pytest.mark.parametrize(
    ("response", "data"),
    [
        ("4f 17 10 00 aa 00 00 00", "aa"),
        ("4b 17 10 00 aa bb 00 00", "aabb"),
        ("47 17 10 00 aa bb cc 00", "aabbcc"),
        ("43 17 10 00 aa bb cc dd", "aabbccdd"),
        ("42 17 10 00 aa bb cc dd", "aabbccdd"),
    ],
)
def test_an_expedited_upload_has_the_bytes_of_the_standard(response: str, data: str) -> None:
    transfer = sdo.upload(1, 0x1017, 0)
    assert exchange(transfer, [("40 17 10 00 00 00 00 00", response)]) == bytes.fromhex(data)


@pytest.mark.parametrize(
    ("data", "request_bytes"),
    [
        ("aa", "2f 17 10 00 aa 00 00 00"),
        ("aabb", "2b 17 10 00 aa bb 00 00"),
        ("aabbcc", "27 17 10 00 aa bb cc 00"),
        ("aabbccdd", "23 17 10 00 aa bb cc dd"),
    ],
)
def test_an_expedited_download_has_the_bytes_of_the_standard(data: str, request_bytes: str) -> None:
    transfer = sdo.download(1, 0x1017, 0, bytes.fromhex(data))
    exchange(transfer, [(request_bytes, "60 17 10 00 00 00 00 00")])


def test_a_segmented_upload_alternates_the_toggle_bit() -> None:
    script = [
        ("40 08 10 00 00 00 00 00", "41 08 10 00 0a 00 00 00"),
        ("60 00 00 00 00 00 00 00", "00 68 61 70 74 69 63 64"),
        ("70 00 00 00 00 00 00 00", "19 20 46 54 00 00 00 00"),
    ]
    assert exchange(sdo.upload(1, 0x1008, 0), script) == b"hapticd FT"


def test_a_segmented_download_alternates_the_toggle_bit() -> None:
    script = [
        ("21 08 10 00 0a 00 00 00", "60 08 10 00 00 00 00 00"),
        ("00 68 61 70 74 69 63 64", "20 00 00 00 00 00 00 00"),
        ("19 20 46 54 00 00 00 00", "30 00 00 00 00 00 00 00"),
    ]
    exchange(sdo.download(1, 0x1008, 0, b"hapticd FT"), script)


def test_a_download_of_nothing_is_one_empty_segment() -> None:
    script = [
        ("21 08 10 00 00 00 00 00", "60 08 10 00 00 00 00 00"),
        ("0f 00 00 00 00 00 00 00", "20 00 00 00 00 00 00 00"),
    ]
    exchange(sdo.download(1, 0x1008, 0, b""), script)


@pytest.mark.parametrize("transfer", [sdo.upload(3, 0x1018, 9), sdo.download(3, 0x1018, 9, b"x")])
def test_an_abort_is_reported_with_its_text(transfer: Generator[bytes, bytes, object]) -> None:
    next(transfer)
    with pytest.raises(SdoAbortError, match=r"node 3, object 1018h:09.*0x06090011.*Subindex") as caught:
        transfer.send(bytes.fromhex("80 18 10 09 11 00 09 06"))
    assert caught.value.code == 0x06090011


def test_an_abort_code_that_nobody_knows_is_reported_too() -> None:
    transfer = sdo.upload(3, 0x1018, 1)
    next(transfer)
    with pytest.raises(SdoAbortError, match="does not list"):
        transfer.send(bytes.fromhex("80 18 10 01 ff ff ff ff"))


@pytest.mark.parametrize(
    "responses",
    [
        ["60 08 10 00 00 00 00 00"],  # the answer to a download
        ["43 09 10 00 00 00 00 00"],  # the answer for another object
        ["41 08 10 00 0a 00 00 00", "10 00 00 00 00 00 00 00"],  # wrong toggle bit
        ["41 08 10 00 0a 00 00 00", "20 00 00 00 00 00 00 00"],  # the answer to a download
        ["41 08 10 00 0a 00 00 00", "01 00 00 00 00 00 00 00"],  # ends too early
        ["41 08 10 00 03 00 00 00", "01 00 00 00 00 00 00 00"],  # more than announced
    ],
)
def test_a_broken_upload_is_a_protocol_error(responses: list[str]) -> None:
    transfer = sdo.upload(1, 0x1008, 0)
    next(transfer)
    with pytest.raises(SdoProtocolError, match="node 1, object 1008h:00"):
        for response in responses:
            transfer.send(bytes.fromhex(response))


def test_an_endless_upload_ends() -> None:
    transfer = sdo.upload(1, 0x1008, 0)
    next(transfer)
    request = transfer.send(bytes.fromhex("40 08 10 00 00 00 00 00"))
    with pytest.raises(SdoProtocolError, match="more than 4096 bytes"):
        for _ in range(1000):
            request = transfer.send(bytes([request[0] & 0x10]) + b"endless")


def test_the_object_of_a_request_is_told_only_where_a_transfer_begins() -> None:
    assert sdo.address_of(next(sdo.upload(1, 0x1018, 2))) == (0x1018, 2)
    assert sdo.address_of(next(sdo.download(1, 0x1017, 0, b"ab"))) == (0x1017, 0)
    assert sdo.address_of(bytes.fromhex("60 00 00 00 00 00 00 00")) is None
    assert sdo.address_of(bytes.fromhex("00 00 00 00 00 00 00 00")) is None


def test_client_and_simulated_server_agree(devices: list[Device]) -> None:
    joint = devices[0]
    assert serve(sdo.upload(1, 0x1008, 0), joint) == b"hapticd joint drive"
    assert serve(sdo.upload(1, 0x1018, 2), joint) == b"\x01\0\0\0"
    serve(sdo.download(1, 0x1017, 0, b"\x64\x00"), joint)


@pytest.mark.parametrize(
    ("transfer", "code"),
    [
        (sdo.upload(1, 0x5000, 0), 0x06020000),
        (sdo.upload(1, 0x1018, 9), 0x06090011),
        (sdo.download(1, 0x6041, 0, b"ab"), 0x06010002),
        (sdo.download(1, 0x1017, 0, b"abc"), 0x06070010),
        (sdo.download(1, 0x1017, 0, b"segmented"), 0x06070010),
        (sdo.download(1, 0x6060, 0, b"\x08"), 0x06090032),
        (sdo.download(1, 0x6060, 0, b"\x0b"), 0x06090031),
    ],
)
def test_the_simulated_server_aborts_as_the_standard_says(
    devices: list[Device], transfer: Generator[bytes, bytes, object], code: int
) -> None:
    with pytest.raises(SdoAbortError) as caught:
        serve(transfer, devices[0])
    assert caught.value.code == code
