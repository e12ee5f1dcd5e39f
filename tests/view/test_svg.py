import re
from math import inf

import numpy as np
import pytest
from hapticd.view.svg import HEIGHT, WIDTH, Plot, Series, nice, number


@pytest.mark.parametrize(
    ("low", "high", "count", "expected"),
    [
        (0.0, 10.0, 5, [0, 2, 4, 6, 8, 10]),
        (-1.0, 1.0, 4, [-1, -0.5, 0, 0.5, 1]),
        (0.1, 0.31, 3, [0.1, 0.2, 0.3]),
        (3.0, 3.0, 4, [3.0]),
    ],
)
def test_round_numbers(low: float, high: float, count: int, expected: list[float]) -> None:
    np.testing.assert_allclose(nice(low, high, count), expected, atol=1e-12)


def test_numbers_are_short() -> None:
    assert [number(x) for x in (0.0, 1e-15, 0.1 + 0.2, 1234567.0)] == ["0", "0", "0.3", "1.235e+06"]


def test_line_band_and_limits_lie_where_their_values_are() -> None:
    time = np.array([0.0, 5.0])
    series = Series("a<b", np.array([0.0, 0.0]), np.array([1.0, 4.0]), np.array([0.5, 2.0]))
    drawn = Plot("x & y", "m", time, 10.0, [series], lower=-1.0, upper=inf).html
    bottom, top = (float(re.search(rf'data-{end}="([^"]*)"', drawn)[1]) for end in ("bottom", "top"))  # type: ignore[index]
    assert bottom < -1.0 < 4.0 < top

    def y(value: float) -> float:
        return HEIGHT * (top - value) / (top - bottom)

    points = re.search(r'points="([^"]*)"', drawn)
    assert points is not None
    drawn_points = [tuple(map(float, pair.split(","))) for pair in points[1].split()]
    np.testing.assert_allclose(drawn_points, [(0, y(0.5)), (WIDTH / 2, y(2.0))], atol=0.05)
    limit = re.search(r'class="limit" d="M0 ([0-9.]+)H720"', drawn)
    assert limit is not None
    assert float(limit[1]) == pytest.approx(y(-1.0), abs=0.05)
    assert "x &amp; y" in drawn and "a&lt;b" in drawn and "a<b" not in drawn


def test_a_channel_that_is_constant_or_empty_still_has_a_range() -> None:
    flat = np.array([2.0])
    assert "data-bottom" in Plot("t", "", np.array([0.0]), 1.0, [Series("s", flat, flat, flat)]).html
    empty = np.zeros(0)
    assert "data-bottom" in Plot("t", "", empty, 0.0, [Series("s", empty, empty, empty)]).html
