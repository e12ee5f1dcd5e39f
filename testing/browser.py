"""A browser without a screen, for tests of pages and pictures of them."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
ARGUMENTS = (
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
)
"""WebGL without a graphics processor."""


def missing() -> str:
    """What is not there and how to get it; empty where nothing is missing."""
    try:
        import playwright  # noqa: F401
    except ModuleNotFoundError:
        return "playwright is not installed: pip install playwright"
    if not _program():
        return "there is no Chromium: sudo apt install chromium"
    return ""


@contextmanager
def browser() -> Iterator[Any]:
    """Playwright's ``Browser``; see ``missing``."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=_program(), args=list(ARGUMENTS))
        try:
            yield found
        finally:
            found.close()


def _program() -> str | None:
    return next((path for name in NAMES if (path := shutil.which(name))), None)
