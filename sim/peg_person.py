"""A scripted person who puts a bar into a part's hole with both hands: eyes that err, hands that feel.

Nothing else reaches the person: eyes see where things are, a fifth of a second late and with an error that
stays for an attempt; hands feel the force that is given back to them, a tenth of a second late, or nothing.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator
from math import cos, hypot, pi, sin

import numpy as np

from ..models import Array
from .peg_task import PERIOD, Sight

LEFT, RIGHT = 0, 1
SEEN, FELT = 20, 10
"""How many periods late the person sees and feels."""
FLICKERS, SHAKES = 0.2, 0.3
"""In which errors of the eyes come and go, and the hands tremble [s]."""
GRASP = np.array((0.035, 0.0, 0.0))
"""Between the jaws, from the palm [m]."""
PART_GRIP, BAR_GRIP = np.array((0.0, 0.0, -0.017)), np.array((0.0, 0.0, 0.105))
"""Where each is taken: from the middle of the hole's rim, and from the bar's end [m]."""
BEFORE, ABOVE = np.array((-0.07, 0.0, 0.0)), np.array((0.0, 0.0, 0.012))
"""From there a hand comes to what it takes, and the bar to the hole [m]."""
SHOWN = np.array((0.46, 0.04, 0.96))
"""Where the left palm holds the part [m]."""
SPEED, CAREFUL, SEARCHES = 0.12, 0.03, 0.03
"""Of hands: on their way, near things, while they search [m/s]."""
TOUCHES, PRESSES, MOST = 2.0, 3.0, 8.0
"""Force that is contact, that the person searches with, and at which the bar is not pushed further [N]."""
GIVES, YIELDS = 1.0, 3e-3
"""Above this force from the side a hand goes along with it [N], so fast [m/(N s)]."""
STALLS, LAGS = 0.8, 1.0
"""Without feeling: after so long in motion, a look of so long at a bar that stays behind is contact [s]."""
FURTHEST, PATIENCE = 0.06, 6.0
"""Way down without any contact, and time to push it in, before the person begins anew [m], [s]."""
PITCH, WIDEST = 3.5e-3, 15e-3
"""Of the spiral, from turn to turn, and its radius at the end [m]."""
DROPS, IN = 6e-3, 31e-3
"""Depth below where it touched at which the bar is in the hole, and below the rim at which it is done [m]."""
GONE, EMPTY = 0.05, 0.006
"""So far from a hand a thing has been lost; so little between closed jaws is nothing [m]."""


class PalmCourse:
    """Where one of the person's palms wants to be: position and rotation vector."""

    def __init__(self, person: Person, side: int) -> None:
        self._person, self._side = person, side

    def at(self, t: float) -> tuple[list[float], list[float]]:
        """Coordinates (6,) and their rates at time t, which never goes back."""
        return self._person.wish(self._side, t)


class Person:
    """Both hands of a scripted person.

    Attributes:
        closed: whether each hand is.
        trigger: whether each hand wants its arm to follow; for hand controllers.
        done: the bar is in the hole, as far as the person can see.
        lost: something fell.
    """

    def __init__(
        self,
        look: Callable[[], Sight],
        feel: Callable[[int], Array] | None,
        first: Array,
        seed: int,
        begin: float = 0.0,
        error: float = 3e-3,
        tremor: float = 0.5e-3,
    ) -> None:
        """A person at rest.

        Args:
            look: at what is there to see.
            feel: force that pushes a palm, (3,) in the station's axes [N]; None: nothing is felt.
            first: where the own palms are, (2, 3) [m].
            seed: of everything that this person does at random.
            begin: when the person begins [s].
            error: of the eyes, standard deviation along each axis, as it stays for an attempt [m]; a third of
                it comes and goes beside.
            tremor: of the hands, likewise [m].
        """
        self._look, self._feel, self._error = look, feel, error
        self._tremor, self._flickers = tremor, error / 3.0
        self._random = np.random.default_rng([seed, 29])
        self.closed, self.trigger = [False, False], [False, False]
        self.done = self.lost = False
        self._want, self._next = np.array(first), np.array(first)
        self._shake, self._flicker = np.zeros((2, 3)), np.zeros((2, 3))
        self._seen: deque[Sight] = deque(maxlen=SEEN)
        self._felt: deque[Array] = deque(maxlen=FELT)
        self._shown, self._has = False, [False, False]
        self._then = begin
        self._acts = [self._take_part(), self._put_bar()]
        self.courses = PalmCourse(self, LEFT), PalmCourse(self, RIGHT)

    def wish(self, side: int, t: float) -> tuple[list[float], list[float]]:
        """See ``PalmCourse``."""
        while t > self._then:
            self._think()
        late = 1.0 - (self._then - t) / PERIOD if t > self._then - PERIOD else 0.0
        rate = (self._next[side] - self._want[side]) / PERIOD
        place = self._want[side] + late * (self._next[side] - self._want[side])
        return [*place.tolist(), 0.0, 0.0, 0.0], [*rate.tolist(), 0.0, 0.0, 0.0]

    def _think(self) -> None:
        self._then += PERIOD
        self._drift(self._flicker, self._flickers, PERIOD / FLICKERS)
        seen = self._look()
        seen.bar[:] += self._flicker[0]
        seen.hole[:] += self._flicker[1]
        self._seen.append(seen)
        if self._feel is not None:
            self._felt.append(np.array([self._feel(LEFT), self._feel(RIGHT)]))
        self._want = self._next
        wanted = np.array([next(act) for act in self._acts])
        self._drift(self._shake, self._tremor, PERIOD / SHAKES)
        self._next = wanted + self._shake
        held = self._sees
        pairs = ((held.hole, PART_GRIP), (held.bar, BAR_GRIP))
        for side, (thing, grip) in enumerate(pairs):
            away = thing + grip - held.palms[side] - GRASP
            self.lost |= self._has[side] and hypot(*away.tolist()) > GONE

    def _drift(self, error: Array, size: float, share: float) -> None:
        """An error (2, 3) of some standard deviation, of which a share is forgotten, goes on at random."""
        error += size * (2.0 * share) ** 0.5 * self._random.normal(size=(2, 3)) - share * error

    @property
    def _sees(self) -> Sight:
        return self._seen[0]

    def _push(self, side: int) -> Array:
        """Force on a palm, (3,), as it was felt a moment ago [N]; zero where nothing is felt."""
        return self._felt[0][side] if self._felt else np.zeros(3)

    # Each act yields where a palm wants to be a period later.

    def _rest(self, place: Array, seconds: float) -> Generator[Array, None, None]:
        for _ in range(round(seconds / PERIOD)):
            yield place

    def _go(self, begin: Array, end: Array, speed: float) -> Generator[Array, None, Array]:
        """Straight, at rest at both ends; the speed is the mean one."""
        way = float(np.linalg.norm(end - begin))
        steps = max(20, round(way / speed / PERIOD))
        for k in range(1, steps + 1):
            s = k / steps
            yield begin + (end - begin) * (s**3 * (10.0 - 15.0 * s + 6.0 * s * s))
        return end

    def _approach(
        self, place: Array, missing: Callable[[], Array], speed: float
    ) -> Generator[Array, None, Array]:
        """Go to where nothing seems to be missing: look, go, wait, and look again."""
        for _ in range(4):
            step = missing()
            if hypot(*step.tolist()) < 1.5e-3:
                break
            place = yield from self._go(place, place + step, speed)
            yield from self._rest(place, 0.7)
        return place

    def _grasp(self, side: int, thing: Callable[[], Array], lift: Array) -> Generator[Array, None, Array]:
        """Come to a thing, take it and lift it; if the hand stays empty, do it again."""
        place = self._next[side] - self._shake[side]
        self.trigger[side] = True
        while True:
            error = self._error * self._random.normal(size=3)

            def missing(before: Array) -> Array:
                way: Array = thing() + error + before - self._sees.palms[side] - GRASP  # noqa: B023
                return way

            yield from self._rest(place, 0.3)
            place = yield from self._approach(place, lambda: missing(BEFORE), SPEED)
            place = yield from self._approach(place, lambda: missing(np.zeros(3)), CAREFUL * 2.0)
            self.closed[side] = True
            yield from self._rest(place, 1.0)
            if self._sees.opening[side] > EMPTY:
                self._has[side] = True
                return (yield from self._go(place, place + lift, SPEED))
            self.closed[side] = False
            yield from self._rest(place, 0.5)
            place = yield from self._go(place, place + BEFORE, SPEED)

    def _take_part(self) -> Generator[Array, None, None]:
        """The left hand takes the part, and holds it in the middle."""
        place = yield from self._grasp(LEFT, lambda: self._sees.hole + PART_GRIP, np.array((0.0, 0.0, 0.04)))
        place = yield from self._go(place, place + SHOWN - self._sees.palms[LEFT], SPEED)
        yield from self._rest(place, 0.7)
        self._shown = True
        while True:
            yield place

    def _put_bar(self) -> Generator[Array, None, None]:
        """The right hand takes the bar, and puts it into the part."""
        place = yield from self._grasp(RIGHT, lambda: self._sees.bar + BAR_GRIP, np.array((0.0, 0.0, 0.12)))
        while not self._shown:
            yield place
        while not self.done:
            error = self._error * self._random.normal(size=3)

            def missing() -> Array:
                seen = self._sees
                way: Array = seen.hole + ABOVE + error - seen.bar  # noqa: B023
                return way

            if (high := -float(missing()[2])) < 0.0:
                place = yield from self._go(place, place + np.array((0.0, 0.0, 0.01 - high)), SPEED)
            place = yield from self._approach(place, missing, SPEED)
            depth = self._depth(float(error[2]))
            place = yield from self._insert(place, depth)
            if not self.done:
                place = yield from self._go(place, place + np.array((0.0, 0.0, 0.04)), 2.0 * CAREFUL)
        while True:
            yield place

    def _depth(self, error: float) -> Callable[[], float]:
        """How far the bar's end seems to be below the rim [m]."""
        return lambda: float(self._sees.hole[2] - self._sees.bar[2]) + error

    def _insert(self, place: Array, depth: Callable[[], float]) -> Generator[Array, None, Array]:
        """Down to the contact, in a spiral until it drops, down again until it is in, or given up."""
        blind = self._feel is None
        before = float(self._push(RIGHT)[2])
        down, speed = np.array((0.0, 0.0, -1.0)), 0.5 * CAREFUL if blind else CAREFUL
        seen: deque[float] = deque(maxlen=round(STALLS / PERIOD))
        moving = 0

        def pushed() -> float:
            return float(self._push(RIGHT)[2]) - before

        def stands() -> bool:
            """Whether it meets something: by its force, or as it does not go where the hand goes."""
            if not blind:
                return pushed() > TOUCHES
            seen.append(depth())
            return moving * PERIOD > LAGS and seen[-1] - seen[0] < 0.5 * speed * STALLS

        while not stands() and depth() < IN and moving * PERIOD * speed < FURTHEST:
            moving += 1
            place = place + speed * PERIOD * down
            yield place
        first, middle, angle, radius, sunk = depth(), place, 0.0, 0.0, 0.0
        while depth() < first + DROPS and radius < WIDEST:
            angle += SEARCHES * PERIOD / max(radius, 1e-3)
            radius = PITCH * angle / (2.0 * pi)
            if not blind:
                sunk += min(max(5e-3 * (PRESSES - pushed()), -0.015), 0.015) * PERIOD
            place = middle + np.array((radius * cos(angle), radius * sin(angle), -sunk))
            yield place
        moving, tries = 0, 0
        seen.clear()
        while depth() < IN:
            tries += 1
            if tries * PERIOD > PATIENCE:
                return place
            if pushed() < MOST and not (blind and stands()):
                moving += 1
                place = place + speed * PERIOD * down
            aside = self._push(RIGHT) * (1.0, 1.0, 0.0)
            if hypot(*aside.tolist()) > GIVES:
                place = place + YIELDS * PERIOD * aside
            yield place
        yield from self._rest(place, 0.5)
        self.done = depth() > IN - 2e-3
        return place
