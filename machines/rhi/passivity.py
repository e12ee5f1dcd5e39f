"""Passivity of the rendered force: the hand gets back no more than it has put in.

An environment that stores its energy U(x) is passive; rendered in part, it is not: the hand presses against
the little that a weak posture holds, the posture turns to strong, and on its way out the hand is pushed with
more than it has pressed against. An observer keeps the energy that the rendered force has really taken from
the hand, E; the force may be no larger a share of the environment's than GAIN E / U. That leaves it alone
until the hand goes back, further than a force that rises pushes it. Then it falls to the share FADE E / U, so
that E falls as U^FADE and ends with U. Whatever the hand presses against on its way in is its own energy:
there the share rises as it fell.
"""

from __future__ import annotations

from collections.abc import Sequence

GAIN = 2.0
"""What of E / U may be rendered until the hand goes back."""
PLAY = 0.7
"""What of its potential the hand has left when it counts as going back, and, from there, as going in."""
FADE = 1.25
"""The same from then on: above 1, or what sampling costs would be missing of a force rendered in full."""
STEEP = 2.0
"""The share changes with the potential to this power: gently enough that torques do not jump."""
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
        self.energy, self.share, self._rendered = granted, 1.0, 0.0
        self._potential = self._turn = 0.0
        self._force, self._position = self._nothing, self._nothing

    def update(self, position: Sequence[float], potential: float) -> float:
        """Observe the last tick and return ``share`` for this one.

        Args:
            position: of the hand, (m,) [m].
            potential: of the environment there [J]; 0 where it stores nothing.
        """
        if not potential > 0.0:
            self.energy, self.share, self._rendered, self._turn = 0.0, 1.0, 0.0, potential
        else:
            # the force was held for a tick: its work is exact
            for f, x, before in zip(self._force, position, self._position, strict=True):
                self.energy -= f * (x - before)
            coming = max(0.0, potential - self._potential)  # what this tick's way in brings, half a tick late
            left = max(0.0, (self.energy + coming + SPARE) / potential)
            turn = min(max(self._turn, potential), potential / PLAY)
            way = (turn / self._turn) ** STEEP if self._turn > 0.0 else 1.0
            back = (potential / self._potential) ** STEEP if self._potential > 0.0 else 1.0
            self.share = min(1.0, max(GAIN * left, self._rendered * back), max(FADE * left, self.share * way))
            self._turn = turn
        self._position = list(position)
        self._potential = potential
        return self.share

    def render(self, force: Sequence[float], share: float) -> None:
        """The force (m,) [N] that is rendered until the next ``update``, so much of the environment's."""
        self._force, self._rendered = list(force), share
