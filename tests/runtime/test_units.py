"""Numbers with units."""

from math import inf, pi

import pytest
from hapticd.configs.quantities import Angles3, Duration, Frequency, Instant, Length
from hapticd.configs.units import UnitError, parse


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("1 kHz", "frequency", (1000.0,)),
        ("150 deg/s", "angular speed", (150 * pi / 180,)),
        ("1 2.5 -3e-1 mm", "length", (1e-3, 2.5e-3, -3e-4)),
        ("-inf inf rad", "angle", (-inf, inf)),
        ("4 kg m^2", "inertia", (4.0,)),
        ("  5   ms ", "time", (5e-3,)),
    ],
)
def test_numbers_are_read_in_si(text: str, dimension: str, value: tuple[float, ...]) -> None:
    assert parse(text, dimension) == pytest.approx(value)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (5, "has no unit"),
        (5.0, "has no unit"),
        (True, "not a quantity"),
        (["1 m"], "not a quantity"),
        ("5", "has no unit"),
        ("m", "does not start with a number"),
        ("", "does not start with a number"),
        ("5 rad", "not a unit of length"),
        ("5 M", "not a unit of length"),
        ("nan m", "contains a NaN"),
        ("1 nan m", "contains a NaN"),
    ],
)
def test_anything_else_is_refused_and_says_what_to_write(text: object, why: str) -> None:
    with pytest.raises(UnitError, match=why) as error:
        parse(text, "length")
    assert "; " in str(error.value)


def test_single_quantities_are_finite_and_in_range() -> None:
    with pytest.raises(UnitError, match="give a finite number > 0"):
        Duration.read("-1e300 s")
    with pytest.raises(UnitError, match="give a magnitude of at most 100 rad"):
        Angles3.read("1 2 -1e300 rad")
    assert Duration.read("3 s") == 3.0
    assert Instant.read("0 s") == 0.0
    assert Length.read("0 m") == 0.0
    for kind, text in ((Duration, "0 s"), (Duration, "-1 s"), (Frequency, "inf Hz"), (Duration, "1 2 s")):
        with pytest.raises(UnitError):
            kind.read(text)


def test_vectors_have_their_length() -> None:
    assert Angles3.read("180 0 -90 deg") == pytest.approx((pi, 0.0, -pi / 2))
    with pytest.raises(UnitError, match="holds 2 numbers; give 3"):
        Angles3.read("1 2 rad")
    with pytest.raises(UnitError, match="contains inf"):
        Angles3.read("1 inf 2 rad")
