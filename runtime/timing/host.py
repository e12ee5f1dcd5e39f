"""What the doctor can see of a host: files below a root folder, and its network links."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

from .cpu_list import parse_cpus


class Host:
    """The one door to the system, so that a folder of files can stand for a whole host."""

    def __init__(self, root: Path = Path("/")) -> None:
        self._root = root

    def read(self, path: str) -> str | None:
        """Text of a file without the white space around it; None where it is missing or forbidden."""
        data = self.read_bytes(path)
        return None if data is None else data.decode(errors="replace").strip()

    def read_bytes(self, path: str) -> bytes | None:
        """Contents of a file; None where it is missing or forbidden."""
        try:
            with (self._root / path.lstrip("/")).open("rb", buffering=0) as file:
                return file.read(1 << 20)
        except OSError:
            return None

    def find(self, pattern: str) -> list[str]:
        """Paths that match a pattern, sorted."""
        found = self._root.glob(pattern.lstrip("/"))
        return sorted("/" + str(path.relative_to(self._root)) for path in found)

    def cpus(self, path: str) -> set[int]:
        """A file that lists CPUs, e.g. ``0-2,5``; empty where there is none."""
        return parse_cpus(self.read(path) or "")

    def links(self) -> list[dict[str, Any]]:
        """Network links with their details, as ``ip`` tells them; none where there is no ``ip``."""
        try:
            told = subprocess.run(
                ["ip", "-json", "-details", "link", "show"], capture_output=True, check=True, timeout=10.0
            )
            links: list[dict[str, Any]] = json.loads(told.stdout)
        except (OSError, subprocess.SubprocessError, ValueError):
            return []
        return links
