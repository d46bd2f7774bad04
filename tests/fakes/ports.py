"""Ports for tests: a free network port of this computer, and a serial port with a device behind it (a pty)."""

import os
import pty
import socket
import tty

from bridge.links.descriptor import DescriptorLink


def free_port(kind=socket.SOCK_STREAM):
    """Number of a port that nobody holds now; `kind`: SOCK_STREAM for TCP, SOCK_DGRAM for UDP."""
    with socket.socket(type=kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def open_pty() -> tuple[DescriptorLink, str]:
    """The device's end, and the path of the port for a reader to open; raw bytes both ways.

    Closing the device's end pulls the plug: the reader's port is lost.
    """
    master, slave = pty.openpty()
    tty.setraw(slave)
    path = os.ttyname(slave)

    def release() -> None:
        os.close(slave)
        os.close(master)

    return DescriptorLink(f"pty:{path}", master, release), path
