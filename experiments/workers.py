"""Processes that share the work of an experiment."""

from __future__ import annotations

import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context, parent_process
from threading import Thread


def pool_of(count: int) -> ProcessPoolExecutor:
    """So many processes, which end with this one however it ends."""
    return ProcessPoolExecutor(count, get_context("forkserver"), initializer=_end_with_parent)


def _end_with_parent() -> None:
    """In a worker: else one whose parent was killed waits for work for ever."""
    parent = parent_process()
    assert parent is not None

    def wait() -> None:
        parent.join()
        os._exit(1)

    Thread(target=wait, daemon=True).start()
