"""The gate, whose rule is in C, against the same in plain Python: the same bits, and the same words."""

from collections.abc import Sequence
from dataclasses import replace
from math import ceil, inf, isfinite, nan

import numpy as np
import pytest
from hapticd.safety import PASS, AxisLimits, Gate, Heat, Peak, Reaction, Verdict
from hapticd.safety.gate import (
    CLAMPED_HOLD_S,
    CLAMPED_OFF_S,
    CLAMPED_RAMP_S,
    CLAMPS_BEFORE_HOLD,
    LOST_BEFORE_OFF,
    OFTEN,
    OFTEN_WINDOW,
)
from hapticd.safety.heat import ADMITTED
from hapticd.safety.tally import WINDOW, Rule, Tally

RATE = 1000.0
AXES = (
    AxisLimits("joint_1", command=100.0, step=inf, power=200.0, lower=-1.0, upper=1.0),
    AxisLimits("joint_2", command=20.0, step=35.0, power=30.0, lower=-inf, upper=inf),
    AxisLimits("joint_3", command=5.0, step=inf, power=0.0, lower=-0.1, upper=0.1),
    AxisLimits("ppu_x", command=1.2, step=0.01, power=inf, lower=-1.6, upper=1.6),
    AxisLimits("ppu_y", command=1.2, step=0.1, power=inf, lower=-1.6, upper=inf),
)
PEAKS = (Peak(12.0, 120.0, 0.05), None, Peak(5.0, 9.0, 0.3), None, None)
PEAKED = tuple(replace(axis, peak=peak) for axis, peak in zip(AXES, PEAKS, strict=True))
STRANGE = (nan, inf, -inf, 0.0, -0.0, 1e308, -1e308, 5e-324, -5e-324)


class PlainGate:
    """What an admitted tick is, an axis after the other."""

    def __init__(self, axes: Sequence[AxisLimits]) -> None:
        self.axes, self.admitted, self.enable, self.clamps = axes, [0.0] * len(axes), False, 0
        self.most = [axis.command for axis in axes]
        peaks = [axis.peak for axis in axes]
        self.told, self.tick = np.zeros(len(axes)), -1
        self.heat = Heat(self.told, self.most, peaks, ADMITTED, 1.0 / RATE) if any(peaks) else None
        hold = max(CLAMPS_BEFORE_HOLD, ceil(CLAMPED_HOLD_S * RATE))
        ramp, off = round(CLAMPED_RAMP_S * RATE), round(CLAMPED_OFF_S * RATE)
        self.clamped = Tally(
            Rule(Reaction.SANITISE, 1, 1),
            Rule(Reaction.HOLD, hold, hold),
            Rule(Reaction.HOLD, OFTEN * hold, OFTEN_WINDOW * hold),
            Rule(Reaction.RAMP, ramp, OFTEN * ramp),
            Rule(Reaction.OFF, off, OFTEN * off),
        )
        self.lost = Tally(
            Rule(Reaction.OFF, LOST_BEFORE_OFF, LOST_BEFORE_OFF),
            Rule(Reaction.RAMP, LOST_BEFORE_OFF, WINDOW),
        )

    def deny(self) -> None:
        self.admitted, self.enable = [0.0] * len(self.axes), False

    def admit(
        self,
        commands: Sequence[float],
        position: Sequence[float],
        velocity: Sequence[float],
        armed: bool,
        command_tick: int,
        tick: int,
        dropped: Sequence[bool],
    ) -> Verdict:
        if self.heat:
            self.told[:] = self.admitted
            self.heat.take(max(0, tick - self.tick))
            self.tick, self.most = tick, self.heat.able.tolist()
        if not armed:
            self.deny()
            self.clamped.clear()
            self.lost.clear()
            return PASS
        if command_tick != tick:
            self.deny()
            detail = f"the output was computed for tick {command_tick}, not {tick}"
            return Verdict(Reaction.RAMP, "stale_output", detail)
        self.enable = True
        bad = [not (isfinite(command) or gone) for command, gone in zip(commands, dropped, strict=True)]
        lost = self.lost.push(any(bad))
        said = []
        for i, axis in enumerate(self.axes):
            why = ""
            if dropped[i]:
                self.admitted[i] = 0.0
            elif bad[i]:
                self.admitted[i] = 0.0 if lost is Reaction.OFF else self.admitted[i]
                why = "is not a number"
            else:
                measured = position[i], velocity[i]
                self.admitted[i], why = clamp(axis, self.most[i], commands[i], self.admitted[i], *measured)
            if why:
                said.append(f"command of {axis.name} {why}")
        return self.judge(said, lost)

    def judge(self, said: list[str], lost: Reaction) -> Verdict:
        clamped = self.clamped.push(bool(said))
        self.clamps += bool(said)
        if lost >= clamped and lost.stops:
            detail = f"{self.lost.count} of {WINDOW} ticks with commands that are no numbers"
            return Verdict(lost, "output_not_finite", detail)
        if not clamped.stops:
            return Verdict(Reaction.SANITISE, "output_clamped", said[0]) if said else PASS
        detail = f"{said[0] if said else 'commands exceed limits'}, {self.clamped.count} ticks"
        return Verdict(clamped, "output_beyond_limit", detail)


def clamp(
    axis: AxisLimits, most: float, command: float, last: float, position: float, velocity: float
) -> tuple[float, str]:
    safe, why = command, ""
    if abs(safe) > most:
        safe, why = limited(safe, most), f"exceeds {most:g}"
    if abs(safe - last) > axis.step:
        safe, why = last + limited(safe - last, axis.step), f"jumps by more than {axis.step:g}"
    if safe > 0.0 and not position <= axis.upper:
        safe, why = 0.0, f"pushes further at {position:g}, beyond {axis.upper:g}"
    if safe < 0.0 and not position >= axis.lower:
        safe, why = 0.0, f"pushes further at {position:g}, beyond {axis.lower:g}"
    if not safe * velocity <= axis.power:
        most = axis.power / abs(velocity) if isfinite(velocity) else 0.0
        safe, why = limited(safe, most), f"exceeds {axis.power:g} W"
    return safe, why


def limited(value: float, most: float) -> float:
    return most if value > most else -most if value < -most else value


def numbers(rng: np.random.Generator, scale: np.ndarray, strange: float) -> list[float]:
    values = scale * rng.normal(0.0, 1.0, len(AXES))
    odd = rng.random(len(AXES)) < strange
    return np.where(odd, rng.choice(STRANGE, len(AXES)), values).tolist()


@pytest.mark.parametrize("axes", [AXES, PEAKED], ids=["rated", "with peaks"])
@pytest.mark.parametrize("seed", range(3))
def test_the_gate_admits_and_says_what_the_plain_rule_does(axes: Sequence[AxisLimits], seed: int) -> None:
    rng, n = np.random.default_rng(seed), len(axes)
    outputs = [np.full(3, nan), np.full(2, nan)]
    gate, plain = Gate(axes, RATE, outputs), PlainGate(axes)
    largest = np.array([axis.command for axis in axes])
    ends = np.array([min(1.0, axis.upper) for axis in axes])
    dropped, heard, tick = [False] * n, set[str](), 0
    for _ in range(80):  # spells, in which as much is wrong as in one fault, or nothing
        size, odd, far = (
            rng.choice([0.2, 0.9, 3.0]),
            rng.choice([0.0, 0.0, 0.02, 0.5]),
            rng.choice([0.3, 1.5]),
        )
        for _ in range(rng.integers(1, 60)):
            tick += int(rng.choice([1, 1, 1, 2, 7]))
            commands = numbers(rng, size * largest, odd)
            position, velocity = numbers(rng, far * ends, odd), numbers(rng, np.full(n, far), odd)
            if rng.random() < 0.02:
                dropped[rng.integers(n)] = bool(rng.random() < 0.4)
            armed, command_tick = rng.random() > 0.002, tick - int(rng.random() < 0.002)
            given = commands, position, velocity, armed, command_tick, tick, dropped
            verdict = gate.admit(*given)
            assert verdict == plain.admit(*given), tick
            assert gate.admitted.tobytes() == np.array(plain.admitted).tobytes(), tick
            assert b"".join(map(np.ndarray.tobytes, outputs)) == gate.admitted.tobytes()
            assert (gate.enable, gate.clamps) == (plain.enable, plain.clamps)
            heard.update(word for word in WORDS if word in verdict.detail)
    assert heard == set(WORDS), "every branch was taken"


WORDS = (
    *("is not a number", "exceeds 100", "jumps by more", "pushes further", "beyond -1", "exceeds 200 W"),
    *("commands exceed limits", "commands that are no numbers", "was computed for tick"),
)


@pytest.mark.parametrize("length", [0, len(AXES) - 1, len(AXES) + 1])
@pytest.mark.parametrize("which", range(4))
def test_what_is_not_one_number_an_axis_is_refused(which: int, length: int) -> None:
    gate = Gate(AXES, RATE, [np.zeros(len(AXES))])
    given: list[list[float]] = [[0.0] * len(AXES) for _ in range(4)]
    given[which] = [0.0] * length
    commands, position, velocity, dropped = given
    with pytest.raises(ValueError):
        gate.admit(commands, position, velocity, True, 1, 1, [bool(each) for each in dropped])
