"""The plotting library, which is an extra."""

from __future__ import annotations

import importlib
from typing import Any

from .recorded import BenchError


def pyplot() -> Any:
    """The plotting library.

    Raises:
        BenchError: it is not installed.
    """
    try:
        import matplotlib
    except ImportError as error:
        raise BenchError("--plot needs matplotlib; pip install 'hapticd[plot]'") from error
    matplotlib.use("Agg")
    return importlib.import_module("matplotlib.pyplot")
