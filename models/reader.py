"""Reads a robot description by its grammar: what is not in there is refused."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..configs.numerals import number
from ..configs.ranges import RANGES
from .findings import Findings, called, near, shown
from .grammar import JOINTS, Numbers, Rule, Text
from .xml_tree import Element

MAX_NAME = 200
"""Characters of a name or of a number's text."""


def read(element: Element, rule: Rule, found: Findings, within: str = "") -> None:
    """Check an element and all it holds, and read its numbers.

    Args:
        element: as parsed; loses the children that its rule ignores, and gets those that are assumed.
        rule: of the element.
        found: gets everything that the rule does not know, or that is missing or out of range; an element
            without any of that is marked as sound.
        within: what the messages call the nearest element around it that has a name.
    """
    before = len(found)
    within = called(element) if "name" in element.attributes else within or called(element)
    if element.text:
        found.refuse(element, f"<{element.tag}> holds the text '{shown(element.text)}'", "remove it")
    _read_attributes(element, rule.attributes, found, within)
    _count_children(element, rule, found, within)
    element.children = [child for child in element.children if child.tag in rule.known]
    element.children += [Element(tag, {}, element.line) for tag in rule.assumed if not element.child(tag)]
    for child in element.children:
        if own := _rule_of(child, rule, found):
            read(child, own, found, within)
    _refuse_repetition(element.children, found)
    element.sound = len(found) == before


def _rule_of(child: Element, rule: Rule, found: Findings) -> Rule | None:
    if child.tag != "joint":
        return rule.known[child.tag]
    kind = child.attributes.get("type", "")
    if kind not in JOINTS:
        name = shown(child.attributes.get("name", ""))
        found.refuse(child, f"joint '{name}' has type '{shown(kind)}'", f"use one of {', '.join(JOINTS)}")
    return JOINTS.get(kind)


def _read_attributes(
    element: Element, known: Mapping[str, Numbers | Text], found: Findings, within: str
) -> None:
    for name in element.attributes:
        if name not in known and name.partition(":")[0] != "xmlns":
            problem = f"{within}: <{element.tag}> has no attribute '{shown(name)}'"
            found.refuse(element, problem, near(name, known))
    for name, kind in known.items():
        text = element.attributes.get(name)
        if text is None:
            if isinstance(kind, Numbers) and kind.default is not None:
                element.numbers[name] = kind.default
            elif kind.needed:
                what = "without a name" if name == "name" else f"lacks '{name}'"
                found.refuse(element, f"{within}: a <{element.tag}> {what}", f'give {name}="..."')
        elif isinstance(kind, Numbers):
            element.numbers[name] = _read_numbers(element, name, kind, found, within)
        elif not text.strip() or not text.isprintable() or len(text) > MAX_NAME:
            fix = f"give 1 to {MAX_NAME} printable characters"
            found.refuse(element, f'<{element.tag} {name}="{shown(text)}">', fix)


def _read_numbers(
    element: Element, name: str, kind: Numbers, found: Findings, within: str
) -> tuple[float, ...]:
    text, allowed = element.attributes[name], RANGES[kind.range]
    numbers = [number(word) for word in text.split()] if len(text) <= MAX_NAME else []
    values = tuple(value for value in numbers if value is not None)
    if len(numbers) != kind.count or len(values) != kind.count:
        fix = f"give {kind.count} finite number{'s' if kind.count > 1 else ''}"
        found.refuse(element, f'{within}: <{element.tag} {name}="{shown(text)}">', fix)
        return values
    for value in values:
        if not allowed.lower <= value <= allowed.upper:
            what = element.tag if name == "value" else name
            problem = f"{within}: {what} = {value:g} is out of range"
            found.refuse(element, problem, f"give {allowed}: {allowed.why}")
    return values


def _count_children(element: Element, rule: Rule, found: Findings, within: str) -> None:
    known = rule.known
    here = within if within == called(element) else f"{within}: <{element.tag}>"
    for child in element.children:
        if child.tag in rule.refused:
            found.refuse(child, f"{here}: <{child.tag}>", rule.refused[child.tag])
        elif child.tag not in known and child.tag not in rule.ignored:
            if ":" in child.tag:
                fix = "a macro; expand it first, e.g. with xacro"
            else:
                fix = near(child.tag, [*known, *rule.ignored])
            found.refuse(child, f"{here}: unknown element <{shown(child.tag)}>", fix)
    for tag in (*rule.needed, *rule.allowed, *rule.assumed):
        same = element.all(tag)
        if len(same) > 1:
            found.refuse(same[1], f"{here}: a second <{tag}>", "keep one")
        if tag in rule.needed and not same:
            found.refuse(element, f"{here} has no <{tag}>", _WHY_NEEDED.get(tag, "give one"))
    chosen = [child for child in element.children if child.tag in rule.one_of]
    if rule.one_of and len(chosen) != 1:
        fix = f"give one of {', '.join(rule.one_of)}"
        found.refuse(element, f"{here} holds {len(chosen)} shapes", fix)


_WHY_NEEDED = {
    "limit": "give effort and velocity, and lower and upper where it has ends; without them pinocchio assumes"
    " zero",
}


def _refuse_repetition(children: Sequence[Element], found: Findings) -> None:
    """No two of a kind with one name, and no two nameless ones that say the same."""
    seen = set()
    for child in children:
        name = child.attributes.get("name")
        key = (child.tag, name) if name else child.content()
        if key in seen:
            what = f"a second <{child.tag}> '{shown(name)}'" if name else f"the same <{child.tag}> twice"
            found.refuse(child, what, "names must differ" if name else "remove one of them")
        seen.add(key)
