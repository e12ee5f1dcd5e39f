"""The C core in the build that suits this machine: what AVX2 runs is faster, and the bits are the same."""

from contextlib import suppress
from importlib import import_module
from types import ModuleType

from . import _hqp


def best() -> ModuleType:
    """The module for this machine, of those that were built."""
    if _hqp.lib.hqp_has_avx2():
        with suppress(ModuleNotFoundError):
            return import_module("._hqp_avx2", __package__)
    portable: ModuleType = _hqp
    return portable


_module = best()
ffi, lib = _module.ffi, _module.lib
