"""The program: ``hapticd``, or ``python -m hapticd.runtime``."""

import sys

from .live.interrupts import end_at_once, hear_no_more


def main() -> int:
    """Run the command line; returns the exit status."""
    end_at_once()  # importing the rest takes a second
    from .command_line.cli import main

    try:
        return main()
    finally:
        hear_no_more()


if __name__ == "__main__":
    sys.exit(main())
