"""An arm's configuration from its URDF, as texts."""

from __future__ import annotations

from dataclasses import dataclass

from ...models import ModelError
from ...runtime.configuration.config import Loaded, parse
from ...runtime.configuration.session import build
from ...runtime.errors import ConfigError
from .config import DIRECTIONS
from .errors import InitError
from .guess import guess
from .text import write_toml
from .urdf_read import read_arm

UNFIT = "no configuration fits this arm"


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
        InitError: the URDF holds no arm, or none that a machine that a person holds could be.
        ModelError: the text is no XML, or too much of it.
    """
    arm = read_arm(text, source, tip)
    try:
        guessed = guess(arm)
    except ModelError as error:
        raise InitError(f"{source}: {error.problem}; {error.fix}") from error
    toml = write_toml(guessed, source, model)
    try:
        build(Loaded(out, parse(toml, out), toml, out, guessed.urdf, model))
    except ConfigError as error:  # of a file that is not there, in numbers that nobody wrote
        raise InitError(f"{source}: {UNFIT}: {'; '.join(map(str, error.findings))}") from error
    return Made(
        toml,
        guessed.urdf,
        list(guessed.arm.joints),
        [DIRECTIONS[i] for i in guessed.directions],
        guessed.arm.remarks,
    )
