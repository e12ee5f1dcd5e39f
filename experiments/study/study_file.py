"""Reads the file of a study."""

from __future__ import annotations

from pathlib import Path

import msgspec

from ...runtime.configuration.toml_reader import read
from .protocol import Design
from .settings import StudyError
from .threshold import ThresholdDesign

PROTOCOLS = ThresholdDesign
"""What `protocol` may name; more of them become a union."""


def read_design(path: Path) -> tuple[str, Design]:
    """Text of the file, and the study in it.

    Raises:
        StudyError: there is no such file, or what is wrong with the study.
        ConfigError: it is no TOML.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "is not UTF-8"
        raise StudyError(f"cannot read {path}: {why}") from error
    try:
        design: Design = msgspec.convert(read(text, str(path)), type=PROTOCOLS)
    except msgspec.ValidationError as error:
        raise StudyError(f"{path}: {error}; `study --help` shows a whole one") from error
    if problem := design.problem():
        raise StudyError(f"{path}: {problem}")
    return text, design
