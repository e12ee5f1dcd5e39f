"""What a configuration may hold at a place: found in the types of its sections."""

from __future__ import annotations

import re
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import msgspec
from msgspec import Struct

PLAIN = {
    bool: "write true or false",
    int: "write a whole number",
    float: "write a number",
    str: 'write words in quotes, "like these"',
}
"""What to write where a type is all that is asked."""


def steps(path: str) -> list[int | str]:
    """Keys of tables and places in lists on the way to a path: ``sums[0].weights`` takes three."""
    return [int(place) if place else key for place, key in re.findall(r"\[(\d+)\]|([^.\[\]]+)", path)]


def known_fields(path: str, root: type[Struct], tree: dict[str, Any]) -> list[str]:
    """Keys that a section may have, the one that says its kind included; none where it is no section.

    Args:
        path: of the section, e.g. ``devices.joint_1``.
        root: type of the whole.
        tree: the whole, whose words say which kind of section stands there.
    """
    kind = _type_at(path, root, tree)
    if not _is_struct(kind):
        return []
    tag = kind.__struct_config__.tag_field
    return [*([tag] if tag else []), *(field.encode_name for field in msgspec.structs.fields(kind))]


def advice(path: str, root: type[Struct], tree: dict[str, Any]) -> str:
    """What to write at a path instead of a value of the wrong type, kind or size; "" where nobody knows."""
    kind = _type_at(path, root, tree)
    section, _, key = path.rpartition(".")
    around = _unwrapped(_type_at(section, root, tree, chosen=False))
    tags = [each.__struct_config__ for each in _structs(around)]
    if tags and tags[0].tag_field == key:
        return f"known: {', '.join(str(tag.tag) for tag in tags)}"
    if words := _words(kind):
        return f"known: {', '.join(words)}"
    return bounds_advice(kind) or PLAIN.get(_unwrapped(kind), "")


def bounds_advice(kind: Any) -> str:
    """What an annotation advises to write; "" where it does not."""
    return next((meta.description for meta in _bounds(kind) if meta.description), "")


def name_type(path: str, root: type[Struct], tree: dict[str, Any]) -> Any:
    """What the keys of the table of anything at a path may be."""
    return get_args(_unwrapped(_type_at(path, root, tree)))[0]


def value_type(path: str, root: type[Struct], tree: dict[str, Any]) -> Any:
    """What the table of anything at a path holds under each of its keys."""
    return get_args(_unwrapped(_type_at(path, root, tree)))[1]


def _type_at(path: str, root: Any, tree: Any, chosen: bool = True) -> Any:
    """The annotation at a path; at its end, if ``chosen``, only the kind of section that the tree names."""
    kind, node = root, tree
    for step in steps(path):
        kind = _choose(kind, node)
        if isinstance(step, int):
            kind = _item(kind, step)
            node = node[step] if isinstance(node, list) and step < len(node) else None
        else:
            kind = _field(kind, step)
            node = node.get(step) if isinstance(node, dict) else None
    return _choose(kind, node) if chosen else kind


def _field(kind: Any, name: str) -> Any:
    if _is_struct(kind):
        return next((f.type for f in msgspec.structs.fields(kind) if f.encode_name == name), None)
    kind = _unwrapped(kind)
    return get_args(kind)[1] if get_origin(kind) is dict else None


def _item(kind: Any, index: int) -> Any:
    kinds = get_args(_unwrapped(kind))
    return (kinds[0] if kinds[1:] == (Ellipsis,) or index >= len(kinds) else kinds[index]) if kinds else None


def _choose(kind: Any, node: Any) -> Any:
    """The section that a table stands for, where there are several kinds of it."""
    structs = _structs(_unwrapped(kind))
    named = node if isinstance(node, dict) else {}
    for each in structs:
        config = each.__struct_config__
        if config.tag_field and named.get(config.tag_field) == config.tag:
            return each
    return structs[0] if len(structs) == 1 else kind


def _structs(kind: Any) -> list[Any]:
    """The kinds of sections that an annotation allows."""
    return [each for each in (get_args(kind) if _is_union(kind) else (kind,)) if _is_struct(each)]


def _words(kind: Any) -> list[str]:
    """The words that an annotation allows."""
    parts = get_args(kind) if _is_union(kind) else (kind,)
    return [str(word) for part in parts if get_origin(part) is Literal for word in get_args(part)]


def _bounds(annotation: Any) -> list[msgspec.Meta]:
    """All that an annotation, and what stands in it, says of numbers."""
    own = [meta for meta in getattr(annotation, "__metadata__", ()) if isinstance(meta, msgspec.Meta)]
    parts = [getattr(annotation, "__origin__", None)] if own else get_args(annotation)
    return own + [meta for part in parts for meta in _bounds(part)]


def _unwrapped(kind: Any) -> Any:
    """An annotation without its bounds, and without the None that says that it may be left out."""
    if get_origin(kind) is Annotated:
        return _unwrapped(get_args(kind)[0])
    present = [each for each in get_args(kind) if each is not NoneType] if _is_union(kind) else []
    return _unwrapped(present[0]) if len(present) == 1 else kind


def _is_union(kind: Any) -> bool:
    return get_origin(kind) in (Union, UnionType)


def _is_struct(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, Struct)
