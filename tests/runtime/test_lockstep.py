"""Lockstep without the garbage collector."""

from __future__ import annotations

import gc

import pytest
from hapticd.runtime.live.lockstep import unswept

from .conftest import Bench


def test_ticks_leave_nothing_to_the_garbage_collector(moving: Bench) -> None:
    with unswept():
        gc.collect()
        for _ in range(300):
            moving.lockstep.tick()
        assert gc.collect() == 0


def test_the_collector_is_afterwards_as_it_was_before() -> None:
    with pytest.raises(KeyError), unswept():
        assert not gc.isenabled()
        raise KeyError
    assert gc.isenabled()
    gc.disable()
    try:
        with unswept():
            pass
        assert not gc.isenabled()
    finally:
        gc.enable()
