"""Takes a serial arm out of anybody's URDF: the chain to a tip, with everything else frozen to it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pinocchio as pin

from ...configs.words import counted
from ...models.xml_tree import Element, parse
from .check import FEWEST, MOST
from .description import GRIP_LENGTH, HANDLE, SENSOR, Body, Description, Joint
from .errors import InitError
from .mending import mend
from .urdf_elements import body_of, joint_of, name_of, primitives_of
from .urdf_tree import Tree

GRASPING = ("gripper", "finger", "thumb", "jaw", "claw")
"""Words in the names of joints that close a gripper; of the links that they move, all but the first."""


def read_arm(text: str, source: str, tip: str | None) -> Description:
    """The chain from the root of a URDF to a tip, or to where it ends or branches.

    Raises:
        InitError: there is no such tip, or no arm with three to seven joints and masses on the way to it.
        ModelError: the text is no XML, or too much of it.
    """
    root = parse(text, source)
    if root.tag != "robot":
        raise InitError(f"{source}: the root element is <{root.tag}>; a URDF starts with <robot name=...>")
    _require_expanded(root, source)
    links = {name_of(link, source): body_of(link, source) for link in root.all("link")}
    joints = [joint_of(joint, source) for joint in root.all("joint")]
    shapes = {name_of(link, source): primitives_of(link, source) for link in root.all("link")}
    tree = Tree(links, joints, source, shapes)
    remarks: list[str] = []
    every = sum(len(link.all("visual")) + len(link.all("collision")) for link in root.all("link"))
    unused = every - sum(map(len, shapes.values()))
    if unused:
        remarks.append(
            f"{unused} shapes and their meshes are left out: only primitives for collisions are kept"
        )
    end = tree.end(tip)
    if tip is None:
        remarks.append(f"the tip is taken to be '{end}'; --tip names another")
    chain = tree.chain(end)
    if tip is None:
        remarks += _closing(chain, joints, tree)
    _require_arm(chain, tree, source)
    arm = _gather(root.attributes.get("name", "arm"), chain, tree, remarks)
    arm.source = source
    mend(arm)
    return arm


def _closing(chain: Sequence[Joint], joints: Sequence[Joint], tree: Tree) -> list[str]:
    """What to do about a last joint that closes a gripper, where an arm is left without it."""
    moving = [joint for joint in chain if joint.moves]
    if len(moving) <= FEWEST:
        return []
    last = moving[-1]
    named = any(word in last.name.lower() for word in GRASPING) or any(
        word in last.child.lower() for word in GRASPING[1:]
    )
    if named or any(joint.follows == last.name for joint in joints):
        return [
            f"'{last.name}', the last joint, looks like a gripper's, which the hand would open and close; "
            f"--tip {tree.tool(last.parent)} leaves it out"
        ]
    return []


def _require_expanded(element: Element, source: str) -> None:
    if element.tag.startswith("xacro:") or any("${" in value for value in element.attributes.values()):
        raise InitError(f"{source}:{element.line}: this is a xacro, not a URDF; expand it first: xacro FILE")
    for child in element.children:
        _require_expanded(child, source)


def _require_arm(chain: Sequence[Joint], tree: Tree, source: str) -> None:
    for joint in chain:
        if joint.kind in ("floating", "planar"):
            raise InitError(f"{source}: '{joint.name}' is {joint.kind}; give a URDF whose base stands")
    moving = [joint.name for joint in chain if joint.moves]
    if FEWEST <= len(moving) <= MOST:
        return
    end = chain[-1].child if chain else tree.root
    what = f"{counted(len(moving), 'joint')} ({', '.join(moving)})" if moving else "no joint"
    raise InitError(
        f"{source}: {what} can move between '{tree.root}' and '{end}'; an arm has {FEWEST} to {MOST}. "
        f"{tree.tips('Name another tip with --tip: ')}"
    )


def _gather(name: str, chain: Sequence[Joint], tree: Tree, remarks: list[str]) -> Description:
    """The chain, and what hangs on it, frozen."""
    first = next(i for i, joint in enumerate(chain) if joint.moves)
    on_chain = {chain[0].parent, *(joint.child for joint in chain)}
    joints: dict[str, Joint] = {}
    frozen, dropped, kept, stuck = [], [], dict[str, Body | None](), []
    for i, joint in enumerate(chain):
        kept.setdefault(joint.parent, tree.links[joint.parent])
        kept[joint.child] = tree.links[joint.child]
        if joint.moves:
            joints[joint.name] = joint
        else:
            frozen.append(_frozen(joint))
            stuck += [joint.name] if joint.kind != "fixed" else []
        if i < first:
            continue
        branches = [other for other in tree.below[joint.child] if other.child not in on_chain]
        while branches:
            other = branches.pop()
            branches += tree.below[other.child]
            stuck += [other.name] if other.kind != "fixed" else []
            empty = tree.links[other.child] is None and not tree.shapes[other.child]
            if empty and not tree.below[other.child]:
                dropped.append(other.child)
            else:
                kept[other.child] = tree.links[other.child]
                frozen.append(_frozen(other))
    standing = [chain[0].parent, *(joint.child for joint in chain[:first])]
    aside = [other.name for link in standing for other in tree.below[link] if other.child not in on_chain]
    if aside:
        remarks.append(f"left out, for nothing that moves carries them: {', '.join(sorted(aside))}")
    if stuck:
        remarks.append(f"frozen where they stand, with what they carry: {', '.join(sorted(stuck))}")
    if dropped:
        remarks.append(f"merged into what carries them, for they weigh nothing: {', '.join(sorted(dropped))}")
    kept[chain[first].parent] = None  # what does not move needs no mass
    shapes = {link: tree.shapes[link] for link in kept if tree.shapes[link]}
    return _renamed(Description(name, joints, kept, frozen, shapes, remarks=remarks), chain[-1].child)


def _frozen(joint: Joint) -> Joint:
    """The joint as a fixed one, at 0 or at the end of its range that is next to it."""
    at = min(max(0.0, joint.lower), joint.upper)
    if joint.kind == "fixed" or not at:
        return replace(joint, kind="fixed")
    R, axis = pin.rpy.rpyToMatrix(*joint.rpy), np.array(joint.axis)
    xyz = np.array(joint.xyz)
    if joint.kind == "prismatic":
        xyz = xyz + R @ (at * axis)
    else:
        R = R @ pin.exp3(at * axis)
    return replace(joint, kind="fixed", xyz=tuple(xyz), rpy=tuple(pin.rpy.matrixToRpy(R)))


def _renamed(arm: Description, tip: str) -> Description:
    """Names that a configuration can hold, no two alike; sensor and handle on the tip."""
    taken = {"universe", HANDLE, SENSOR}
    new: dict[tuple[str, str], str] = {}

    def unique(kind: str, name: str) -> None:
        plain = re.sub(r"[^A-Za-z0-9_-]", "_", name)[:60] or kind
        tries = (plain, f"{plain}_{kind}", *(f"{plain}_{kind}_{i}" for i in range(2, 999)))
        new[kind, name] = next(word for word in tries if word not in taken)
        taken.add(new[kind, name])

    for link in arm.links:
        unique("link", link)
    for joint in (*arm.joints.values(), *arm.frozen):
        unique("joint", joint.name)
    other = [f"'{name}' is called '{word}'" for (_, name), word in new.items() if name != word]
    if other:
        arm.remarks.append(f"{', '.join(other)}: names are letters and digits, and all differ")

    def rename(joint: Joint) -> Joint:
        parent, child = new["link", joint.parent], new["link", joint.child]
        return replace(joint, name=new["joint", joint.name], parent=parent, child=child)

    end, zero = new["link", tip], (0.0, 0.0, 0.0)
    mounts = [
        Joint(f"{SENSOR}_mount", "fixed", end, SENSOR, zero, zero),
        Joint(f"{HANDLE}_mount", "fixed", end, HANDLE, (0.0, 0.0, GRIP_LENGTH), zero),
    ]
    joints = {new["joint", name]: rename(joint) for name, joint in arm.joints.items()}
    links = {new["link", name]: body for name, body in arm.links.items()}
    return Description(
        re.sub(r"[^A-Za-z0-9_-]", "_", arm.name)[:60] or "arm",
        joints,
        {**links, SENSOR: None, HANDLE: None},
        [*map(rename, arm.frozen), *mounts],
        {new["link", name]: shapes for name, shapes in arm.shapes.items()},
        remarks=arm.remarks,
    )
