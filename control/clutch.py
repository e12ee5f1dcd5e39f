"""Where a palm leads a far one: from where both were at a moment on, at a scale, with a clutch."""

from __future__ import annotations

import numpy as np

from ..models import Array


class Clutch:
    """The far palm's pose for that of the near one, which may be moved alone without a jump afterwards.

    Attributes:
        position, rotation: wanted of the far palm, (3,) [m] and (3, 3).
        open: whether the near one moves alone.
    """

    def __init__(self, scale: float) -> None:
        """The far palm's way for that of the near one."""
        self._scale = scale
        self.position, self.rotation, self.open = np.zeros(3), np.eye(3), False
        self._near, self._far = np.zeros(3), np.zeros(3)
        self._turn = np.eye(3)

    def align(self, position: Array, rotation: Array) -> None:
        """From now on the far palm is wanted where the near one is, (3,) and (3, 3)."""
        self._near[:], self._far[:] = position, position
        self._turn[:] = np.eye(3)
        self.open = False
        self.update(position, rotation, False)

    def update(self, position: Array, rotation: Array, open: bool) -> None:
        """Take the near palm's pose, and whether the clutch is open."""
        if open:
            self.open = True
            return
        if self.open:  # it closes: on from where the far palm was left
            self.open = False
            self._near[:], self._far[:] = position, self.position
            np.matmul(rotation.T, self.rotation, out=self._turn)
        self.position[:] = self._far + self._scale * (position - self._near)
        np.matmul(rotation, self._turn, out=self.rotation)
