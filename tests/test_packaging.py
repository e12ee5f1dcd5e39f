"""The folders, the packages that are installed, and the contracts agree."""

import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
NOT_PACKAGES = {"tests", "docs", "csrc", "build", "examples"}


def folders() -> set[str]:
    """Folders with an __init__.py, as package names."""
    found = set()
    for init in ROOT.glob("*/**/__init__.py"):
        path = init.parent.relative_to(ROOT)
        if path.parts[0] not in NOT_PACKAGES and not path.parts[0].startswith("."):
            found.add("hapticd." + ".".join(path.parts))
    return found


def test_every_folder_is_installed_under_its_name_by_one_of_two_distributions(tmp_path: Path) -> None:
    tools = [PROJECT["tool"]["setuptools"], staged(tmp_path)["tool"]["setuptools"]]
    assert sorted(name for tool in tools for name in tool["packages"]) == sorted(folders())
    for tool in tools:
        assert tool["package-dir"] == {
            name: name.removeprefix("hapticd.").replace(".", "/") for name in tool["packages"]
        }


def staged(tree: Path, *options: str) -> dict[str, Any]:
    """Stage the tree of hapticd-hqp; its pyproject.toml."""
    command = [sys.executable, ROOT / "csrc" / "stage_hqp.py", *options, tree]
    subprocess.run(command, check=True, timeout=60)
    return tomllib.loads((tree / "pyproject.toml").read_text())


def test_the_solver_is_a_distribution_that_hapticd_of_the_same_version_depends_on(tmp_path: Path) -> None:
    project = staged(tmp_path)["project"]
    assert f"{project['name']}=={project['version']}" in PROJECT["project"]["dependencies"]
    assert project["version"] == PROJECT["project"]["version"]
    assert {dependency.partition(">")[0] for dependency in project["dependencies"]} == {"cffi", "numpy"}


def test_the_solvers_tree_has_all_it_needs_and_is_small(tmp_path: Path) -> None:
    """Its extension modules are built, and used without anything else of this checkout."""
    staged(tmp_path)
    size = sum(path.stat().st_size for path in tmp_path.rglob("*") if path.is_file())
    assert size < 2**20
    (tmp_path / "site").mkdir()
    (tmp_path / "site" / "hapticd").symlink_to(tmp_path)
    build = [sys.executable, "-I", "setup.py", "-q", "build_ext", "--inplace"]
    subprocess.run(build, cwd=tmp_path, check=True, timeout=300)
    use = """
import sys
sys.path.insert(0, "site")
sys.modules["scipy"] = None
from hapticd import hqp
modules = [sys.modules[f"hapticd.hqp.{name}"].__file__ for name in ("_hqp", "_qp")]
print(*modules, hqp.solve_qp([[2.0]], [-2.0], ub=[0.5]).x[0])
import hapticd.hqp.certificate, hapticd.hqp.generate, hapticd.hqp.multipliers
"""
    done = subprocess.run(
        [sys.executable, "-I", "-c", use], cwd=tmp_path, capture_output=True, text=True, timeout=60
    )
    modules = [str(tmp_path / f"site/hapticd/hqp/{name}.abi3.so") for name in ("_hqp", "_qp")]
    assert done.stdout.split() == [*modules, "0.5"], done.stderr
    folders = [tmp_path / name for name in ("hqp", "binding")]  # bytecode among it
    assert sum(path.stat().st_size for folder in folders for path in folder.rglob("*")) < 2**20


def test_a_linked_tree_follows_the_checkout_and_staging_again_leaves_it_whole(tmp_path: Path) -> None:
    for _ in range(2):
        staged(tmp_path / "tree", "--link")
        assert (tmp_path / "tree" / "hqp").resolve() == ROOT / "hqp"
    staged(tmp_path / "tree")
    assert not (tmp_path / "tree" / "hqp").is_symlink()
    assert (ROOT / "hqp" / "solver.py").exists()


def test_every_package_is_typed() -> None:
    for name in folders():
        assert (ROOT / name.removeprefix("hapticd.").replace(".", "/") / "py.typed").exists(), name


def test_every_top_level_package_is_under_the_import_contract_and_the_bans() -> None:
    top = {name for name in folders() if name.count(".") == 1}
    assert set(PROJECT["tool"]["importlinter"]["root_packages"]) == top
    banned = PROJECT["tool"]["ruff"]["lint"]["flake8-tidy-imports"]["banned-api"]
    assert {name.removeprefix("hapticd.") for name in top} <= set(banned)


def test_the_daemon_never_imports_what_is_gpl() -> None:
    for path in ROOT.glob("*/**/*.py"):
        part = path.relative_to(ROOT).parts[0]
        if (
            part in {"tests", "bench"}
            or part.startswith(".")
            or part == "build"
            or path.name == "reference.py"
        ):
            continue
        text = path.read_text()
        assert "import quadprog" not in text, path
        assert "hqp.reference" not in text and "from .reference" not in text, path


def test_a_checkout_may_lie_in_a_folder_of_any_name(tmp_path: Path) -> None:
    pytest.importorskip("ruff")
    checkout = tmp_path / "2026-hapticd, a copy"
    tops = {name.removeprefix("hapticd.").partition(".")[0] for name in folders()}
    for top in tops:
        shutil.copytree(
            ROOT / top,
            checkout / top,
            ignore=lambda _, names: [n for n in names if "." in n and not n.endswith(".py")],
        )
    for name in ("__init__.py", "pyproject.toml"):
        shutil.copy(ROOT / name, checkout)
    ruff = [sys.executable, "-m", "ruff", "check", "--no-cache", "."]
    done = subprocess.run(ruff, cwd=checkout, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("folder", ["runtime", "devices", "safety", "sim"])
def test_what_every_machine_uses_names_none(folder: str) -> None:
    named = re.compile("giant|rhi|panda", re.IGNORECASE)
    found = [
        f"{path.relative_to(ROOT)}: {line.strip()}"
        for path in sorted((ROOT / folder).rglob("*.py"))
        for line in path.read_text().splitlines()
        if named.search(line)
    ]
    assert found == []
