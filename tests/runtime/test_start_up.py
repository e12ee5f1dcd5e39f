"""Help, a wrong word and completion answer at once: nothing that takes long is imported for them."""

import subprocess
import sys

import pytest

HEAVY = {"asyncio", "can", "canopen", "mcap", "msgspec", "numpy", "pinocchio", "sqlite3", "uvloop", "viser"}
"""What takes ten milliseconds or more to import, or brings something along that does."""
PROGRAM = """
import sys
from hapticd.runtime.__main__ import main
sys.argv = ["hapticd", *sys.argv[1:]]
try:
    main()
finally:
    print("\\n" + ",".join({name.partition(".")[0] for name in sys.modules}))
"""


@pytest.mark.parametrize(
    "arguments",
    [
        ["--help"],
        ["run", "--help"],
        ["--version"],
        ["rnu"],
        ["hands", "--help"],
        ["init", "--help"],
        ["calibrate", "--help"],
    ],
)
def test_no_heavy_import_for_help(arguments: list[str]) -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM, *arguments], capture_output=True, text=True)
    imported = set(done.stdout.splitlines()[-1].split(","))
    assert "argparse" in imported
    assert not HEAVY & imported
