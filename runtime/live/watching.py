"""A dashboard beside a session, as a process of its own: the session goes on whatever becomes of it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from .children import end, tied


@contextmanager
def watching(wanted: bool, opened: bool) -> Iterator[None]:
    """While this lasts, a dashboard waits for this process's session and shows it.

    Args:
        wanted: whether there is to be one at all.
        opened: whether the browser of this desktop is to open it.
    """
    if not wanted:
        yield
        return
    command = [sys.executable, "-m", "hapticd.runtime", "view", "--session", str(os.getpid())]
    child = subprocess.Popen(
        [*command, *(["--open"] if opened else [])],
        stdin=subprocess.DEVNULL,
        stdout=2,  # the address is for people; what a session comes to has standard output for itself
        preexec_fn=tied(),
        process_group=0,
    )
    try:
        yield
    finally:
        end(child)
