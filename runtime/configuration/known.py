"""Names of the machines and twins that are installed, found without reading any of them."""

from __future__ import annotations

import re
from importlib import resources

from ...configs import plugins
from ...configs.demonstrations import DEMONSTRATIONS

CONFIGS = "hapticd.configs"
"""Where the built-in machines have their configurations; an installed one has them in its own package."""
TWINS = "twins"
"""Folder of the built-in twins there."""
TWIN_TABLE = re.compile(r"^\[\w+\.twin\]", re.MULTILINE)
BETWEEN = " with "
"""Stands between machine and twin in the name of both, "MACHINE with TWIN"."""
AND = ","
"""Stands between the twins of a machine that has several."""


def machine_folders() -> list[str]:
    """Packages that may hold configurations."""
    return list(
        dict.fromkeys(
            (CONFIGS, *(plugins.folder(plugins.MACHINES, name) for name in plugins.names(plugins.MACHINES)))
        )
    )


def built_in() -> list[str]:
    """Names of the configurations that come with the installed machines."""
    files = (file.name for folder in machine_folders() for file in resources.files(folder).iterdir())
    return sorted({name.removesuffix(".toml") for name in files if name.endswith(".toml")})


def demonstrations() -> list[str]:
    """Names that `hapticd demo` knows: scenarios and machines."""
    return sorted({*DEMONSTRATIONS, *built_in()})


def example() -> str:
    """The built-in configuration that help shows: the first with a twin to exchange, or the first of all."""
    texts = {
        file.name.removesuffix(".toml"): file.read_text(encoding="utf-8")
        for folder in machine_folders()
        for file in resources.files(folder).iterdir()
        if file.name.endswith(".toml")
    }
    return min(texts, key=lambda name: (TWIN_TABLE.search(texts[name]) is None, name))


def twins() -> list[str]:
    """Names of the built-in twins."""
    files = (file.name for file in (resources.files(CONFIGS) / TWINS).iterdir())
    return sorted(name.removesuffix(".toml") for name in files if name.endswith(".toml"))
