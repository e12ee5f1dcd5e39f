"""Postures for contact all over the bodies: found before the session begins, looked up while it runs.

A scan of the self-motion takes far longer than a tick, and what it finds must not depend on when there was
time for it: a recording would not repeat. So places of the surface are scanned beforehand.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from ...models import Array, ModelError
from .atlas import atlas_of
from .crossing import PERIOD, Crossings, dead_ends
from .environment import Environment
from .guard import Span
from .manipulability import Shape
from .once import Once
from .reachable import AHEAD, Targets, Way
from .redundant import RedundantArm
from .self_motion import Ellipsoid
from .tool import Tool

TRIED = 4000
"""Random postures whose hands are brought to the surface."""
GLIDE_S = 0.1
"""Time constant with which targets move to those of the next place: a jump would be one of torque."""
FASTEST = 5.0
"""And the most that they move with [rad/s]."""
ARRIVED = 1e-6
"""Distance to the targets that is none [rad]."""
AWAY, BACK = 0.15, 0.12
"""Distance from all places from which on their targets say nothing, and at which they do again [m]."""
NEARER = 0.8
"""Share of the distance to its place at which another must be nearer: the hand may tremble between two."""

Place = tuple[Array, Array]
"""Of a surface, (m,) [m], and the unit vector into the body there, (m,)."""


def surface_places(
    arm: RedundantArm, environment: Environment | Tool, span: Span, spacing: float | None
) -> Iterator[Place]:
    """Places of the bodies' surfaces in reach, ``spacing`` [m] apart; the first only without a spacing.

    They are where random postures that hold the hand in a body come out of it; those next to the middle of
    all come first.
    """
    rng = np.random.default_rng(0)
    low, high = span.inside(0.0)
    hands, _ = arm.reach(rng.uniform(np.maximum(low, -np.pi), np.minimum(high, np.pi), (TRIED, arm.n)))
    found = [place for hand in hands.tolist() if (place := environment.surface(hand))]
    if not found:
        return
    points = np.array([point for point, _ in found])
    kept: list[Array] = []
    for k in np.argsort(np.linalg.norm(points - hands.mean(axis=0), axis=1), kind="stable").tolist():
        if kept and np.linalg.norm(np.array(kept) - points[k], axis=1).min() < (spacing or np.inf):
            continue
        kept.append(points[k])
        yield points[k], np.array(found[k][1])


_TARGETS = Once[Targets](64)


class Places:
    """Targets of the places of a surface, and of these the ones that suit the hand now.

    Attributes:
        targets: one a place.
        goals: for free motion and contact, (2, n) [rad], as they move.
    """

    def __init__(
        self,
        arm: RedundantArm,
        places: Sequence[Place],
        shape: Shape,
        limit: Array,
        span: Span,
        count: int,
        goals: tuple[Array, Array],
        dt: float,
    ) -> None:
        """Scan with so many configurations a place.

        Args:
            arm: the interface.
            places: of the surface; those that no posture reaches are left out.
            shape: of the desired ellipsoids.
            limit: of the motors, (n,) [N m].
            span: where they may be.
            count: configurations of each scan.
            goals: where targets for free motion and contact are written, (n,) each [rad].
            dt: of a tick [s].

        Raises:
            ModelError: no place can be reached.
        """
        self.targets: list[Targets] = []
        points = []
        refused: ModelError | None = None
        for point, normal in places:
            uu = np.outer(normal, normal)
            objectives = [Ellipsoid(desired, limit) for desired in (shape.free(uu), shape.stiff(uu))]
            try:
                what = (point.tobytes(), normal.tobytes(), limit.tobytes(), shape, count)
                self.targets.append(
                    _TARGETS.get(arm, span, what, partial(Targets, arm, point, span, objectives, count))
                )
            except ModelError as error:
                refused = error
            else:
                points.append(point)
        if not points:
            assert refused is not None
            raise refused
        self._points, self._goals, self._blend = np.array(points), goals, min(1.0, dt / GLIDE_S)
        self._step = FASTEST * dt
        self._at, self._wanted = 0, self._favourite()
        self._ways = [[Way(t.parts, best[0]) for best in t.best] for t in self.targets]
        self._way: Way | None = None  # that the posture is to take to its targets
        self._part = self._ticks = 0
        self._atlas, self._roams = atlas_of(arm, span), False
        for goal, wanted in zip(self._goals, self._wanted, strict=True):
            goal[:] = wanted
        self._gliding = False
        # places along a surface have targets of their own: where there are more, the nearest says
        crossed = len(points) == 1 and dead_ends(self.targets[0])
        self._crossings = Crossings(arm, points[0], self.targets[0], span) if crossed else None

    def _favourite(self) -> Array:
        """The targets of the first place's part that is best in contact."""
        first = self.targets[0]
        best: Array = first.best[np.argmin(first.cost[:, 1])]
        return best

    def reset(self, x: Array, q: Array) -> None:
        """Targets for a hand at x (m,) in the part of the posture q (n,)."""
        self._ticks, self._roams = 0, False
        self._aim(x, q)
        for goal, wanted in zip(self._goals, self._wanted, strict=True):
            goal[:] = wanted
        self._gliding = False

    def _aim(self, x: Array, q: Array) -> None:
        """At the targets of the place next to x (m,), along the way from q (n,)."""
        self._at = int(np.argmin(self._distance(x)))
        self._part = self.targets[self._at].parts.of(q)
        self._way = self._ways[self._at][self._part]
        self._go_on(q)
        if self._crossings:
            self._crossings.reset(self._part)

    def _go_on(self, q: Array) -> None:
        """In free motion aim at the next posture on the way from q (n,), or at the target if that is near."""
        targets = self.targets[self._at].best[self._part]
        left, ahead = self._way.go_on(q) if self._way else (0.0, q)
        if AHEAD < left < np.inf:
            self._wanted = np.stack([ahead, *targets[1:]])
        else:
            self._way, self._wanted = None, targets

    def follow(self, x: Array, q: Array) -> None:
        """Let the targets go on towards those next to a hand at x (m,), in the part of the posture q (n,)."""
        self._ticks += 1
        looks = self._ticks % PERIOD == 0
        if looks:
            self._roam(x, q)
        if not self._roams:
            self._change(x, q)
        if looks and self._way:
            self._gliding = True
            self._go_on(q)
        if self._gliding:
            left = 0.0
            for goal, wanted in zip(self._goals, self._wanted, strict=True):
                way = wanted - goal
                goal += np.clip(self._blend * way, -self._step, self._step)
                left = max(left, float(np.abs(way).max()))
            self._gliding = left > ARRIVED

    def _change(self, x: Array, q: Array) -> None:
        """To the next place, or to another part of the only one."""
        if len(self._points) > 1:
            far = self._distance(x)
            nearest = int(far.argmin())
            if nearest != self._at and far[nearest] < NEARER * far[self._at]:
                self._at, self._gliding, self._way = nearest, True, None
                self._wanted = self.targets[nearest].reachable(q)
        elif self._crossings and (towards := self._crossings.follow(x, q)) is not None:
            self._wanted, self._gliding, self._way = towards, True, None

    def _roam(self, x: Array, q: Array) -> None:
        """Far from all places keep a posture that can follow; back there, turn to their targets."""
        far = self._distance(x).min()
        if far > AWAY or (self._roams and far > BACK):
            if (ahead := self._atlas.ahead(x, q)) is not None:
                self._wanted, self._way = np.broadcast_to(ahead, self._wanted.shape), None
                self._roams = self._gliding = True
        elif self._roams:
            self._roams, self._gliding = False, True
            self._aim(x, q)

    def _distance(self, x: Array) -> Array:
        distance: Array = np.linalg.norm(self._points - x, axis=1)
        return distance
