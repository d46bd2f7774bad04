"""The ways to a vehicle that there are now: running recordings, serial ports, addresses to listen at."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bridge.links.addresses import DEFAULT_BAUD, among, own_addresses
from gcs_plugin.recording.state import Holding
from tui.links import recordings_now

PORT: Final = 14550
"""UDP port to which vehicles and autopilots send by default."""


@dataclass(frozen=True)
class Way:
    """A link to choose, with a description.

    `recorded`: a recording holds it already; `others`: a recording that this app does not use.
    """

    link: str
    words: str
    recorded: bool = False
    others: bool = False


@dataclass(frozen=True)
class Choice:
    """The link to connect; `records`: record it, else only show it."""

    link: str
    records: bool


def ways(
    recordings: Sequence[Holding], ports: Sequence[tuple[str, str]], addresses: Sequence[str]
) -> tuple[Way, ...]:
    """All links to choose from, recorded links first.

    `recordings`: first the one that other programs use; `ports`: device and name.
    """
    running = [
        Way(link, f"is recorded into {Path(holding.folder).name}", recorded=True, others=n > 0)
        for n, holding in enumerate(recordings)
        for link in holding.links
    ]
    held = [way.link for way in running]
    serial = [Way(f"serial:{device}:{DEFAULT_BAUD}", name or "serial port") for device, name in ports]
    heard = [
        Way(f"udpin:{address}:{PORT}", "from this computer" if n == 0 else "from this network")
        for n, address in enumerate(dict.fromkeys(("127.0.0.1", *addresses)))
    ]
    return (*running, *(way for way in (*serial, *heard) if not among(way.link, held)))


def ways_now() -> tuple[Way, ...]:
    from serial.tools.list_ports import comports  # looked for only here

    ports = [(port.device, port.description) for port in sorted(comports()) if port.hwid != "n/a"]
    return ways(recordings_now(), ports, own_addresses())
