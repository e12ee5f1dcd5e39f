"""The studies that come with the program."""

from __future__ import annotations

from importlib import resources

SUFFIX = ".toml"


def built_in() -> dict[str, str]:
    """Their names, and the first line of each, which says what it is."""
    files = (file.name for file in resources.files(__package__).iterdir())
    names = sorted(name.removesuffix(SUFFIX) for name in files if name.endswith(SUFFIX))
    return {name: built_in_text(name).partition("\n")[0].removeprefix("# ") for name in names}


def built_in_text(name: str) -> str:
    """The file of one."""
    return (resources.files(__package__) / f"{name}{SUFFIX}").read_text(encoding="utf-8")
