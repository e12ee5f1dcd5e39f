"""Builds the extension module hapticd.hqp._hqp; setup.py names it in cffi_modules."""

from pathlib import Path

from cffi import FFI

PARTS = ("hqp", "hqp_clash", "hqp_dual", "hqp_lq", "hqp_set", "hqp_sweep", "hqp_walk")

ffi = FFI()
header = Path(__file__).with_name("hqp.h").read_text()
ffi.cdef("\n".join(line for line in header.splitlines() if not line.startswith("#")))
ffi.set_source(
    "hapticd.hqp._hqp",
    '#include "hqp.h"',
    sources=[f"csrc/{part}.c" for part in PARTS],
    include_dirs=["csrc"],
    depends=["csrc/hqp.h", "csrc/hqp_internal.h"],
    extra_compile_args=["-std=c11", "-O3", "-ffp-contract=off", "-fvisibility=hidden"],
)
