"""Passivity of the rendered force: the hand gets back no more than it has put in.

An environment that stores its energy U(x) is passive; rendered in part, it is not: the hand presses against
the little that a weak posture holds, the posture turns to strong, and on its way out the hand is pushed with
more than it has pressed against. An observer keeps the energy that the rendered force has really taken from
the hand, E; the force may be no larger a share of the environment's than GAIN E / U. On the way out E then
falls as U^GAIN: the force fades smoothly to nothing at the surface, and E stays positive.
"""

from __future__ import annotations

from collections.abc import Sequence

GAIN = 2.0
"""Energy falls on the way out as the potential to this power; 1 for a force in proportion to the depth. A
larger one leaves the force alone until the hand goes back, and takes it back sooner then."""
SPARE = 1e-4
"""Energy that may be given away besides [J]: a wall entered within one tick has not taken any yet."""


class Tank:
    """Observes the energy of the rendered force, and limits the force.

    Attributes:
        energy: that the rendered force has taken from the hand since it met the environment [J].
        share: of the environment's force that may be rendered, 0 to 1.
    """

    def __init__(self, m: int) -> None:
        """For forces with m components."""
        self._nothing = [0.0] * m
        self.reset()

    def reset(self, granted: float = 0.0) -> None:
        """Nothing has been rendered; so much energy [J] is the hand's for the taking."""
        self.energy, self.share, self._potential = granted, 1.0, 0.0
        self._force, self._position = self._nothing, self._nothing

    def update(self, position: Sequence[float], potential: float) -> float:
        """Observe the last tick and return ``share`` for this one.

        Args:
            position: of the hand, (m,) [m].
            potential: of the environment there [J]; 0 where it stores nothing.
        """
        if not potential > 0.0:
            self.energy, self.share = 0.0, 1.0
        else:
            # the force was held for a tick: its work is exact
            for f, x, before in zip(self._force, position, self._position, strict=True):
                self.energy -= f * (x - before)
            coming = max(0.0, potential - self._potential)  # what this tick's way in brings, half a tick late
            self.share = min(1.0, max(0.0, GAIN * (self.energy + coming + SPARE) / potential))
        self._position = list(position)
        self._potential = potential
        return self.share

    def render(self, force: Sequence[float]) -> None:
        """The force (m,) [N] that is rendered until the next ``update``."""
        self._force = list(force)
