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


class Permission:
    """To arm by a press, given by a command for a while, or once and for all where none is needed.

    Attributes:
        given: whether it stands.
    """

    def __init__(self, needed: bool, lifetime: int) -> None:
        """Binds the rule.

        Args:
            needed: whether a command must give it.
            lifetime: ticks after which it expires.
        """
        self._needed, self._lifetime = needed, lifetime
        self._left = 0
        self.given = not needed

    def give(self) -> None:
        """The command is given; its time begins anew."""
        self.given, self._left = True, self._lifetime

    def revoke(self) -> bool:
        """Takes it back; whether there was one to take."""
        taken = self._needed and self.given
        self.given = not self._needed
        return taken

    def expired(self) -> bool:
        """Whether it ends at this tick; call once in every tick in which it may be used."""
        if not (self._needed and self.given):
            return False
        self._left -= 1
        return self._left < 0 and self.revoke()


def refusals(
    *,
    operational: bool,
    faults: int,
    unfit: str,
    latched: bool,
    resetting: bool,
    e_stop: bool,
    supervised: bool,
    guarded: bool,
    field_clear: bool,
    sto: bool,
    permitted: bool,
    sensors_valid: bool,
    inside_limits: bool,
    at_rest: bool,
    recorded: bool,
) -> list[str]:
    """Everything that forbids arming now, for people; empty where nothing does.

    Args:
        operational: whether every device answers in its operating state.
        faults: devices that report an error.
        unfit: a drive that must not be enabled, "" where all may be.
        latched: whether a stop stands.
        resetting: whether a reset is under way.
        e_stop: whether the emergency stop is pressed.
        supervised: whether the safety operator's dead-man switch is pressed, where there must be one.
        guarded: whether nobody may be in the scanned field.
        field_clear: whether nobody stands in the scanned field.
        sto: whether the safety PLC holds the torque off.
        permitted: whether arming was commanded, where it must be.
        sensors_valid: whether the sensors that move the machine give valid values.
        inside_limits: whether every axis stands inside its limits.
        at_rest: whether every axis is measured to stand.
        recorded: whether the session is recorded.
    """
    found = []
    if not operational:
        found.append("not all devices answer in their operating state")
    if faults:
        found.append(f"{faults} devices report an error; reset")
    if unfit:
        found.append(unfit)
    if latched:
        found.append("a stop is latched; reset it first")
    if resetting:
        found.append("a reset is under way; press again when it is done")
    if e_stop:
        found.append("the emergency stop is pressed")
    if not supervised:
        found.append("the safety operator's dead-man switch is open; press it, then the one at the handle")
    if guarded and not field_clear:
        found.append("somebody stands in the scanned field")
    if sto:
        found.append("the safety PLC holds the torque off; reset")
    if not permitted:
        found.append("arming was not commanded; give the command, then press")
    if not sensors_valid:
        found.append("the force-torque sensor or an inertial unit gives nothing valid")
    if not inside_limits:
        found.append("an axis stands outside its limits")
    if not at_rest:
        found.append("the machine moves")
    if not recorded:
        found.append("the recorder is gone or lost records; end this session and start another")
    return found
