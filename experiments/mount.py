"""Where to mount an operator arm, in simulation."""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from ..runtime.errors import HapticdError
from ..runtime.invocation import install
from .mounting import INITIAL, Mounting, Progress, base, reached, search
from .seated_operator import COUNT, SHOULDER, HandPoses, hand_poses
from .workers import pool_of

PAPER = {"initial": (1795, 1164, 60.6), "optimised": (2848, 111, 96.3)}
"""Reached, missed and share [%] in Table I of Bimanual."""
BAR = 30


class MountError(HapticdError):
    """A mounting cannot be looked for as asked."""

    code = "mount"
    exit_status = 2


@dataclass(frozen=True, slots=True)
class Mount:
    """What a search came to.

    Attributes:
        poses: that it was made for; held: others, that it has never seen.
        mounting: the best; before, after: which of the poses are reached, (k,); shares of the others held.
    """

    poses: HandPoses
    held: HandPoses
    mounting: Mounting
    before: Any
    after: Any
    held_before: float
    held_after: float

    def figures(self) -> dict[str, Any]:
        """Plain numbers for --json."""
        return {
            "poses": len(self.before),
            "initial": {"reached": int(self.before.sum()), "share": float(self.before.mean())},
            "optimised": {"reached": int(self.after.sum()), "share": float(self.after.mean())},
            "held_out": {"initial": self.held_before, "optimised": self.held_after},
            "position": list(self.mounting[:3]),
            "rotation_vector": list(self.mounting[3:]),
        }


def run(options: argparse.Namespace) -> int:
    """Search, print and draw; 1 where too few of the poses held out are reached, else 0.

    Raises:
        MountError: a picture is asked for and matplotlib is missing, or the file cannot be written.
    """
    if options.picture and not find_spec("matplotlib"):
        raise MountError(f"a picture needs matplotlib; type: {install('matplotlib')}")
    live = sys.stderr.isatty() and not options.json
    found = mounted(options.poses or COUNT, options.seed, options.workers, show if live else lambda _: None)
    if live:
        sys.stderr.write("\r\x1b[K")
    print(msgspec.json.encode(found.figures()).decode() if options.json else "\n".join(table(found)))
    if options.picture:
        try:
            _save(options.picture, found)
        except (OSError, ValueError) as error:
            raise MountError(f"cannot write {options.picture}: {error}") from error
        print(f"written: {options.picture}", file=sys.stderr)
    return int(found.held_after < 0.96)


def mounted(count: int, seed: int, workers: int, progress: Any) -> Mount:
    """Search with so many processes, and look at the result."""
    own, held = hand_poses(count, 2 * seed), hand_poses(count, 2 * seed + 1)
    if workers == 1:
        best = search(own, seed, None, progress)
    else:
        with pool_of(workers) as pool:
            best = search(own, seed, pool, progress)
    shares = (float(reached(each, held).mean()) for each in (INITIAL, best))
    return Mount(own, held, best, reached(INITIAL, own), reached(best, own), *shares)


def show(progress: Progress) -> None:
    """A bar, how many mountings were tried, and the best so far."""
    done = BAR * progress.done // progress.of
    bar = "#" * done + "." * (BAR - done)
    sys.stderr.write(
        f"\r[{bar}] {progress.done}/{progress.of} mountings, best {100 * progress.best:.1f} %\x1b[K"
    )
    sys.stderr.flush()


def table(found: Mount) -> list[str]:
    """Before and after, beside the paper's."""
    lines = [
        "Poses of a seated person's left hand that the arm reaches; a simulated person, not a recorded one",
        "",
        f"{'mounting':12}{'reached':>9}{'missed':>9}{'share':>9}{'held out':>10}{'paper':>9}",
    ]
    both = ("initial", found.before, found.held_before), ("optimised", found.after, found.held_after)
    for name, mask, held in both:
        hit, of = int(mask.sum()), len(mask)
        shares = f"{100 * hit / of:8.1f}%{100 * held:9.1f}%{PAPER[name][2]:8.1f}%"
        lines.append(f"{name:12}{hit:9}{of - hit:9}{shares}")
    place, turn = (" ".join(f"{x:.3f}" for x in part) for part in (found.mounting[:3], found.mounting[3:]))
    lines += [
        "",
        "base in the person's frame (x forward, y to the left, z up, from between the shoulders):",
        f"  position {place} m, rotation vector {turn} rad",
    ]
    return lines


def draw(figure: Any, found: Mount) -> None:
    """Both mountings in 3D: poses reached and missed, the base, and the person's shoulder."""
    shown = np.linspace(0, len(found.before) - 1, min(500, len(found.before))).astype(int)
    for k, (name, mounting, mask) in enumerate(
        (("initial", INITIAL, found.before), ("optimised", found.mounting, found.after)), 1
    ):
        axes = figure.add_subplot(1, 2, k, projection="3d")
        for hit, colour, label in ((True, "turquoise", "reached"), (False, "red", "missed")):
            chosen = shown[mask[shown] == hit]
            p, fingers = found.poses.positions[chosen], found.poses.rotations[chosen][:, :, 0]
            axes.quiver(
                *p.T, *fingers.T, length=0.04, color=colour, label=label, linewidth=0.6, rasterized=True
            )
        T = base(mounting)
        for axis, colour in enumerate("rgb"):
            axes.quiver(*T[:3, 3], *T[:3, axis], length=0.2, color=colour)
            axes.quiver(0, 0, 0, *np.eye(3)[axis], length=0.15, color=colour, linestyle=":")
        axes.plot([0.0, SHOULDER[0]], [0.0, SHOULDER[1]], [0.0, SHOULDER[2]], color="black")
        axes.set(title=f"{name}: {100 * mask.mean():.1f} %", xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
        axes.set_box_aspect((1, 1, 1), zoom=0.85)
        axes.legend(loc="upper left")


def _save(path: Path, found: Mount) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 5.0), layout="constrained")
    draw(figure, found)
    figure.savefig(path)
