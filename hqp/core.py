"""The C core in the build that suits this machine: what AVX2 runs is faster, and the bits are the same."""

from contextlib import suppress
from importlib import import_module
from types import ModuleType
from typing import Any

_portable = import_module("._hqp", __package__)


def best(name: str, package: str | None) -> ModuleType:
    """The module of this name in the build for this machine, of those that were built."""
    if _portable.lib.hqp_has_avx2():
        with suppress(ModuleNotFoundError):
            return import_module(f"{name}_avx2", package)
    return import_module(name, package)


_module = best("._hqp", __package__)
ffi: Any = _module.ffi
lib: Any = _module.lib
