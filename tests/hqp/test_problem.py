import numpy as np
import pytest
from hapticd.hqp import HqpError, Level


def test_an_absent_part_has_no_rows():
    equalities = Level(A=np.ones((2, 3)), b=np.zeros(2))
    assert equalities.rows == (2, 0) and equalities.C.shape == (0, 3) and equalities.lb.shape == (0,)
    ranges = Level(C=np.ones((1, 3)), lb=np.zeros(1), ub=np.ones(1))
    assert ranges.rows == (0, 1) and ranges.A.shape == (0, 3) and ranges.n == 3


def test_arrays_are_kept_not_copied():
    A = np.ones((1, 2))
    assert Level(A=A, b=np.zeros(1)).A is A


def test_a_level_cannot_be_reassigned():
    level = Level(A=np.ones((1, 2)), b=np.zeros(1))
    with pytest.raises(AttributeError):
        level.b = np.ones(1)


@pytest.mark.parametrize(
    ("parts", "what", "message"),
    [
        ({}, "Level", "neither A nor C"),
        ({"A": [[1.0]], "b": np.zeros(1)}, "A", "type list"),
        ({"A": np.ones((1, 2), dtype=np.float32), "b": np.zeros(1)}, "A", "float32"),
        ({"A": np.ones(2), "b": np.zeros(1)}, "A", "2 dimensions"),
        ({"A": np.ones((2, 2)).T[::-1], "b": np.zeros(2)}, "A", "not C-contiguous"),
        ({"A": np.ones((1, 2)), "b": np.zeros(2)}, "b", "2 entries and A has 1 rows"),
        ({"A": np.ones((1, 2))}, "b", "0 entries"),
        ({"C": np.ones((1, 2)), "lb": np.zeros(1)}, "ub", "0 entries"),
        (
            {
                "A": np.ones((1, 2)),
                "b": np.zeros(1),
                "C": np.ones((1, 3)),
                "lb": np.zeros(1),
                "ub": np.zeros(1),
            },
            "C",
            "3 columns and A has 2",
        ),
    ],
)
def test_a_wrong_array_is_named_with_what_is_wrong(parts, what, message):
    with pytest.raises(HqpError, match=message) as raised:
        Level(**parts)
    assert raised.value.what == what
    assert raised.value.mend in str(raised.value)
