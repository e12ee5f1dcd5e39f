"""What a plant's motion costs: kinetic energy, and the work of hand, gravity, and of everything else."""

from __future__ import annotations

from ..sim.plant import SimPlant


class Energy:
    """Follows a plant from the moment it is made, one ``take`` a tick.

    Attributes:
        kinetic: of links, rotors and whatever carries them, as seen from the room [J].
        stored: in springs [J].
        hand, gravity: their work so far [J].
        lifted: the part of gravity's work that it took, not gave: positive [J].
    """

    def __init__(self, plant: SimPlant) -> None:
        self._plant = plant
        self.hand = self.gravity = self.lifted = 0.0
        self._measure()

    def take(self, dt: float) -> None:
        """Account for a period [s] that has passed."""
        potential, power = self._potential, self._power
        self._measure()
        self.hand += 0.5 * dt * (power + self._power)
        fallen = potential - self._potential
        self.gravity += fallen
        self.lifted += max(0.0, -fallen)

    def _measure(self) -> None:
        now = self._plant.energies()
        self.kinetic, self.stored, self._potential, self._power = (
            now.kinetic,
            now.stored,
            now.potential,
            now.hand,
        )
