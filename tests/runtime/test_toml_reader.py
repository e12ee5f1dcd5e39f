"""Hostile TOML costs an error and nothing else."""

import time

import pytest
from hapticd.runtime.configuration.toml_reader import read
from hapticd.runtime.errors import ConfigError


def refusal(text: str) -> tuple[str, int]:
    start = time.process_time()
    with pytest.raises(ConfigError) as error:
        read(text, "m.toml")
    assert time.process_time() - start < 1.0
    assert len(str(error.value)) < 500
    (found,) = error.value.findings
    assert found.fix
    return found.problem, found.line


@pytest.mark.parametrize(
    ("text", "problem", "line"),
    [
        ("a = " + "[" * 900, "nested too deep", 0),
        ("a = " + "[\n" * 50_000, "nested too deep", 0),
        ("\na = " + "[" * 11 + "]" * 11, "nested too deep", 2),
        ("a = " + "{a = " * 11 + "1" + "}" * 11, "nested too deep", 1),
        ("a = " + "[" * 50_000, "a line of 50004 characters", 1),
        ("x = 1\na = " + "1" * 990, "beyond 2^53", 2),
        ("a = 9007199254740993", "beyond 2^53", 1),
        ("a = -9223372036854775809", "beyond 2^53", 1),
        ("a = 1e-320", "too small", 1),
        ("a = 1\n" + ".".join("a" * 400) + " = 1", "a key of more than 10 names", 2),
        ("a = 1\n" + " . ".join(['"a"'] * 100) + " = 1", "a key of more than 10 names", 2),
        ("[" + ".".join("a" * 40) + "]", "a key of more than 10 names", 1),
        ("b = 1\na = 1\na = 2", "not TOML", 3),
        ("[a]\n[a]", "not TOML", 2),
        ("a = 1\nb = [1,\n2,\n", "not TOML", 3),
        ("a = 1\nb = {", "not TOML", 2),
        ("a = \x00", "not TOML", 1),
        ("a = '\x1b[2J'", "not TOML", 1),
        ('a = "\\ud800"', "not TOML", 1),
        ("a = 2020-13-45", "not TOML", 1),
        ("\ufeffa = 1", "byte order mark", 1),
        ("#" * (300 << 10), "larger than", 0),
    ],
)
def test_what_no_configuration_holds_is_refused_at_once(text: str, problem: str, line: int) -> None:
    found, at = refusal(text)
    assert problem in found
    assert at == line


def test_an_integer_of_thousands_of_digits_over_several_lines_is_refused() -> None:
    assert "characters" in refusal("a = " + "1" * 5000)[0]


def test_names_of_many_dots_in_comments_and_texts_of_numbers_are_no_keys() -> None:
    text = (
        '# see a.b.c.d.e.f.g.h.i.j.k.l\na = "1.5 2.5 3.5 4.5 5.5 6.5 7.5 8.5 9.5 10.5 11.5 12.5 rad"\r\nb = 1'
    )
    assert read(text, "m.toml")["b"] == 1
