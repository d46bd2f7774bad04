"""The whole recording put into the folder of its dive: never while that is recorded, and with all that came since."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from bridge.errors import LogError
from bridge.wire.whole import WHOLE, lacked
from gcs_plugin.dives.folder import DiveFolder
from gcs_plugin.fetch.whole import Whole, made_whole, write_records
from gcs_plugin.locks import LOOK_EVERY_S, holder_of, is_written
from gcs_plugin.recording.state import Holding, held, held_beside, hung

CLOSED_WITHIN_S: Final = 3.0
"""How long to wait after the end of a dive for its files to be synced to disk and closed."""


def refuse_recorded(folder: DiveFolder, now_unix_s: float, again: str) -> None:
    """Raise LogError, ending with `again`, if a recorder still writes this dive.

    Frames that it wrote after the whole recording was made would never be read.
    """
    holding = held(now_unix_s) or hung(now_unix_s)
    if holding is not None and _is_of(holding, folder):
        raise LogError(
            f"{folder.path}: is still recorded, by process {holding.pid}; let that go on in the next dive "
            f"(`seatrial record --next`) or end it (`seatrial record --end`), and {again}"
        )
    if (second := next((hold for hold in held_beside(now_unix_s) if _is_of(hold, folder)), None)) is not None:
        raise _by_second(folder, second.pid, again)
    looks = round(CLOSED_WITHIN_S / LOOK_EVERY_S)
    while (written := next(filter(is_written, folder.heard()), None)) is not None and looks > 0:
        looks -= 1
        time.sleep(LOOK_EVERY_S)
    if written is None:
        return
    raise _by_second(folder, holder_of(written), again)


def remade(
    folder: DiveFolder, source: tuple[int, int], make: Callable[[Sequence[Path]], Whole], again: str
) -> Whole:
    """Apply `make` to the dive's recordings and put the result in the dive's folder; `source` as in `made_whole`.

    Raises LogError as `make` does, and if a recording grew meanwhile; the previous whole recording then stays
    unchanged.
    """
    before = _sizes(folder)
    renew(folder, source)
    made = make(folder.telemetry())
    if _sizes(folder) != before:
        raise LogError(
            f"{folder.path}: its recording grew meanwhile, so that somebody still records it; end that recording, and "
            f"{again}"
        )
    write_records(folder.path / WHOLE, made.records)
    return made


def renew(folder: DiveFolder, source: tuple[int, int]) -> Whole | None:
    """Add frames of the dive's other recordings to its whole one; None if that is missing or lacks nothing.

    Raises LogError as `made_whole` does.
    """
    whole = folder.path / WHOLE
    if not lacked([*folder.heard(), *folder.telemetry()]):
        return None
    made = made_whole(folder.heard(), [whole], source)
    write_records(whole, made.records)
    return made


def _is_of(holding: Holding, folder: DiveFolder) -> bool:
    return Path(holding.folder).resolve() == folder.path.resolve()


def _by_second(folder: DiveFolder, process: int | None, again: str) -> LogError:
    by = f" by process {process}," if process else ""
    return LogError(
        f"{folder.path}: is still recorded,{by} beside what `seatrial record --end` ends; end that recording where it "
        f"runs (Ctrl-C there; in MAVProxy `seatrial record stop`), and {again}"
    )


def _sizes(folder: DiveFolder) -> dict[Path, int]:
    return {path: path.stat().st_size for path in folder.heard() if path.is_file()}
