"""Arrays that C is given are those that its headers name, and live as long as C may look at them."""

from __future__ import annotations

import gc
import re
import weakref
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hapticd.binding import BindError, bind, pointer
from hapticd.control._kernels import ffi, lib
from hapticd.devices import _wire
from hapticd.devices.frames import FRAME
from hapticd.safety import _plausibility

ROOT = Path(__file__).parents[2]


def tracking(n: int = 3) -> Any:
    return ffi.new("tracking *", {"n": n})


def read_only(array: np.ndarray) -> np.ndarray:
    array.flags.writeable = False
    return array


def test_c_reads_and_writes_the_array_itself() -> None:
    core, J, torque = tracking(), np.arange(18.0).reshape(6, 3), np.zeros(3)
    bind(lib, core, J=J, torque=torque)
    J[5, 2], core.torque[1] = -1.0, 7.0
    assert (core.J[17], core.J[4], torque[1]) == (-1.0, 4.0, 7.0)


WRONG = {
    "float32": (np.zeros((6, 3), np.float32), r"tracking\.J has dtype float32; expected a C-contiguous"),
    "integers": (np.zeros((6, 3), int), r"has dtype int64; expected .* float64, shape \(6, 3\)"),
    "byte order": (np.zeros((6, 3), ">f8"), "has dtype >f8"),
    "a row less": (np.zeros((5, 3)), r"tracking\.J has shape \(5, 3\); expected .* shape \(6, 3\)"),
    "transposed": (np.zeros((3, 6)), r"has shape \(3, 6\)"),
    "flat": (np.zeros(18), r"has shape \(18,\)"),
    "Fortran order": (np.zeros((6, 3), order="F"), r"tracking\.J is not C-contiguous"),
    "every other": (np.zeros((6, 6))[:, ::2], "is not C-contiguous"),
    "unaligned": (np.frombuffer(bytes(145), np.uint8)[1:].view(float).reshape(6, 3), "is not aligned"),
    "a list": ([[0.0] * 3] * 6, "is of type list"),
    "masked": (np.ma.zeros((6, 3)), "is of type MaskedArray"),
    "None": (None, r"tracking\.J is None; expected a C-contiguous array"),
    "cdata of another type": (ffi.new("int[]", 3), "entries|type"),
}


@pytest.mark.parametrize("wrong", WRONG)
def test_what_does_not_fit_is_refused_with_field_and_expectation(wrong: str) -> None:
    array, message = WRONG[wrong]
    core = tracking()
    with pytest.raises((BindError, TypeError), match=message):
        bind(lib, core, J=array)
    assert core.J == ffi.NULL


def test_read_only_memory_is_for_reading() -> None:
    core = tracking()
    bind(lib, core, p=read_only(np.ones(3)))
    with pytest.raises(BindError, match=r"tracking\.torque is read-only; expected .* that C may write"):
        bind(lib, core, torque=read_only(np.zeros(3)))


def test_all_arrays_are_bound_or_none() -> None:
    core = tracking()
    with pytest.raises(BindError):
        bind(lib, core, p=np.zeros(3), d=np.zeros(4))
    assert core.p == ffi.NULL


def test_a_field_that_is_unknown_or_no_array_is_refused_with_those_that_are() -> None:
    for name in ("torques", "n"):
        with pytest.raises(BindError, match=rf"tracking\.{name} is not declared as an array; .*torque"):
            bind(lib, tracking(), **{name: np.zeros(3)})


def test_a_size_that_the_struct_does_not_hold_must_be_given() -> None:
    frames = ffi.new("serial_frame[]", 2)
    with pytest.raises(
        BindError, match=r"serial_frame\.J depends on the size n; expected it among the sizes"
    ):
        bind(lib, frames, {}, 1, J=np.zeros((6, 4)))
    with pytest.raises(BindError, match=r"shape \(6, 5\)"):
        bind(lib, frames, {"n": 5}, 1, J=np.zeros((6, 4)))
    bind(lib, frames, {"n": 4}, 1, J=np.zeros((6, 4)))
    assert frames[0].J == ffi.NULL != frames[1].J


def test_an_optional_array_may_be_none_again() -> None:
    core = _plausibility.ffi.new("plausible_values *", {"n": 2})
    bind(_plausibility.lib, core, rate=np.zeros(2))
    assert core.rate
    bind(_plausibility.lib, core, rate=None)
    assert not core.rate


def test_entries_may_lie_as_far_apart_as_the_struct_says() -> None:
    status = np.zeros(3, [("age", np.int32), ("fresh", np.bool_), ("rest", "u1", 3)])
    core = _plausibility.ffi.new("plausible_values *", {"n": 2, "stride": status.itemsize})
    bind(_plausibility.lib, core, fresh=status["fresh"])
    status["fresh"][2] = True
    assert [core.fresh[i * core.stride] for i in range(3)] == [0, 0, 1]
    with pytest.raises(BindError, match=r"has strides \(1,\); expected an array with entries 8 bytes apart"):
        bind(_plausibility.lib, core, fresh=np.zeros(3, np.bool_))


def test_structured_arrays_must_lie_in_memory_as_the_struct_does() -> None:
    frames = _wire.ffi.new("wire_frames *", {"capacity": 4})
    bind(_wire.lib, frames, frame=np.zeros(4, FRAME))
    for wrong in (
        np.dtype([("id", "<u4"), ("len", "u1"), ("flags", "u1"), ("data", "u1", 64), ("reserved", "u1", 2)]),
        np.dtype({"names": ["id"], "formats": ["<u4"], "itemsize": 72}),
        np.dtype("V72"),
        np.dtype([("id", "<i4"), *FRAME.descr[1:]]),
    ):
        with pytest.raises(BindError, match=r"wire_frames\.frame has dtype"):
            bind(_wire.lib, frames, frame=np.zeros(4, wrong))


def test_arrays_live_as_long_as_their_struct_and_no_longer() -> None:
    core, array = tracking(), np.ones(3)
    seen = weakref.ref(array)
    bind(lib, core, p=array)
    del array
    gc.collect()
    assert seen() is not None and core.p[2] == 1.0
    del core
    gc.collect()
    assert seen() is None


def test_arrays_of_an_element_live_as_long_as_all_of_them() -> None:
    frames = ffi.new("serial_frame[]", 2)
    seen = []
    for k in (0, 1):
        drift = np.full(6, float(k))
        seen.append(weakref.ref(drift))
        bind(lib, frames, {}, k, drift=drift)
        del drift
    gc.collect()
    assert [frames[k].drift[0] for k in (0, 1)] == [0.0, 1.0] and all(ref() is not None for ref in seen)
    del frames
    gc.collect()
    assert [ref() for ref in seen] == [None, None]


def test_an_array_that_another_replaces_is_let_go() -> None:
    core, array = tracking(), np.ones(3)
    seen = weakref.ref(array)
    bind(lib, core, p=array)
    bind(lib, core, p=np.zeros(3))
    del array
    gc.collect()
    assert seen() is None


def test_memory_that_c_knows_is_not_moved() -> None:
    core, array = tracking(), np.ones(3)
    bind(lib, core, p=array)
    with pytest.raises(ValueError, match="resize"):
        array.resize(1000, refcheck=False)


def test_a_struct_of_somebody_else_is_refused() -> None:
    """Nobody would know how long it lives, and with it the arrays."""
    core, frames = tracking(), ffi.new("serial_frame[]", 1)
    for struct in (ffi.cast("tracking *", core), frames[0], core[0]):
        with pytest.raises(BindError, match="does not own its memory"):
            bind(lib, struct, {"n": 3}, J=np.zeros((6, 3)))


def test_an_argument_is_checked_the_same_way_and_kept() -> None:
    array = np.zeros((2, 3))
    seen = weakref.ref(array)
    argument = pointer(array, "double", 2, 3)
    del array
    gc.collect()
    assert seen() is not None and len(argument) == 6
    pointer(read_only(np.zeros(3)), "const double", None)
    for wrong, message in (
        (np.zeros(4), r"R has shape \(4,\)"),
        (np.zeros(3, np.int32), "R has dtype int32"),
        (np.zeros(6)[::2], "R is not C-contiguous"),
        (read_only(np.zeros(3)), "R is read-only"),
    ):
        with pytest.raises(BindError, match=message):
            pointer(wrong, "double", 3, name="R")


NO_ARRAYS = {
    *(
        "chain_twin.chain",
        "look_ahead.chain",
        "redundant.chain",
        "nullspace.guard",
        "peers.outbox",
        "task_arm.chain",
        "task_arm.palm",
        "tracking.chain",
        "tracking_tool.drift",
    ),
    *(f"link_inbox.{part}" for part in ("now", "before", "next")),
    "link_outbox.now",
    *(f"link_sealing.{part}" for part in ("key", "seal", "open")),
    *(f"avatar_model.{part}" for part in ("arm", "wish", "chain", "palm", "limits")),
}
"""Pointers to one struct that somebody else bound or owns, or to functions."""


def test_every_pointer_of_a_struct_says_what_array_it_is() -> None:
    bare = set()
    for header in {*(ROOT / "csrc").glob("*.h")} - {ROOT / "csrc" / "hqp_internal.h"}:  # nobody binds to it
        text = re.sub(r"/\*.*?\*/", "", header.read_text(), flags=re.DOTALL)
        for body, struct in re.findall(r"typedef struct(?: \w+)? \{([^}]*)\} (\w+);", text):
            bare |= {f"{struct}.{field}" for field in re.findall(r"\*\s*(\w+)\s*[;,]", body)}
    assert bare == NO_ARRAYS


def test_nobody_binds_arrays_in_another_way() -> None:
    """But for the ring, whose memory is another process' too and no array."""
    found = set()
    for path in ROOT.glob("*/**/*.py"):
        part = path.relative_to(ROOT)
        if part.parts[0] not in ("binding", "tests", "build") and not part.parts[0].startswith("."):
            text = path.read_text()
            if "from_buffer(" in text.replace("np.frombuffer(", "") or "ctypes.data" in text:
                found.add(str(part))
    assert found == {"runtime/recording/ring.py"}
