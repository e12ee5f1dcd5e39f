"""ContactAware, fig. 9: palpation in the free and in the stiff posture, and with the full controller."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np

from ..machines.rhi.polytope import Polytope
from ..machines.rhi.saturation import force_limit
from ..machines.rhi.self_motion import descend, scan
from ..models import Array
from .outcome import Outcome, Progress, Row
from .palpation import Device, Trace

TITLE = "palpation: free, stiff and switching (fig. 9)"
DEPTHS = (0.010, 0.015, 0.020, 0.030, 0.040)
FREQUENCIES = (0.1, 0.25, 0.5)
STEEPNESS = (1.0, 5.0)
VARIANTS: dict[str, dict[str, Any]] = {
    "full": {},
    "without posture targets": {"null_space": {"scan": 0}},
    "without headroom": {"saturation": {"held": 1.0}},
    "hqp": {"null_space": {"resolution": "hqp"}},
}

RESOLUTIONS = ("full", "hqp")


class Bound:
    """What statics allow at best: the largest force along u over the self-motion, for every depth."""

    def __init__(self, device: Device, count: int = 3000) -> None:
        self._device, self._y = device, np.linspace(0.0, max(DEPTHS), 9)
        self._force = np.array([self._best(y, count) for y in self._y])

    def of(self, trace: Trace) -> float:
        """The largest force that was both asked for and possible in a session [N]."""
        depth = (trace.position - self._device.centre) @ self._device.u
        possible = np.interp(depth, self._y, self._force)
        return float(np.minimum(np.linalg.norm(trace.demand, axis=1), possible).max())

    def _best(self, depth: float, count: int) -> float:
        d = self._device
        x = d.centre + depth * d.u
        Q = scan(d.arm, x, d.bounds, count)
        force = force_limit(d.arm.reach(Q)[1], d.limit, d.u)
        start = Q[np.argsort(-force)[:8]]
        found, _ = descend(d.arm, start, x, Polytope(d.limit, d.u[None], worst_condition=50.0))
        polished = force_limit(d.arm.reach(found)[1], d.limit, d.u)
        return float(max(force.max(), polished.max()))


def peak(trace: Trace) -> float:
    """Largest rendered force [N]."""
    return float(np.linalg.norm(trace.force, axis=1).max())


def given(trace: Trace) -> float:
    """Net energy given to the hand over what it has put in; negative where it has lost some."""
    return -float(trace.work.sum() / trace.work[trace.work > 0.0].sum())


def chatter(trace: Trace, limit: Array) -> float:
    """Largest step of a torque from tick to tick over its limit."""
    return float((np.abs(np.diff(trace.torque, axis=0)) / limit).max())


def unfelt(trace: Trace, u: Array) -> float:
    """Root mean square of what the sensor sees along u (m,) beside the rendered force, in contact [N]."""
    contact = np.linalg.norm(trace.demand, axis=1) > 0.0
    return float(np.sqrt(np.mean(((trace.sensed - trace.force)[contact] @ u) ** 2)))


def half_turns(trace: Trace) -> int:
    """How often the activation crosses one half."""
    return int(np.count_nonzero(np.diff((trace.omega < 0.5).astype(int))))


def run(progress: Progress) -> Outcome:
    """Cases A and B, then every depth, frequency and S with the full controller and its variants."""
    plain = Device()
    cases = {mode: plain.palpate(0.04, 0.25, 4.0, mode) for mode in ("free", "stiff", "switching")}
    forces = {mode: peak(trace) for mode, trace in cases.items()}
    unseen = {mode: unfelt(trace, plain.u) for mode, trace in cases.items()}
    bound = Bound(plain)
    optimum = float(bound._force[0])
    palpations = list(_palpations(bound, progress))
    rows = [*_cases(forces, unseen, optimum), *_shares(palpations), *_most(palpations)]
    figures = {
        "force_n": forces,
        "unseen_n": unseen,
        "static_optimum_n": optimum,
        "palpations": palpations,
    }
    return Outcome(rows, figures, lambda figure: _draw(figure, cases, plain.u), (9.0, 6.0))


def _palpations(bound: Bound, progress: Progress) -> Iterator[dict[str, Any]]:
    """What is measured at every depth, frequency and S, with the full controller and its variants."""
    for (variant, changes), S in product(VARIANTS.items(), STEEPNESS):
        saturation = {**changes.get("saturation", {}), "steepness": S}
        device = Device(**{**changes, "saturation": saturation})
        for f, depth in product(FREQUENCIES, DEPTHS):
            progress(f"{variant}, S = {S:g}, {f:g} Hz, {1e3 * depth:g} mm")
            trace = device.palpate(depth, f, 1.0 / f)
            yield {
                **{"variant": variant, "S": S, "hz": f, "depth_mm": 1e3 * depth},
                "peak_n": peak(trace),
                "share": peak(trace) / bound.of(trace),
                "torque": float((np.abs(trace.torque) / device.limit).max()),
                "turns": half_turns(trace),
                "given": given(trace),
                "step": chatter(trace, device.limit),
            }


def _cases(forces: dict[str, float], unseen: dict[str, float], optimum: float) -> list[Row]:
    """What the paper prints of the cases A and B, and what the hand does not feel of them."""
    apart = "the optima lie further apart than the paper's postures"
    return [
        Row("force in case A, free [N]", "5.674", f"{forces['free']:.3f}", UNKNOWN),
        Row("force in case B, stiff [N]", "8.564", f"{forces['stiff']:.3f}", UNKNOWN),
        Row("gain of B over A", "1.51", f"{forces['stiff'] / forces['free']:.2f}", apart),
        Row("largest static force at X0 over the self-motion [N]", "-", f"{optimum:.3f}"),
        *(
            Row(f"sensed less rendered force along u, {mode}, rms [N]", "-", f"{rms:.3f}", CARRIED)
            for mode, rms in unseen.items()
        ),
    ]


def _shares(palpations: list[dict[str, Any]]) -> Iterator[Row]:
    """How much of what could be rendered is, by variant and frequency."""
    for variant, f in product(VARIANTS, FREQUENCIES):
        shares = [e["share"] for e in palpations if e["variant"] == variant and e["hz"] == f]
        quantity = f"peak over the smaller of demand and static optimum, {variant}, {f:g} Hz"
        yield Row(quantity, "-", f"{min(shares):.3f} to {max(shares):.3f}", "10 to 40 mm, S = 1 and 5")


def _most(palpations: list[dict[str, Any]]) -> Iterator[Row]:
    """What none of the palpations exceeds."""
    for variant in (name for name in RESOLUTIONS if name in VARIANTS):
        own = [e for e in palpations if e["variant"] == variant]
        energy, step = max(e["given"] for e in own), max(e["step"] for e in own)
        quantity = f"net energy given to the hand over what it has put in, {variant}, at most"
        yield Row(quantity, "-", f"{energy:.4f}", "all depths, frequencies, S; negative: lost")
        quantity = f"step of a torque from tick to tick over its limit, {variant}, at most"
        yield Row(quantity, "-", f"{step:.3f}", "the same")
    most = max(e["torque"] for e in palpations)
    quantity = "largest torque over its limit, all sessions"
    yield Row(quantity, "-", f"{most:.6f}", "1 is what the motors may give")
    turns = max(e["turns"] for e in palpations)
    yield Row("half-way crossings of the activation per palpation", "-", f"{turns}", "2: there and back")


UNKNOWN = "statics put the paper's value inside what the self-motion at X0 allows, not at its optimum"
CARRIED = "inertia and friction of the device, which the hand carries"


def _draw(figure: Any, cases: dict[str, Trace], u: Array) -> None:
    axes = figure.subplots(2, len(cases), sharex=True, sharey="row")
    for k, (name, trace) in enumerate(cases.items()):
        axes[0, k].plot(trace.t, -trace.force @ u, label="rendered")
        axes[0, k].plot(trace.t, -trace.sensed @ u, lw=0.8, ls="--", label="seen by the sensor")
        axes[0, k].plot(trace.t, -trace.demand @ u, lw=0.8, label="demand")
        axes[0, k].set(title=name, ylim=(-2, 20))
        axes[1, k].plot(trace.t, trace.torque, label=[f"motor {i}" for i in range(1, 5)])
        axes[1, k].set(xlabel="t [s]", ylim=(-3.2, 3.2))
    axes[0, 0].set_ylabel("force on the hand [N]")
    axes[1, 0].set_ylabel("motor torque [N m]")
    axes[0, 0].legend(fontsize=7)
    axes[1, 0].legend(fontsize=7)
