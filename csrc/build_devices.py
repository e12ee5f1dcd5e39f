"""Builds hapticd.devices._wire: the C half of the wire and of the process image."""

from pathlib import Path

from cffi import FFI

CSRC = Path(__file__).resolve().parent
HEADERS = ("wire.h", "image.h")


def declarations(header: str) -> str:
    """The header without its preprocessor lines, as cffi wants it."""
    lines = (CSRC / header).read_text().splitlines()
    return "\n".join(line for line in lines if not line.startswith("#"))


ffi = FFI()
for name in HEADERS:
    ffi.cdef(declarations(name))
ffi.set_source(
    "hapticd.devices._wire",
    '#include "wire.h"\n#include "image.h"\n',
    sources=["csrc/wire.c", "csrc/image.c"],
    include_dirs=["csrc"],
    depends=[f"csrc/{name}" for name in HEADERS],
    define_macros=[("_GNU_SOURCE", None)],
    extra_compile_args=["-std=c11", "-O2", "-fvisibility=hidden", "-ffp-contract=off"],
)
