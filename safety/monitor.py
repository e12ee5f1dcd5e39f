"""Watches what comes in, one small check for a few rows of docs/fault-matrix.md each (layer L2)."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from operator import attrgetter, not_

from .check import Check, Maker, Row, Trust
from .hard_limits import HardLimits
from .observation import Observation, Thresholds
from .tally import WINDOW, Rule, Tallies, Tally
from .verdict import PASS, Reaction, Verdict, strongest

SPORADIC = 5
"""Bad ticks in a window that are forgiven: missing or stale frames, skipped ticks, failed solves."""
MISSED_HOLD = 5
"""Consecutive frames of one device missing (row 2)."""
SILENCE_S = 20e-3
"""Silence of one device, its dead-man signal included, that counts as its loss (rows 3 and 15)."""
SKIPPED_IN_A_ROW = 3
"""Skipped ticks at once that stop the machine where overruns stop it (row 19)."""
STALL_S = 20e-3
"""A gap after which every drive's watchdog has acted (row 20)."""
SOLVE_HOLD, SOLVE_RAMP = 3, 10
"""Failed solves in a row (row 17)."""
FADE_S = 20e-3
"""Without a valid wrench, faded out meanwhile, or acceleration before the machine stops (row 12)."""
FADE_WINDOW = 5
"""The same altogether within so many times as long: a sensor that is invalid for a fifth of the time is
broken."""
LIMIT_TICKS = 3
"""Ticks past a hard limit before the machine stops (row 25)."""
JUMPS = 2
"""Measurements of an axis within a window that are not plausible and stop the machine (row 10)."""
MISMATCHES = 10
"""Ticks within a window in which two encoders, or motor and torque sensor, contradict each other before the
machine stops (row 11)."""

ASTRAY_S = 5e-3
"""For so long an axis may not follow its controller before the machine stops (row 44)."""

SPORADIC_HOLD = Rule(Reaction.HOLD, SPORADIC + 1, WINDOW)


class Monitor:
    """Judges one observation a tick; total, never raises.

    Attributes:
        trust: in the measurements of the last observation.
    """

    def __init__(self, thresholds: Thresholds) -> None:
        self._sound = [True] * len(thresholds.axes)
        self.trust = Trust(1.0, self._sound.copy())
        checks = [(row, row.make(thresholds, self.trust)) for row in CHECKS.values()]
        spared = [(row, check) for row, check in checks if row.bad or row.good]
        self._judges = [check.judge for _, check in checks]
        self._always = [check.judge for row, check in checks if not (row.bad or row.good)]
        self._counts = [count for _, check in spared for count in check.counts]
        self._bad = attrgetter(*(name for row, _ in spared for name in row.bad))
        self._good = attrgetter(*(name for row, _ in spared for name in row.good))
        self._idle = False

    def judge(self, seen: Observation) -> Verdict:
        """The strongest of what the single checks say; the first of equals."""
        self.trust.axes[:] = map(not_, seen.stale) if True in seen.stale else self._sound
        calm = self._idle and not any(self._bad(seen)) and all(self._good(seen))
        self._idle = calm  # where it is not, until all that is counted now is known to be forgotten
        verdict = PASS
        for judge in self._always if calm else self._judges:
            found = judge(seen)
            if found is not PASS:
                verdict = strongest(verdict, found)
        self._idle = calm or all(count.idle for count in self._counts)
        return verdict


def _people(t: Thresholds, trust: Trust) -> Check:
    def check(seen: Observation) -> Verdict:
        if seen.e_stop:
            return Verdict(Reaction.OFF, "e_stop", "the emergency stop is pressed")
        if seen.armed and seen.sto:
            return Verdict(Reaction.OFF, "sto", "the safety PLC switched the torque off")
        if seen.armed and not seen.supervised:
            return Verdict(Reaction.RAMP, "supervisor", "the safety operator's dead-man switch is open")
        if seen.armed and not (seen.dead_man or seen.overriding):
            return Verdict(Reaction.RAMP, "dead_man", "the dead-man switch is open")
        if seen.armed and seen.guarded and not seen.field_clear:
            return Verdict(Reaction.RAMP, "scanner", "somebody is in the scanned field")
        return PASS

    return Check(check)


def _devices(t: Thresholds, trust: Trust) -> Check:
    def check(seen: Observation) -> Verdict:
        if any(seen.faults):
            name, code = next(fault for fault in zip(t.devices, seen.faults, strict=True) if fault[1])
            return Verdict(Reaction.RAMP, "device_fault", f"{name} reports error {code:#06x}")
        if seen.armed and True in seen.lost:
            name = t.devices[list(seen.lost).index(True)]
            return Verdict(Reaction.RAMP, "device_state", f"{name} restarted or left its operating state")
        return PASS

    return Check(check)


def _missing(t: Thresholds, trust: Trust) -> Check:
    tallies = Tallies(t.devices, Rule(Reaction.SANITISE, 1, 1), SPORADIC_HOLD)
    silence = t.ticks(SILENCE_S)

    def check(seen: Observation) -> Verdict:
        strong, short, detail = tallies.push(seen.missed)
        if not short:
            return PASS
        worst = max(seen.missed, default=0)
        if worst >= MISSED_HOLD:
            name = t.devices[list(seen.missed).index(worst)]
            blind = bool(seen.stale) and all(seen.stale)  # no axis is left that could brake
            reaction = Reaction.RAMP if blind or worst >= silence else Reaction.HOLD
            return Verdict(reaction, "device_silent", f"{worst} frames of {name} missing in a row")
        if strong is Reaction.SANITISE:
            i = short[0]
            return Verdict(strong, "frame_missing", f"{seen.missed[i]} frames of {t.devices[i]} missing")
        return Verdict(strong, "device_silent", f"{detail} frames missing") if strong else PASS

    return Check(check, (tallies,))


def _discarded(t: Thresholds, trust: Trust) -> Check:
    tally = Tally(Rule(Reaction.SANITISE, 1, 1), SPORADIC_HOLD)

    def check(seen: Observation) -> Verdict:
        reaction = tally.push(seen.discarded > 0)
        if not reaction:
            return PASS
        if reaction is Reaction.SANITISE:
            return Verdict(reaction, "frame_discarded", f"{seen.discarded} stale frames")
        detail = f"{tally.count} of {WINDOW} ticks with stale or repeated frames"
        return Verdict(reaction, "stale_frames", detail)

    return Check(check, (tally,))


def _masters(t: Thresholds, trust: Trust) -> Check:
    def check(seen: Observation) -> Verdict:
        if not seen.foreign:
            return PASS
        return Verdict(Reaction.RAMP, "second_master", f"{seen.foreign} frames that only a master sends")

    return Check(check)


def _frozen(t: Thresholds, trust: Trust) -> Check:
    def check(seen: Observation) -> Verdict:
        if True not in seen.frozen:
            return PASS
        still = [i for i, frozen in enumerate(seen.frozen) if frozen]
        _distrust(trust, still)
        return Verdict(Reaction.RAMP, "encoder_frozen", f"an encoder of {t.axes[still[0]]} stands still")

    return Check(check)


def _contradicted(t: Thresholds, trust: Trust) -> Check:
    def check(seen: Observation) -> Verdict:
        if True not in seen.contradicted:
            return PASS
        wrong = [i for i, contradicted in enumerate(seen.contradicted) if contradicted]
        _distrust(trust, wrong)
        detail = f"position and velocity of {t.axes[wrong[0]]} contradict each other"
        return Verdict(Reaction.RAMP, "velocity_mismatch", detail)

    return Check(check)


def _contradictions(seen_in: str, first: Reaction, most: int, reason: str, detail: str) -> Maker:
    """Findings of single axes, some of which stop the machine without the axis.

    Args:
        seen_in: field of the observation, one an axis.
        first: reaction to a single one.
        most: as many within a window stop.
        reason: of the stop.
        detail: after which axis it is, and how often, for people.
    """

    def make(t: Thresholds, trust: Trust) -> Check:
        tallies = Tallies(t.axes, Rule(first, 1, 1), Rule(Reaction.RAMP, most, WINDOW))

        def check(seen: Observation) -> Verdict:
            strong, worst, whose = tallies.push(getattr(seen, seen_in))
            if not worst:
                return PASS
            if strong is Reaction.RAMP:
                _distrust(trust, worst)
            return Verdict(strong, reason, f"{whose} {detail}") if strong else PASS

        return Check(check, (tallies,))

    return make


_jumps = _contradictions("rejected", Reaction.SANITISE, JUMPS, "encoder_jump", "measurements not plausible")
_mismatches = _contradictions(
    "mismatched", Reaction.RECORD, MISMATCHES, "encoder_mismatch", "contradict each other"
)
_unbalanced = _contradictions(
    "unbalanced",
    Reaction.RECORD,
    MISMATCHES,
    "torque_mismatch",
    "in which its torque sensor does not show what its motor gives",
)


def overloaded(seen: Observation, verdict: Verdict) -> Verdict:
    """The same, called by its cause where a hand is stronger than the machine."""
    if not seen.overload:
        return verdict
    detail = f"{seen.overload} is pulled with more than its rated torque: {verdict.detail}"
    return Verdict(verdict.reaction, "overloaded", detail)


def _distrust(trust: Trust, axes: list[int]) -> None:
    for i in axes:
        trust.axes[i] = False


def _limits(t: Thresholds, trust: Trust) -> Check:
    tally = Tally(Rule(Reaction.RAMP, LIMIT_TICKS, LIMIT_TICKS), Rule(Reaction.RAMP, SPORADIC + 1, WINDOW))
    limits = HardLimits(t)

    def check(seen: Observation) -> Verdict:
        fine = limits.kept(seen.position, seen.velocity, seen.way)
        reaction = tally.push(not fine)
        if fine:
            return PASS
        rows = zip(
            *(t.axes, seen.position, seen.velocity, t.lower, t.upper, t.motor_speed, seen.way, t.speed),
            strict=True,
        )
        name, q, qd, lower, upper, speed = next(
            (name, q, qd, lower, upper, most) if abs(qd) > most else (name, q, way, lower, upper, fast)
            for name, q, qd, lower, upper, most, way, fast in rows
            if not (lower <= q <= upper and abs(qd) <= most and way <= fast)
        )
        detail = f"{name} at {q:g} with {qd:g} per second; allowed {lower:g} to {upper:g}, {speed:g}"
        if reaction and seen.armed:
            return overloaded(seen, Verdict(reaction, "beyond_limit", detail))
        return Verdict(Reaction.RECORD, "near_limit", detail)

    return Check(check, (tally,))


def _following(t: Thresholds, trust: Trust) -> Check:
    tally = Tally(Rule(Reaction.RAMP, t.ticks(ASTRAY_S), t.ticks(ASTRAY_S)))

    def check(seen: Observation) -> Verdict:
        astray = True in seen.astray
        reaction = tally.push(astray)
        if not (astray and reaction):
            return PASS
        name = t.axes[list(seen.astray).index(True)]
        return overloaded(seen, Verdict(reaction, "not_following", f"{name} does not follow its controller"))

    return Check(check, (tally,))


def _collision(t: Thresholds, trust: Trust) -> Check:
    def check(seen: Observation) -> Verdict:
        if seen.pressed:
            return Verdict(Reaction.RAMP, "collision_ahead", seen.pressed)
        return Verdict(Reaction.HOLD, "collision_ahead", seen.ahead) if seen.ahead else PASS

    return Check(check)


def _wrench(t: Thresholds, trust: Trust) -> Check:
    (lost, tally), step = _lost(t, "wrench"), 1.0 / t.ticks(FADE_S)

    def check(seen: Observation) -> Verdict:
        valid = seen.wrench is not None and all(map(isfinite, seen.wrench))
        if valid and trust.wrench == 1.0 and tally.idle:
            return PASS
        trust.wrench = min(1.0, trust.wrench + step) if valid else max(0.0, trust.wrench - step)
        return lost(valid, seen.armed)

    return Check(check, (tally,))


def _inertial(t: Thresholds, trust: Trust) -> Check:
    lost, tally = _lost(t, "acceleration")
    return Check(lambda seen: lost(seen.inertial, seen.armed), (tally,))


def _lost(t: Thresholds, what: str) -> tuple[Callable[[bool, bool], Verdict], Tally]:
    fade = t.ticks(FADE_S)
    tally = Tally(Rule(Reaction.SANITISE, 1, 1), Rule(Reaction.HOLD, fade + 1, FADE_WINDOW * fade))

    def judge(valid: bool, armed: bool) -> Verdict:
        reaction = tally.push(not valid)
        stops = armed and reaction is Reaction.HOLD
        if valid and not stops:
            return PASS
        detail = f"no valid {what} in {tally.count} of {FADE_WINDOW * fade} ticks"
        if stops:
            return Verdict(reaction, f"{what}_lost", detail)
        return Verdict(Reaction.SANITISE, f"{what}_invalid", detail)

    return judge, tally


def _solver(t: Thresholds, trust: Trust) -> Check:
    tally = Tally(
        Rule(Reaction.SANITISE, 1, 1),
        Rule(Reaction.HOLD, SOLVE_HOLD, SOLVE_HOLD),
        Rule(Reaction.RAMP, SOLVE_RAMP, SOLVE_RAMP),
        SPORADIC_HOLD,
    )

    def check(seen: Observation) -> Verdict:
        reaction = tally.push(not seen.solved)
        return Verdict(reaction, "solve_failed", f"{tally.count} of {WINDOW} solves") if reaction else PASS

    return Check(check, (tally,))


def _punctuality(t: Thresholds, trust: Trust) -> Check:
    tally = Tally(SPORADIC_HOLD)
    stall = t.ticks(STALL_S)

    def check(seen: Observation) -> Verdict:
        often = tally.push(False, seen.skipped)
        if not seen.skipped:
            return PASS
        detail = f"{seen.skipped} ticks skipped, {tally.count} within {WINDOW} ticks"
        if not (t.overruns_stop and seen.armed):
            return Verdict(Reaction.RECORD, "overrun", detail)
        if seen.skipped >= stall:
            return Verdict(Reaction.RAMP, "stall", detail)
        if seen.skipped >= SKIPPED_IN_A_ROW or often:
            return Verdict(Reaction.HOLD, "overrun", detail)
        return Verdict(Reaction.RECORD, "overrun", detail)

    return Check(check, (tally,))


CHECKS: dict[str, Row] = {
    "14 to 16": Row(_people),
    "7, 8": Row(_devices, bad=("faults", "lost")),
    "1 to 3": Row(_missing, bad=("missed",)),
    "4": Row(_discarded, bad=("discarded",)),
    "6": Row(_masters, bad=("foreign",)),
    "9": Row(_frozen, bad=("frozen",)),
    "9, velocity": Row(_contradicted, bad=("contradicted",)),
    "10": Row(_jumps, bad=("rejected",)),
    "11": Row(_mismatches, bad=("mismatched",)),
    "11, torques": Row(_unbalanced, bad=("unbalanced",)),
    "25": Row(_limits),
    "26": Row(_collision, bad=("ahead", "pressed")),
    "44": Row(_following, bad=("astray",)),
    "12": Row(_wrench),
    "12, accelerometers": Row(_inertial, good=("inertial",)),
    "17, 18": Row(_solver, good=("solved",)),
    "19, 20": Row(_punctuality, bad=("skipped",)),
}
"""Rows of the fault matrix and what checks them."""
