"""Draws docs/view.png, view_dark.png and report.png: dashboard and report of built-in machines in lockstep.

make pictures
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from hapticd.testing.browser import browser, missing
from PIL import Image

PROGRAM = (sys.executable, "-m", "hapticd.runtime")
COLOURS = 200
"""Of a picture: such pages have few, and a file is a third as large."""


def main() -> None:
    """Write the pictures beside this file."""
    if missing():
        sys.exit(missing())
    here = Path(__file__).parent
    with tempfile.TemporaryDirectory() as folder, browser() as chromium:
        for machine, name, scheme, share in (
            ("giant", "view.png", "light", 0.53),
            ("panda", "view_dark.png", "dark", 0.3),
        ):
            log = Path(folder, f"{machine}.mcap")
            subprocess.run([*PROGRAM, "run", machine, "--lockstep", "--log", log], check=True)
            draw_dashboard(chromium, log, here / name, scheme, share)
        page = Path(folder, "report.html")
        subprocess.run([*PROGRAM, "report", Path(folder, "giant.mcap"), "--out", page], check=True)
        context = chromium.new_context(viewport={"width": 1200, "height": 1130})
        shown = context.new_page()
        shown.goto(page.as_uri())
        save(shown, here / "report.png")


def draw_dashboard(chromium: Any, log: Path, out: Path, scheme: str, share: float) -> None:
    """The dashboard of a recording at a share of its time."""
    command = [*PROGRAM, "view", str(log), "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as view:
        assert view.stdout
        found = re.search(r"view: (http\S+)", view.stdout.readline())
        assert found
        context = chromium.new_context(color_scheme=scheme, viewport={"width": 1280, "height": 930})
        page = context.new_page()
        page.goto(found[1])
        while page.evaluate("document.getElementById('clock').textContent") == "":
            page.wait_for_timeout(200)
        page.evaluate(f"seek(Math.round({share} * frames.length))")
        page.wait_for_timeout(1500)
        save(page, out)
        context.close()
        view.terminate()


def save(page: Any, out: Path) -> None:
    """A picture with few colours."""
    page.screenshot(path=out, timeout=120_000)
    Image.open(out).convert("RGB").quantize(COLOURS, method=Image.Quantize.MEDIANCUT).save(out, optimize=True)


if __name__ == "__main__":
    main()
