"""cffi build script: the C core as one extension module for each folder that uses it.

Each is made when asked for: the solver's distribution has the files of its own module alone.
"""

from __future__ import annotations

import copy
import platform
import re
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from cffi import FFI
from setuptools import Extension
from setuptools.command.build_ext import build_ext

HERE = Path(__file__).resolve().parent
FLAGS = ["-std=c11", "-ffp-contract=off", "-fvisibility=hidden"]
FAST_AND_SMALL = ("-O3", "-g0")
"""Of what is distributed alone: what debuggers read is larger than the solver."""
COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
STRUCT = re.compile(r"typedef struct(?:\s+\w+)?\s*\{([^}]*)\}\s*(\w+)\s*;")
ARRAY = re.compile(r"\*\s*(\w+)\s+(?:HQP_)?(SHAPE|OPTIONAL|STRIDED)\(([^)]*)\)")
"""A field that points to an array, with what csrc/shape.h has for it."""


class BuildBeside(build_ext):
    """Builds several modules at a time, each with object files of its own: they share sources, not flags."""

    def finalize_options(self) -> None:
        """As many at a time as there are processors, unless asked for otherwise."""
        super().finalize_options()
        self.parallel = self.parallel or True

    def build_extension(self, ext: Extension) -> None:
        """Build one; others may be under way."""
        one = copy.copy(self)
        one.build_temp = str(Path(self.build_temp) / ext.name)
        super(BuildBeside, one).build_extension(ext)


def module(
    name: str,
    headers: list[str],
    sources: list[str],
    flags: Sequence[str] = ("-O2",),
    shared: Sequence[str] = (),
) -> FFI:
    """An extension module with everything that the headers declare, and ``arrays``, see below.

    What the shared headers declare is of the module ``devices``: both may be given the same objects.
    """
    ffi = FFI()
    if shared:
        ffi.include(devices())
    rows: list[str] = []
    for header in headers:
        lines = (HERE / header).read_text(encoding="utf-8").splitlines()
        text = COMMENT.sub("", "\n".join(line for line in lines if not line.startswith("#")))
        rows += arrays(text)
        ffi.cdef(ARRAY.sub(r"*\1", text))
    ffi.cdef("const char *arrays(void);")
    table = "".join(f'"{row}\\n"' for row in rows) or '""'
    ffi.set_source(
        name,
        "\n".join(f'#include "{header}"' for header in (*shared, *headers))
        + f"\nstatic const char *arrays(void) {{ return {table}; }}\n",
        sources=[f"csrc/{source}" for source in sources],
        include_dirs=["csrc"],
        depends=[f"csrc/{path.relative_to(HERE)}" for path in sorted(HERE.rglob("*.h"))],
        define_macros=[("_GNU_SOURCE", None)],
        extra_compile_args=[*FLAGS, *flags],
    )
    return ffi


def arrays(text: str) -> list[str]:
    """What a header says of its structs' arrays, a line each: struct|field|flags|stride|size|size...

    Flags: w: C writes there, o: may be NULL.
    """
    rows = []
    for body, struct in STRUCT.findall(text):
        for declaration in body.split(";"):
            written = "" if declaration.lstrip().startswith("const ") else "w"
            for field, macro, sizes in ARRAY.findall(declaration):
                shape = [size.strip() for size in sizes.split(",")]
                stride = shape.pop() if macro == "STRIDED" else ""
                flags = written + "o" * (macro == "OPTIONAL")
                rows.append("|".join([struct, field, flags, stride, *shape]))
    return rows


CONTROL = (
    *("bounds", "rotation", "serial", "look_ahead", "chain", "drift", "tracking", "ppu", "joint_kalman"),
    *("inertial_unit", "spd", "redundant", "guard", "nullspace"),
    *("limit_avoidance", "task_arm", "hand_wrench", "operator_law", "avatar_law", "panda_ik"),
    *("avatar_model", "link_passivity", "following", "handle_lead", "cartesian_twin", "copies"),
    *("shared_wrench", "chain_twin"),
)

DEVICES = ["wire.h", "codec.h", "image.h", "drives.h"]
devices = partial(module, "hapticd.devices._wire", DEVICES, [f"{Path(part).stem}.c" for part in DEVICES])
control = partial(
    module,
    "hapticd.control._kernels",
    ["serial_model.h", *(f"{part}.h" for part in CONTROL)],
    [f"{part}.c" for part in CONTROL],
    ("-O3",),
)
QP = [path.name for path in sorted(HERE.glob("hqp_qp*.c"))]
HIERARCHIES = [path.name for path in sorted(HERE.glob("hqp*.c")) if path.name not in QP]
HIERARCHIES += [f"extended/{path.name}" for path in sorted((HERE / "extended").glob("*.c"))]
HEADERS = ["hqp.h", "hqp_machine.h"]
hqp = partial(module, "hapticd.hqp._hqp", HEADERS, HIERARCHIES, FAST_AND_SMALL)
hqp_avx2 = partial(module, "hapticd.hqp._hqp_avx2", HEADERS, HIERARCHIES, (*FAST_AND_SMALL, "-mavx2"))
MAY_HAVE_AVX2 = platform.machine() in {"x86_64", "AMD64"}
SOLVERS = ["hqp", "hqp_avx2"] if MAY_HAVE_AVX2 else ["hqp"]
"""What is built of the solver of hierarchies; of two, hqp/core.py takes the one that suits the machine."""


def qp() -> Extension:
    """The QP solver as an extension module that reads numpy's arrays itself, without cffi."""
    import numpy  # of the distribution hapticd-hqp alone

    return Extension(
        "hapticd.hqp._qp",
        [f"csrc/{source}" for source in ("qp_module.c", "hqp_clock.c", *QP)],
        include_dirs=["csrc", numpy.get_include()],
        depends=[f"csrc/{path.name}" for path in sorted(HERE.glob("hqp*.h"))],
        define_macros=[("_GNU_SOURCE", None), ("Py_LIMITED_API", "0x030b0000")],
        extra_compile_args=[
            *FLAGS,
            *FAST_AND_SMALL,
            "-fno-math-errno",
        ],  # or each root asks whether to set it
        py_limited_api=True,
    )


LINK = ("link_age", "link_seal", "link", "link_channel")
link = partial(module, "hapticd.link._inbox", [f"{part}.h" for part in LINK], [f"{part}.c" for part in LINK])
runtime = partial(module, "hapticd.runtime._rt", ["rt.h", "ring.h"], ["rt.c", "ring.c"])
CHECKS = ("balance", "springs", "heat", "plausibility", "hard_limits", "gate")
safety = partial(
    module,
    "hapticd.safety._plausibility",
    [f"{part}.h" for part in CHECKS],
    [f"{part}.c" for part in CHECKS],
)
MECHANICS = ("links", "dry", "held", "elastic", "direct", "rigid", "axes", "tool", "path", "hand")
SENSING = ("probes", "sensor_errors")
PEERS = ("codec", "peer", "peer_drive", "peer_safety", "peers", "gateway", "wire")
plant = partial(
    module,
    "hapticd.sim._plant",
    ["serial_model.h", *(f"{part}.h" for part in (*MECHANICS, *SENSING)), "peer.h", "gateway.h"],
    ["rotation.c", "spd.c", *(f"{part}.c" for part in (*MECHANICS, *SENSING, *PEERS))],
    flags=("-O3",),
    shared=DEVICES,
)
bench = partial(module, "hapticd.bench._floor", ["floor.h"], ["floor.c"], ("-O3",))
bench_avx2 = partial(module, "hapticd.bench._floor_avx2", ["floor.h"], ["floor.c"], ("-O3", "-mavx2"))
FLOORS = ["bench", "bench_avx2"] if MAY_HAVE_AVX2 else ["bench"]
"""The same of the floor that the benchmark compares the solver with."""
