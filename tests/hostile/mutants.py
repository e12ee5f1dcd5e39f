"""Random mutations of robot descriptions and configurations, as text and as structure; seeded."""

from __future__ import annotations

import random
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable

Mutation = Callable[[random.Random, bytes], bytes]

NUMBER = re.compile(rb"(?<![\w.\-+])[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?(?![\w.])")
WORDS = [
    *(b"nan", b"inf", b"-inf", b"NaN", b"Infinity", b"1e300", b"-1e300", b"1e999", b"1e-320", b"-1", b"0"),
    *(b"-0", b"", b"one", b"1_0", b"0x10", b"1,5", b"1e", b"--1", b"1e9", b"1e-9", b"1e6", b"-1e6", b"90"),
    *(b"180", b"1000", b"1e-3", b"+1", b"1.", b"1e0", b"3.14", "١".encode(), b"9" * 400, b"1" * 20),
]
UNITS = [
    *(b"N m", b"N", b"rad", b"deg", b"mm", b"m", b"s", b"ms", b"kg", b"Hz", b"kHz", b"m/s", b"rad/s", b""),
    b"furlong",
]
JUNK = [
    *(b"\x00", b"\xff", b"\xfe\xff", b"\xc3", b"\xed\xa0\x80", b"\xef\xbb\xbf", b"\r", b"\r\n", b"\t"),
    *(b"<", b">", b"&", b"&amp;", b"&#0;", b"&x;", b'"', b"'", b"]]>", b"<![CDATA[x]]>", b"<!-- c -->"),
    *(b"<?p i?>", b"#", b"[", b"]", b"{", b"}", b"=", b".", b"\\", b"1e5", b"\xe2\x80\xa8", b"<a/>"),
    b"<!DOCTYPE x>",
]


def _replace_number(rng: random.Random, data: bytes) -> bytes:
    found = list(NUMBER.finditer(data))
    if not found:
        return data
    at = rng.choice(found)
    return data[: at.start()] + rng.choice(WORDS) + data[at.end() :]


def _scale_number(rng: random.Random, data: bytes) -> bytes:
    found = list(NUMBER.finditer(data))
    if not found:
        return data
    at = rng.choice(found)
    value = float(at[0]) * rng.choice((-1.0, 0.1, 0.5, 2.0, 10.0, 1e3, 1e-3, 1e6, 1e-6, 57.3))
    return data[: at.start()] + f"{value:g}".encode() + data[at.end() :]


def _count_numbers(rng: random.Random, data: bytes) -> bytes:
    """One number more, or one less."""
    at = rng.choice(list(NUMBER.finditer(data)) or [re.match(b"", data)])
    assert at is not None
    more = rng.random() < 0.5
    return data[: at.start()] + (at[0] + b" " + at[0] if more else b"") + data[at.end() :]


def _flip(rng: random.Random, data: bytes) -> bytes:
    at = rng.randrange(len(data))
    return data[:at] + bytes([data[at] ^ (1 << rng.randrange(8))]) + data[at + 1 :]


def _insert_junk(rng: random.Random, data: bytes) -> bytes:
    at = rng.choice((0, len(data), rng.randrange(len(data)), rng.randrange(len(data))))
    return data[:at] + rng.choice(JUNK) + data[at:]


def _truncate(rng: random.Random, data: bytes) -> bytes:
    return data[: rng.randrange(len(data))]


def _cut(rng: random.Random, data: bytes) -> bytes:
    at = rng.randrange(len(data))
    return data[:at] + data[at + rng.choice((1, 2, 8, 64, 512)) :]


def _repeat(rng: random.Random, data: bytes) -> bytes:
    at, size = rng.randrange(len(data)), rng.choice((1, 4, 32, 256))
    return data[:at] + data[at : at + size] * rng.choice((2, 3, 50)) + data[at + size :]


def _lines(rng: random.Random, data: bytes) -> bytes:
    """Delete, double, move or swap lines."""
    lines = data.split(b"\n")
    i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
    match rng.randrange(4):
        case 0:
            del lines[i]
        case 1:
            lines.insert(i, lines[i])
        case 2:
            lines.insert(j, lines.pop(i))
        case _:
            lines[i], lines[j] = lines[j], lines[i]
    return b"\n".join(lines)


def _swap_numbers(rng: random.Random, data: bytes) -> bytes:
    found = list(NUMBER.finditer(data))
    if len(found) < 2:
        return data
    a, b = sorted(rng.sample(found, 2), key=lambda match: match.start())
    return data[: a.start()] + b[0] + data[a.end() : b.start()] + a[0] + data[b.end() :]


def _swap_words(rng: random.Random, data: bytes) -> bytes:
    found = list(re.finditer(rb"[A-Za-z_][A-Za-z_0-9]*", data))
    if len(found) < 2:
        return data
    a, b = sorted(rng.sample(found, 2), key=lambda match: match.start())
    return data[: a.start()] + b[0] + data[a.end() : b.start()] + a[0] + data[b.end() :]


ANY: list[Mutation] = [
    *(_replace_number, _replace_number, _scale_number, _scale_number, _count_numbers, _flip, _insert_junk),
    *(_truncate, _cut, _repeat, _lines, _lines, _swap_numbers, _swap_words),
]


# ---------------------------------------------------------------- XML by its structure


Parents = dict[ET.Element, ET.Element]
Change = Callable[[random.Random, ET.Element, list[ET.Element], Parents], None]
CORE = set("link joint inertial mass inertia parent child axis limit dynamics origin".split())


def _xml(change: Change) -> Mutation:
    def mutate(rng: random.Random, data: bytes) -> bytes:
        try:
            root = ET.fromstring(data)
        except (ET.ParseError, ValueError, LookupError):
            return data
        inner = [element for element in root.iter() if element is not root]
        if inner:
            change(rng, root, inner, {child: parent for parent in root.iter() for child in parent})
        try:
            return ET.tostring(root)
        except RecursionError:  # nested twice over
            return data

    return mutate


def _weighted(rng: random.Random, elements: list[ET.Element]) -> ET.Element:
    """Elements of links and joints rather than of shapes, of which there are more."""
    core = [e for e in elements if e.tag in CORE]
    return rng.choice(core if core and rng.random() < 0.7 else elements)


@_xml
def _delete_element(rng: random.Random, _: ET.Element, inner: list[ET.Element], parents: Parents) -> None:
    element = _weighted(rng, inner)
    parents[element].remove(element)


@_xml
def _double_element(rng: random.Random, _: ET.Element, inner: list[ET.Element], parents: Parents) -> None:
    element = _weighted(rng, inner)
    copy = ET.fromstring(ET.tostring(element))
    for attribute in rng.sample(sorted(copy.attrib), rng.randrange(len(copy.attrib) + 1)):
        copy.set(attribute, rng.choice(WORDS[:22]).decode())
    parents[element].insert(rng.randrange(len(parents[element]) + 1), copy)


@_xml
def _move_element(rng: random.Random, root: ET.Element, inner: list[ET.Element], parents: Parents) -> None:
    element, target = _weighted(rng, inner), rng.choice(inner)
    if element not in list(target.iter()) and target not in list(element.iter()):
        parents[element].remove(element)
        target.append(element)


@_xml
def _shuffle_children(rng: random.Random, root: ET.Element, inner: list[ET.Element], _: Parents) -> None:
    element = rng.choice([root, rng.choice(inner)])
    element[:] = rng.sample(list(element), len(element))


@_xml
def _swap_elements(rng: random.Random, _: ET.Element, inner: list[ET.Element], __: Parents) -> None:
    a = _weighted(rng, inner)
    b = rng.choice([e for e in inner if e.tag == a.tag])
    a.attrib, b.attrib = b.attrib, a.attrib


@_xml
def _delete_attribute(rng: random.Random, _: ET.Element, inner: list[ET.Element], __: Parents) -> None:
    element = _weighted(rng, inner)
    if element.attrib:
        del element.attrib[rng.choice(sorted(element.attrib))]


@_xml
def _change_attribute(rng: random.Random, _: ET.Element, inner: list[ET.Element], __: Parents) -> None:
    element = _weighted(rng, inner)
    if element.attrib:
        name = rng.choice(sorted(element.attrib))
        words = element.attrib[name].split() or [""]
        words[rng.randrange(len(words))] = rng.choice(WORDS).decode()
        element.attrib[name] = " ".join(words)


@_xml
def _rename(rng: random.Random, _: ET.Element, inner: list[ET.Element], __: Parents) -> None:
    element = _weighted(rng, inner)
    other = rng.choice(inner)
    match rng.randrange(3):
        case 0:
            element.tag = rng.choice([other.tag, "mimic", "safety_controller", "Limit", "x:y", "gazebo"])
        case 1 if element.attrib:
            name = rng.choice(sorted(element.attrib))
            element.set(rng.choice([*other.attrib, "nam", "XYZ", "value"]), element.attrib.pop(name))
        case _ if "type" in element.attrib:
            kinds = ["fixed", "revolute", "continuous", "prismatic", "floating", "planar", "", "Fixed"]
            element.set("type", rng.choice(kinds))
        case _:
            element.text = rng.choice(["text", "1", "\n", "<x>"])


@_xml
def _nest(rng: random.Random, _: ET.Element, inner: list[ET.Element], parents: Parents) -> None:
    element = rng.choice(inner)
    tag, parent = rng.choice(["a", element.tag, "visual", "gazebo"]), parents[element]
    parent.remove(element)
    for _level in range(rng.choice((1, 2, 30, 800))):
        wrapper = ET.Element(tag)
        wrapper.append(element)
        element = wrapper
    parent.append(element)


@_xml
def _chain(rng: random.Random, root: ET.Element, inner: list[ET.Element], __: Parents) -> None:
    """More links at the end, loops, and joints that name what is not there."""
    links = [e.get("name", "") for e in inner if e.tag == "link"]
    last = rng.choice(links or [""])
    for i in range(rng.choice((1, 3, 150, 3000))):
        name = f"more_{i}"
        if rng.random() < 0.999:
            ET.SubElement(root, "link", name=name)
        joint = ET.SubElement(root, "joint", name=f"{name}_mount", type="fixed")
        ET.SubElement(joint, "origin", xyz="0 0 0.01", rpy="0 0 0")
        ET.SubElement(joint, "parent", link=last)
        ET.SubElement(joint, "child", link=name if rng.random() < 0.999 else rng.choice(links or [""]))
        last = name


URDF: list[Mutation] = [
    *ANY,
    *(_delete_element, _delete_element, _double_element, _move_element, _shuffle_children, _swap_elements),
    *(_delete_attribute, _delete_attribute, _change_attribute, _change_attribute, _rename, _nest, _chain),
]


# ---------------------------------------------------------------- TOML by its lines

_PAIR = re.compile(rb"^(\s*[\w.\"-]+\s*=\s*)(.*?)(\s*(?:#[^\"\n]*)?)$")
VALUES = [
    *(b"nan", b"inf", b"-inf", b"+nan", b"1e300", b"1e-320", b"0", b"-1", b"1", b"1.5", b"true", b'""'),
    *(b"[]", b"{}", b"1979-05-27", b"07:32:00", b"1979-05-27T07:32:00Z", b'[1, "a"]', b"[[[[]]]]", b"'x'"),
    *(b"0xff", b"9" * 400, b"9" * 5000, b"[" * 30, b"[" * 3000, b'"1 m"', b'"nan m"', b'"1e999 rad"'),
    *(b'"1 2 3 4 N m"', b'"""\nx\n"""', b"{ a = { b = 1 } }", b'"\\u0000"', b'"\\ud800"', b"[nan]"),
    *(b"[inf, 1]", b'["1 m"]', b""),
]

EXTREMES = [b"0", b"-1", b"-1e-3", b"1e-9", b"1e-4", b"100", b"1e4", b"1e6", b"1e9", b"nan", b"inf"]


def _pairs(change: Callable[[random.Random, list[bytes], list[int]], None]) -> Mutation:
    def mutate(rng: random.Random, data: bytes) -> bytes:
        lines = data.split(b"\n")
        at = [i for i, line in enumerate(lines) if _PAIR.match(line)]
        if at:
            core = [i for i in at if not lines[i].startswith((b"at =", b"position =", b"angles ="))]
            change(rng, lines, core if core and rng.random() < 0.8 else at)
        return b"\n".join(lines)

    return mutate


def _pair(line: bytes) -> tuple[bytes, bytes, bytes]:
    match = _PAIR.match(line)
    assert match is not None
    return match[1], match[2], match[3]


@_pairs
def _set_value(rng: random.Random, lines: list[bytes], at: list[int]) -> None:
    i = rng.choice(at)
    key, _, rest = _pair(lines[i])
    lines[i] = key + rng.choice(VALUES) + rest


@_pairs
def _swap_values(rng: random.Random, lines: list[bytes], at: list[int]) -> None:
    i, j = rng.choice(at), rng.choice(at)
    (a, x, r), (b, y, s) = _pair(lines[i]), _pair(lines[j])
    lines[i] = a + y + r
    if i != j:
        lines[j] = b + x + s


@_pairs
def _delete_pair(rng: random.Random, lines: list[bytes], at: list[int]) -> None:
    del lines[rng.choice(at)]


@_pairs
def _double_pair(rng: random.Random, lines: list[bytes], at: list[int]) -> None:
    i = rng.choice(at)
    lines.insert(rng.choice((i + 1, rng.randrange(len(lines)))), lines[i])


@_pairs
def _change_number(rng: random.Random, lines: list[bytes], at: list[int]) -> None:
    i = rng.choice(at)
    key, value, rest = _pair(lines[i])
    lines[i] = key + rng.choice((_replace_number, _scale_number, _count_numbers))(rng, value) + rest


@_pairs
def _go_to_extremes(rng: random.Random, lines: list[bytes], at: list[int]) -> None:
    """A number of a key that is as likely as any other, however many lines have the same."""
    i = {_pair(lines[i])[0]: i for i in at}[rng.choice(sorted({_pair(lines[i])[0] for i in at}))]
    key, value, rest = _pair(lines[i])
    found = list(NUMBER.finditer(value))
    if found:
        number = rng.choice(found)
        new = rng.choice(EXTREMES)
        lines[i] = key + value[: number.start()] + new + value[number.end() :] + rest


@_pairs
def _change_unit(rng: random.Random, lines: list[bytes], at: list[int]) -> None:
    i = rng.choice(at)
    key, value, rest = _pair(lines[i])
    lines[i] = key + re.sub(rb'(["\d.]) [A-Za-z][^"]*"$', rb"\1 " + rng.choice(UNITS) + b'"', value) + rest


@_pairs
def _rename_key(rng: random.Random, lines: list[bytes], at: list[int]) -> None:
    i, j = rng.choice(at), rng.choice(at)
    (_, value, rest), (other, _, _) = _pair(lines[i]), _pair(lines[j])
    name = rng.choice([other, b"x = ", b"a.b = ", b'"" = ', b'"a b" = ', b".".join([b"a"] * 300) + b" = "])
    lines[i] = name + value + rest


def _sections(rng: random.Random, data: bytes) -> bytes:
    """Delete, double, reorder, rename or retype sections."""
    parts = re.split(rb"(?m)^(?=\[)", data)
    i, j = rng.randrange(len(parts)), rng.randrange(len(parts))
    match rng.randrange(5):
        case 0:
            del parts[i]
        case 1:
            parts.insert(j, parts[i])
        case 2:
            parts[1:] = rng.sample(parts[1:], len(parts) - 1)
        case 3:
            parts[i] = re.sub(
                rb"^\[+([\w.]+)\]+", rng.choice((rb"[[\1]]", rb"[\1]", rb"[x.\1]", rb"[\1.\1]")), parts[i]
            )
        case _:
            parts[i], parts[j] = parts[j], parts[i]
    return b"".join(parts)


TOML: list[Mutation] = [
    *ANY,
    *(_set_value, _set_value, _swap_values, _delete_pair, _delete_pair, _double_pair, _change_number),
    *(
        _change_number,
        _change_number,
        _go_to_extremes,
        _go_to_extremes,
        _change_unit,
        _rename_key,
        _sections,
        _sections,
    ),
]


def mutant(data: bytes, mutations: list[Mutation], seed: int) -> bytes:
    """One or, in a third of all seeds, two mutations of a file; the same for the same seed."""
    rng = random.Random(seed)
    original = data
    for _ in range(2 if rng.random() < 1 / 3 else 1):
        data = rng.choice(mutations)(rng, data) if data else data
    return data if data != original else mutant(original, mutations, seed + 1_000_003)
