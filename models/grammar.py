"""Elements and attributes of a robot description that the linter knows; what is not here is refused."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Numbers:
    """An attribute that holds numbers.

    Attributes:
        range: a key of RANGES.
        count: how many.
        needed: whether it must be there.
        default: what a URDF means that does not say it.
    """

    range: str
    count: int = 1
    needed: bool = True
    default: tuple[float, ...] | None = None


@dataclass(frozen=True, slots=True)
class Text:
    """An attribute that holds a name."""

    needed: bool = True


@dataclass(frozen=True, slots=True)
class Rule:
    """What an element may hold.

    Attributes:
        attributes: by name.
        needed: children that must be there exactly once.
        allowed: children that may be there once.
        assumed: the same; where one is not there its defaults hold, so that reading adds it.
        repeated: children that may be there any number of times.
        one_of: children of which exactly one must be there.
        ignored: children that are skipped with all they hold; each says why.
        refused: children that are known and not supported; each says what to do.
    """

    attributes: Mapping[str, Numbers | Text] = field(default_factory=dict)
    needed: Mapping[str, Rule] = field(default_factory=dict)
    allowed: Mapping[str, Rule] = field(default_factory=dict)
    assumed: Mapping[str, Rule] = field(default_factory=dict)
    repeated: Mapping[str, Rule] = field(default_factory=dict)
    one_of: Mapping[str, Rule] = field(default_factory=dict)
    ignored: Mapping[str, str] = field(default_factory=dict)
    refused: Mapping[str, str] = field(default_factory=dict)

    @property
    def known(self) -> dict[str, Rule]:
        """Rules of all children that are read."""
        return {**self.needed, **self.allowed, **self.assumed, **self.repeated, **self.one_of}


FIXED, REVOLUTE, CONTINUOUS, PRISMATIC = "fixed", "revolute", "continuous", "prismatic"
NAMED = {"name": Text()}

_NOWHERE = (0.0, 0.0, 0.0)
_pose = Rule({"xyz": Numbers("place", 3, default=_NOWHERE), "rpy": Numbers("angle", 3, default=_NOWHERE)})
_inertia = Rule(
    {
        **{f"i{axis}{axis}": Numbers("moment") for axis in "xyz"},
        **{f"i{pair}": Numbers("product") for pair in ("xy", "xz", "yz")},
    }
)
_inertial = Rule(
    needed={"mass": Rule({"value": Numbers("mass")}), "inertia": _inertia}, assumed={"origin": _pose}
)
_round = {"radius": Numbers("size"), "length": Numbers("size")}
_geometry = Rule(
    one_of={
        "box": Rule({"size": Numbers("size", 3)}),
        "cylinder": Rule(_round),
        "capsule": Rule(_round),
        "sphere": Rule({"radius": Numbers("size")}),
        "mesh": Rule({"filename": Text(), "scale": Numbers("scale", 3, needed=False)}),
    }
)
_looks = {
    "color": Rule({"rgba": Numbers("colour", 4)}),
    "texture": Rule({"filename": Text()}),
}
_material = Rule(NAMED, allowed=_looks)
_collision = Rule({"name": Text(needed=False)}, needed={"geometry": _geometry}, assumed={"origin": _pose})
_visual = Rule(
    {"name": Text(needed=False)},
    needed={"geometry": _geometry},
    allowed={"material": Rule({"name": Text(needed=False)}, allowed=_looks)},
    assumed={"origin": _pose},
)
_link = Rule(
    {**NAMED, "type": Text(needed=False)},
    allowed={"inertial": _inertial, "collision_checking": Rule(repeated={"capsule": Rule(NAMED)})},
    repeated={"visual": _visual, "collision": _collision},
)


_axis = Rule({"xyz": Numbers("axis", 3, default=(1.0, 0.0, 0.0))})


def _joint(limit: Rule | None, dynamics: Rule | None) -> Rule:
    ends = {"parent": Rule({"link": Text()}), "child": Rule({"link": Text()})}
    moves = limit and dynamics
    unread = dict.fromkeys(("axis", "limit", "dynamics"), "a fixed joint has none of its own")
    return Rule(
        {**NAMED, "type": Text()},
        needed=ends | ({"limit": limit} if limit else {}),
        assumed={"origin": _pose} | ({"axis": _axis, "dynamics": dynamics} if dynamics else {}),
        ignored={
            "calibration": "the drives find their zero by themselves",
            **({} if moves else unread),
        },
        refused={
            "mimic": "a joint that follows another would be taken for a free one; give it a drive, or fix it",
            "safety_controller": "its soft limits are not obeyed; put limits into the configuration",
        },
    )


def _limit(effort: str, velocity: str, **ends: Numbers) -> Rule:
    return Rule({"effort": Numbers(effort), "velocity": Numbers(velocity), **ends})


def _dynamics(damping: str, friction: str) -> Rule:
    return Rule({"damping": Numbers(damping, default=(0.0,)), "friction": Numbers(friction, needed=False)})


_turning = ("torque", "angular speed"), ("angular damping", "dry torque")
JOINTS = {
    FIXED: _joint(None, None),
    CONTINUOUS: _joint(_limit(*_turning[0]), _dynamics(*_turning[1])),
    REVOLUTE: _joint(
        _limit(*_turning[0], lower=Numbers("turn"), upper=Numbers("turn")), _dynamics(*_turning[1])
    ),
    PRISMATIC: _joint(
        _limit("force", "speed", lower=Numbers("travel"), upper=Numbers("travel")),
        _dynamics("damping", "dry force"),
    ),
}
"""The joint by its type."""

ROBOT = Rule(
    {**NAMED, "version": Text(needed=False)},
    repeated={"link": _link, "joint": JOINTS[FIXED], "material": _material},
    ignored={
        "gazebo": "for another simulator",
        "transmission": "the drives stand in the configuration",
        "ros2_control": "the drives stand in the configuration",
    },
)
