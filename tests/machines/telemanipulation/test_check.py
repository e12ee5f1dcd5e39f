"""A station's configuration agrees with its model and with itself, or is refused."""

from __future__ import annotations

import re

import pytest
from hapticd.configs import read_text
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.session import build
from hapticd.runtime.errors import ConfigError

BUTTONS = """
[[simulation.buttons]]
at = "1 s"
until = "2 s"

[[simulation.buttons]]
at = "3 s"
until = "4 s"
"""


def findings(text: str) -> dict[str, str]:
    """Key and problem of everything that is wrong with an operator's configuration."""
    model = read_text("bimanual.urdf")
    try:
        build(config.Loaded("operator", config.parse(text, "o.toml"), text, "o.toml", model, "bimanual.urdf"))
    except ConfigError as error:
        return {found.key: found.problem for found in error.findings}
    return {}


@pytest.mark.parametrize("until", ["3 s", "0 s"])
def test_a_button_is_let_go_of_after_it_was_pressed(until: str) -> None:
    text = read_text("operator.toml") + BUTTONS
    assert findings(text) == {}
    found = findings(text.replace('until = "4 s"', f'until = "{until}"'))
    assert found == {"simulation.buttons[1].until": f"{until} is not after 3 s"}


def test_a_rate_at_which_cues_cannot_be_told_apart_is_refused() -> None:
    text = read_text("operator.toml")
    assert text.count('rate = "1 kHz"') == 1
    assert findings(text.replace('rate = "1 kHz"', 'rate = "500 Hz"')) == {}
    slow = text.replace('rate = "1 kHz"', 'rate = "390 Hz"')
    assert findings(slow)["loop.rate"] == "at 390 Hz the operator's cues are not told apart"
    silent = re.sub(r'(\[operator\.cue\].*\nforce = )"2 N"', r'\1"0 N"', slow)
    assert silent != slow and findings(silent) == {}
    # a station at rest turned by itself until it stopped
    assert "hold.damping" in findings(silent.replace("390 Hz", "333 Hz"))


@pytest.mark.parametrize(("old", "new", "key"), [("60 N", "201 N", "force"), ("15 N m", "21 N m", "torque")])
def test_an_arm_cannot_stop_itself_at_what_its_sensor_does_not_measure(old: str, new: str, key: str) -> None:
    text = read_text("operator.toml")
    at = text.index("[operator.stop]")
    found = findings(text[:at] + text[at:].replace(f'"{old}"', f'"{new}"', 1))
    sensors = "left_force_torque", "right_force_torque"
    assert found == {f"operator.stop.{key}": f"{new} is more than the sensor '{sensors[1]}' measures"}
