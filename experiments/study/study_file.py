"""Reads the file of a study: of one's own, or one that comes with the program."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import msgspec

from ...runtime.command_line.arguments import meant
from ...runtime.configuration.toml_reader import read
from .built_in import SUFFIX, built_in, built_in_text
from .protocol import Design
from .settings import StudyError
from .study_text import StudyText
from .tasks import TasksDesign
from .threshold import ThresholdDesign

PROTOCOLS = ThresholdDesign | TasksDesign
"""What `protocol` may name."""


def read_design(study: Path) -> tuple[str, Design]:
    """Text of the file, or of a built-in study, and the study in it.

    Raises:
        StudyError: there is no such study, or what is wrong with it.
        ConfigError: it is no TOML.
    """
    text = _text(study)
    written = StudyText(str(study), text)
    try:
        design: Design = msgspec.convert(read(text, str(study)), type=PROTOCOLS, dec_hook=_quantity)
    except msgspec.ValidationError as error:
        problem, key = _placed(str(error))
        raise written.refusal(key, f"{problem}; docs/study.md shows whole ones") from error
    if found := design.problem():
        key, _, problem = found.partition(": ")
        raise written.refusal(key, problem)
    return text, design


def _placed(message: str) -> tuple[str, str]:
    """What does not fit, and the key that it is about; "" for the whole file."""
    problem, _, place = message.partition(" - at ")
    key = place.strip("`").removeprefix("key in `").lstrip("$.")
    if unknown := re.search(r"unknown field `(.*?)`", problem):
        key = f"{key}.{unknown[1]}".lstrip(".")
    return problem, key


def _text(study: Path) -> str:
    if not study.suffix and not study.exists():
        if str(study) not in (known := built_in()):
            hint = meant(str(study), known)
            raise StudyError(f"there is no study '{study}'; {hint}, or give a FILE{SUFFIX}")
        return built_in_text(str(study))
    try:
        return study.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "is not UTF-8"
        raise StudyError(f"cannot read {study}: {why}") from error


def _quantity(kind: type, value: Any) -> Any:
    return kind.read(value)  # type: ignore[attr-defined]
