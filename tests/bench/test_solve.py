import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def run(*arguments):
    command = [sys.executable, ROOT / "bench" / "solve.py", *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def test_figures_come_as_json_and_as_a_table():
    data = ("--data", str(ROOT / "bench" / "data" / "hqp_cycling.npz"), "--rounds", "1")
    figures = json.loads(run(*data, "--json"))["cycling"]
    assert figures["hapticd cold"]["wrong_1e6"] == figures["hapticd warm"]["wrong_1e6"] == 0
    assert figures["hapticd warm"]["median_us"] > 0
    table = run(*data).splitlines()
    assert len(table) == 4 and all("cycling" in line for line in table[1:])
