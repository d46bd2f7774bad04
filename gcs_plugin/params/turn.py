"""One upload to a vehicle at a time, among the programs that keep their receipts in one folder.

The system lets go of a turn where its process is killed. Where files can't be locked, everybody has the turn: what the
vehicle itself says of its set is looked at all the same, before a commit and at the end.
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
"""The number of a vehicle's newest receipt and what that says; (0, "") where it has none."""

NONE_YET: Final[Newest] = (0, "")


class Turn:
    """Held from the moment it is made until `end`, for uploads to MAVLink system `system`. `read_at` is what `newest`
    said as the vehicle was read, None where nobody looked.

    Raises ParamRejected where another program has the turn, or had it since the vehicle was read.
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
        """Let others have it."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def __enter__(self) -> "Turn":
        return self

    def __exit__(self, *_: object) -> None:
        self.end()


def newest(receipts: Path, system: int) -> Newest:
    """What the newest receipt of a vehicle in that folder is: while that stays, no upload to it began or ended."""
    found = ((number_in(path), _outcome(path, system)) for path in receipts.glob(f"*{RECEIPT}"))
    return max((one for one in found if one[1]), default=NONE_YET)


def _outcome(path: Path, system: int) -> str:
    """What a receipt says became of its upload; "" for another vehicle's, and one that can't be read."""
    try:
        data = from_json(read_small(path))
        return str(data["outcome"]) if data["vehicle"]["system"] == system else ""
    except (OSError, ValueError, KeyError, TypeError):
        return ""
