"""Stations with arms of six joints and parallel axes, as of a UR5, in place of their Pandas."""

from __future__ import annotations

import re
from collections.abc import Mapping
from math import pi

import numpy as np
import pinocchio as pin
from hapticd.runtime.configuration import config
from hapticd.runtime.configuration.config import Loaded

LINKS = (
    ("z", 0.0, 3.7),
    ("y", 0.425, 8.4),
    ("y", 0.392, 2.3),
    ("y", 0.1, 1.2),
    ("z", 0.1, 1.2),
    ("y", 0.1, 0.6),
)
"""Axis, length along z to the next joint [m], mass [kg]; the fourth is beside the third."""
ASIDE, PALM = 0.11, 0.12
FLANGE_TO_PALM = np.array([0.0, 0.05, 0.0])
HOME = (0.0, 0.3, 1.7, -2.0, -0.5 * pi, 0.0)
EFFORT, SPEED, MOST = (150, 150, 150, 28, 28, 28), (3.1,) * 6, 3.0
HOLD = {
    "stiffness": "2000 2000 1500 300 300 200 N m/rad",
    "damping": "60 60 45 8 8 4 N m s/rad",
    "deceleration": "10 7.5 10 15 20 20 rad/s^2",
}
SIMULATED = {
    "rotor_inertia": "0.2 0.2 0.2 0.08 0.08 0.08 kg m^2",
    "brake": "100 100 100 20 20 20 N m",
}


def _number(*values: float) -> str:
    return " ".join(f"{round(x, 9) + 0.0:.9g}" for x in values)


def _arm(prefix: str, base: np.ndarray) -> str:
    """An arm that stands upright at a place of the station, as URDF."""
    parent, place = f"{prefix}base", (0.0, 0.0, 0.0)
    text = [
        f'<link name="{parent}"/><joint name="{prefix}mount" type="fixed"><parent link="base"/>'
        f'<child link="{parent}"/><origin xyz="{_number(*base)}" rpy="0 0 0"/></joint>'
    ]
    for i, (axis, length, mass) in enumerate(LINKS):
        link, moment = f"{prefix}link_{i + 1}", mass * (0.06**2 + length**2 / 12.0)
        text.append(
            f'<link name="{link}"><inertial><origin xyz="0 0 {0.5 * length:g}" rpy="0 0 0"/>'
            f'<mass value="{mass}"/><inertia ixx="{moment:.9g}" iyy="{moment:.9g}" izz="{mass * 0.06**2:.9g}"'
            f' ixy="0" ixz="0" iyz="0"/></inertial></link>'
            f'<joint name="{prefix}joint_{i + 1}" type="revolute">'
            f'<origin xyz="{_number(*place)}" rpy="0 0 0"/>'
            f'<parent link="{parent}"/><child link="{link}"/>'
            f'<axis xyz="{"0 0 1" if axis == "z" else "0 1 0"}"/><limit lower="-{MOST + 0.05}" '
            f'upper="{MOST + 0.05}" effort="{EFFORT[i]}" velocity="{SPEED[i]}"/>'
            f'<dynamics damping="0.3"/></joint>'
        )
        parent, place = link, (0.0, ASIDE if i == 2 else 0.0, length)
    text.append(
        f'<link name="{prefix}flange"/><joint name="{prefix}end" type="fixed"><parent link="{parent}"/>'
        f'<child link="{prefix}flange"/><origin xyz="0 {PALM} 0" rpy="0 0 0"/></joint>'
    )
    return "".join(text)


def _home() -> pin.SE3:
    """Pose of the flange at home, from the arm's base."""
    axes = {"z": np.array([0.0, 0.0, 1.0]), "y": np.array([0.0, 1.0, 0.0])}
    pose, place = pin.SE3.Identity(), np.zeros(3)
    for i, ((axis, length, _), q) in enumerate(zip(LINKS, HOME, strict=True)):
        pose = pose * pin.SE3(pin.exp3(axes[axis] * q), place)
        place = np.array([0.0, ASIDE if i == 2 else 0.0, length])
    return pose * pin.SE3(np.eye(3), np.array([0.0, PALM, 0.0]))


def chain() -> dict[str, str]:
    """What a configuration says of such an arm."""
    return {
        "palm": f"{_number(*FLANGE_TO_PALM)} m",
        "turned": f"{_number(*pin.log3(_home().rotation.T))} rad",
        "lower": f"{_number(*([-MOST] * 6))} rad",
        "upper": f"{_number(*([MOST] * 6))} rad",
        "velocity": f"{_number(*([2.2] * 6))} rad/s",
        "home": f"{_number(*HOME)} rad",
    }


def led_by(operator: Loaded, model: str) -> Loaded:
    """An operator's station that knows that the avatar's arms are such ones."""
    text = operator.text
    for side in ("left", "right"):
        text = with_values(text, f"operator.avatar.{side}", chain())
    return told(operator, text, model)


def six_joints(station: str, model: str) -> tuple[Loaded, str]:
    """A built-in station with such arms, and the model with them; palms begin where the Pandas' do."""
    loaded, arms = config.load(station), ""
    home = _home()
    for side, sign in (("left", 1.0), ("right", -1.0)):
        begin = np.array([0.45, sign * 0.25, 1.0])
        base = begin - home.act(FLANGE_TO_PALM)
        arms += _arm(f"{station}_{side}_", base)
    model = re.sub(
        rf'<link name="{station}_\w+" ?/>|<(link|joint) name="{station}_\w+".*?</\1>', "", model, flags=re.S
    )
    model = model.replace("</robot>", f"{arms}</robot>")
    text = loaded.text
    for side in ("left", "right"):
        text = without(text, f"devices.{side}_joint_7")
        text = with_values(text, f"{station}.arms.{side}", chain())
        for joint in (1, 2, 3, 4, 5, 6):
            rated = {"rated_torque": "5 N m" if joint < 4 else "0.9 N m"}
            text = with_values(text, f"devices.{side}_joint_{joint}", rated)
    text = with_values(text, f"{station}.hold", HOLD)
    text = with_values(text, "simulation.arms", SIMULATED)
    text = text.replace("0.97, 1.02, 0.98, 1.02]", "0.97, 1.02, 0.98]")  # masses
    return told(loaded, text, model), model


def told(loaded: Loaded, text: str, model: str) -> Loaded:
    """A station by another text and another model."""
    return Loaded(
        loaded.name, config.parse(text, loaded.source), text, loaded.source, model, loaded.model_source
    )


def without(text: str, table: str) -> str:
    """The text without a table."""
    begin = text.index(f"[{table}]")
    return text[:begin] + text[text.index("\n[", begin) + 1 :]


def with_values(text: str, table: str, values: Mapping[str, str]) -> str:
    """The text with other values in a table."""
    begin = text.index(f"[{table}]")
    after = text.find("\n[", begin)
    part = text[begin:after]
    for key, value in values.items():
        part, found = re.subn(rf"^{key} = .*$", f'{key} = "{value}"', part, flags=re.M)
        assert found == 1, (table, key)
    return text[:begin] + part + text[after:]
