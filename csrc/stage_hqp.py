"""Stages the tree of the distribution hapticd-hqp, the solver alone: package, C files, pyproject.toml.

python csrc/stage_hqp.py build/hqp           copies, for a wheel and an sdist
python csrc/stage_hqp.py --link build/hqp    links, for an editable installation of this checkout
"""

from __future__ import annotations

import shutil
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

PYPROJECT = """\
[build-system]
requires = {requires}
build-backend = "setuptools.build_meta"

[project]
name = "hapticd-hqp"
version = "{version}"
description = "Hierarchical least squares and quadratic programs with inequalities, proven, over a C core"
readme = "README.md"
license = "{licence}"
license-files = ["LICENSE"]
requires-python = "{python}"
dependencies = {dependencies}

[project.optional-dependencies]
certificate = ["scipy>=1.14"]

[tool.setuptools]
packages = ["hapticd.binding", "hapticd.hqp"]

[tool.setuptools.package-dir]
"hapticd.binding" = "binding"
"hapticd.hqp" = "hqp"

[tool.setuptools.package-data]
"*" = ["py.typed", "*.pyi"]

[tool.distutils.bdist_wheel]
py-limited-api = "{abi}"
"""

SETUP = """\
import runpy

from setuptools import setup

build = runpy.run_path("csrc/build.py")
# none of these has a pyproject key
setup(
    cmdclass={"build_ext": build["BuildBeside"]},
    cffi_modules=[f"csrc/build.py:{solver}" for solver in build["SOLVERS"]],
    ext_modules=[build["qp"]()],
)
"""


FOLDERS = ("binding", "hqp", "csrc")


def contents() -> list[tuple[Path, str]]:
    """Files of the checkout, and where they go in the tree."""
    packages = [f"{name}/{file}" for name in ("binding", "hqp") for file in ("*.py", "*.pyi", "py.typed")]
    parts = [*packages, "csrc/hqp*.c", "csrc/hqp*.h", "csrc/hqp*.hpp", "csrc/extended/*.[ch]"]
    parts += ["csrc/qp_module.c", "csrc/build.py"]
    files = [(path, str(path.relative_to(ROOT))) for part in parts for path in sorted(ROOT.glob(part))]
    return [*files, (ROOT / "LICENSE", "LICENSE"), (ROOT / "docs" / "hqp.md", "README.md")]


def pyproject() -> str:
    """The staged pyproject.toml, with what the two distributions share taken from the root's."""
    root = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    project = root["project"]
    shared = [d for d in project["dependencies"] if d.startswith(("cffi", "numpy"))]
    requires = root["build-system"]["requires"] + [d for d in shared if d.startswith("numpy")]
    return PYPROJECT.format(
        requires=str(requires).replace("'", '"'),
        version=project["version"],
        licence=project["license"],
        python=project["requires-python"],
        dependencies=str(shared).replace("'", '"'),
        abi=root["tool"]["distutils"]["bdist_wheel"]["py-limited-api"],
    )


def stage(tree: Path, link: bool) -> None:
    """Write the tree; what was there before goes, but for what an installation keeps beside it."""
    for name in FOLDERS:
        old = tree / name
        old.unlink() if old.is_symlink() else shutil.rmtree(old, ignore_errors=True)
    tree.mkdir(parents=True, exist_ok=True)
    for name in FOLDERS if link else ():
        (tree / name).symlink_to(ROOT / name, target_is_directory=True)
    for source, place in contents():
        if link and place.startswith(tuple(f"{name}/" for name in FOLDERS)):
            continue
        (tree / place).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, tree / place)
    (tree / "pyproject.toml").write_text(pyproject(), encoding="utf-8")
    (tree / "setup.py").write_text(SETUP, encoding="utf-8")
    (tree / "MANIFEST.in").write_text("graft csrc\nglobal-exclude *.py[cod] *.so\n", encoding="utf-8")


if __name__ == "__main__":
    stage(Path(sys.argv[-1]), "--link" in sys.argv[1:-1])
