"""The folders, the packages that are installed, and the contracts agree."""

import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
NOT_PACKAGES = {"tests", "docs", "csrc", "build"}


def folders() -> set[str]:
    """Folders with an __init__.py, as package names."""
    found = set()
    for init in ROOT.glob("*/**/__init__.py"):
        path = init.parent.relative_to(ROOT)
        if path.parts[0] not in NOT_PACKAGES and not path.parts[0].startswith("."):
            found.add("hapticd." + ".".join(path.parts))
    return found


def test_every_folder_is_installed_under_its_name() -> None:
    tool = PROJECT["tool"]["setuptools"]
    assert set(tool["packages"]) == folders()
    assert tool["package-dir"] == {
        name: name.removeprefix("hapticd.").replace(".", "/") for name in folders()
    }


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
