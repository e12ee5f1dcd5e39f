"""Whether what a configuration says of turns fits the directions of its task."""

from __future__ import annotations

from .config import RhiConfig
from .redundant import AXES, PLACE

Found = list[tuple[str, str, str]]
TURNS = ("rotational_stiffness", "rotational_damping", "torque")


def check_directions(config: RhiConfig) -> Found:
    """Directions that are none of a hand's, and turns where the task has none: key, problem, fix."""
    task = config.rhi.task
    named = " ".join(task.directions)
    if len(set(task.directions)) < len(task.directions):
        return [("rhi.task.directions", f"{named}: one is named twice", "name each once")]
    if set(task.directions) - set(AXES[:PLACE]) and task.directions != AXES:
        return [
            (
                "rhi.task.directions",
                f"{named}: a hand that turns moves in all directions",
                f"write {' '.join(AXES)}, or leave the turns out",
            )
        ]
    if len(task.directions) > PLACE:
        return []
    fix = f"leave it out, or let rhi.task.directions be {' '.join(AXES)}"
    given = {f"rhi.task.{key}": getattr(task, key) is not None for key in ("lever", "tool")}
    if config.simulation is not None:
        hand, plant = config.simulation.hand, config.simulation.rhi
        given |= {f"simulation.hand.{key}": getattr(hand, key) is not None for key in TURNS}
        given |= {
            "simulation.hand.path": any(place.turned is not None for place in hand.path),
            "simulation.rhi.torque_noise": plant.torque_noise is not None,
        }
    return [(key, "is of turns, and the task has none", fix) for key, there in given.items() if there]
