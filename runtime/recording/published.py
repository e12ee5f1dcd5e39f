"""Frames in shared memory, from the recorder to whoever looks: the writer never knows of its readers.

A reader that is slow, hangs or dies costs the session nothing: slots are overwritten as time passes, and the
reader counts what it missed. A checksum tells a slot that was overwritten while it was read.

The file lies in a folder of this user's own, ``PID.frames`` of the daemon's process; who writes it holds a
lock on it, so that what a killed session left behind is known from one that runs.
"""

from __future__ import annotations

import fcntl
import mmap
import os
import socket
import stat
import struct
import tempfile
import zlib
from contextlib import suppress
from pathlib import Path

import msgspec

from ..errors import HapticdError
from .frames import Frame

SLOTS, SLOT_BYTES = 128, 16 << 10
"""Two and a half seconds of frames at 50 Hz; a frame of 100 channels has 3 KiB."""
_HEAD = struct.Struct("<8sQI")  # magic, frames ever published, length of what it is about
_SLOT = struct.Struct("<QII")  # number of the frame, its length, its checksum
MAGIC = b"hapticd1"
SUFFIX, ORDERS = ".frames", ".orders"


class SessionError(HapticdError):
    """There is no running session to look at, or none that can be."""

    code = "session"
    exit_status = 2


class About(msgspec.Struct, frozen=True):
    """What a reader needs to know of a session.

    Attributes:
        log: path of the recording.
        config: name that the configuration was asked for by.
        text, source, model_text, model_source: of the configuration and its model, see ``Loaded``.
        rate: of the loop [Hz].
        pid: of the daemon.
        words: what a person may tell it, see ``orders``; empty where nobody listens.
    """

    log: str
    config: str
    text: str
    source: str
    model_text: str
    model_source: str
    rate: float
    pid: int
    words: list[str]


def run_folder() -> Path:
    """Where sessions of this user can be found; nobody else may look into it.

    Raises:
        SessionError: somebody else made it.
    """
    base = os.environ.get("XDG_RUNTIME_DIR", "")
    folder = Path(base, "hapticd") if base else Path(tempfile.gettempdir(), f"hapticd-{os.getuid()}")
    try:
        folder.mkdir(mode=0o700, parents=False, exist_ok=True)
        found = folder.lstat()
    except OSError as error:
        raise SessionError(f"{folder}: {error.strerror}; set XDG_RUNTIME_DIR to a folder of yours") from error
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid() or found.st_mode & 0o077:
        raise SessionError(
            f"{folder} is not a folder that is yours alone; move it away, or set XDG_RUNTIME_DIR"
        )
    return folder


class Publisher:
    """The recorder's end.

    Attributes:
        count: of frames so far.
        unfit: frames that were too long for a slot.
    """

    def __init__(self, path: Path, about: About) -> None:
        """Make the file; what a dead session of the same number left there goes.

        Raises:
            OSError: it cannot be made.
        """
        words = msgspec.json.encode(about)
        path.unlink(missing_ok=True)
        self._path = path
        self._fd = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
        fcntl.flock(self._fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        self._slots = _slots(len(words))
        size = self._slots + SLOTS * SLOT_BYTES
        os.posix_fallocate(self._fd, 0, size)  # a full disk is an error here, not a signal later
        self._map = mmap.mmap(self._fd, size)
        self._map[_HEAD.size : _HEAD.size + len(words)] = words
        self.count = self.unfit = 0
        self._about = len(words)
        self._publish_head()

    def publish(self, frame: Frame) -> None:
        """Put a frame into the place of the oldest."""
        data = msgspec.msgpack.encode(frame)
        if len(data) > SLOT_BYTES - _SLOT.size:
            self.unfit += 1
            return
        at = self._slots + self.count % SLOTS * SLOT_BYTES
        self.count += 1
        _SLOT.pack_into(self._map, at, self.count, len(data), zlib.crc32(data))
        self._map[at + _SLOT.size : at + _SLOT.size + len(data)] = data
        self._publish_head()

    def close(self) -> None:
        """The session is over: its file goes, and whoever reads it sees that."""
        self._path.unlink(missing_ok=True)
        self._map.close()
        os.close(self._fd)

    def _publish_head(self) -> None:
        _HEAD.pack_into(self._map, 0, MAGIC, self.count, self._about)


class Subscriber:
    """A reader's end.

    Attributes:
        about: the session.
        missed: frames that were overwritten before they were read.
    """

    def __init__(self, path: Path) -> None:
        """Look at a session from its newest frame on.

        Raises:
            SessionError: the file is gone, is none, or its session is over.
        """
        try:
            self._fd = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
        except OSError as error:
            raise SessionError(f"there is no session {path.stem}") from error
        try:
            self._map = mmap.mmap(self._fd, 0, prot=mmap.PROT_READ)
            magic, count, length = _HEAD.unpack_from(self._map)
            self._slots = _slots(length)
            if magic != MAGIC or len(self._map) != self._slots + SLOTS * SLOT_BYTES:
                raise ValueError
            self.about = msgspec.json.decode(self._map[_HEAD.size : _HEAD.size + length], type=About)
        except (ValueError, OSError, struct.error, msgspec.MsgspecError) as error:
            os.close(self._fd)
            raise SessionError(f"{path} shows no session of this version") from error
        self._read = max(0, count - 1)
        self.missed = 0

    @property
    def over(self) -> bool:
        """Whether nobody writes any more."""
        try:
            fcntl.flock(self._fd, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except OSError:
            return False
        fcntl.flock(self._fd, fcntl.LOCK_UN)
        return True

    def take(self) -> list[Frame]:
        """Frames since the last time, oldest first."""
        _, count, _ = _HEAD.unpack_from(self._map)
        first = max(self._read, count - SLOTS + 1)
        self.missed += first - self._read
        self._read = count
        found = [self._frame(number) for number in range(first + 1, count + 1)]
        frames = [frame for frame in found if frame is not None]
        self.missed += len(found) - len(frames)
        return frames

    def close(self) -> None:
        """Look no more."""
        self._map.close()
        os.close(self._fd)

    def _frame(self, number: int) -> Frame | None:
        at = self._slots + (number - 1) % SLOTS * SLOT_BYTES
        found, length, checksum = _SLOT.unpack_from(self._map, at)
        if found != number or length > SLOT_BYTES - _SLOT.size:
            return None
        data = self._map[at + _SLOT.size : at + _SLOT.size + length]
        if zlib.crc32(data) != checksum:
            return None
        return msgspec.msgpack.decode(data, type=Frame)


def _slots(about: int) -> int:
    """Where the slots begin behind what the session is about, of a length."""
    return (_HEAD.size + about + SLOT_BYTES - 1) // SLOT_BYTES * SLOT_BYTES


def running() -> list[Path]:
    """Files of the sessions of this user that run, the newest last."""
    found = []
    for path in sorted(run_folder().glob(f"*{SUFFIX}"), key=lambda each: each.stat().st_mtime):
        try:
            subscriber = Subscriber(path)
        except SessionError:
            continue
        if not subscriber.over:
            found.append(path)
        subscriber.close()
    return found


def unseen() -> list[int]:
    """Processes of sessions of this user that go on although nobody records or shows them any more."""
    seen = {path.stem for path in running()}
    orders = [path for path in run_folder().glob(f"*{ORDERS}") if path.stem.isdecimal()]
    return [int(o.stem) for o in orders if o.stem not in seen and alive(int(o.stem)) and not _unheard(o)]


def sweep() -> None:
    """Remove what sessions of this user left behind that were killed; those that run keep what is theirs.

    Raises:
        SessionError: see ``run_folder``.
    """
    for path in run_folder().iterdir():
        left = {SUFFIX: _unwritten, ORDERS: _unheard}.get(path.suffix)
        if left and not _runs(path.stem) and left(path):
            with suppress(OSError):  # somebody else was quicker, or it is none of ours
                path.unlink()


def _runs(pid: str) -> bool:
    """Whether there is a process of a number, of any user."""
    return not pid.isdecimal() or alive(int(pid))


def alive(pid: int) -> bool:
    """Whether a process runs that has not ended, waited for or not."""
    try:
        told = Path("/proc", str(pid), "stat").read_text(errors="replace")
    except OSError:
        return False
    return told.rpartition(")")[2].split()[0] not in ("Z", "X")


def _unwritten(path: Path) -> bool:
    """Whether nobody holds the lock of a file of frames: a session in another namespace of processes may."""
    try:
        fd = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NOFOLLOW)
    except OSError:
        return False
    try:
        fcntl.flock(fd, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError:
        return False
    finally:
        os.close(fd)
    return True


def _unheard(path: Path) -> bool:
    """Whether nobody hears the words that are sent to a socket."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK) as word:
        try:
            word.connect(os.fspath(path))
        except ConnectionRefusedError:
            return True
        except OSError:
            return False
    return False
