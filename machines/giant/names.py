"""Names of the giant's axes."""

JOINTS = tuple(f"joint_{i}" for i in range(1, 7))
PPU_JOINTS = ("ppu_x", "ppu_y")
