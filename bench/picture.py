"""The plotting library, which is an extra."""

from __future__ import annotations

import importlib
from pathlib import Path
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


def save(figure: Any, path: Path) -> None:
    """Write a figure, as SVG the same bytes for the same numbers.

    Raises:
        BenchError: the file cannot be written.
    """
    import matplotlib

    try:
        with matplotlib.rc_context({"svg.hashsalt": "hapticd"}):
            figure.savefig(path, metadata={"Date": None} if path.suffix == ".svg" else None)
    except OSError as error:
        raise BenchError(f"cannot write the plot {path}: {error}") from error
