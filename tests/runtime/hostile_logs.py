"""Reads hundreds of forged recordings within bounds of memory and time.

    python hostile_logs.py SEED COUNT FOLDER

Takes a recording apart, changes it with valid checksums and without, and reads each result to its end, some
through a whole replay. Prints a line of JSON: how many were refused, and everything that was no typed error
within the bounds. A process of its own, because the largest memory of a process never falls.
"""

from __future__ import annotations

import hashlib
import json
import random
import resource
import struct
import sys
import time
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path

import zstandard
from hapticd.runtime.configuration import config
from hapticd.runtime.errors import HapticdError
from hapticd.runtime.live import lockstep_run
from hapticd.runtime.recording.log import open_log
from hapticd.runtime.recording.replay import replay

MAGIC = b"\x89MCAP0\r\n"
HEADER, SCHEMA, CHANNEL, MESSAGE, CHUNK, ATTACHMENT, METADATA, DATA_END = 1, 3, 4, 5, 6, 9, 12, 15
INNER = (SCHEMA, CHANNEL, MESSAGE)
MAX_MIB, MAX_S = 64, 1.0
"""docs/fault-matrix.md, row 40; seconds of processor time, for the host is shared."""
REPLAYED = 7
"""Every so many recordings that can be read are replayed."""

Parts = list[tuple[int, bytes]]


def take_apart(data: bytes) -> Parts:
    """Opcode and content of all records up to the end of the data, chunks expanded, without indexes."""
    parts: Parts = []
    for opcode, content in frames(data[len(MAGIC) :]):
        if opcode == DATA_END:
            break
        if opcode == CHUNK:
            (size,) = struct.unpack_from("<I", content, 28)
            parts += frames(zstandard.decompress(content[32 + size + 8 :], 1 << 20))
        elif opcode in (HEADER, ATTACHMENT, METADATA):
            parts.append((opcode, content))
    return parts


def frames(data: bytes) -> Iterator[tuple[int, bytes]]:
    at = 0
    while at + 9 <= len(data):
        opcode, length = struct.unpack_from("<BQ", data, at)
        yield opcode, data[at + 9 : at + 9 + length]
        at += 9 + length


def frame(opcode: int, content: bytes, length: int | None = None) -> bytes:
    return struct.pack("<BQ", opcode, len(content) if length is None else length) + content


def chunk(data: bytes, size: int | None = None, kind: bytes = b"zstd", packed: bytes | None = None) -> bytes:
    packed = zstandard.compress(data, 1) if packed is None else packed
    size = len(data) if size is None else size
    head = struct.pack("<QQQII", 0, 0, size, zlib.crc32(data), len(kind)) + kind
    return frame(CHUNK, head + struct.pack("<Q", len(packed)) + packed)


def text(value: bytes) -> bytes:
    return struct.pack("<I", len(value)) + value


def attachment(name: str, data: bytes) -> tuple[int, bytes]:
    body = bytes(16) + text(name.encode()) + text(b"") + struct.pack("<Q", len(data)) + data
    return ATTACHMENT, body + struct.pack("<I", zlib.crc32(body))


def metadata(name: str, values: dict[str, str]) -> tuple[int, bytes]:
    pairs = b"".join(text(k.encode()) + text(v.encode()) for k, v in values.items())
    return METADATA, text(name.encode()) + text(pairs)


def put_together(parts: Parts, extra: bytes = b"") -> bytes:
    """A recording whose checksums are right; ``extra`` goes before the end of its data."""
    out, inner = bytearray(MAGIC), bytearray()
    for opcode, content in [*parts, (0, b"")]:
        if opcode in INNER:
            inner += frame(opcode, content)
        if inner and (opcode not in INNER or len(inner) > 60_000):
            out += chunk(bytes(inner))
            inner.clear()
        if opcode not in (0, *INNER):
            out += frame(opcode, content)
    out += extra
    out += frame(DATA_END, struct.pack("<I", zlib.crc32(out)))
    return bytes(out + frame(2, bytes(20)) + MAGIC)


class Forger:
    """Forged recordings made of a good one."""

    def __init__(self, good: bytes, seed: int) -> None:
        self.good, self.parts, self.dice = good, take_apart(good), random.Random(seed)
        self.session = self._metadata("session")
        names = self.session["config_name"], self.session["model_name"]
        self.config, self.model = (self._attachment(name) for name in names)

    def _metadata(self, name: str) -> dict[str, str]:
        for opcode, content in self.parts:
            if opcode == METADATA and content[4:].startswith(name.encode()):
                pairs, values = content[4 + len(name) + 4 :], []
                while pairs:
                    (size,) = struct.unpack_from("<I", pairs)
                    values.append(pairs[4 : 4 + size].decode())
                    pairs = pairs[4 + size :]
                return dict(zip(values[::2], values[1::2], strict=True))
        raise AssertionError(name)

    def _attachment(self, name: str) -> bytes:
        for opcode, content in self.parts:
            if opcode == ATTACHMENT and content[20:].startswith(name.encode()):
                at = 20 + len(name)
                at += 4 + struct.unpack_from("<I", content, at)[0]
                return content[at + 8 : -4]
        raise AssertionError(name)

    # as a disk, a network or a knife changes files

    def cut(self) -> bytes:
        return self.good[: self.dice.randrange(len(self.good))] + self.dice.choice((b"", MAGIC))

    def flips(self) -> bytes:
        data = bytearray(self.good)
        for _ in range(self.dice.choice((1, 1, 1, 8))):
            data[self.dice.randrange(len(data))] ^= 1 << self.dice.randrange(8)
        return bytes(data)

    def splice(self) -> bytes:
        a, b, n = (self.dice.randrange(len(self.good)) for _ in range(3))
        return self.good[:a] + self.good[b : b + n % 5000] + self.good[a + self.dice.choice((0, n % 5000)) :]

    def absurd_length(self) -> bytes:
        data, at, places = bytearray(self.good), len(MAGIC), []
        while at + 9 <= len(data) - len(MAGIC):
            places.append(at + 1)
            at += 9 + struct.unpack_from("<BQ", data, at)[1]
        place = self.dice.choice(places)
        (length,) = struct.unpack_from("<Q", data, place)
        odd = (0, length - 1, length + 1, 1 << 21, 1 << 31, 1 << 40, 1 << 63, (1 << 64) - 1)
        struct.pack_into("<Q", data, place, self.dice.choice(odd) % (1 << 64))
        return bytes(data)

    # as somebody changes them who knows the format

    def inner_flips(self) -> bytes:
        parts = list(self.parts)
        for _ in range(self.dice.choice((1, 4))):
            k = self.dice.randrange(len(parts))
            opcode, content = parts[k]
            changed = bytearray(content)
            for _ in range(self.dice.choice((1, 3))):
                if changed:
                    changed[self.dice.randrange(len(changed))] = self.dice.choice((0, 1, 127, 128, 255))
            parts[k] = opcode, bytes(changed)
        return put_together(parts)

    def records_moved(self) -> bytes:
        parts = list(self.parts)
        for _ in range(3):
            a, b = (self.dice.randrange(len(parts)) for _ in range(2))
            match self.dice.randrange(4):
                case 0:
                    del parts[a]
                case 1:
                    parts.insert(b, parts[a])
                case 2:
                    parts[a] = self.dice.randrange(256), parts[a][1]
                case 3:
                    parts[a] = parts[a][0], parts[a][1] + parts[b][1]
        return put_together(parts)

    def bomb(self) -> bytes:
        mib = self.dice.choice((1, 3, 40, 400))
        zeros = zstandard.compress(bytes(mib << 20), 1)
        tick = frame(MESSAGE, struct.pack("<HIQQ", 1, 0, 0, 0) + bytes(900_000))
        empty = frame(MESSAGE, struct.pack("<HIQQ", 2, 0, 0, 0))
        extra = self.dice.choice(
            (
                lambda: chunk(bytes(mib << 20)) * 10,
                lambda: chunk(b"", 100, packed=zeros),
                lambda: chunk(b"", 1 << 62, packed=zeros),
                lambda: chunk(b"", mib << 20, packed=zeros[:100]),
                lambda: chunk(b"", 4 << 20, packed=zstandard.compress(b"x", 1) * 1000),
                lambda: chunk(b"", 0, packed=b"\x28\xb5\x2f\xfd\x00\xff" + bytes(20)),  # a window of 3.75 TiB
                lambda: chunk(b"y", kind=b"lz4"),
                lambda: chunk(b"y", kind=b"\xff\xfe"),
                lambda: chunk(tick * 4) * 60,
                lambda: chunk(empty * 100_000) * 40,
                lambda: chunk(empty * 2000) * 2000,
            )
        )()
        return put_together(self.parts, extra)

    def crowd(self) -> bytes:
        count, what = self.dice.choice((15, 100, 3000)), self.dice.randrange(5)
        many: Parts = []
        for k in range(count):
            number = struct.pack("<H", 3 + k)
            many.append(
                (
                    attachment(f"a{k}", bytes(1000)),
                    metadata(f"m{k}", {str(k): "x"}),
                    (CHANNEL, number + number + text(b"tick") + text(b"") + text(b"")),
                    (CHANNEL, number + b"\x01\x00" + text(f"c{k}".encode()) + text(b"") + text(b"")),
                    (SCHEMA, number + text(b"hapticd.Tick") + text(b"") + text(b"[]")),
                )[what]
            )
        big = [metadata("session", {str(k): "" for k in range(50_000)}), attachment("x", bytes(1_000_000))]
        at = self.dice.randrange(4)
        return put_together([*self.parts[:at], *many, *big[: self.dice.randrange(3)], *self.parts[at:]])

    def other_session(self) -> bytes:
        values = dict(self.session)
        for _ in range(2):
            key = self.dice.choice(list(values))
            match self.dice.randrange(4):
                case 0:
                    del values[key]
                case 1:
                    values[key] = self.dice.choice(("", "\x1b[2J", "x" * 100_000, "../../etc/passwd", "2"))
                case 2:
                    values["cpu"] = "\r\n\x07" * 100
                case 3:
                    values[key] = values[self.dice.choice(list(values))]
        return self._with("session", metadata("session", values))

    def other_schema(self) -> bytes:
        k = next(k for k, part in enumerate(self.parts) if part[0] == SCHEMA)
        content = self.parts[k][1]
        at = content.index(b"[[")
        descr = content[at:]
        forged = self.dice.choice(
            (
                b"",
                b"{}",
                b"[1]",
                b"[" * 100_000,
                b"[" + b'["a", ' * 3000 + b'"u1"' + b"]" * 3000 + b"]",
                descr.replace(b"u1", b"O", 1),
                descr.replace(b'"in_bytes"', b'"on_bytes"'),
                descr.replace(b'"tick"', b'["tick", 7]'),
                descr.replace(b'["tick", "<u8"]', b'["tick", "<u8", [' + b"9" * 5000 + b"]]"),
                descr.replace(b"<u8", b"S1000000000", 1),
                descr.replace(b"<u8", b"<f8", 1),
                descr[:-2] + b', ["more", "u1", [1000000]]]',
                b"[" + b",".join(b'["f%d", "u1"]' % k for k in range(40_000)) + b"]",
                b"\xff" + descr,
            )
        )
        parts = list(self.parts)
        parts[k] = SCHEMA, content[: at - 4] + text(forged)
        return put_together(parts)

    def other_machine(self) -> bytes:
        """Texts of configuration or model that do not fit the program, with hashes that fit the texts."""
        name = self.dice.choice(("config", "model"))
        data = bytearray(self.config if name == "config" else self.model)
        match self.dice.randrange(4):
            case 0:
                for _ in range(3):
                    data[self.dice.randrange(len(data))] = self.dice.choice(b'0."=<>[]\xffa')
            case 1:
                data = data[: self.dice.randrange(len(data))]
            case 2:
                data += self.dice.choice((b"x", b"\n# ", b" ", b"\na = 1")) * self.dice.choice((9, 900_000))
            case 3:
                data.clear()
        source = self.session[f"{name}_name"]
        values = self.session | {f"sha256_{name}": hashlib.sha256(data).hexdigest()}
        parts = take_apart(self._with("session", metadata("session", values)))
        k = next(k for k, (op, c) in enumerate(parts) if op == ATTACHMENT and source.encode() in c[:60])
        parts[k] = attachment(source, bytes(data))
        return put_together(parts)

    def lying_index(self) -> bytes:
        """Only what follows the data is changed: indexes, statistics, offsets."""
        at = self.good.rindex(frame(DATA_END, b"", 4)) + 13
        tail = bytearray(self.good[at : -len(MAGIC)])
        for _ in range(20):
            tail[self.dice.randrange(len(tail))] = self.dice.randrange(256)
        return self.good[:at] + bytes(tail) + MAGIC

    def _with(self, name: str, part: tuple[int, bytes]) -> bytes:
        parts = list(self.parts)
        k = next(k for k, (op, c) in enumerate(parts) if op == METADATA and c[4:].startswith(name.encode()))
        parts[k] = part
        return put_together(parts)


BLIND = ("cut", "flips", "absurd_length", "splice")
"""What these change is found out, or changes no tick."""
KINDS = (
    *BLIND,
    *("inner_flips", "records_moved", "bomb", "crowd", "other_session", "other_schema", "other_machine"),
    "lying_index",
)


def main(seed: int, count: int, folder: Path) -> None:
    path = folder / "good.mcap"
    lockstep_run.run(config.load("rhi"), path, 0.3, False)
    good = path.read_bytes()
    forger = Forger(good, seed)
    ticks = [record.data for record in open_log(str(path)).records()]
    assert take_apart(put_together(forger.parts)) == forger.parts
    reset_peak()
    replay(open_log(str(path)))
    honest = peak_mib()
    forged = folder / "forged.mcap"
    refused, readable, wrong = 0, 0, []
    worst_s = worst_mib = 0.0
    for index in range(count):
        kind = KINDS[index % len(KINDS)]
        make: Callable[[], bytes] = getattr(forger, kind)
        forged.write_bytes(make())
        reset_peak()
        before, start = peak_mib(), time.process_time()
        replayed = 0.0
        try:
            try:
                log = open_log(str(forged))
                read = [record.data for record in log.records()]
                list(log.events())
            finally:
                seconds, mib = time.process_time() - start, peak_mib() - before
            readable += 1
            if kind in (*BLIND, "lying_index") and read != ticks:
                wrong.append((index, kind, "other ticks than were recorded, without an error"))
            if readable % REPLAYED == 0:
                try:
                    replay(log)  # lasts as long as its ticks, and builds a session as an honest one does
                finally:
                    replayed = peak_mib() - honest
        except HapticdError as error:
            refused += 1
            message = str(error)
            if len(message) > 2000 or not message.replace("\n", "").isprintable():
                wrong.append((index, kind, f"message: {message[:200]!r}"))
        except Exception as error:
            wrong.append((index, kind, f"{type(error).__name__}: {error}"[:300]))
        mib = max(mib, replayed)
        worst_s, worst_mib = max(worst_s, seconds), max(worst_mib, mib)
        if seconds > MAX_S or mib > MAX_MIB:
            wrong.append((index, kind, f"{seconds:.2f} s, {mib:.0f} MiB"))
    print(json.dumps({"refused": refused, "wrong": wrong, "seconds": worst_s, "mib": worst_mib}))


def reset_peak() -> None:
    """Let the peak begin anew, where the kernel can."""
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        pass


def peak_mib() -> float:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) / 1024.0
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3]))
