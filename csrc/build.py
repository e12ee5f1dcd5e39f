"""cffi build script: the C core as one extension module for each folder that uses it."""

from __future__ import annotations

from pathlib import Path

from cffi import FFI

HERE = Path(__file__).resolve().parent
FLAGS = ["-std=c11", "-ffp-contract=off", "-fvisibility=hidden"]


def module(name: str, headers: list[str], sources: list[str], optimise: str = "-O2") -> FFI:
    """An extension module with everything that the headers declare."""
    ffi = FFI()
    for header in headers:
        lines = (HERE / header).read_text(encoding="utf-8").splitlines()
        ffi.cdef("\n".join(line for line in lines if not line.startswith("#")))
    ffi.set_source(
        name,
        "\n".join(f'#include "{header}"' for header in headers),
        sources=[f"csrc/{source}" for source in sources],
        include_dirs=["csrc"],
        depends=[f"csrc/{path.name}" for path in sorted(HERE.glob("*.h"))],
        define_macros=[("_GNU_SOURCE", None)],
        extra_compile_args=[*FLAGS, optimise],
    )
    return ffi


CONTROL = ("bounds", "rotation", "serial", "chain", "tracking", "ppu", "redundant", "nullspace")

devices = module("hapticd.devices._wire", ["wire.h", "image.h"], ["wire.c", "image.c"])
control = module(
    "hapticd.control._kernels",
    [f"{part}.h" for part in CONTROL],
    [f"{part}.c" for part in CONTROL],
)
hqp = module("hapticd.hqp._hqp", ["hqp.h"], [path.name for path in sorted(HERE.glob("hqp*.c"))], "-O3")
runtime = module("hapticd.runtime._rt", ["rt.h", "ring.h"], ["rt.c", "ring.c"])
safety = module("hapticd.safety._plausibility", ["plausibility.h"], ["plausibility.c"])
plant = module("hapticd.sim._plant", ["elastic.h"], ["elastic.c"])
bench = module("hapticd.bench._floor", ["floor.h"], ["floor.c"], "-O3")
