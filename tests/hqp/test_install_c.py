"""`make install-c`: headers, library and pkg-config file, and the examples of docs/examples that use them."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent
QP_OUTPUT = "status 0: x = 0.500 1.500, multiplier of the sum 0.500\n"
OUTPUT = """\
solved: x = 0.500 0.500, wish missed by 0.000
solved: x = 1.000 1.000, wish missed by 0.000
solved: x = 1.000 1.000, wish missed by 1.000
"""


def run(*command, **environment):
    done = subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, timeout=300, env={**os.environ, **environment}
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    for program in ("make", "cc", "pkg-config"):
        if not shutil.which(program):
            pytest.skip(f"there is no {program}")
    prefix = tmp_path_factory.mktemp("prefix")
    run("make", "install-c", f"PREFIX={prefix}")
    return prefix


def flags(prefix, *packages):
    path = f"{prefix}/lib/pkgconfig:{os.environ.get('PKG_CONFIG_PATH', '')}"
    return run("pkg-config", "--cflags", "--libs", *packages, PKG_CONFIG_PATH=path).split()


def test_the_c_example_compiles_against_what_is_installed_and_runs(prefix, tmp_path):
    strict = ["-std=c11", "-Wall", "-Wextra", "-Wconversion", "-Werror"]
    example = "docs/examples/hqp.c"
    run("cc", *strict, example, *flags(prefix, "hapticd-hqp"), "-o", f"{tmp_path}/example")
    assert run(f"{tmp_path}/example", LD_LIBRARY_PATH=f"{prefix}/lib") == OUTPUT


def test_the_example_of_a_qp_compiles_against_what_is_installed_and_runs(prefix, tmp_path):
    strict = ["-std=c11", "-Wall", "-Wextra", "-Wconversion", "-Werror"]
    run("cc", *strict, "docs/examples/qp.c", *flags(prefix, "hapticd-hqp"), "-o", f"{tmp_path}/example")
    assert run(f"{tmp_path}/example", LD_LIBRARY_PATH=f"{prefix}/lib") == QP_OUTPUT


def test_the_cpp_example_compiles_against_what_is_installed_and_runs(prefix, tmp_path):
    if not shutil.which("c++") or subprocess.run(["pkg-config", "--exists", "eigen3"]).returncode:
        pytest.skip("there is no C++ compiler, or no Eigen")
    example = "docs/examples/hqp.cpp"
    run("c++", "-std=c++17", "-Wall", example, *flags(prefix, "hapticd-hqp", "eigen3"), "-o", f"{tmp_path}/x")
    assert run(f"{tmp_path}/x", LD_LIBRARY_PATH=f"{prefix}/lib") == OUTPUT


def test_the_library_exports_its_interface_and_nothing_else(prefix):
    headers = [(prefix / "include" / "hapticd" / name).read_text() for name in ("hqp.h", "hqp_qp.h")]
    declared = set(re.findall(r"^[\w ]+[ *](hqp_\w+)\(", "".join(headers), re.M))
    listed = run("nm", "-D", "--defined-only", str(prefix / "lib" / "libhapticd-hqp.so"))
    assert {line.split()[-1] for line in listed.splitlines()} == declared
    assert {"hqp_solve", "hqp_qp_solve"} <= declared


def test_the_version_of_header_library_and_package_is_one(prefix):
    header = (prefix / "include" / "hapticd" / "hqp.h").read_text()
    version = re.search(r'HQP_VERSION "(.*)"', header).group(1)
    path = f"{prefix}/lib/pkgconfig"
    assert run("pkg-config", "--modversion", "hapticd-hqp", PKG_CONFIG_PATH=path).strip() == version
    from hapticd.hqp._hqp import ffi, lib

    assert ffi.string(lib.hqp_version()).decode() == version
    assert (prefix / "lib" / f"libhapticd-hqp.so.{version.partition('.')[0]}").exists()
