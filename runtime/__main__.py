"""The program: ``hapticd``, or ``python -m hapticd.runtime``."""

import sys

from .live.interrupts import end_at_once


def main() -> int:
    """Run the command line; returns the exit status."""
    end_at_once()  # importing the rest takes a second
    from .command_line.cli import main

    return main()


if __name__ == "__main__":
    sys.exit(main())
