"""What an accepted file must not hold, and must hold: written without a look at how the program reads it.

Plain ElementTree and tomllib, regular expressions, and tables of its own, which say what docs/models.md and
the built-in configurations say.
"""

from __future__ import annotations

import math
import re
import tomllib
import xml.etree.ElementTree as ET
from itertools import pairwise
from typing import Any

import numpy as np

NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
TURN = 2 * math.pi * 1.00001

# ---------------------------------------------------------------- robot descriptions

Bounds = tuple[int, float, float]
"""How many numbers, and their ends."""
MOMENT, PRODUCT, SIZE = (1, 1e-10, 1e4), (1, -1e4, 1e4), (1, 1e-4, 100.0)
NUMBERS: dict[tuple[str, str], Bounds] = {
    ("origin", "xyz"): (3, -20.0, 20.0),
    ("origin", "rpy"): (3, -TURN, TURN),
    ("axis", "xyz"): (3, -1.01, 1.01),
    ("mass", "value"): (1, 1e-4, 1000.0),
    **{("inertia", name): MOMENT for name in ("ixx", "iyy", "izz")},
    **{("inertia", name): PRODUCT for name in ("ixy", "ixz", "iyz")},
    ("dynamics", "damping"): (1, 0.0, 1e5),
    ("dynamics", "friction"): (1, 0.0, 2e4),
    ("color", "rgba"): (4, 0.0, 1.0),
    ("box", "size"): (3, 1e-4, 100.0),
    ("sphere", "radius"): SIZE,
    **{(shape, name): SIZE for shape in ("cylinder", "capsule") for name in ("radius", "length")},
    ("mesh", "scale"): (3, -1000.0, 1000.0),
}
LIMITS: dict[str, dict[str, Bounds]] = {
    "revolute": {
        **{"lower": (1, -TURN, TURN), "upper": (1, -TURN, TURN)},
        **{"effort": (1, 1e-3, 2000.0), "velocity": (1, 1e-2, 100.0)},
    },
    "continuous": {"effort": (1, 1e-3, 2000.0), "velocity": (1, 1e-2, 100.0)},
    "prismatic": {
        **{"lower": (1, -20.0, 20.0), "upper": (1, -20.0, 20.0)},
        **{"effort": (1, 1e-2, 2e4), "velocity": (1, 1e-3, 20.0)},
    },
}
TEXTS = {"name", "type", "link", "filename", "version"}
IGNORED = {"gazebo", "transmission", "ros2_control", "calibration"}
UNREAD = {"axis", "limit", "dynamics"}
"""In a fixed joint."""
CHILDREN = {
    "robot": {"link", "joint", "material"},
    "link": {"inertial", "visual", "collision", "collision_checking"},
    "joint": {"origin", "parent", "child", "axis", "limit", "dynamics"},
    "inertial": {"origin", "mass", "inertia"},
    "visual": {"origin", "geometry", "material"},
    "collision": {"origin", "geometry"},
    "geometry": {"box", "cylinder", "sphere", "mesh", "capsule"},
    "material": {"color", "texture"},
    "collision_checking": {"capsule"},
}
MANY = {"link", "joint", "material", "visual", "collision", "capsule"}


def judge_urdf(data: bytes) -> str:
    """What is wrong with a robot description, or an empty text."""
    try:
        data.decode("utf-8")
        root = ET.fromstring(data)
    except (ET.ParseError, UnicodeDecodeError, ValueError, LookupError) as error:
        return f"no XML: {error}"
    if root.tag != "robot":
        return "no <robot>"
    return next((found for found in _walk(root) if found), "") or _judge_tree(root)


def _walk(element: ET.Element, kind: str = "") -> Any:
    yield "text" if (element.text or "").strip() or (element.tail or "").strip() else ""
    kind = element.get("type", "") if element.tag == "joint" else kind
    yield from _judge_attributes(element, kind)
    names = set()
    for child in element:
        if child.tag in IGNORED or (kind == "fixed" and child.tag in UNREAD):
            continue
        yield "" if child.tag in CHILDREN.get(element.tag, ()) else f"<{child.tag}> in <{element.tag}>"
        key = (child.tag, child.get("name") if child.tag in MANY else "")
        repeated = child.tag not in MANY or key[1] is not None
        yield f"two {key}" if repeated and key in names else ""
        names.add(key)
        yield from _walk(child, kind)


def _judge_attributes(element: ET.Element, kind: str) -> Any:
    table = LIMITS.get(kind, {}) if element.tag == "limit" else {}
    for name, text in element.attrib.items():
        bounds = table.get(name) or NUMBERS.get((element.tag, name))
        if element.tag == "capsule" and name == "name":
            bounds = None
        if bounds is None:
            yield "" if name in TEXTS or "xmlns" in name else f"attribute {name} of <{element.tag}>"
            continue
        words = text.split()
        yield "" if len(words) == bounds[0] else f"{name}={text!r}: {bounds[0]} numbers"
        for word in words:
            good = NUMBER.fullmatch(word) and bounds[1] <= float(word) <= bounds[2]
            denormal = bool(good) and 0 < abs(float(word)) < 2.3e-308
            yield "" if good and not denormal else f"{name}={text!r} of <{element.tag}>"
    needed = {
        **{"link": ["name"], "mass": ["value"], "parent": ["link"], "child": ["link"]},
        **{
            "inertia": ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"],
            "limit": list(table),
        },
        **{"joint": ["name", "type"], "robot": ["name"]},
    }
    for name in needed.get(element.tag, []):
        yield "" if element.get(name) else f"<{element.tag}> lacks {name}"


def _judge_tree(root: ET.Element) -> str:
    links = {link.get("name"): link for link in root.findall("link")}
    joints = root.findall("joint")
    parents: dict[str | None, str | None] = {}
    for joint in joints:
        if joint.get("type") not in ("fixed", *LIMITS):
            return f"type {joint.get('type')}"
        needed = ["parent", "child"]
        needed += [] if joint.get("type") == "fixed" else ["limit"]
        for tag in needed:
            if joint.find(tag) is None:
                return f"joint {joint.get('name')} lacks <{tag}>"
        child, parent = joint.find("child"), joint.find("parent")
        assert child is not None and parent is not None
        if child.get("link") in parents or not {child.get("link"), parent.get("link")} <= set(links):
            return "no tree"
        parents[child.get("link")] = parent.get("link")
        if problem := _judge_moving(joint):
            return problem
    if len(set(links) - set(parents)) != 1:
        return "no single root"
    for link in links:
        seen = set()
        while link in parents:
            if link in seen:
                return "a loop"
            seen.add(link)
            link = parents[link]
    return next(filter(None, map(_judge_body, root.iter("inertial"))), "")


def _judge_moving(joint: ET.Element) -> str:
    axis, limit = joint.find("axis"), joint.find("limit")
    if joint.get("type") == "fixed" or limit is None:
        return ""
    direction = "1 0 0" if axis is None else axis.get("xyz", "1 0 0")
    if abs(math.hypot(*map(float, direction.split())) - 1.0) > 2e-3:
        return "no unit axis"
    if limit.get("lower") and float(limit.get("lower", "")) >= float(limit.get("upper", "")):
        return "lower above upper"
    return ""


def _judge_body(body: ET.Element) -> str:
    mass, inertia = body.find("mass"), body.find("inertia")
    if mass is None or inertia is None:
        return "half a body"
    entries = {key: float(value) for key, value in inertia.items()}
    matrix = [[entries[f"i{min(i, j)}{max(i, j)}"] for j in "xyz"] for i in "xyz"]
    a, b, c = np.linalg.eigvalsh(np.array(matrix))
    if a <= 0 or a + b < c * (1 - 1e-5):
        return "moments of no body"
    m = float(mass.get("value", ""))
    return "" if 0.99e-4 <= math.sqrt(a / m) and math.sqrt(c / m) <= 10.1 else "gyration"


# ---------------------------------------------------------------- configurations

RANGES = {
    **{"s": (1e-6, 1e6), "Hz": (1.0, 1e4), "m": (1e-6, 20.0), "rad": (1e-6, 100.0), "m/s": (1e-3, 20.0)},
    **{"rad/s": (1e-2, 100.0), "m/s^2": (1e-4, 1e3), "rad/s^2": (1e-2, 1e4), "kg": (1e-4, 1e3)},
    **{"kg m^2": (1e-8, 1e4), "N": (1e-6, 2e4), "N m": (1e-6, 2e3), "N/m": (1e-2, 1e6)},
    **{"N s/m": (1e-4, 1e5), "N m/rad": (1e-4, 1e6), "N m s/rad": (1e-6, 1e4)},
    **{"1/s": (1e-3, 1e4), "1/s^2": (1e-6, 1e8)},
}
"""Magnitudes by SI unit."""
SCALES = {
    **{"ms": ("s", 1e-3), "us": ("s", 1e-6), "min": ("s", 60.0), "kHz": ("Hz", 1e3), "cm": ("m", 1e-2)},
    **{"mm": ("m", 1e-3), "mrad": ("rad", 1e-3), "deg": ("rad", math.pi / 180), "mm/s": ("m/s", 1e-3)},
    **{"deg/s": ("rad/s", math.pi / 180), "deg/s^2": ("rad/s^2", math.pi / 180), "g": ("kg", 1e-3)},
}
NARROWER = {
    **{"loop.rate": (200.0, 8e3), "arming.fade": (3.0, 60.0), "safety.stop_time": (1e-6, 1.0)},
    **{"safety.position_margin": (1e-6, 0.2), "safety.ppu_margin": (1e-6, 0.2)},
    **{"giant.manipulator.tilt": (0.0, math.pi), "simulation.plant.delay": (0, 100)},
    **{f"{kind}.link.delay": (0.0, 2.0) for kind in ("operator", "avatar")},
}
"""Ranges of single keys that docs/configuration.md states, or that a person knows."""
SIGNED = re.compile(
    r"(lower|upper|tilt|point|home|posture|ppu|centre|position|angles|palm|turned|left|range|start|normal|floor)$"
)
INFINITY = ("inf", "-inf", "+inf")
FINEST = 1e-9
"""Errors of sensors may be smaller than anything else."""
NOTHING = re.compile(r"(noise|damping|friction|delay|at|bias|drift|step)$")
"""What may be 0, beside what has a sign."""
DAMPS = re.compile(r"avatar\.impedance\.\w+|(operator|avatar)\.(avatar\.)?posture\.\w+|simulation\.hand\.\w+")
"""What would swing without end."""
INFINITE = re.compile(
    r"giant\.manipulator\.(lower|upper)|arm\.(boxes\.(lower|upper)|(joints\.\w+|sums)\.range)"
)
FACTOR = (0.01, 100)
SENSORS = "motor_encoder motor_speed link_encoder load_torque force torque acceleration angular_rate".split()
PLAIN = {
    "node": (1, 127),
    "counts_per_turn": (64, 2**30),
    "link_counts_per_turn": (64, 2**30),
    "counts_per_metre": (1000, 1e8),
    "gear_ratio": (1, 1e5),
    "transmission": (-100, 100),
    "spread": (1, 1000),
    "ratio": (0, 2),
    "steepness": (0.01, 100),
    "leave": (0, 1),
    "come_back": (0, 1),
    "held": (0.01, 1),
    "rho": (0, 10),
    "urgency": (1, 100),
    "scan": (0, 20_000),
    "seed": (0, 2**53),
    "substeps": (1, 64),
    "cpu": (0, 4095),
    **{f"arm.sums.weights.joint_{i}": (-100, 100) for i in range(1, 8)},
    **{f"operator.{name}": (0, 10) for name in ("assist", "feedback", "scale")},
    "periods": (1, 100),
    "tool_mass": (0.1, 10),
    **{f"simulation.plant.{name}": FACTOR for name in ("masses", "rotor_inertia", "stiffness")},
    "simulation.plant.viscous_friction": (0, 100),
    "simulation.rhi.masses": FACTOR,
    **{f"simulation.plant.{name}_friction": (0, 1) for name in ("gear", "load", "bearing")},
    "giant.tracking.load_friction": (0, 1),
    "simulation.plant.delay": (0, 100),
    **{f"simulation.sensors.{name}.{share}": (0, 1) for name in SENSORS for share in ("gain", "coupling")},
    "stiffness_tolerance": (0, 0.6),
    "compliance.threshold": (0.02, 0.4),
    **{f"simulation.fingers.{side}": (0, 1) for side in ("left", "right")},
    "simulation.things.share": (0, 1),
    "avatar.body.base.dead_zone": (0.02, 0.5),
    "simulation.paddle.axes": (-1, 1),
}
"""Numbers without a unit, by their key or its last word."""
PATTERNS = [(r"rhi\.bodies\.\w+\.normal", (-1000, 1000)), (r"avatar\.hands\..*\.follows\.\w+", (-100, 100))]
"""The same where a person names what is on the way."""
MAY_BE_EMPTY = {"dead_man", "sums", "boxes", "walls", "away", "buttons", "things", "fingers", "pushes"}
TRUTHS = {"pressed", "best_effort", "passivity", "operator.body"} | {
    f"simulation.buttons.{side}" for side in ("left", "right")
}
OPTIONAL = re.compile(
    r"loop\.(duration|on_overrun|best_effort|sync|spin|cpu)|arming\.scanner|rhi\.(task\.follow|saturation\.(linger|urgency))"
    r"|rhi\.bodies\.(\w+\.damping|sphere\..*)"  # one of two
    r"|simulation\.touches\..*"  # a promise less is a configuration, too
    r"|simulation\.hand\.dead_man"  # an empty list: nobody presses
    r"|simulation\.(hand\.dead_man|hand\.away|supervisor|buttons|walls|things|fingers|pushes)\.\w+"
    r"|simulation\.(plant|sensors)\..*|simulation\.rhi\.masses|simulation\.arms\.tool_mass|[\w.]+\.stiffness_tolerance"
    r"|operator\.(assist|feedback|scale|body)|simulation\.(head|paddle)\..*|(operator|avatar)\.link\.\w+|arm\.(sums|boxes)\..*"
    r"|(giant|arm)\.(twin\.name|twins\..*)|look_ahead\..*|compliance\..*|avatar\.hands\..*\.follows\.\w+"
)
"""What may be missing, by docs/configuration.md, alone or together with the rest of its table."""


def judge_toml(data: bytes, built_in: bytes) -> str:
    """What is wrong with a changed copy of a built-in configuration, or an empty text."""
    try:
        tree = tomllib.loads(data.decode("utf-8").replace("\r\n", "\n"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, ValueError, RecursionError) as error:
        return f"no TOML: {str(error)[:80]}"
    have, pattern = (dict(_leaves(_renamed(t))) for t in (tree, tomllib.loads(built_in.decode())))
    keys, known = ({_plain(key) for key in leaves} for leaves in (have, pattern))
    if lost := [key for key in sorted(known - keys) if not OPTIONAL.fullmatch(key)]:
        return f"lacks {lost[:3]}"
    if more := [key for key in sorted(keys - known) if not OPTIONAL.fullmatch(key)]:
        return f"knows {more[:3]}"
    counts = {_plain(key): _count(value) for key, value in pattern.items()}
    for key, value in have.items():
        plain = _plain(key)
        if problem := _judge_value(plain, value):
            return f"{key} = {value!r}: {problem}"
        if plain in counts and _count(value) != counts[plain]:
            return f"{key} = {value!r}: {counts[plain]} numbers"
    return _judge_rows(have, pattern) or _judge_order(tree)


def _plain(key: str) -> str:
    return re.sub(r"\[\d+\]", "", key)


def _count(value: Any) -> int:
    """How many numbers a text holds."""
    return sum(_is_number(word) for word in value.split()) if isinstance(value, str) else 0


def _is_number(word: str) -> bool:
    return bool(NUMBER.fullmatch(word)) or word in INFINITY


def _judge_rows(have: dict[str, Any], pattern: dict[str, Any]) -> str:
    """Every row of a list of tables has what the first one of the original has."""
    needed = _rows(pattern)
    for (table, row), keys in _rows(have).items():
        if table != "simulation.buttons" and (lost := needed.get((table, "0"), keys) - keys):
            return f"{table}[{row}] lacks {sorted(lost)}"
    return ""


def _rows(leaves: dict[str, Any]) -> dict[tuple[str, str], set[str]]:
    """Keys of each row, by the name of its list and its place."""
    rows: dict[tuple[str, str], set[str]] = {}
    for key in leaves:
        if found := re.match(r"([^\[]+)\[(\d+)\]\.(\w+)", key):
            rows.setdefault((found[1], found[2]), set()).add(found[3])
    return rows


def _renamed(tree: dict[str, Any]) -> dict[str, Any]:
    """The redundant interface's drives and bodies may have any names; order and kind are what counts."""
    devices, rhi = tree.get("devices"), tree.get("rhi")
    if tree.get("system") != "rhi" or not isinstance(devices, dict):
        return tree
    if isinstance(rhi, dict) and isinstance(rhi.get("bodies"), dict):
        bodies = {body.get("kind", name): body for name, body in rhi["bodies"].items()}
        tree = tree | {"rhi": rhi | {"bodies": bodies}}
    drives = [name for name, device in devices.items() if device.get("type") == "joint_drive"]
    names = {name: f"drive {i}" for i, name in enumerate(drives)}
    return tree | {"devices": {names.get(name, name): device for name, device in devices.items()}}


def _leaves(node: Any, path: str = "") -> Any:
    if isinstance(node, dict):
        for key, value in node.items():
            yield from _leaves(value, f"{path}.{key}" if path else key)
    elif isinstance(node, list) and node:
        for i, value in enumerate(node):
            yield from _leaves(value, f"{path}[{i}]")
    else:
        yield path, node


def _judge_value(key: str, value: Any) -> str:
    name = key.rpartition(".")[2]
    named = (bounds for pattern, bounds in PATTERNS if re.fullmatch(pattern, key))
    bounds = PLAIN.get(key) or PLAIN.get(name) or next(named, None)
    if isinstance(value, bool):
        return "" if name in TRUTHS or key in TRUTHS else "no truth is asked for"
    if isinstance(value, int | float):
        low, high = bounds or (math.nan, math.nan)
        denormal = 0 < abs(value) < 2.3e-308
        return "" if low <= value <= high and not denormal else "out of range"
    if not isinstance(value, str):
        return "" if value == [] and name in MAY_BE_EMPTY else f"a {type(value).__name__}"
    if bounds:
        return "a text for a number"
    if " " not in value.strip():
        return ""  # a name
    return _judge_quantity(key, name, value)


def _judge_quantity(key: str, name: str, value: str) -> str:
    words = value.split()
    numbers = []
    while words and _is_number(words[0]):
        numbers.append(float(words.pop(0)))
    shown_infinite = sum(word in INFINITY for word in value.split())
    unit = " ".join(words)
    unit, scale = SCALES.get(unit, (unit, 1.0))
    if unit not in RANGES or not numbers:
        return "not a quantity"
    low, high = RANGES[unit]
    low = FINEST if key.startswith("simulation.sensors.") else low
    narrow_low, narrow_high = NARROWER.get(key, (-math.inf, math.inf))
    for number in numbers:
        if math.isinf(number):
            if not INFINITE.fullmatch(key) or shown_infinite < sum(map(math.isinf, numbers)):
                return "infinite"
            continue
        if number != 0 and not low * 0.999 <= abs(number * scale) <= high * 1.001:
            return "out of range"
        if not narrow_low - 1e-9 <= number * scale <= narrow_high + 1e-9:
            return "out of the key's range"
        if number < 0 and not SIGNED.search(name):
            return "negative"
        if number == 0 and (DAMPS.fullmatch(key) or not (SIGNED.search(name) or NOTHING.search(name))):
            return "nothing"
    return ""


def _judge_order(tree: dict[str, Any]) -> str:
    hand = tree.get("simulation", {}).get("hand", {})
    for name in ("path", "dead_man"):
        times = [_seconds(entry["at"]) for entry in hand.get(name, [])]
        if any(b <= a for a, b in pairwise(times)):
            return f"{name} out of order"
    for push in tree.get("simulation", {}).get("buttons", []):
        if _seconds(push["until"]) <= _seconds(push["at"]):
            return "a button is let go of first"
    nodes = [device["node"] for device in tree["devices"].values()]
    return "" if len(nodes) == len(set(nodes)) else "two devices on one node"


def _seconds(text: str) -> float:
    number, unit = text.split()
    return float(number) * SCALES.get(unit, ("s", 1.0))[1]
