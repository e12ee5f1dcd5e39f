"""Numbers of bodies that nobody meant: what is accepted can be built, what is not is told with its line."""

import re
from random import Random

import pytest
from hapticd.configs import read_text
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.session import build
from hapticd.runtime.errors import ConfigError

MODELS = {"rhi": "rhi.urdf", "panda_rhi": "panda.urdf", "panda_stamp": "panda.urdf"}
COUNT = 60
"""Corrupt copies of each."""
MILD = 0.3
"""Share of corruptions that may have been meant."""
NUMBER = re.compile(r"(?<![\w.^])-?\d+(\.\d+)?(e-?\d+)?")
EVERYTHING = """layers = [{ thickness = "2 mm", stiffness = "500 N/m" }]
spots = [{ point = "%s m", radius = "15 mm", factor = 3 }]
damping = "5 N s/m"
"""
BODIES = """
[rhi.bodies.more_1]
kind = "box"
point = "%(at)s m"
size = "%(size)s m"
edge = "2 mm"
stiffness = "900 N/m"
%(tissue)s
[rhi.bodies.more_2]
kind = "sphere"
point = "%(at)s m"
radius = "6 cm"
stiffness = "900 N/m"
%(tissue)s
[rhi.bodies.more_3]
kind = "assist"
point = "%(at)s m"
force = "3 N"
soft = "2 cm"

[rhi.bodies.more_4]
kind = "resist"
point = "%(at)s m"
radius = "6 cm"
damping = "9 N s/m"

"""
OUTLINE = """[rhi.bodies.more_5]
kind = "solid"
vertices = ["0.4 0.1 m", "0.6 0.1 m", "0.6 0.2 m", "0.4 0.2 m"]
cell = "4 mm"
stiffness = "900 N/m"

"""


def whole(machine: str) -> str:
    """A built-in configuration with a body of every kind."""
    text = read_text(f"{machine}.toml")
    flat = machine == "rhi"
    at = "0.5 0.12" if flat else "0.45 0.1 0.35"
    fields = {"at": at, "size": "0.2 0.1" if flat else "0.2 0.1 0.1", "tissue": EVERYTHING % at}
    more = BODIES % fields + (OUTLINE if flat else "")
    text = re.sub(r"\nscan = \d+", "\nscan = 60", text)
    return text.replace("[rhi.hold]", more + "[rhi.hold]", 1)


def corrupt(line: str, random: Random) -> str:
    """A line in which one number is another, or none, or something else."""
    places = [found.span() for found in NUMBER.finditer(line.partition("#")[0])]
    begin, end = random.choice(places)
    number = line[begin:end]
    sign = number[1:] if number.startswith("-") else f"-{number}"
    large = f"{number}e{random.randint(1, 2)}"
    huge, tiny = f"{number}e{random.randint(2, 320)}", f"{number}e-{random.randint(2, 320)}"
    instead = (
        sign,
        "0",
        large,
        huge,
        tiny,
        "nan",
        "inf",
        "-inf",
        "",
        f"{number} {number}",
        "x",
        "true",
        "[]",
        "1 m",
        "5 kg",
    )
    if random.random() < MILD:
        instead = (f"{random.uniform(0.5, 1.5) * float(number):.3g}",)
    return line[:begin] + random.choice(instead) + line[end:]


def bodies_of(text: str) -> list[int]:
    """Indices of the lines of bodies that hold numbers."""
    begin, end = text.index("[rhi.bodies."), text.index("[rhi.hold]")
    first, last = text[:begin].count("\n"), text[:end].count("\n")
    lines = text.splitlines()
    numbered = [k for k in range(first, last) if NUMBER.search(lines[k].partition("#")[0])]
    return [k for k in numbered if not lines[k].startswith("[")]


def attempt(text: str, machine: str) -> list[str]:
    """What is told of a configuration; nothing where a session is built of it."""
    model = MODELS[machine]
    try:
        parsed = config.parse(text, "m.toml")
        build(config.Loaded(machine, parsed, text, "m.toml", read_text(model), model))
    except ConfigError as error:
        return [f"m.toml:{found.line}: {found}" if found.line else str(found) for found in error.findings]
    return []


@pytest.mark.slow
@pytest.mark.parametrize("machine", MODELS)
def test_a_corrupt_body_is_refused_with_its_line_or_can_be_built(machine: str) -> None:
    text = whole(machine)
    assert attempt(text, machine) == []
    places, refused = bodies_of(text), 0
    for seed in range(COUNT):
        random = Random(f"{machine} {seed}")
        lines = text.splitlines()
        for k in random.sample(places, random.choice((1, 1, 1, 2))):
            lines[k] = corrupt(lines[k], random)
        told = attempt("\n".join(lines) + "\n", machine)
        refused += bool(told)
        for each in told:
            line = re.match(r"m\.toml:(\d+): (rhi\.bodies[\w.\[\]]*: )?\S", each)
            assert line, (seed, each)
            # bodies as a whole, or a body, or its line
            assert places[0] - 5 <= int(line[1]) - 1 <= places[-1] + 1, (seed, each)
            assert "\n" not in each and "Traceback" not in each, (seed, each)
    assert COUNT / 3 < refused < COUNT
