"""Reads a robot description by its grammar: what is not in there is refused."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..configs.numerals import number
from ..configs.ranges import RANGES
from .findings import called, near, refuse, shown
from .grammar import JOINTS, Numbers, Rule, Text
from .xml_tree import Element

MAX_NAME = 200
"""Characters of a name or of a number's text."""


def read(element: Element, rule: Rule, source: str, within: str = "") -> None:
    """Check an element and all it holds, and read its numbers.

    Args:
        element: as parsed; loses the children that its rule ignores.
        rule: of the element.
        source: of the description.
        within: what the messages call the nearest element around it that has a name.

    Raises:
        ModelError: at the first thing that the rule does not know, or that is missing or out of range.
    """
    within = called(element) if "name" in element.attributes else within or called(element)
    if element.text:
        refuse(element, source, f"<{element.tag}> holds the text '{shown(element.text)}'", "remove it")
    _read_attributes(element, rule.attributes, source, within)
    _count_children(element, rule, source, within)
    element.children = [child for child in element.children if child.tag not in rule.ignored]
    for child in element.children:
        read(child, _rule_of(child, rule, source), source, within)
    _refuse_repetition(element.children, source)


def _rule_of(child: Element, rule: Rule, source: str) -> Rule:
    if child.tag != "joint":
        return rule.known[child.tag]
    kind = child.attributes.get("type", "")
    if kind not in JOINTS:
        name = shown(child.attributes.get("name", ""))
        refuse(child, source, f"joint '{name}' has type '{shown(kind)}'", f"use one of {', '.join(JOINTS)}")
    return JOINTS[kind]


def _read_attributes(element: Element, known: Mapping[str, Numbers | Text], source: str, within: str) -> None:
    for name in element.attributes:
        if name not in known and name.partition(":")[0] != "xmlns":
            problem = f"{within}: <{element.tag}> has no attribute '{shown(name)}'"
            refuse(element, source, problem, near(name, known))
    for name, kind in known.items():
        text = element.attributes.get(name)
        if text is None:
            if kind.needed:
                what = "without a name" if name == "name" else f"lacks '{name}'"
                refuse(element, source, f"{within}: a <{element.tag}> {what}", f'give {name}="..."')
        elif isinstance(kind, Numbers):
            element.numbers[name] = _read_numbers(element, name, kind, source, within)
        elif not text.strip() or not text.isprintable() or len(text) > MAX_NAME:
            fix = f"give 1 to {MAX_NAME} printable characters"
            refuse(element, source, f'<{element.tag} {name}="{shown(text)}">', fix)


def _read_numbers(element: Element, name: str, kind: Numbers, source: str, within: str) -> tuple[float, ...]:
    text, allowed = element.attributes[name], RANGES[kind.range]
    numbers = [number(word) for word in text.split()] if len(text) <= MAX_NAME else []
    values = tuple(value for value in numbers if value is not None)
    if len(numbers) != kind.count or len(values) != kind.count:
        fix = f"give {kind.count} finite number{'s' if kind.count > 1 else ''}"
        refuse(element, source, f'{within}: <{element.tag} {name}="{shown(text)}">', fix)
    for value in values:
        if not allowed.lower <= value <= allowed.upper:
            what = element.tag if name == "value" else name
            problem = f"{within}: {what} = {value:g} is out of range"
            refuse(element, source, problem, f"give {allowed}: {allowed.why}")
    return values


def _count_children(element: Element, rule: Rule, source: str, within: str) -> None:
    known = rule.known
    here = within if within == called(element) else f"{within}: <{element.tag}>"
    for child in element.children:
        if child.tag in rule.refused:
            refuse(child, source, f"{here}: <{child.tag}>", rule.refused[child.tag])
        if child.tag not in known and child.tag not in rule.ignored:
            if ":" in child.tag:
                fix = "a macro; expand it first, e.g. with xacro"
            else:
                fix = near(child.tag, [*known, *rule.ignored])
            refuse(child, source, f"{here}: unknown element <{shown(child.tag)}>", fix)
    for tag in (*rule.needed, *rule.allowed):
        found = element.all(tag)
        if len(found) > 1:
            refuse(found[1], source, f"{here}: a second <{tag}>", "keep one")
        if tag in rule.needed and not found:
            refuse(element, source, f"{here} has no <{tag}>", _WHY_NEEDED.get(tag, "give one"))
    chosen = [child for child in element.children if child.tag in rule.one_of]
    if rule.one_of and len(chosen) != 1:
        fix = f"give one of {', '.join(rule.one_of)}"
        refuse(element, source, f"{here} holds {len(chosen)} shapes", fix)


_WHY_NEEDED = {
    "limit": "give effort and velocity, and lower and upper where it has ends; without them pinocchio assumes"
    " zero",
    "axis": 'give xyz="..."; without it pinocchio assumes x',
    "dynamics": 'give damping="...", 0 where nothing damps it; without it pinocchio assumes zero',
    "origin": 'give xyz="..." and rpy="..."; without them pinocchio assumes zero',
}


def _refuse_repetition(children: Sequence[Element], source: str) -> None:
    """No two of a kind with one name, and no two nameless ones that say the same."""
    seen = set()
    for child in children:
        name = child.attributes.get("name")
        key = (child.tag, name) if name else child.content()
        if key in seen:
            what = f"a second <{child.tag}> '{shown(name)}'" if name else f"the same <{child.tag}> twice"
            refuse(child, source, what, "names must differ" if name else "remove one of them")
        seen.add(key)
