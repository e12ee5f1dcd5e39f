"""What people add to the built-in configurations: the tables that these leave out, each with all its keys."""

from __future__ import annotations

from hapticd.configs import read_text

from ..machines.giant.own_tables import OWN


def _sensor(name: str, unit: str, noise: str, more: str = "") -> str:
    keys = ("noise", "bias", "drift", "step")
    small = "".join(f'{key} = "{noise} {unit}"\n' for key in keys)
    return f'\n[simulation.sensors.{name}]\n{small}drift_time = "60 s"\ngain = 0.001\n{more}'


_COUPLED = "coupling = 0.002\n"
SENSORS = "".join(
    (
        _sensor("motor_encoder", "rad", "1e-5"),
        _sensor("motor_speed", "rad/s", "2e-3", 'range = "10 rad/s"\n'),
        _sensor("link_encoder", "rad", "1e-5"),
        _sensor("load_torque", "N m", "0.05", 'range = "500 N m"\n'),
        _sensor("force", "N", "0.05", _COUPLED + 'range = "600 N"\n'),
        _sensor("torque", "N m", "0.002", _COUPLED + 'range = "50 N m"\n'),
        _sensor("acceleration", "m/s^2", "0.02", _COUPLED + 'range = "50 m/s^2"\n'),
        _sensor("angular_rate", "rad/s", "2e-3", _COUPLED + 'range = "20 rad/s"\n'),
    )
)
PLANT = """
[simulation.plant]
masses = [1.02, 0.98, 1.03, 0.97, 1.02, 0.98]
rotor_inertia = 1.1
stiffness = 0.9
viscous_friction = 0.8
gear_friction = 0.02
load_friction = 0.02
bearing_friction = 0.01
delay = 1
"""
SUPERVISOR = """
[[simulation.supervisor]]
at = "0.1 s"
pressed = true

[[simulation.supervisor]]
at = "20 s"
pressed = false
"""
AWAY = """
[[simulation.hand.away]]
at = "12 s"
seconds = "0.5 s"
"""
BUTTONS = """
[[simulation.buttons]]
at = "9 s"
until = "10 s"
left = true
right = false
"""


def _changed(text: str, *changes: tuple[str, str]) -> str:
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    return text


SUPERVISED = ('by = "dead-man" ', 'by = "supervisor"\nscanner = "always" #')
TOLERANCE = ("\n[giant.tracking]\n", "\n[giant.tracking]\nstiffness_tolerance = 0.3\n")
LINK = ('delay = "0 ms" ', 'delay = "20 ms"\npassivity = true #')


def giant() -> bytes:
    """The giant with every table that it may have."""
    text = _changed(read_text("giant.toml"), SUPERVISED, TOLERANCE, (OWN, ""))
    return (text + PLANT + SENSORS + SUPERVISOR + AWAY).encode()


def operator() -> bytes:
    """The operator's station, supervised, with buttons that are pressed."""
    text = _changed(read_text("operator.toml"), SUPERVISED, LINK)
    return (text + SUPERVISOR + BUTTONS).encode()
