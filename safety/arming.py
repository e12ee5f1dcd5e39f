"""Arming: permission to move is given by a press of the dead-man switch, never by a level or a restart."""

from __future__ import annotations


class DeadMan:
    """Turns the state of the dead-man switch into presses.

    A switch that is already closed when watching starts is no press: it must be opened first. Whoever asks
    decides what a press is good for; once reported, it is spent.
    """

    def __init__(self) -> None:
        self._seen_open = False

    def pressed_anew(self, pressed: bool) -> bool:
        """Whether the switch closes at this tick; call once a tick with its state."""
        anew = pressed and self._seen_open
        self._seen_open = not pressed
        return anew


def refusals(
    *,
    operational: bool,
    faults: int,
    latched: bool,
    e_stop: bool,
    field_clear: bool,
    sto: bool,
    permitted: bool,
    sensors_valid: bool,
    inside_limits: bool,
    recorded: bool,
) -> list[str]:
    """Everything that forbids arming now, for people; empty where nothing does."""
    found = []
    if not operational:
        found.append("not all devices answer in their operating state")
    if faults:
        found.append(f"{faults} devices report an error; reset")
    if latched:
        found.append("a stop is latched; reset it first")
    if e_stop:
        found.append("the emergency stop is pressed")
    if not field_clear:
        found.append("somebody stands in the scanned field")
    if sto:
        found.append("the safety PLC holds the torque off; reset")
    if not permitted:
        found.append("arming was not commanded; give the command, then press")
    if not sensors_valid:
        found.append("the force-torque sensor or an inertial unit gives nothing valid")
    if not inside_limits:
        found.append("an axis stands outside its limits")
    if not recorded:
        found.append("the recorder is gone; end this session and start another")
    return found
