"""A serial port, 8N1, held by one program only."""

import errno
from typing import Any

import serial

from bridge.errors import LinkError
from bridge.link.descriptor import DescriptorLink

DEFAULT_BAUD = 115200


def open_serial(port: str, baud: int = DEFAULT_BAUD) -> DescriptorLink:
    """Open the serial port `port`. Raises LinkError if it is absent, busy, forbidden or no serial port."""
    name = f"serial:{port}:{baud}"
    try:
        opened: Any = serial.Serial(port, baud, timeout=0, exclusive=True)
    except serial.SerialException as error:
        raise LinkError(f"{name}: {_reason(port, error)}") from None
    except ValueError as error:
        raise LinkError(f"{name}: can't be set up ({error}); check the baud rate") from None
    except OSError as error:
        raise LinkError(f"{name}: can't be opened ({error.strerror}); check the port") from None
    return DescriptorLink(name, opened.fileno(), opened.close)


def _reason(port: str, error: serial.SerialException) -> str:
    code = error.errno
    if code == errno.ENOENT:
        return f"there is no port {port}; check the cable and the name (ls /dev/tty*)"
    if code == errno.EACCES:
        return "permission denied; join the group that owns the port (often `dialout`) and log in again"
    if code in (errno.EBUSY, errno.EAGAIN):
        return "another program holds the port; stop that program, or give another port"
    return f"can't be opened ({error}); check that it is a serial port"
