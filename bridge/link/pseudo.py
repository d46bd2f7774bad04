"""A pseudo-terminal that stands for a serial cable."""

import os
import pty
import tty

from bridge.link.descriptor import DescriptorLink


def open_pty() -> tuple[DescriptorLink, str]:
    """Return the device's end, and the path of the port for a reader to open; raw bytes both ways.

    Closing the device's end pulls the plug: the reader's port is lost.
    """
    master, slave = pty.openpty()
    tty.setraw(slave)
    path = os.ttyname(slave)

    def release() -> None:
        os.close(slave)
        os.close(master)

    return DescriptorLink(f"pty:{path}", master, release), path
