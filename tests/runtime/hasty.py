"""hapticd with machines that engage in a fifth of a second, which no configuration may ask for.

python tests/runtime/hasty.py run giant      and whatever else hapticd takes

The daemon alone is in haste: its plant, its recorder and a replay of its log know the configured time.
"""

import sys
from dataclasses import replace

import msgspec
from hapticd.runtime.command_line import cli
from hapticd.runtime.configuration import config, session
from hapticd.runtime.core.sections import Config

FADE_S = 0.2


def hasty(name: str) -> config.Loaded:
    """A machine that is otherwise as configured."""
    loaded = _load(name)
    arming = msgspec.structs.replace(loaded.config.arming, fade=FADE_S)
    return replace(loaded, config=msgspec.structs.replace(loaded.config, arming=arming))


def unhurried(found: Config) -> list[tuple[str, str, str]]:
    """What is wrong with a loop, but for its haste."""
    return [finding for finding in _check(found) if finding[0] != "arming.fade"]


_load, config.load = config.load, hasty
_check, session._check_loop = session._check_loop, unhurried

if __name__ == "__main__":
    sys.exit(cli.main())
