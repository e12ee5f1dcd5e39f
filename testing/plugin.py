"""The pytest plugin: ``pytest --hapticd-machine NAME`` runs the conformance suite over a machine.

pytest loads this module wherever hapticd is installed, so it imports nothing else of it until it must.
"""

from __future__ import annotations

import importlib
import os
import sys
from pathlib import Path
from typing import Any

import pytest

SUITE = Path(__file__).parent / "conformance"
PACKAGE = "hapticd.testing.conformance"
OPTION = "--hapticd-machine"
BEHIND_LIVE = 10
"""Nice value: about a tenth of the processor that a live test leaves to it."""

pytest.register_assert_rewrite(PACKAGE)


def pytest_addoption(parser: pytest.Parser) -> None:
    """The option, and its counterpart for a project whose tests always include the suite."""
    parser.getgroup("hapticd").addoption(
        OPTION,
        action="append",
        default=[],
        metavar="NAME",
        help="run hapticd's conformance suite over a machine: the name of an installed configuration, or a "
        "TOML file; may be repeated. Without a path it alone runs; -m 'not live' leaves out what takes wall "
        "time",
    )
    parser.addini("hapticd_machines", "machines that a run without a path is to include", "args", [])


def pytest_configure(config: pytest.Config) -> None:
    """Add the suite to what is collected."""
    config.addinivalue_line("markers", "live: depends on wall time")
    config.addinivalue_line("markers", "slow: takes about ten seconds or more")
    config.addinivalue_line("markers", "xdist_group(name): tests that one process runs, of several")
    suite, source = str(SUITE), config.args_source
    if config.getoption("hapticd_machine"):
        if source is not pytest.Config.ArgsSource.ARGS:
            config.args = [suite]
        elif suite not in config.args:
            config.args.append(suite)
    elif config.getini("hapticd_machines") and source is not pytest.Config.ArgsSource.ARGS:
        config.args = [*config.args, suite]
    if machines(config):
        config.pluginmanager.import_plugin("hapticd.testing.suite")


def machines(config: pytest.Config) -> list[str]:
    """Names of the machines that the suite runs over."""
    named: list[str] = config.getoption("hapticd_machine") or config.getini("hapticd_machines")
    return list(dict.fromkeys(named))


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Without a machine the suite is nothing to collect."""
    return True if collection_path == SUITE and not machines(config) else None


def pytest_collect_directory(path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """The suite's folders are packages of hapticd, wherever they lie."""
    if path in (SUITE, SUITE.parent):
        return pytest.Dir.from_parent(parent, path=path)
    return None


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Module | None:
    """A module of the suite."""
    if file_path.parent != SUITE or file_path.suffix != ".py" or file_path.stem == "__init__":
        return None
    module: pytest.Module = SuiteModule.from_parent(parent, path=file_path)
    return module


class SuiteModule(pytest.Module):
    """A module that is imported under the name it has in hapticd."""

    def _getobj(self) -> Any:
        return importlib.import_module(f"{PACKAGE}.{self.path.stem}")


@pytest.hookimpl(tryfirst=True)  # xdist reads the groups in a hook of the same name
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Where several processes run the tests: a machine is one process's, live tests run one by one and first.

    That takes ``--dist loadgroup --no-loadscope-reorder``.
    """
    for item in items:
        if item.path.parent == SUITE and isinstance(item, pytest.Function):
            machine = item.callspec.params["machine_name"]
            live = item.get_closest_marker("live")
            item.add_marker(pytest.mark.xdist_group("live" if live else f"hapticd {machine}"))
    items.sort(key=lambda item: item.path.parent != SUITE or item.get_closest_marker("live") is None)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """What does not depend on wall time makes way."""
    if item.path.parent == SUITE:
        make_way(item)


def make_way(item: pytest.Item) -> None:
    """Gives a process, one of several that run tests, a low priority before its first test that is not live.

    Live tests come first, so the process that runs them has not made way yet.
    """
    several = "PYTEST_XDIST_WORKER" in os.environ
    if several and not item.get_closest_marker("live") and os.getpriority(os.PRIO_PROCESS, 0) < BEHIND_LIVE:
        os.setpriority(os.PRIO_PROCESS, 0, BEHIND_LIVE)


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> bool | None:
    """A test that gets a bench runs in a copy of the process: it leaves the session as it found it."""
    bench = sys.modules.get("hapticd.testing.bench")
    arguments = {name: pyfuncitem.funcargs[name] for name in pyfuncitem._fixtureinfo.argnames}
    if bench is None or not any(isinstance(argument, bench.Bench) for argument in arguments.values()):
        return None
    copies = importlib.import_module("hapticd.testing.copies")
    copies.in_a_copy(pyfuncitem.obj)(**arguments)
    return True
