"""The tables of the built-in giant that make its plant another than its controller believes."""

from hapticd.configs import read_text

_TEXT = read_text("giant.toml")
OWN = _TEXT[_TEXT.index("[simulation.plant]") : _TEXT.index("[simulation.touches]")]
"""Of the plant and of the sensors: without them it is what its controller believes."""
FED = "".join(line + "\n" for line in _TEXT.splitlines() if "_friction = " in line and line not in OWN)
"""The lines with the dry friction that is fed forward."""
