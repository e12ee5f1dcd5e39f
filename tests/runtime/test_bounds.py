"""Every number of every section has finite bounds, and they have a reason."""

from collections.abc import Iterator
from math import inf
from typing import Annotated, Any, get_args, get_origin

import msgspec
import pytest
from hapticd.configs import plugins
from hapticd.configs.units import DIMENSIONS, RANGES, Quantity, UnitError, Vector
from hapticd.runtime.configuration.system import find_system, system_names


def numbers(
    annotation: Any, path: str = "", metas: tuple[Any, ...] = ()
) -> Iterator[tuple[str, Any, tuple[Any, ...]]]:
    """Every number that an annotation leads to: path, type, what is said of it."""
    if get_origin(annotation) is Annotated:
        kind, *more = get_args(annotation)
        yield from numbers(kind, path, (*metas, *more))
    elif isinstance(annotation, type) and issubclass(annotation, msgspec.Struct):
        for field in msgspec.structs.fields(annotation):
            yield from numbers(field.type, f"{path}.{field.encode_name}")
    elif get_args(annotation):
        for part in get_args(annotation):
            yield from numbers(part, path)
    elif (
        isinstance(annotation, type)
        and issubclass(annotation, int | float | Vector)
        and annotation is not bool
    ):
        yield path, annotation, metas


FOUND = [
    pytest.param(kind, metas, id=f"{name}{path}")
    for name in system_names()
    for path, kind, metas in numbers(find_system(name).config)
] + [
    pytest.param(kind, metas, id=f"devices.{name}{path}")
    for name in plugins.names(plugins.DEVICES)
    for path, kind, metas in numbers(plugins.plugin(plugins.DEVICES, name))
]


def test_the_walk_finds_the_numbers() -> None:
    names = {parameter.id for parameter in FOUND}
    assert {"rhi.rhi.bodies.normal", "rhi.rhi.motors.transmission", "rhi.rhi.task.spread"} <= names
    assert {"devices.imu.node", "giant.simulation.hand.path.at", "giant.giant.twin.mass"} <= names
    assert {"rhi.loop.cpu", "rhi.simulation.seed", "devices.joint_drive.gear_ratio"} <= names
    assert len(names) > 100


@pytest.mark.parametrize(("kind", "metas"), FOUND)
def test_a_number_has_finite_bounds_with_a_reason(kind: type, metas: tuple[msgspec.Meta, ...]) -> None:
    if issubclass(kind, Quantity | Vector):
        allowed = kind.range or RANGES[kind.dimension]
        assert 0.0 < allowed.lower < allowed.upper < inf and allowed.why
        assert allowed.unit in DIMENSIONS[kind.dimension]
        assert DIMENSIONS[kind.dimension][allowed.unit] == 1.0
        for number in (
            "1e300",
            "-1e300",
            "nan",
            *(() if getattr(kind, "infinite", False) else ("inf", "-inf")),
        ):
            text = " ".join([number] * (getattr(kind, "length", None) or 1))
            with pytest.raises(UnitError):
                kind.read(f"{text} {allowed.unit}")
        return
    (meta,) = metas
    assert meta.ge is not None or meta.gt is not None
    assert meta.le is not None or meta.lt is not None
    assert meta.description


@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_a_number_beyond_its_range_is_refused_with_the_reason(dimension: str) -> None:
    unit, allowed = next(iter(DIMENSIONS[dimension])), RANGES[dimension]
    kind = type("Kind", (Quantity,), {"dimension": dimension, "minimum": -inf})
    vector = type("Row", (Vector,), {"dimension": dimension})
    for value in (1.001 * allowed.upper, 0.999 * allowed.lower, -1.001 * allowed.upper, 1e300):
        for reader in (kind, vector):
            with pytest.raises(ValueError, match="is out of range; give ") as error:
                reader.read(f"{value:.17g} {unit}")
            assert allowed.why in str(error.value)
    for value in (allowed.upper, allowed.lower, 0.0):
        assert vector.read(f"{value:.17g} {unit}") == (value,)
