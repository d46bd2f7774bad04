"""Options of `seatrial bridge` for the vehicle's own recording: its folder and how large it may become."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Final

from tui.arguments import size

if TYPE_CHECKING:
    from bridge.clock import Clock
    from bridge.ftp.aside import ServedAside
    from bridge.ring.keeper import RingKeeper

MEGABYTE: Final = 1_000_000
TOTAL_MB: Final = 1000
SEGMENT_MB: Final = 4
FEWEST_SEGMENTS: Final = 4
MOST_SEGMENT_MB: Final = 4000
"""MAVLink FTP reaches 4 GiB into a file."""
NETWORK_BYTES_S: Final = 200_000.0
SERIAL_SHARE: Final = 0.25
"""Share of a serial port's capacity; the telemetry keeps the rest."""
BITS_A_BYTE: Final = 10


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--ring",
        metavar="FOLDER",
        help="keep all that is sent in this folder as well, for dives without a link; the oldest goes first",
    )
    parser.add_argument(
        "--ring-mb",
        type=size,
        default=TOTAL_MB,
        metavar="N",
        help=f"how large the ring may become, in MB (default: {TOTAL_MB}, some ten hours)",
    )
    parser.add_argument(
        "--segment-mb",
        type=size,
        default=SEGMENT_MB,
        metavar="N",
        help=f"how large each of its files may become, in MB (default: {SEGMENT_MB})",
    )


def ring_for(arguments: argparse.Namespace, clock: "Clock") -> "RingKeeper | None":
    """Make the ring that the options ask for, not yet begun; None without one.

    Raises UsageError for an unusable folder or sizes.
    """
    from bridge.ring.files import Bounds
    from bridge.ring.keeper import ring_in
    from tui.exit_codes import UsageError
    from tui.files import check_folder

    if arguments.ring is None:
        return None
    check_folder("--ring", arguments.ring)
    if arguments.ring_mb < FEWEST_SEGMENTS * arguments.segment_mb:
        raise UsageError(
            f"--ring-mb {arguments.ring_mb}: holds fewer than {FEWEST_SEGMENTS} files of "
            f"--segment-mb {arguments.segment_mb}; give more, or make the files smaller"
        )
    if arguments.segment_mb > MOST_SEGMENT_MB:
        raise UsageError(
            f"--segment-mb {arguments.segment_mb}: MAVLink FTP reaches no more than {MOST_SEGMENT_MB} MB into a file; "
            "make the files smaller"
        )
    bounds = Bounds(arguments.ring_mb * MEGABYTE, arguments.segment_mb * MEGABYTE)
    return ring_in(Path(arguments.ring), bounds, clock)


def files_for(arguments: argparse.Namespace, clock: "Clock") -> "ServedAside | None":
    """Make the server of the ring's files on the bridge's links, at each link's own pace; None without a ring."""
    from bridge.ftp.aside import ServedAside
    from bridge.ftp.files import Segments
    from bridge.ftp.server import FileServer

    if arguments.ring is None:
        return None
    paces = [pace_of(spec) for spec in arguments.link]
    return ServedAside(FileServer(Segments(Path(arguments.ring)), lambda link: paces[link]), clock)


def pace_of(spec: str) -> float:
    """Bytes per second of files that a link may carry in addition to its telemetry."""
    from bridge.link.open import parse_link

    kind, _, number = parse_link(spec)
    return SERIAL_SHARE * number / BITS_A_BYTE if kind == "serial" else NETWORK_BYTES_S


def words(arguments: argparse.Namespace) -> str:
    """Describe in a few words what is kept on board."""
    if arguments.ring is None:
        return "nothing is kept on board (see --ring)"
    return f"up to {arguments.ring_mb} MB kept in {arguments.ring}"
