"""Links and joints of a URDF, and the ways through them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ...configs.words import nearest
from .check import FEWEST, MOST
from .description import MOVING, Body, Joint, Primitive
from .errors import InitError

TIPS = ("tcp", "tool0", "tool", "ee", "flange", "hand", "gripper")
"""Words in the names of links that people hold an arm at, best first."""


class Tree:
    """Links and the joints between them.

    Raises:
        InitError: they are no tree with one root.
    """

    def __init__(
        self,
        links: Mapping[str, Body | None],
        joints: Sequence[Joint],
        source: str,
        shapes: Mapping[str, list[Primitive]],
    ) -> None:
        self.links, self.source, self.shapes = links, source, shapes
        self.above: dict[str, Joint] = {}
        self.below: dict[str, list[Joint]] = {name: [] for name in links}
        for joint in joints:
            for link in (joint.parent, joint.child):
                if link not in links:
                    raise InitError(
                        f"{source}: joint '{joint.name}' names the link '{link}', which is not there"
                    )
            if joint.child in self.above:
                raise InitError(f"{source}: the link '{joint.child}' has two parent joints; a URDF is a tree")
            self.above[joint.child] = joint
            self.below[joint.parent].append(joint)
        self.root = self._root()

    def _root(self) -> str:
        """The link that no joint leads to."""
        roots = [name for name in self.links if name not in self.above]
        if not roots:
            loop = "every link has a parent joint, so the joints form a loop"
            what = loop if self.links else "there are no links"
            raise InitError(f"{self.source}: {what}; a URDF is a tree with one root")
        if len(roots) > 1:
            what = ", ".join(roots[:5]) + (", ..." if len(roots) > 5 else "")
            raise InitError(
                f"{self.source}: {len(roots)} links have no parent ({what}); connect all to one root"
            )
        return roots[0]

    def ways(self, link: str) -> list[Joint]:
        """Joints of a link that lead to anything that moves, or would if it did not follow another."""
        return [
            joint
            for joint in self.below[link]
            if (joint.kind in MOVING and joint.lower < joint.upper) or self.ways(joint.child)
        ]

    def end(self, tip: str | None) -> str:
        """The tip, or the link at which the only way to moving joints ends."""
        if tip is not None:
            if tip not in self.links:
                near = nearest(tip, self.links)
                meant = f"did you mean '{near}'? " if near else ""
                raise InitError(
                    f"{self.source}: there is no link '{tip}'; {meant}{self.tips('candidates: ')}"
                )
            return tip
        link = self.root
        while len(ways := self.ways(link)) == 1:
            link = ways[0].child
        if len(ways) > 1 and not any(joint.moves for joint in self.chain(link)):
            raise InitError(
                f"{self.source} branches at '{link}' before anything moves; "
                f"{self.tips('say where the hand holds it: --tip with one of ')}"
            )
        return link if ways else self.tool(link)

    def tool(self, link: str) -> str:
        """A mere frame fixed to a link whose name says that people hold the arm there, or the link."""
        frames = [joint.child for joint in self.below[link] if self.links[joint.child] is None]
        for word in TIPS:
            for frame in frames:
                if word in frame.lower():
                    return self.tool(frame)
        return link

    def chain(self, link: str) -> list[Joint]:
        """Joints from the root to a link."""
        found: list[Joint] = []
        while link != self.root:
            found.append(self.above[link])
            link = self.above[link].parent
            if len(found) > len(self.links):
                raise InitError(f"{self.source}: the joints form a loop; a URDF is a tree")
        return found[::-1]

    def tips(self, before: str) -> str:
        """A sentence with the links that may be named, or why there is none."""
        known = self.leaves()
        none = (
            f"no way from '{self.root}' to any link has {FEWEST} to {MOST} joints, so there is no arm in it"
        )
        return f"{before}{', '.join(known)}" if known else none

    def leaves(self) -> list[str]:
        """Links at which 3 to 7 joints end, the longest way first, as people may have meant them."""
        ways = {link: sum(joint.moves for joint in self.chain(link)) for link in self.links}
        known = [
            link
            for link, count in ways.items()
            if FEWEST <= count <= MOST and not any(joint.moves for joint in self.below[link])
        ]
        return sorted(known, key=lambda link: -ways[link])[:12] or []
