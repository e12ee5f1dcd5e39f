"""The twin: a puck that slides in a round room, whose wall is a spring."""

import numpy as np


class Puck:
    def __init__(self, config) -> None:
        self._config, self._centre = config, np.array(config.room)
        self.position, self.velocity, self.depth = np.zeros(2), np.zeros(2), 0.0  # beyond the wall

    def reset(self, position) -> None:
        self.position[:], self.velocity[:] = position, 0.0

    def push(self, force, dt: float) -> None:
        """Advance by dt under a force (2,) [N]."""
        c, out = self._config, self.position - self._centre
        far = float(np.hypot(*out))
        self.depth = far - c.radius
        wall = -c.wall * self.depth / far * out if self.depth > 0.0 else 0.0
        self.velocity += dt / c.puck * (force + wall - c.puck_damping * self.velocity)
        self.position += dt * self.velocity
