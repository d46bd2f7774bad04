"""State file of the running recording, which holds the links: written once a second, for all programs of this user.

A second recording, begun on other links, has a state file of its own, for programs that need its links or its dive.
"""

import math
import os
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from bridge import schema
from bridge.errors import ConfigError, LogError
from bridge.files import read_small, state_folder, write_whole
from bridge.plain import from_json, to_json

FRESH_S: Final = 10.0
FORGOTTEN_S: Final = 3600.0
"""A recording silent for longer is not taken as hung: its process number may belong to another process by then."""


def present_boot() -> str:
    """Identity of this computer's run since it was switched on, "" where the system has none."""
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError):
        return ""


@dataclass(frozen=True)
class HeardVehicle:
    """A vehicle's component that the recording heard, last at `heard_unix_s`; `holds` and `behind` as in
    `peers.KnownVehicle`."""

    system: int
    component: int
    holds: bool
    heard_unix_s: float
    behind: bool = False


@dataclass(frozen=True)
class Holding:
    """State of a running recording.

    `hub` is the address of its hub, "" without a hub; `disk_left_s` is inf if nothing arrives. `refused` counts the
    frames that a signed link rejected, by kind, "" for none; `trouble` is the advice if all frames of a system are
    rejected; `sign_key` is the key file, "" for none. `waiting` frames could not be written yet, for the reason
    `unwritten`, "" if all frames are in a file.
    `began_utc` is on the recording's clock, as its stamps are, which nobody sets; `set_by_s` is how far this computer's
    clock was set ahead of it since. `vehicles` are those that an OFF must go to. `written_monotonic_s` is by the clock
    that all programs of this computer share and nobody sets, None if unknown. `boot` as in `present_boot`.
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
    vehicles: tuple[HeardVehicle, ...] = ()
    written_monotonic_s: float | None = None
    boot: str = field(default_factory=present_boot)

    @property
    def lives(self) -> bool:
        """Whether its process runs: one of that number may be another's once the computer was switched on anew."""
        return self.boot == present_boot() and _lives(self.pid)

    def age_s(self, now_unix_s: float) -> float:
        """How long ago it was written, s: by the clock that nobody sets, where that is known."""
        if self.written_monotonic_s is None:
            return abs(now_unix_s - self.written_unix_s)
        return abs(time.monotonic() - self.written_monotonic_s)

    def own_unix_s(self, now_unix_s: float) -> float:
        """Present time on the recording's clock, Unix s."""
        return now_unix_s - self.set_by_s

    def lasted_s(self, now_unix_s: float) -> float:
        """Duration of its dive so far, s."""
        return self.own_unix_s(now_unix_s) - self.began_unix_s

    @property
    def began_unix_s(self) -> float:
        """Start time of its dive, Unix s; the time of the last state if `began_utc` can't be read."""
        try:
            began = datetime.fromisoformat(self.began_utc)
        except ValueError:
            return self.own_unix_s(self.written_unix_s)
        return (began if began.tzinfo else began.replace(tzinfo=UTC)).timestamp()


def state_file() -> Path:
    return state_folder() / "recording.json"


def write_holding(holding: Holding, *, second: bool = False) -> None:
    """Write the state file atomically; a `second` recording has a file of its own. Raises LogError if that fails."""
    file_of_second = _file_of_second(holding.pid)
    file = file_of_second if second else state_file()
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        write_whole(file, to_json(asdict(holding)))
        if not second:
            file_of_second.unlink(missing_ok=True)
    except OSError as error:
        raise LogError(
            f"{file}: can't be written ({error.strerror}), so that nobody learns of the recording; check the disk"
        ) from None


def held(now_unix_s: float) -> Holding | None:
    """The running recording; None if its process has ended, or if its state is older than 10 s."""
    return _fresh(state_file(), now_unix_s)


def held_second(now_unix_s: float) -> list[Holding]:
    """Second recordings that run in addition to that of `held`; programs that name no link use the hub of `held`."""
    holdings = (_fresh(file, now_unix_s) for file in sorted(_files_of_seconds()))
    return [holding for holding in holdings if holding is not None]


def hung(now_unix_s: float, silent_s: float = FRESH_S) -> Holding | None:
    """The recording that hangs: its process runs and keeps its links, but its state is older than `silent_s`.

    None if there is none, or if the state is older than FORGOTTEN_S.
    """
    holding = _living(state_file())
    return holding if holding is not None and silent_s < holding.age_s(now_unix_s) <= FORGOTTEN_S else None


def hangs(holding: Holding) -> str:
    """Message to a user whose command needs a recording that hangs."""
    return f"the recording into {holding.folder} hangs and keeps its links: {how_to_end(holding.pid)}"


def how_to_end(process: int) -> str:
    """Advice to the crew on a recorder that hangs."""
    return f"end it with `kill -9 {process}` (what it wrote is kept), then begin another"


def was_killed(pid: int) -> bool:
    """Whether a recording was killed or crashed: a recording that ends in order removes its state."""
    states = (_read_state(file) for file in (state_file(), _file_of_second(pid)))
    return any(state is not None and state.pid == pid and not state.lives for state in states)


def release() -> None:
    """Remove the state files of this process, and those of second recordings that were killed."""
    for file in _files_of_seconds():
        state = _read_state(file)
        if state is None or state.pid == os.getpid() or not state.lives:
            file.unlink(missing_ok=True)
    holding = _read_state(state_file())
    if holding is not None and holding.pid == os.getpid():
        state_file().unlink(missing_ok=True)


def _file_of_second(pid: int | str) -> Path:
    return state_file().with_name(f"recording.{pid}.beside")


def _files_of_seconds() -> Iterator[Path]:
    return state_file().parent.glob(_file_of_second("*").name)


def _fresh(file: Path, now_unix_s: float) -> Holding | None:
    """The state in the file, None if its process has ended, or if it is older than FRESH_S."""
    holding = _living(file)
    return holding if holding is not None and holding.age_s(now_unix_s) <= FRESH_S else None


def _living(file: Path) -> Holding | None:
    """The state in the file, of any age; None if its process has ended."""
    holding = _read_state(file)
    return holding if holding is not None and holding.lives else None


def _read_state(file: Path) -> Holding | None:
    """The state in the file, of any age; None if the file is missing or damaged."""
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
    if pid <= 0:
        return False
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    try:
        stat = Path(f"/proc/{pid}/stat").read_bytes()
    except OSError:  # no Linux
        return True
    # A zombie has ended, but its parent has not asked for it yet. The state follows the program's name in brackets,
    # which may itself contain brackets.
    return stat.rpartition(b")")[2].split()[:1] not in ([b"Z"], [b"X"])
