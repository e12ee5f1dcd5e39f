"""Runs a command on Debian's PREEMPT_RT kernel in an emulated machine, over the files of this one.

    python tests/vm/boot.py COMMAND ARGUMENT...

The command runs as root in the current folder; what it writes is dropped with the machine. Time is virtual:
one nanosecond an instruction, and idling is skipped, so that a busy or slow host changes nothing that the
machine can see. That tests logic, never latency. Exit status: the command's own, 124 after LIMIT_S, 125
where the machine died.
"""

from __future__ import annotations

import lzma
import os
import platform
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
CACHE = HERE.parent.parent / "build" / "vm"
QEMU = "qemu-system-x86_64"
KERNELS = ("linux-image-6.12-rt-amd64", "linux-image-rt-amd64")
"""Packages that depend on the newest kernel of their kind, the wanted one first."""
MODULES = ("virtio_pci", "9pnet_virtio", "9p", "overlay", "can_raw", "can_dev", "vcan")
LIMIT_S = 1800
MEMORY = "2G"
SILENCE = "quiet loglevel=3 panic=-1 mitigations=off tsc=reliable no_timer_check random.trust_cpu=on"


class VmError(Exception):
    """The machine cannot be made; the message says how to mend that."""


def prepare() -> tuple[Path, Path]:
    """Unpacks kernel and busybox into the cache; returns the kernel's folder and busybox.

    Raises:
        VmError: a program or package is missing.
    """
    if platform.machine() != "x86_64":
        raise VmError(f"this is {platform.machine()}: kernel and files of an x86-64 Debian are needed")
    for program, package in ((QEMU, "qemu-system-x86"), ("apt-get", ""), ("dpkg-deb", "dpkg")):
        if not shutil.which(program):
            remedy = f"sudo apt install {package}" if package else "this needs Debian, or a child of it"
            raise VmError(f"there is no {program}: {remedy}")
    kernel, busybox = CACHE / "kernel", CACHE / "busybox"
    for folder, package in ((kernel, _newest_kernel), (busybox, lambda: "busybox-static")):
        if not folder.is_dir():
            _unpack(package(), folder)
    return kernel, busybox / "bin" / "busybox"


def _newest_kernel() -> str:
    for package in KERNELS:
        found = subprocess.run(["apt-cache", "depends", package], capture_output=True, text=True, check=False)
        if match := re.search(r"Depends: (linux-image-\d\S*)", found.stdout):
            return match[1]
    raise VmError(f"apt knows none of {', '.join(KERNELS)}: sudo apt update, or add Debian's archive")


def _unpack(package: str, folder: Path) -> None:
    """The files of a package, which is downloaded and not installed."""
    print(f"vm: fetching {package}", flush=True)
    part = folder.with_suffix(".part")
    shutil.rmtree(part, ignore_errors=True)
    part.mkdir(parents=True)
    try:
        subprocess.run(["apt-get", "-qq", "download", package], cwd=part, check=True)
        for archive in part.glob("*.deb"):
            subprocess.run(["dpkg-deb", "-x", str(archive), str(part)], check=True)
            archive.unlink()
    except subprocess.CalledProcessError as error:
        raise VmError(f"{package} could not be fetched: sudo apt update, then try again") from error
    part.rename(folder)


def initramfs(kernel: Path, busybox: Path, job: str) -> bytes:
    """The first files of the machine: busybox, modules in loading order, `init` and the job."""
    modules = _modules(next((kernel / "lib" / "modules").iterdir()))
    entries = [_entry(name, 0o040755) for name in ("bin", "modules", "host", "memory", "guest")]
    entries += [_entry(name, 0o040755) for name in ("proc", "sys", "dev")]
    entries += [_entry(f"modules/{name}.ko", 0o100644, data) for name, data in modules.items()]
    entries += [
        _entry("modules/order", 0o100644, "".join(f"{name}\n" for name in modules).encode()),
        _entry("bin/busybox", 0o100755, busybox.read_bytes()),
        _entry("init", 0o100755, (HERE / "init").read_bytes()),
        _entry("job", 0o100644, job.encode()),
        _entry("TRAILER!!!", 0),
    ]
    return b"".join(entries)


def _modules(folder: Path) -> dict[str, bytes]:
    """MODULES with what they depend on, each after its dependencies."""
    files = {path.name.split(".")[0].replace("-", "_"): path for path in folder.rglob("*.ko*")}
    found: dict[str, bytes] = {}

    def load(name: str) -> None:
        if name in found or name not in files:  # loaded before, or built in
            return
        data = files[name].read_bytes()
        if files[name].suffix == ".xz":
            data = lzma.decompress(data)
        depends = re.search(rb"\0depends=([^\0]*)\0", data)
        for other in depends[1].decode().split(",") if depends else ():
            load(other.replace("-", "_"))
        found[name] = data

    for name in MODULES:
        load(name)
    return found


def _entry(name: str, mode: int, data: bytes = b"") -> bytes:
    """A file in a cpio archive of the format `newc`."""
    path = name.encode() + b"\0"
    fields = (0, mode, 0, 0, 1, 0, len(data), 0, 0, 0, 0, len(path), 0)
    header = b"070701" + b"".join(b"%08X" % field for field in fields) + path
    return header + bytes(-len(header) % 4) + data + bytes(-len(data) % 4)


def run(command: list[str]) -> int:
    """Boots, runs the command, and returns its exit status.

    Raises:
        VmError: the machine cannot be made.
    """
    kernel, busybox = prepare()
    job = f"export PATH={shlex.quote(os.environ['PATH'])} HOME=/\ncd {shlex.quote(os.getcwd())}\n"
    image = CACHE / "initramfs"
    image.write_bytes(initramfs(kernel, busybox, job + shlex.join(command) + "\n"))
    machine = [QEMU, "-nodefaults", "-no-user-config", "-no-reboot", "-display", "none"]
    machine += ["-accel", "tcg,thread=single", "-icount", "shift=0,sleep=off", "-cpu", "max", "-m", MEMORY]
    machine += ["-kernel", str(next((kernel / "boot").glob("vmlinuz-*"))), "-initrd", str(image)]
    machine += ["-append", f"console=ttyS0 {SILENCE}", "-serial", "stdio"]
    machine += ["-device", "isa-debug-exit,iobase=0xf4,iosize=1"]
    machine += ["-fsdev", "local,id=host,path=/,security_model=none,readonly=on,multidevs=remap"]
    machine += ["-device", "virtio-9p-pci,fsdev=host,mount_tag=host"]
    try:
        status = subprocess.run(machine, stdin=subprocess.DEVNULL, timeout=LIMIT_S, check=False).returncode
    except subprocess.TimeoutExpired:
        return 124
    return status >> 1 if status & 1 else 125


if __name__ == "__main__":
    try:
        sys.exit(run(sys.argv[1:]))
    except VmError as error:
        print(f"vm: {error}", file=sys.stderr)
        sys.exit(2)
