"""What counts as a number in a file."""

import pytest
from hapticd.configs.numerals import number


@pytest.mark.parametrize(
    ("word", "value"),
    [
        ("1", 1.0),
        ("1.", 1.0),
        (".5", 0.5),
        ("+1", 1.0),
        ("-2.50", -2.5),
        ("1e0", 1.0),
        ("1E+3", 1e3),
        ("-0", 0.0),
    ],
)
def test_plain_decimals_are_numbers(word: str, value: float) -> None:
    assert number(word) == value


@pytest.mark.parametrize(
    "word",
    [
        *(
            "",
            ".",
            "+",
            "e5",
            "1e",
            "1_0",
            "0x10",
            "nan",
            "inf",
            "Infinity",
            "1e999",
            "-1e999",
            "1e-320",
            "1,5",
        ),
        *("1 2", "1\n", " 1", "١", "１", "--1", "1.2.3", "1" * 65, "0." + "0" * 80 + "1"),
    ],
)
def test_anything_else_is_none(word: str) -> None:
    assert number(word) is None
