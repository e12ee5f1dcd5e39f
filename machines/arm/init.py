"""An arm's configuration from its URDF, as texts."""

from __future__ import annotations

from dataclasses import dataclass

from ...runtime.configuration.config import Loaded, parse
from ...runtime.configuration.session import build
from .config import DIRECTIONS
from .description import read_arm
from .guess import guess
from .text import write_toml


@dataclass(frozen=True, slots=True)
class Made:
    """Texts of a configuration and its model, joints, directions, and what was guessed."""

    toml: str
    urdf: str
    joints: list[str]
    directions: list[str]
    remarks: list[str]


def init(text: str, source: str, tip: str | None, out: str, model: str) -> Made:
    """A configuration that ``hapticd check`` accepts.

    Args:
        text: of the URDF.
        source: its name.
        tip: link that the handle is put on.
        out: name of the configuration.
        model: name of the URDF beside it.

    Raises:
        InitError: the URDF holds no arm.
        ModelError: the arm has what no machine that a person holds may have.
        ConfigError: what was guessed does not fit together.
    """
    guessed = guess(read_arm(text, source, tip))
    toml = write_toml(guessed, source, model)
    build(Loaded(out, parse(toml, out), toml, out, guessed.urdf, model))
    return Made(
        toml,
        guessed.urdf,
        list(guessed.arm.joints),
        [DIRECTIONS[i] for i in guessed.directions],
        guessed.arm.remarks,
    )
