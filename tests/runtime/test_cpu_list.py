"""Lists of processors."""

import pytest
from hapticd.runtime.timing.cpu_list import format_cpus, parse_cpus


@pytest.mark.parametrize(
    ("text", "cpus"), [("", set()), ("3", {3}), ("0-2,5", {0, 1, 2, 5}), ("(null)", set()), ("2,1", {1, 2})]
)
def test_lists_of_cpus_are_read_and_written(text: str, cpus: set[int]) -> None:
    assert parse_cpus(text) == cpus
    assert parse_cpus(format_cpus(cpus)) == cpus


def test_the_shortest_list_is_written() -> None:
    assert format_cpus({7, 0, 1, 2, 5}) == "0-2,5,7"
