"""``hapticd report``: a recorded session as one page of HTML."""

from __future__ import annotations

import argparse
import os
from contextlib import suppress
from pathlib import Path

from ..runtime.command_line.arguments import Commands, file, name
from ..runtime.errors import HapticdError


class ReportPathError(HapticdError):
    """The report cannot take the place that it was given."""

    code = "report-path"
    exit_status = 2


def add_report(commands: Commands) -> None:
    """Add `hapticd report`."""
    report = commands.add_parser(
        "report",
        help="a recorded session as one page of HTML",
        description="Write a recorded session as one page of HTML that needs nothing else: modes and"
        " interventions with their reasons, limits and when they were touched, force and work of the hand,"
        " punctuality, late ticks and their causes, the solver. It opens offline, in light and dark, on a"
        " phone, and prints.",
    )
    report.add_argument("log", type=name, metavar="LOG", nargs="?", help="default: the newest in log/")
    report.add_argument("--out", type=file, metavar="FILE", help="default: LOG with .html instead of .mcap")
    report.add_argument("--json", action="store_true", help="print {report, bytes, ticks} as JSON")
    report.set_defaults(handler=run)


def run(options: argparse.Namespace) -> int:
    """Write the page; the exit status.

    Raises:
        LogError: the recording cannot be read.
        ReportPathError: the page would take the place of something else, or cannot be written.
    """
    import msgspec

    from ..runtime.command_line.logs import newest_log
    from ..runtime.command_line.progress import counting
    from ..runtime.recording.log import open_log
    from .report import page
    from .session import read

    source = Path(options.log or newest_log())
    out: Path = options.out or source.with_suffix(".html")
    _require_place(out)
    with counting(options.json) as progress:
        found = read(open_log(str(source)), progress)
    content = page(found).encode()
    _write(out, content)
    assert found.summary is not None
    if options.json:
        said = {"report": str(out), "bytes": len(content), "ticks": found.summary.ticks}
        print(msgspec.json.encode(said).decode())
    else:
        print(f"report: {out}, {len(content) / 1e6:.1f} MB")
    return 0


def _require_place(out: Path) -> None:
    """Only a page is replaced by a page."""
    if out.suffix not in (".html", ".htm"):
        raise ReportPathError(f"'{out}' does not end in .html; name a page with --out FILE.html")
    if out.is_dir():
        raise ReportPathError(f"{out} is a folder; name a page with --out FILE.html")
    if not out.parent.is_dir():
        raise ReportPathError(f"there is no folder {out.parent}; make it, or name another with --out")


def _write(out: Path, content: bytes) -> None:
    """All of it or nothing: a page that is there stays until the new one is complete."""
    part = out.with_name(f".{out.name}.{os.getpid()}")
    try:
        part.write_bytes(content)
        part.replace(out)
    except OSError as error:
        raise ReportPathError(
            f"cannot write {out}: {error.strerror}; name another with --out FILE.html"
        ) from error
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)
