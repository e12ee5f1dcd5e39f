"""What source, tests and documents cite can be looked up."""

import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parent.parent
MATRIX = (ROOT / "docs" / "fault-matrix.md").read_text()
ROWS = {int(line.split("|")[1]): line for line in MATRIX.splitlines() if re.match(r"\| \d+ \|", line)}
PAPERS = set(
    re.findall(r"^\| \*\*(?:\w+ )?(\w+)\*\*", (ROOT / "docs" / "references.md").read_text(), re.MULTILINE)
)
SUFFIXES = {".py", ".c", ".h", ".md", ".toml", ".urdf", ".sh", ".service", ""}


def texts() -> Iterator[tuple[str, str]]:
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True)
    names = listed.stdout.split("\0") if listed.returncode == 0 else []
    for name in filter(None, names):
        path = ROOT / name
        if (
            path.suffix in {".py", ".c", ".h", ".md", ".toml", ".urdf", ".sh", ".service", ""}
            and path.is_file()
        ):
            if path != Path(__file__):
                yield name, path.read_text(encoding="utf-8")


def test_every_citation_of_a_paper_names_one_of_the_references() -> None:
    place = r"(?:\(\d+\)|[Ff]igs?\.? \d|Table [IVX]|sections? [IVX]|[IVX]+(?:-[A-Z])?[),:;. ])"
    cited = set()
    for name, text in texts():
        assert not re.search(r"seed 00\d", text, re.IGNORECASE), name
        for word in re.findall(rf"\b([A-Z][a-z]{{2,}}[A-Za-z]*),\s+(?:\* )?{place}", text):
            assert word in PAPERS, f"{name}: {word}"
            cited.add(word)
    if (ROOT / ".git").exists():  # not an unpacked archive
        assert {"HapticGiant", "ContactAware"} <= cited


def test_every_cited_row_of_the_fault_matrix_is_there() -> None:
    assert sorted(ROWS) == list(range(1, len(ROWS) + 1))
    for name, text in texts():
        assert not re.search(r"(?<!docs/)fault.matrix, row", text), name
        for listed in re.findall(r"fault-matrix\.md, rows? ([\d, toand]+)", text):
            assert {int(row) for row in re.findall(r"\d+", listed)} <= set(ROWS), name


def test_what_the_fault_matrix_names_exists() -> None:
    tests = "\n".join(path.read_text() for path in (ROOT / "tests").rglob("test_*.py"))
    for number, line in ROWS.items():
        *_, today, shown, _ = (cell.strip() for cell in line.split("|"))
        for name in re.findall(r"`(test_\w+)`", shown):
            assert f"def {name}(" in tests, f"row {number}: {name}"
        for path in re.findall(r"`([\w/]+\.[a-z]+)`", today):
            assert (ROOT / path).exists(), f"row {number}: {path}"
        assert shown or today.startswith("not yet"), f"row {number} claims what no test shows"
