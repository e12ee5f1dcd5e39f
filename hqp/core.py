"""The C core in the build that suits this machine: what AVX2 runs is faster, and the bits are the same."""

from contextlib import suppress
from importlib import import_module
from types import ModuleType
from typing import Any


def best() -> ModuleType:
    """The module for this machine, of those that were built."""
    portable = import_module("._hqp", __package__)
    if portable.lib.hqp_has_avx2():
        with suppress(ModuleNotFoundError):
            return import_module("._hqp_avx2", __package__)
    return portable


_module = best()
ffi: Any = _module.ffi
lib: Any = _module.lib
