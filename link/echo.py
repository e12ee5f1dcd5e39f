"""The other end of a measurement, a process of its own: sends back what it receives.

Over the link, a payload's last byte asks for so many forged packets after the answer.

``python -m hapticd.link.echo FOLDER SIZE`` prints two ports, of the link and of plain UDP, and ends with its
input.
"""

from __future__ import annotations

import os
import select
import signal
import socket
import sys
from contextlib import suppress
from pathlib import Path

from ._inbox import lib
from .channel import HEADER, TO_OPERATOR
from .credentials import load
from .host import Host
from .terms import OVERHEAD, Terms

LOOPBACK = "127.0.0.1"
IDLE_MS = 20
"""Between two looks for a session [ms]."""


def terms(size: int) -> Terms:
    """Of both ends of a measurement: delays and silences are measured, not judged."""
    return Terms(sends=size, receives=size, oldest=1.0, lease=60.0, deaf=60.0)


def forged(host: Host, size: int) -> bytes:
    """A packet that nothing but its seal tells from the next one of this session."""
    counter = host.counts().sent + 1
    header = HEADER.pack(lib.LINK_MAGIC, lib.LINK_VERSION, TO_OPERATOR, host.session, counter)
    return header.ljust(size + OVERHEAD, b"\x5a")


def main(folder: Path, size: int) -> None:
    """Echo until nobody asks any more: Ctrl-C of a terminal is for who asks."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    plain = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    plain.bind((LOOPBACK, 0))
    host = Host(load(folder), terms(size), LOOPBACK)
    print(host.port, plain.getsockname()[1], flush=True)
    answer = bytes(size)
    poll, link = select.poll(), -1
    for fd in (sys.stdin.fileno(), plain.fileno()):
        poll.register(fd, select.POLLIN)
    while True:
        if link == -1 and (link := host.fileno()) != -1:
            poll.register(link, select.POLLIN)
        for fd, _ in poll.poll(IDLE_MS if link == -1 else None):
            if fd == plain.fileno():
                content, sender = plain.recvfrom(2048)
                plain.sendto(content, sender)
            elif fd == link:
                received = host.receive()
                answer = received.payload if received else answer
                host.send(answer)  # also what is not judged yet is answered: so both learn of each other
                if asked := answer[-1]:
                    wrong = forged(host, size)
                    with suppress(ConnectionRefusedError):  # who asked has what it needs, and is gone
                        for _ in range(asked):
                            os.write(link, wrong)
            else:
                host.close()
                plain.close()
                return


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
