"""Who holds the links: the running recording, told to everyone of this user by a small file, written once a second.

One that was begun beside it, on other links, tells of itself in a file of its own, for who asks for its links or its
dive.
"""

import contextlib
import json
import math
import os
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from bridge import schema
from bridge.errors import ConfigError, LogError
from bridge.file_size import read_small
from bridge.new_file import whole
from bridge.plain import from_json

FRESH_S: Final = 10.0
FORGOTTEN_S: Final = 3600.0
"""What told nothing for so long is not waited for: its number may be another process's by then."""


@dataclass(frozen=True)
class HeardVehicle:
    """A component of a vehicle that the recording heard, last at `heard_unix_s`; `holds` where it told FF_MODE."""

    system: int
    component: int
    holds: bool
    heard_unix_s: float


@dataclass(frozen=True)
class Holding:
    """A recording that runs. `hub` is "" where it serves nobody; `disk_left_s` is inf where nothing comes.

    `refused` counts the frames that a signed link did not let in, by kind; "" for none.
    `waiting` frames could not be written yet, for the reason `unwritten`; "" where all that came is in a file.
    `taken_away` says what somebody moved or deleted of the dive, "" for nothing.
    `trouble` says what to do where nothing of a system is let in; `sign_key` is the file of the key, "" for none.
    `began_utc` is by the recording's own clock, which nobody sets, as its stamps are; `set_by_s` is how far this
    computer's clock was set ahead of that since. `vehicles` are those that an OFF is for, see `known_vehicles`.
    """

    pid: int
    hub: str
    links: tuple[str, ...]
    folder: str
    began_utc: str
    frames: int
    bytes: int
    lost: int
    disk_left_s: float
    notices: tuple[str, ...]
    written_unix_s: float
    refused: str = ""
    trouble: str = ""
    sign_key: str = ""
    unwritten: str = ""
    waiting: int = 0
    set_by_s: float = 0.0
    taken_away: str = ""
    vehicles: tuple[HeardVehicle, ...] = ()

    def own_unix_s(self, now_unix_s: float) -> float:
        """Now, by the recording's own clock."""
        return now_unix_s - self.set_by_s

    def lasted_s(self, now_unix_s: float) -> float:
        """For how long its dive is recorded."""
        return self.own_unix_s(now_unix_s) - self.began_unix_s

    @property
    def began_unix_s(self) -> float:
        """When its dive began; one that does not say has just begun."""
        try:
            began = datetime.fromisoformat(self.began_utc)
        except ValueError:
            return self.own_unix_s(self.written_unix_s)
        return (began if began.tzinfo else began.replace(tzinfo=UTC)).timestamp()


def state_file() -> Path:
    """Where it is told; the XDG base directory specification names the folder."""
    home = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
    return Path(home) / "seatrial" / "recording.json"


def write_holding(holding: Holding, *, second: bool = False) -> None:
    """Tell it, whole or not at all; of a `second` recording in a file of its own. Raises LogError where that can't be
    written."""
    data = asdict(holding)
    if not math.isfinite(holding.disk_left_s):
        data["disk_left_s"] = None
    own = _file_of_second(holding.pid)
    file = own if second else state_file()
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with whole(file) as made:
            made.write(json.dumps(data, allow_nan=False).encode())
        if not second:
            own.unlink(missing_ok=True)
    except OSError as error:
        raise LogError(
            f"{file}: can't be written ({error.strerror}), so that nobody learns of the recording; check the disk"
        ) from None


def held(now_unix_s: float) -> Holding | None:
    """The recording that runs; None where its process has gone, or has told nothing for 10 s."""
    holding = _told_within(now_unix_s, FRESH_S)
    return holding if holding is not None and _lives(holding.pid) else None


def held_beside(now_unix_s: float) -> list[Holding]:
    """The recordings that run beside the one that `held` tells of, by whose hub others go that name no link."""
    found = []
    with contextlib.suppress(OSError):
        for file in sorted(state_file().parent.glob(_file_of_second("*").name)):
            holding = _told_within(now_unix_s, FRESH_S, file)
            if holding is not None and _lives(holding.pid):
                found.append(holding)
    return found


def hung(now_unix_s: float, silent_s: float = FRESH_S) -> Holding | None:
    """The recording whose process is there and keeps its links, though it has told nothing for so long."""
    holding = _told_within(now_unix_s, FORGOTTEN_S)
    if holding is None or abs(now_unix_s - holding.written_unix_s) <= silent_s:
        return None
    return holding if _lives(holding.pid) else None


def hangs(holding: Holding) -> str:
    """The sentence for who would use a recording that hangs."""
    return f"the recording into {holding.folder} hangs and keeps its links: {how_to_end(holding.pid)}"


def how_to_end(process: int) -> str:
    """What a crew does with a recorder that hangs."""
    return f"end it with `kill -9 {process}` (what it wrote is kept), then begin another"


def release() -> None:
    """Take back what this process told, and what such recordings told that were killed."""
    for file in state_file().parent.glob(_file_of_second("*").name):
        told = _told(file)
        if told is None or told.pid == os.getpid() or not _lives(told.pid):
            with contextlib.suppress(OSError):
                file.unlink()
    holding = _told()
    if holding is not None and holding.pid == os.getpid():
        state_file().unlink(missing_ok=True)


def _file_of_second(pid: int | str) -> Path:
    return state_file().with_name(f"recording.{pid}.beside")


def _told_within(now_unix_s: float, age_s: float, file: Path | None = None) -> Holding | None:
    """What was told no longer ago, by either clock."""
    holding = _told(file)
    return holding if holding is not None and abs(now_unix_s - holding.written_unix_s) <= age_s else None


def _told(file: Path | None = None) -> Holding | None:
    """What the file says, of whatever age; None where it is absent, or says something else."""
    file = file or state_file()
    try:
        data = from_json(read_small(file))
    except (OSError, ValueError):
        return None
    if not isinstance(data, dict):
        return None
    endless = data.get("disk_left_s", 0.0) is None
    try:
        holding = schema.build(Holding, data | {"disk_left_s": 0.0} if endless else data, str(file))
    except ConfigError:
        return None
    return replace(holding, disk_left_s=math.inf) if endless else holding


def _lives(pid: int) -> bool:
    """Whether a process of that number runs."""
    if pid <= 0:
        return False
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return not _has_ended(pid)


def _has_ended(pid: int) -> bool:
    """Whether it has let go of all, and only its parent has not asked for its end yet; Linux alone tells."""
    try:
        stat = Path(f"/proc/{pid}/stat").read_bytes()
    except OSError:
        return False
    # The name before the state is the program's own choice, in brackets.
    return stat.rpartition(b")")[2].split()[:1] in ([b"Z"], [b"X"])
