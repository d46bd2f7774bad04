"""The receipt of an upload: values before, targets, values after, and how each was verified.

The receipt is on the disk before the first write, with the outcome BEGUN, and is replaced at the end. If the ground
station stops in between, the BEGUN receipt shows that the upload is unfinished.

A lock allows a single upload to a vehicle at a time, among programs that share a folder of receipts. The operating
system releases it when its process is killed. On a disk without file locks, every program gets the turn; FF_ACTIVE is
checked on the vehicle in any case, before a commit and at the end.
"""

import contextlib
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from itertools import count
from pathlib import Path
from typing import Any, BinaryIO, Final

from bridge.clock import utc_text
from bridge.errors import ParamRejected
from bridge.files import open_own, read_small, sync_folder
from bridge.locks import try_lock
from bridge.plain import from_json, to_json
from gcs_plugin.params import float32
from gcs_plugin.params.files import replace_text, unwritten, write_parameters
from gcs_plugin.params.meaning import acting_text, unit_of
from gcs_plugin.params.plan import Plan, Verdict
from gcs_plugin.params.sidecar import Sidecar, sidecar_path, write_sidecar
from gcs_plugin.params.transfer import Outcome
from gcs_plugin.params.upload import Ending
from gcs_plugin.peers import Source

BEFORE: Final = "-before.param"
RECEIPT: Final = "-receipt.json"
WANTED: Final = "-wanted.param"
MOST_UPLOADS: Final = 2**53
"""A receipt with a larger number was not written by this program."""
_LARGEST_CRC: Final = 2**32 - 1
_LARGEST_SYSTEM: Final = 255
_UNTOUCHED: Final = (Outcome.SAME, Outcome.NOT_SENT)
_TIME = re.compile(r"\d{4}-\d\d-\d\dT\d{6}Z(-\d+)?")


@dataclass(frozen=True, slots=True)
class Line:
    """Line of a receipt, for a parameter; `after` is the last independent read-back, None if there was none."""

    name: str
    before: float | None
    target: float
    after: float | None
    outcome: Outcome
    sentence: str

    def cells(self) -> tuple[str, ...]:
        """Texts of a table's cells, in the order of RESULT_COLUMNS."""
        before, after = (acting_text(self.name, value) for value in (self.before, self.after))
        became = "read back equal" if self.outcome is Outcome.APPLIED else self.sentence
        return self.name, unit_of(self.name), before, after, became


RESULT_COLUMNS: Final = ("name", "unit", "before", "now", "what became of it")


@dataclass(frozen=True)
class Receipt:
    """Record of an upload.

    `active_crc` is the CRC of the staged set that was to fly, None without a commit; `restores` is the -before.param
    that a roll back went back to, "" for any other upload; `number` counts the uploads of a folder and gives their
    order, whatever the clock was set to; `unkept` says why the receipt on the disk differs from this one, "" if it is
    the same.
    """

    outcome: Outcome
    sentence: str
    system: int
    component: int
    lines: tuple[Line, ...]
    preimage: Path
    active_crc: int | None
    started_utc: str
    took_s: float
    restores: str = ""
    number: int = 0
    unkept: str = ""

    @property
    def good(self) -> bool:
        """Whether the vehicle holds the targets."""
        return self.outcome in (Outcome.APPLIED, Outcome.SAME)

    def cells(self, plan: Plan) -> list[tuple[str, ...]]:
        """Texts of the lines that the plan changes or puts in force."""
        names = plan.changes | plan.staged
        return [line.cells() for line in self.lines if line.name in names]

    def to_json(self) -> dict[str, Any]:
        """The receipt as `--json` writes it; missing and non-finite numbers become null."""
        return {
            "outcome": self.outcome.name.lower(),
            "sentence": self.sentence,
            "vehicle": {"system": self.system, "component": self.component},
            "parameters": [
                asdict(line) | {"unit": unit_of(line.name), "outcome": line.outcome.name.lower()}
                for line in self.lines
            ],
            "preimage": str(self.preimage),
            "active_crc": self.active_crc,
            "started_utc": self.started_utc,
            "took_s": round(self.took_s, 3),
            "restores": self.restores,
            "number": self.number,
            **({"unkept": self.unkept} if self.unkept else {}),
        }


def begin(
    plan: Plan,
    vehicle: Source,
    preimage: Path,
    active_crc: int | None,
    unix_s: float,
    restores: str = "",
    sidecar: Sidecar | None = None,
) -> Receipt:
    """Write the files with which a later run can finish the upload or roll it back, and return the BEGUN receipt.

    The files are the values before, the values to write with their sidecar (not for a roll back), and the receipt. If
    the name `preimage` is taken by another upload, the next free number is used; the receipt has the name. Raises
    ParamUnwritten if they can't be written: then nothing may be sent, and none of the files is left behind, for they
    would look like an upload.
    """
    started_utc = utc_text(unix_s)
    begun = dict.fromkeys((Verdict.CHANGED, Verdict.STAGED), Outcome.BEGUN)
    outcomes = {**begun, Verdict.SAME: Outcome.SAME}
    lines = tuple(
        Line(row.name, row.present, row.target, None, outcomes.get(row.verdict, Outcome.NOT_SENT), "")
        for row in plan.rows
    )
    values = {line.name: line.target for line in lines if line.outcome is not Outcome.NOT_SENT}
    preimage = _claimed(preimage)
    wanted = path_of(preimage, WANTED)
    try:
        words = f"what vehicle {vehicle[0]}, component {vehicle[1]} held before an upload, {started_utc}"
        write_parameters(preimage, plan.present, (words,), *vehicle)
        if values and not restores:
            write_parameters(wanted, values, (f"what was to be written, {started_utc}",), *vehicle)
            if sidecar is not None:
                write_sidecar(wanted, sidecar)
        receipt = Receipt(
            Outcome.BEGUN,
            Outcome.BEGUN.value,
            *vehicle,
            lines,
            preimage,
            active_crc,
            started_utc,
            0.0,
            restores,
            next_number(preimage.parent),
        )
        _keep(receipt)
    except BaseException:
        _take_away(preimage, wanted, sidecar_path(wanted), path_of(preimage, RECEIPT))
        raise
    return receipt


def finish(begun: Receipt, plan: Plan, ending: Ending, took_s: float) -> Receipt:
    """Replace the BEGUN receipt of an upload by its final receipt, and return that.

    A receipt that can't be written raises nothing, since the result on the vehicle matters more: `unkept` then gives
    the reason, and the receipt on the disk still says BEGUN.
    """
    results = [(row, ending.results[row.name]) for row in plan.rows]
    lines = tuple(
        Line(row.name, row.present, row.target, result.seen, result.outcome, result.sentence)
        for row, result in results
    )
    receipt = replace(begun, outcome=ending.outcome, sentence=ending.sentence, lines=lines, took_s=took_s)
    try:
        _keep(receipt)
    except ParamRejected as error:
        again = f"`seatrial params {'rollback' if receipt.restores else 'upload'}`"
        why = f"its receipt still says that it was begun: {error}, or free disk space; the same {again} once more "
        return replace(receipt, unkept=why + "then writes down what the vehicle holds")
    wanted = path_of(receipt.preimage, WANTED)
    _take_away(wanted, sidecar_path(wanted))
    return receipt


def _take_away(*paths: Path) -> None:
    for path in paths:
        with contextlib.suppress(OSError):  # a file left behind does no harm: it is only no longer needed
            path.unlink()


def new_preimage(folder: Path, unix_s: float) -> Path:
    """Path of the pre-image of an upload that begins at `unix_s`; `begin` adds a number if the name is taken."""
    return folder / f"{datetime.fromtimestamp(unix_s, UTC):%Y-%m-%dT%H%M%SZ}{BEFORE}"


def _claimed(preimage: Path) -> Path:
    """Create the pre-image file, empty, and return its path; the next free number if it or its receipt exists.

    The file is created exclusively, so that two uploads that begin at the same time get different files. Raises
    ParamUnwritten if no file can be created.
    """
    tail = BEFORE if preimage.name.endswith(BEFORE) else preimage.suffix
    stem, claimed = preimage.name.removesuffix(tail), preimage
    try:
        claimed.parent.mkdir(parents=True, exist_ok=True)
        for number in count(2):
            with contextlib.suppress(FileExistsError):
                if not path_of(claimed, RECEIPT).exists():
                    claimed.touch(exist_ok=False)
                    break
            claimed = preimage.with_name(f"{stem}-{number}{tail}")
    except OSError as error:
        raise unwritten(preimage, error) from None
    return claimed


def path_of(preimage: Path, kind: str) -> Path:
    """Path of another file of the same upload, by its suffix `kind`: RECEIPT, for example."""
    return preimage.with_name(preimage.name.removesuffix(BEFORE) + kind)


def _keep(receipt: Receipt) -> None:
    path = path_of(receipt.preimage, RECEIPT)
    replace_text(path, to_json(receipt.to_json(), indent=2) + "\n")
    sync_folder(path.parent)
    sync_folder(path.parent.parent)  # the folder of receipts may be new too


@dataclass(frozen=True, slots=True)
class PastUpload:
    """A receipt as read back: `targets` are those of all its lines, `written` of the lines that say BEGUN.

    `wrote` names the lines that it wrote or put in force, or may have. `system` is the vehicle's.
    """

    preimage: Path
    number: int
    outcome: Outcome
    restores: str
    targets: Mapping[str, float]
    written: Mapping[str, float]
    active_crc: int | None
    wrote: frozenset[str] = frozenset()
    system: int = 1

    @property
    def time(self) -> str:
        """Time at which it was begun, as in its file names."""
        return self.preimage.name.removesuffix(BEFORE)


def kept_in(receipts: Path, system: int | None = None) -> list[PastUpload]:
    """The receipts in a folder, of one vehicle or of all, by number: a clock may be set back, a number never is.

    Unreadable receipts are left out, and so are receipts with a number that none of ours has.
    """
    kept = (_read(path, system) for path in receipts.glob(f"*{RECEIPT}"))
    return sorted(filter(None, kept), key=lambda receipt: (receipt.number, receipt.time))


def receipt_of(preimage: Path) -> PastUpload | None:
    """The receipt that lies next to a -before.param; None without one that can be read."""
    return _read(path_of(preimage, RECEIPT), None)


def next_number(receipts: Path) -> int:
    """Number for the next receipt in a folder."""
    return min(1 + max((kept.number for kept in kept_in(receipts)), default=0), MOST_UPLOADS)


def _read(path: Path, system: int | None) -> PastUpload | None:
    time = path.name.removesuffix(RECEIPT)
    if not _TIME.fullmatch(time):
        return None
    try:
        data: Any = from_json(read_small(path))
        its_system = _whole(data["vehicle"]["system"], _LARGEST_SYSTEM)
        if system not in (None, its_system):
            return None
        crc, lines = data.get("active_crc"), data.get("parameters", ())
        targets = {str(line["name"]): float32.rounded(line["target"]) for line in lines}
        outcomes = {str(line["name"]): Outcome[line["outcome"].upper()] for line in lines}
        begun = {name for name, outcome in outcomes.items() if outcome is Outcome.BEGUN}
        return PastUpload(
            path.with_name(time + BEFORE),
            _whole(data["number"], MOST_UPLOADS),
            Outcome[data["outcome"].upper()],
            str(data.get("restores") or ""),
            targets,
            {name: value for name, value in targets.items() if name in begun},
            None if crc is None else _whole(crc, _LARGEST_CRC),
            frozenset(name for name, outcome in outcomes.items() if outcome not in _UNTOUCHED),
            its_system,
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None


def _whole(number: Any, most: int) -> int:
    if isinstance(number, bool) or not isinstance(number, int) or not 0 <= number <= most:
        raise ValueError(f"no whole number from 0 to {most}")
    return number


Newest = tuple[int, Outcome | None]
"""Number and outcome of a vehicle's newest receipt; (0, None) if it has none."""

NONE_YET: Final[Newest] = (0, None)


def newest(receipts: Path, system: int) -> Newest:
    """Number and outcome of a vehicle's newest receipt in a folder; unchanged while no upload begins or ends."""
    kept = kept_in(receipts, system)
    return (kept[-1].number, kept[-1].outcome) if kept else NONE_YET


class Turn:
    """Exclusive right to upload to MAVLink system `system`, held from construction until `close`.

    `read_at` is the result of `newest` at the time the vehicle was read, None to skip that check. Raises ParamRejected
    if another program has the turn, or has had it since the vehicle was read.
    """

    def __init__(self, receipts: Path, system: int, read_at: Newest | None = None) -> None:
        self._file: BinaryIO | None = None
        with contextlib.suppress(OSError):
            receipts.mkdir(parents=True, exist_ok=True)
            self._file = open_own(receipts / f".vehicle-{system}.lock")
        try:
            if self._file is not None and not try_lock(self._file.fileno()):
                raise ParamRejected(
                    f"another upload or roll back to vehicle {system} is under way: nothing was sent; wait for its "
                    "end, then look at the vehicle again"
                )
            if read_at is not None and newest(receipts, system) != read_at:
                raise ParamRejected(
                    f"another program wrote to vehicle {system} since it was read: nothing was sent; look at it again"
                )
        except ParamRejected:
            self.close()
            raise

    def close(self) -> None:
        if self._file is not None:
            self._file.close()
            self._file = None
