from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from canopen import ObjectDictionary, import_od
from canopen.objectdictionary import ODArray, ODRecord
from hapticd import configs
from hapticd.configs import plugins
from hapticd.devices.device import Device
from hapticd.devices.dictionary import load
from hapticd.devices.errors import EdsError
from msgspec.structs import fields

EDS = Path(configs.__path__[0])
NAMES = sorted(path.name for path in EDS.glob("*.eds"))


def edited(tmp_path: Path, name: str, old: str, new: str) -> str:
    text = (EDS / name).read_text()
    assert old in text
    path = tmp_path / name
    path.write_text(text.replace(old, new, 1))
    return str(path)


def eds(kind: type[Device]) -> str:
    return str(next(field.default for field in fields(kind) if field.name == "eds"))


def test_there_is_an_eds_for_every_device_type() -> None:
    kinds = (plugins.plugin(plugins.DEVICES, name) for name in plugins.names(plugins.DEVICES))
    assert sorted({eds(kind) for kind in kinds}) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_an_eds_has_the_objects_that_the_wire_needs(name: str) -> None:
    dictionary = load(name, 5)
    assert [m.address for m in dictionary.tpdo[:2]] == [(0x2100, 1), (0x2100, 2)]
    assert dictionary.default((0x1800, 1)) == 0x185
    assert dictionary.default((0x1014, 0)) == 0x085
    assert len(str(dictionary.default((0x1008, 0)))) > 4
    assert set(dictionary.identity) == {(0x1008, 0), (0x1018, 1), (0x1018, 2), (0x1018, 3)}


@pytest.mark.parametrize("name", NAMES)
def test_the_lists_of_an_eds_name_exactly_its_objects(name: str) -> None:
    listed, sections = [], []
    for line in (EDS / name).read_text().splitlines():
        if line.startswith("[") and len(line) == 6:
            sections.append(int(line[1:5], 16))
        elif "=0x" in line and line.split("=")[0].isdigit():
            listed.append(int(line.split("=")[1], 16))
    assert sorted(listed) == sorted(sections)


def described(objects: ObjectDictionary) -> Iterator[dict[str, Any]]:
    for index, entry in sorted(objects.indices.items()):
        parts = entry.subindices.values() if isinstance(entry, ODRecord | ODArray) else [entry]
        for variable in parts:
            shown = {key: value for key, value in vars(variable).items() if key != "parent"}
            yield {"of": f"{type(entry).__name__} {entry.name} 0x{index:X}", **shown}


@pytest.mark.parametrize("name", NAMES)
def test_what_is_relative_to_the_node_is_so_for_each_node(name: str, tmp_path: Path) -> None:
    path = edited(tmp_path, name, "DefaultValue=", "ParameterValue=$NODEID+0x10\nDefaultValue=")
    for node in (1, 5, 127):
        objects, expected = load(path, node).objects, import_od(path, node)
        assert (objects.node_id, list(described(objects))) == (node, list(described(expected)))


def test_the_mapping_of_a_joint_drive_is_in_the_order_of_its_eds() -> None:
    joint = load("joint_drive.eds", 1)
    assert [(hex(m.address[0]), m.offset, m.size) for m in joint.tpdo] == [
        ("0x2100", 0, 2),
        ("0x2100", 2, 1),
        ("0x6041", 3, 2),
        ("0x6061", 5, 1),
        ("0x6064", 6, 4),
        ("0x2200", 10, 4),
        ("0x606c", 14, 4),
        ("0x6077", 18, 2),
        ("0x603f", 20, 2),
    ]
    assert [m.entry for m in joint.rpdo] == [0x6040_0010, 0x6071_0010]


def test_values_are_encoded_by_their_type() -> None:
    joint = load("joint_drive.eds", 1)
    assert joint.encode((0x6060, 0), 10) == b"\x0a"
    assert joint.encode((0x6071, 0), -1) == b"\xff\xff"
    assert joint.encode((0x6076, 0), 100_000) == b"\xa0\x86\x01\x00"
    assert joint.decode((0x6064, 0), b"\xfe\xff\xff\xff") == -2
    assert joint.decode((0x6064, 0), b"\xfe\xff") == b"\xfe\xff"
    with pytest.raises(EdsError, match="6060h:00 cannot be 1000"):
        joint.encode((0x6060, 0), 1000)
    with pytest.raises(EdsError, match="1234h:05 is missing"):
        joint.encode((0x1234, 5), 0)


def test_a_missing_file_is_named() -> None:
    with pytest.raises(EdsError, match=r"nowhere\.eds.*No such file"):
        load("nowhere.eds", 1)


@pytest.mark.parametrize("text", ["[DeviceInfo]\n", "not an EDS", "[DeviceInfo]\nVendorNumber=x\n", "\0\xff"])
def test_a_file_that_is_no_eds_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "broken.eds"
    path.write_text(text)
    with pytest.raises(EdsError, match=r"broken\.eds"):
        load(str(path), 1)


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("DefaultValue=0x21000110", "DefaultValue=0x60410010", "must begin with 2100h:01"),
        ("DefaultValue=0x60410010", "DefaultValue=0x60410020", "maps 32 bits of 6041h:00, which has 16"),
        ("DefaultValue=0x60410010", "DefaultValue=0x70000010", "7000h:00 is missing"),
        ("DefaultValue=0x60410010", "DefaultValue=0x10080008", "data type"),
    ],
)
def test_a_mapping_that_cannot_be_is_refused(tmp_path: Path, old: str, new: str, why: str) -> None:
    with pytest.raises(EdsError, match=why):
        load(edited(tmp_path, "joint_drive.eds", old, new), 1)
