"""A lock that allows a single upload to a vehicle at a time, among programs that share a folder of receipts.

The operating system releases the lock when its process is killed. On a disk without file locks, every program gets the
turn; FF_ACTIVE is checked on the vehicle in any case, before a commit and at the end.
"""

import contextlib
from pathlib import Path
from typing import BinaryIO, Final

from bridge.errors import ParamRejected
from bridge.file_size import read_small
from bridge.new_file import open_own
from bridge.plain import from_json
from gcs_plugin.file_lock import locked
from gcs_plugin.params.receipt import RECEIPT, number_in

Newest = tuple[int, str]
"""Number and outcome of a vehicle's newest receipt; (0, "") if it has none."""

NONE_YET: Final[Newest] = (0, "")


class Turn:
    """Exclusive right to upload to MAVLink system `system`, held from construction until `end`.

    `read_at` is the result of `newest` at the time the vehicle was read, None to skip that check. Raises ParamRejected
    if another program has the turn, or has had it since the vehicle was read.
    """

    def __init__(self, receipts: Path, system: int, read_at: Newest | None = None) -> None:
        self._file: BinaryIO | None = None
        with contextlib.suppress(OSError):
            receipts.mkdir(parents=True, exist_ok=True)
            self._file = open_own(receipts / f".vehicle-{system}.lock")
        try:
            if self._file is not None and not locked(self._file.fileno()):
                raise ParamRejected(
                    f"another upload or roll back to vehicle {system} is under way: nothing was sent; wait for its "
                    "end, then look at the vehicle again"
                )
            if read_at is not None and newest(receipts, system) != read_at:
                raise ParamRejected(
                    f"another program wrote to vehicle {system} since it was read: nothing was sent; look at it again"
                )
        except ParamRejected:
            self.end()
            raise

    def end(self) -> None:
        """Release the turn."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def __enter__(self) -> "Turn":
        return self

    def __exit__(self, *_: object) -> None:
        self.end()


def newest(receipts: Path, system: int) -> Newest:
    """Number and outcome of a vehicle's newest receipt in a folder; unchanged while no upload begins or ends."""
    numbered = ((number_in(path), _outcome(path, system)) for path in receipts.glob(f"*{RECEIPT}"))
    return max((receipt for receipt in numbered if receipt[1]), default=NONE_YET)


def _outcome(path: Path, system: int) -> str:
    """Outcome in a receipt; "" for a receipt of another vehicle and for an unreadable receipt."""
    try:
        data = from_json(read_small(path))
        return str(data["outcome"]) if data["vehicle"]["system"] == system else ""
    except (OSError, ValueError, KeyError, TypeError):
        return ""
