"""The file of a recording: where the disk takes no more, what is there can still be completed."""

from __future__ import annotations

import os
from io import FileIO
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, TYPE_CHECKING

from ..errors import HapticdError

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer


class LogWriteError(HapticdError):
    """The recording cannot be written."""

    code = "log-write"


RESERVE_BYTES = 1 << 20
"""Space kept at the least for the last chunk and the index of a recording."""
INDEX_SHARE = 1 / 64
"""Space kept for the index, as a share of the recording; it takes less than half of that."""


class LogFile(FileIO):
    """A new file, and a reserve on the same disk that is given up for its last bytes.

    Attributes:
        full: why the disk takes no more, None where it does; what is written then comes out of the reserve.
    """

    def __init__(self, path: str | Path) -> None:
        """Open and reserve.

        Raises:
            LogWriteError: the file cannot be written, or the disk is full already.
        """
        self.full: OSError | None = None
        self._reserved = 0
        self._reserve: IO[bytes] | None = None
        try:
            super().__init__(str(path), "w")
            self._reserve = TemporaryFile(dir=Path(path).parent, buffering=0)
            self._keep(RESERVE_BYTES)
        except OSError as error:
            self.close()
            raise LogWriteError(f"cannot write the log {path}: {error.strerror}") from error

    def write(self, data: ReadableBuffer, /) -> int:
        """See ``FileIO``.

        Raises:
            OSError: the reserve, too, is used up, or of no help: a file may be too large for its disk.
        """
        try:
            written = super().write(data)
        except OSError as error:
            if self.full:
                raise
            self._give_up(error)
            return super().write(data)
        if not self.full:
            try:
                self._keep(round(INDEX_SHARE * self.tell()))
            except OSError as error:
                self._give_up(error)
        return written

    def close(self) -> None:
        """The reserve goes, too."""
        if self._reserve:
            self._reserve.close()
        super().close()

    def _give_up(self, error: OSError) -> None:
        self.full = error
        assert self._reserve
        self._reserve.close()

    def _keep(self, size: int) -> None:
        if size > self._reserved:
            assert self._reserve
            os.posix_fallocate(self._reserve.fileno(), self._reserved, RESERVE_BYTES)
            self._reserved += RESERVE_BYTES


def cut_short(log: str | Path, seconds: float, whole: bool, error: OSError | None = None) -> str:
    """What became of a recording that the disk did not take to its end, for people."""
    why = f" ({error.strerror})" if error else ""
    kept = f"holds the first {seconds:.1f} s" if whole else "ends in the middle and cannot be replayed"
    return f"the disk took no more{why}: the log {log} {kept}"
