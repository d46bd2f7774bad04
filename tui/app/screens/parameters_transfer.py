"""The vehicle's parameters against a file's: the lines chosen, the confirmation to type, and the upload or rollback."""

import contextlib
import re
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from bridge.errors import ConfigError, ParamError
from bridge.exit_codes import NothingLeft
from bridge.files import written_ns
from bridge.schema import build
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.mode import ACTING
from gcs_plugin.params.comparison import Comparison
from gcs_plugin.params.last_accepted import last_accepted, vehicle_in
from gcs_plugin.params.plan import Verdict
from gcs_plugin.watch.picture import Armed, Picture
from tui.app.desk import Desk, values_of
from tui.app.jobs import JobState
from tui.app.view import STALE_S, heard_of

ARMED: Final = "ARMED"
DOUBTED: Final = "DOUBTED"

_WORD = re.compile(r"[A-Z]+|\d+")

IDENTIFY: Final = "identify"
READ, WRITE = "params diff", "params upload"
"""Names of the jobs: READ reads and compares; WRITE writes, for an upload as well as for a rollback."""
UNCHANGED: Final = ("+0.0 %", "-0.0 %")
"""Changes that a reader takes for none; where all are, no line is chosen."""
NO_RECORDING: Final = "the vehicle is read by way of its recording, and none runs: begin one first"
OLD_S: Final = 120.0
"""After this time the vehicle's values may have changed: read them again before asking for a confirmation."""


def needed(lines: int, *, armed: bool, doubted: bool) -> str:
    """Return the confirmation text, `7` or `ARMED 7`; with DOUBTED for an identification that did not converge."""
    return " ".join((*((ARMED,) if armed else ()), *((DOUBTED,) if doubted else ()), str(lines)))


def agrees(typed: str, asked: str) -> bool:
    """Whether the text confirms, in any order and in either case."""
    return sorted(_WORD.findall(typed.upper())) == sorted(asked.split()) and bool(typed.strip())


def comparison(data: Any) -> Comparison | None:
    """The comparison that a verb left, without lines that can only be read; None if it is missing or not a
    comparison."""
    try:
        read = build(Comparison, data, READ)
    except ConfigError:
        return None
    lines = (line for line in read.parameters if line.verdict != Verdict.READ_ONLY.value)
    return replace(read, parameters=tuple(lines))


class ParameterTransfer:
    """A file compared with the vehicle, or with `back` the values before the last upload compared with it.

    `shown` is the comparison that was read, None while there is none; `chosen` the names of the lines to write;
    `written` the running or finished write, until the vehicle is read again; `trouble` a sentence, "" for none;
    `system` the vehicle to read, None for the only one there is. A `picture` argument is the vehicle's newest picture,
    None before the first.
    """

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self.shown: Comparison | None = None
        self.chosen: set[str] = set()
        self.back = False
        self.trouble = ""
        self.written: JobState | None = None
        self.system: int | None = None
        self._taken: JobState | None = None
        self._read_of: tuple[Path, int] | None = None
        self._decided: tuple[tuple[Path, int] | None, dict[str, bool]] = (None, {})
        self._reads_back = False
        self._read_by = self._by

    @property
    def _by(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """The links by which a verb reaches the vehicle now."""
        return self._desk.way, self._desk.links()

    @property
    def reads(self) -> bool:
        return self._desk.jobs.runs(READ)

    @property
    def writes(self) -> bool:
        return self._desk.jobs.runs(WRITE)

    @property
    def unread(self) -> Path | None:
        """The file that could not be compared with a vehicle; None where it was, or is about to be."""
        compared = self.shown is not None or self.reads or self.back or not self.trouble
        return None if compared or self._read_of is None else self._read_of[0]

    def read(self, *, back: bool) -> None:
        """Compare the vehicle with the file, or with the values before the last upload; not during a write."""
        if self.writes:
            return
        if self.shown is not None and not self.back:
            self._decided = self._read_of, {name: name in self.chosen for name in self.shown.choosable}
        self.back, self.shown, self.written, self.trouble = back, None, None, ""
        if (
            not self.reads
        ):  # a running read goes on to its end; if it was for the other comparison, `take` starts again
            self._begin()

    def _begin(self) -> None:
        jobs = self._desk.jobs
        system = ("--system", str(self.system)) if self.system is not None else ()
        receipts = ("--receipts", str(self._desk.receipts), *system, *self._desk.way)
        self._read_by = self._by
        file = self._file()
        self._reads_back, self._taken = self.back, jobs.state(READ)
        if self.back:
            jobs.start(READ, ("params", "rollback", "--dry-run", *receipts))
        elif file is not None:
            self._read_of = (file, written_ns(file))
            jobs.start(READ, ("params", "diff", str(file), *receipts, *self._vehicle()))

    def _vehicle(self) -> tuple[str, ...]:
        """Option with the app's vehicle file but no configuration: results for any configuration may be sent."""
        vehicle = self._desk.vehicle
        with contextlib.suppress(ConfigError):  # the verb reports the error
            vehicle = str(load_vehicle(vehicle).path) if vehicle else ""
        return ("--vehicle", vehicle) if vehicle else ()

    def _file(self) -> Path | None:
        """The file that another screen put on the desk for the chosen dive, else the newest of the dive, else of its
        vehicle."""
        dive, param = self._desk.chosen(), self._desk.param
        if param is not None and (dive is None or param.parent == dive):
            return param
        return (values_of(dive) if dive is not None else None) or self._desk.values(dive)

    def take(self) -> bool:
        """Take the progress of the write and the result of a read; return whether a read has just ended."""
        self._take_written()
        state = self._desk.jobs.state(READ)
        if state is None or state.done is None or state is self._taken:
            return False
        self._taken = state
        if self._reads_back != self.back:
            self._begin()
            return False
        self.shown = comparison(state.done.result)
        if self.shown is None:
            if self.back and NothingLeft.__name__ in state.done.error_names:
                self._leave_back("no upload to this vehicle that stands is kept here")
            else:
                desk = self._desk
                unreachable = desk.record is not None and desk.recorded() is None
                self.trouble = NO_RECORDING if unreachable else state.done.why
            return True
        if self.back:
            # The file holds all of the vehicle's earlier values; lines that already agree are of no interest.
            entries = tuple(e for e in self.shown.parameters if e.changes or e.staged)
            if not entries:
                self._leave_back(f"the vehicle holds all of {self.shown.file} already")
                return True
            self.shown = replace(self.shown, parameters=entries)
        self.chosen = {line.name for line in self.shown.parameters if line.changes}
        if all(line.percent in UNCHANGED for line in self.shown.parameters if line.changes):
            self.chosen = set()
        stamp, decided = self._decided
        if not self.back and stamp == self._read_of:
            # The user's choices for this file, by name, survive a new read.
            self.chosen = {name for name in self.shown.choosable if decided.get(name, name in self.chosen)}
        return True

    def _leave_back(self, why: str) -> None:
        """Return to the file, and say why there is nothing to take back."""
        self.read(back=False)
        self.trouble = f"{why}: there is nothing to take back"

    def _take_written(self) -> None:
        if self.written is None or self.written.done is not None:
            return
        self.written = self._desk.jobs.state(WRITE)
        done, shown = (self.written.done if self.written is not None else None), self.shown
        if done is None or done.code or shown is None:
            return
        # The last accepted values have changed: to this upload, or to those before the upload taken back.
        vehicle = ""
        if self._read_of is not None:
            with contextlib.suppress(ParamError):
                vehicle = vehicle_in(self._read_of[0])
        now = last_accepted(self._desk.receipts, shown.vehicle.system, vehicle)
        values = {name: (accepted.value, accepted.time) for name, accepted in now.items()}
        entries = (
            replace(
                e, accepted=values.get(e.name, (None, ""))[0], accepted_at=values.get(e.name, (None, ""))[1]
            )
            for e in shown.parameters
        )
        self.shown = replace(shown, parameters=tuple(entries))

    def choose_all(self) -> None:
        """Choose all lines that change, or none if all of them were chosen."""
        everything = set(self.shown.changed) if self.shown is not None else set()
        self.chosen = set() if self.chosen == everything else everything

    def is_old(self, picture: Picture | None) -> bool:
        """Whether the comparison was read too long ago, or of another vehicle, or a write has followed it."""
        state = self._taken
        read_s = -OLD_S if state is None or state.ended_s is None else state.ended_s
        changed = self.shown is None or self.written is not None or bool(self._of_other(picture))
        return changed or self._desk.jobs.now_s() - read_s > OLD_S

    def _of_other(self, picture: Picture | None) -> str:
        """That another vehicle is shown by now than was read, "" if it is not: that one's state is not this one's."""
        heard = heard_of(picture) if picture is not None else None
        if self.shown is None or heard in (None, self.shown.vehicle.system):
            return ""
        return (
            f"vehicle {heard} is shown by now, and vehicle {self.shown.vehicle.system} was read: read it anew"
        )

    def stale_s(self, picture: Picture | None) -> float | None:
        """Age of the values that may be out of date: the vehicle is not heard, or they are older than OLD_S.

        None if they are fresh, or if they show the state before a write.
        """
        state, shown = self._taken, self.shown
        if (
            shown is None
            or state is None
            or state.ended_s is None
            or self.written is not None
            or picture is None
        ):
            return None
        age_s = self._desk.jobs.now_s() - state.ended_s
        links = [link for link in picture.links if link.system == shown.vehicle.system]
        heard = any(not link.lost and link.age_s <= STALE_S for link in links)
        return None if heard and age_s <= OLD_S else age_s

    def overtaken(self, picture: Picture | None) -> bool:
        """Whether the vehicle has since reported another set in force than when it was read or written."""
        shown, state, written = self.shown, self._taken, self.written
        if shown is None or state is None or picture is None or self.reads:
            return False
        flies, since_s = shown.active_crc, state.began_s
        if written is not None:
            if written.done is None or written.done.code or written.ended_s is None:
                return False  # the outcome of a failed write stays on screen
            flies, since_s = (written.done.result or {}).get("active_crc"), written.ended_s
        if None in (flies, picture.active_set) or picture.active_set == flies:
            return False
        reported_s = self._desk.jobs.now_s() - picture.active_set_age_s
        return reported_s > since_s and any(link.system == shown.vehicle.system for link in picture.links[:1])

    def has_newer(self) -> bool:
        """Whether values came that were not compared yet, as of an identification that has ended since; not while a
        write, its outcome, or a roll back is shown."""
        identified = self._desk.jobs.state(IDENTIFY)
        if self.reads or self.writes or self.back or self.written is not None:
            return False
        if identified is not None and not identified.answered:
            return False  # the file may be there, and what belongs to it may not
        file = self._file()
        return file is not None and (file, written_ns(file)) != self._read_of

    def armed(self, picture: Picture | None) -> bool:
        """Whether the vehicle is armed, by its newest HEARTBEAT, else by the comparison."""
        armed = picture.armed if picture is not None else Armed.UNKNOWN
        if armed is Armed.UNKNOWN:
            return self.shown is not None and self.shown.vehicle.armed
        return armed is not Armed.DISARMED

    def needed(self, picture: Picture | None) -> str:
        """Text to type as a confirmation."""
        shown = self.shown
        doubted = shown is not None and not self.back and (shown.doubted or bool(shown.accepted(self.chosen)))
        count = len(self.chosen) + (len(shown.staged) if shown is not None else 0)
        return needed(count, armed=self.armed(picture), doubted=doubted)

    def obstacle(self, picture: Picture | None, off_key: str) -> str:
        """Reason why nothing can be written now, "" if there is none; `off_key` forces the feed-forward off."""
        shown = self.shown
        if shown is None:
            return "nothing was read yet"
        if other := self._of_other(picture):
            return other
        if not self.chosen and not shown.staged:
            reason = "the vehicle holds all of it already" if not shown.choosable else "no line is chosen"
            return f"{reason}: there is nothing to write"
        if not self.back and (half := shown.half(self.chosen)):
            return half
        mode = picture.ff_mode if picture is not None else None
        acts = (shown.ff_mode if mode is None else mode) in ACTING
        if self.armed(picture) and shown.needs_disarmed and acts:
            return (
                "the vehicle is ARMED and its feed-forward acts on the thrusters: "
                f"force it off first, by {off_key}"
            )
        return ""

    def write(self, typed: str, picture: Picture | None) -> bool:
        """Write if the typed text is the confirmation needed now; return False if it must be typed again."""
        shown, asked = self.shown, self.needed(picture)
        if shown is None:
            return False
        if not agrees(typed, asked):
            self.trouble = f"'{typed}' is not '{asked}': nothing was sent"
            return False
        file = Path(shown.file)
        if not self.back and (file, written_ns(file)) != self._read_of:
            self.read(back=False)
            self.trouble = f"{shown.file} has changed since it was shown: nothing was sent; look again"
            return True
        if self._by != self._read_by:
            self.read(back=self.back)
            self.trouble = (
                "another link has been connected since the vehicle was read: nothing was sent; look again"
            )
            return True
        self.trouble = ""
        self._desk.jobs.start(WRITE, self._words(shown, armed=self.armed(picture)))
        self.written = self._desk.jobs.state(WRITE)
        return True

    def _words(self, shown: Comparison, *, armed: bool) -> tuple[str, ...]:
        """Command line that writes the chosen lines."""
        action = "rollback" if self.back else "upload"
        words = ["params", action, shown.file, "--yes", "--receipts", str(self._desk.receipts)]
        words += ["--system", str(shown.vehicle.system), *self._desk.way]
        words += ["--armed"] if armed else []
        if not self.back:
            words += self._vehicle()
            words += ["--despite-doubts"] if shown.doubted else []
            only = shown.only(self.chosen)
            words += ["--only", *only] if only else []
            accepted = shown.accepted(self.chosen)
            words += ["--accept-implausible", *accepted] if accepted else []
        return tuple(words)
