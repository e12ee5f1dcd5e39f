"""The plotting library, which is an extra."""

from __future__ import annotations

import importlib
from typing import Any

from ..runtime.invocation import install
from .recorded import BenchError


def pyplot() -> Any:
    """The plotting library.

    Raises:
        BenchError: it is not installed.
    """
    try:
        import matplotlib
    except ImportError as error:
        raise BenchError(f"--plot needs matplotlib; type: {install('matplotlib')}") from error
    matplotlib.use("Agg")
    return importlib.import_module("matplotlib.pyplot")
