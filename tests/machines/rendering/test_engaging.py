"""What drives a twin by itself does not throw the handle while the machine engages."""

from argparse import Namespace
from pathlib import Path

import numpy as np
import pytest
from hapticd.experiments.hands_command import chosen
from hapticd.runtime.configuration.config import load
from hapticd.runtime.configuration.session import build
from hapticd.runtime.core.modes import Mode
from hapticd.runtime.live.lockstep import Lockstep

SLIDE = """\
[twin]
kind = "chain"
{weight}
[twin.joints.slide]
type = "prismatic"
start = "0 m"
range = "-0.2 0.2 m"
velocity = "1 m/s"
{driven}
"""
PUSHED = 'inertia = "5 kg"\ndrive = "100 N"'
HEAVY = 'body = { mass = "8 kg", centre = "0 0 0 m", moments = "0.05 0.05 0.05 kg m^2" }'
SPRUNG = 'inertia = "2 kg"\nstiffness = "500 N/m"\nrest = "0.2 m"'
FASTEST = 0.15
"""Of the plant's handle, until all of it acts [m/s]; it was four times that."""


@pytest.mark.parametrize(
    ("weight", "driven"), [("", PUSHED), ('gravity = "9.81 m/s^2"', HEAVY), ("", SPRUNG)]
)
def test_a_hand_can_hold_what_drives_a_twin_while_it_fades_in(
    weight: str, driven: str, tmp_path: Path
) -> None:
    twin = tmp_path / "slide.toml"
    twin.write_text(SLIDE.format(weight=weight, driven=driven), encoding="utf-8")
    lockstep = Lockstep(build(load(chosen(Namespace(config="giant", twin=str(twin))))))
    control, arm = lockstep.session.cycle.machine.force_control, lockstep.plant.arm  # type: ignore[attr-defined]
    fastest = 0.0
    while lockstep.mode is not Mode.ACTIVE:
        lockstep.tick()
        fastest = max(fastest, float(np.linalg.norm(arm.twist[:3])))
        assert lockstep.inputs.tick < 4000
    assert fastest < FASTEST
    lockstep.tick()
    assert abs(control.twin.q[0]) > 0.02  # it went where hand and drive are in balance, slowly
