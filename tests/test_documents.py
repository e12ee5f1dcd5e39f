"""What the documents promise of commands, targets, codes and files is there."""

import argparse
import re
from collections.abc import Iterator
from pathlib import Path

from hapticd.runtime.command_line.cli import commands

ROOT = Path(__file__).parent.parent
DOCUMENTS = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").glob("*.md")]
FOLDERS = (
    "bench",
    "control",
    "devices",
    "experiments",
    "hqp",
    "link",
    "machines",
    "models",
    "runtime",
    "safety",
    "sim",
    "view",
)
SOURCES = "\n".join(path.read_text() for folder in FOLDERS for path in (ROOT / folder).rglob("*.py"))


def options(parser: argparse.ArgumentParser, words: str = "hapticd") -> Iterator[tuple[str, set[str]]]:
    """Every command with its options."""
    yield words, {option for action in parser._actions for option in action.option_strings}
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for name, each in action.choices.items():
                yield from options(each, f"{words} {name}")


def test_the_readme_names_every_command_with_its_options_and_no_others() -> None:
    lines = [line for line in (ROOT / "README.md").read_text().splitlines() if line.startswith("| `hapticd ")]
    for words, known in options(commands()):
        if words in ("hapticd", "hapticd bench", "hapticd link"):
            continue
        (line,) = (line for line in lines if re.search(rf"^\| `{words}\b", line))
        usage = line.split(" | ")[0]
        assert set(re.findall(r"--[a-z-]+", usage)) <= known, line
        hidden = {"--help", "--verify", "--rounds", "--every", "--seconds", "--all"}
        assert {o for o in known if o.startswith("--")} - hidden <= set(re.findall(r"--[a-z-]+", usage)), line


def test_make_targets_and_files_that_documents_name_exist() -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    for path in DOCUMENTS:
        text = path.read_text()
        assert set(re.findall(r"`make ([a-z-]+)", text)) <= targets, path
        for link in re.findall(r"\]\(([^)#:]+)\)", text):
            assert (path.parent / link).exists(), f"{path.name}: {link}"
        for name in re.findall(rf"`((?:csrc|tests|configs|{'|'.join(FOLDERS)})/[\w/]+\.\w+)`", text):
            assert (ROOT / name).exists(), f"{path.name}: {name}"


def test_every_error_code_is_listed_and_every_listed_one_exists() -> None:
    table = (ROOT / "docs" / "errors.md").read_text().partition("\n## ")[0]
    rows = re.findall(r"^\| `([a-z-]+)` \|", table, re.MULTILINE)
    listed = set(rows)
    assert len(rows) == len(listed)
    raised = set(re.findall(r'^    code(?:: \w+)? = "([a-z-]+)"', SOURCES, re.MULTILINE))
    raised |= set(re.findall(r'_fail\(options, "([a-z-]+)"', SOURCES))
    assert listed == raised - {"runtime"}  # the base class


def test_every_reason_of_a_stop_is_listed_and_every_listed_one_exists() -> None:
    text = (ROOT / "docs" / "errors.md").read_text()
    listed = set(re.findall(r"`(\w+)`", text.partition("## Reasons of a stop")[2]))
    stops = r"Verdict\(\s*Reaction\.(?:HOLD|RAMP|OFF),\s*\"(\w+)\""
    raised = set(re.findall(stops, SOURCES))
    assert raised <= listed, raised - listed
    assert all(f'"{reason.removesuffix("_lost")}"' in SOURCES for reason in listed)
