"""Data of a study in the layout of BIDS: one table a participant, and files that say what is in it."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from .protocol import Column

VERSION = "1.10.0"
PARTICIPANTS = Path("participants.tsv")


def stem(participant: str, study: str) -> Path:
    """Beginning of a participant's files below the folder of the data."""
    return Path(f"sub-{participant}", "beh", f"sub-{participant}_task-{study}")


def write_dataset(folder: Path, name: str, participant: str) -> None:
    """What the data are, and that the participant is among them."""
    folder.mkdir(parents=True, exist_ok=True)
    description = folder / "dataset_description.json"
    if not description.exists():
        _json(description, {"Name": name, "BIDSVersion": VERSION, "DatasetType": "raw"})
        _json(folder / "participants.json", {"participant_id": {"Description": "label of the participant"}})
    table = folder / PARTICIPANTS
    rows = table.read_text(encoding="utf-8").splitlines() if table.exists() else ["participant_id"]
    if (row := f"sub-{participant}") not in (line.split("\t")[0] for line in rows):
        _whole(table, "\n".join([*rows, row]) + "\n")


def write_table(at: Path, columns: Mapping[str, Column], rows: Sequence[Mapping[str, Any]]) -> None:
    """The rows, and what their columns mean; ``at`` is the beginning of the files' names."""
    lines = ["\t".join(columns), *("\t".join(_cell(row.get(name)) for name in columns) for row in rows)]
    _whole(at.with_name(f"{at.name}_beh.tsv"), "\n".join(lines) + "\n")
    meaning = {
        name: {
            "Description": column.description,
            **({"Units": column.unit} if column.unit else {}),
            **({"Levels": dict(column.levels)} if column.levels else {}),
        }
        for name, column in columns.items()
    }
    _json(at.with_name(f"{at.name}_beh.json"), meaning)


def _cell(value: Any) -> str:
    if value is None:
        return "n/a"
    return f"{value:.9g}" if isinstance(value, float) else str(value)


def _json(path: Path, content: Any) -> None:
    _whole(path, msgspec.json.format(msgspec.json.encode(content), indent=2).decode() + "\n")


def _whole(path: Path, text: str) -> None:
    """Write a file so that whoever reads it finds all of it, or what was there before."""
    begun = path.with_name(f".{path.name}.new")
    with begun.open("w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    begun.replace(path)
