# SPDX-License-Identifier: GPL-3.0-or-later
"""`seatrial params`: compare, upload and roll back, spread over MAVProxy's idle moments."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from bridge.clock import Clock
from bridge.errors import ParamRejected, SeatrialError
from bridge.text import typed
from gcs_plugin.fleet import Fleet
from gcs_plugin.params.comparison import COLUMNS
from gcs_plugin.params.files import check_system
from gcs_plugin.params.last_accepted import newest_before
from gcs_plugin.params.plan import ACCEPT_IMPLAUSIBLE, Verdict, action_of
from gcs_plugin.params.proposal import Proposal, propose_rollback, propose_upload
from gcs_plugin.params.receipt import RESULT_COLUMNS, Newest, newest
from gcs_plugin.params.session import News, Session, Step
from gcs_plugin.params.wanted import Wanted, wanted_by

SHOW_EVERY_S: Final = 2.0
AGREE_WITHIN_S: Final = 120.0
"""Values read longer ago than this may have changed on the vehicle, so it is read again."""
DESPITE: Final = "despite-doubts"
ARMED: Final = "armed"
RECEIPTS: Final = Path("receipts")


@dataclass(frozen=True)
class _Typed:
    """A command: `names` are the lines to send, none for all; `armed`: the vehicle may be armed."""

    action: str
    file: Path
    names: tuple[str, ...] = ()
    accepts: tuple[str, ...] = ()
    despite_doubts: bool = False
    armed: bool = False


@dataclass
class _Running:
    """A session with the command that was typed for it; `plan` is None until the vehicle was read."""

    session: Session
    asked: _Typed
    wanted: Wanted
    read_at: Newest
    shown_s: float
    plan: Proposal | None = None


class Parameters:
    """Runs at most one session at a time. `say` shows the crew a line, `clock` gives the time."""

    def __init__(self, fleet: Fleet, clock: Clock, say: Callable[[str], None]) -> None:
        self._fleet, self._clock, self._say = fleet, clock, say
        self._work: _Running | None = None

    @property
    def busy(self) -> bool:
        """Whether parameters are being read or written."""
        return self._work is not None and self._work.session.busy

    def command(self, words: list[str]) -> bool:
        """Handle `params WORDS`; False for an unknown command. Raises SeatrialError."""
        match words:
            case ["diff", file]:
                self._begin(_Typed("diff", Path(file)))
            case ["upload", file, *names]:
                arguments, accepts = _split_accepts(names)
                chosen = tuple(name for name in arguments if name != DESPITE)
                self._begin(
                    _Typed("upload", Path(file), chosen, accepts, despite_doubts=DESPITE in arguments)
                )
            case ["yes", code]:
                self._agree(code)
            case ["rollback", *arguments] if len(arguments) <= 2:
                files = [word for word in arguments if word != ARMED]
                if len(files) > 1:
                    return False
                system, _ = self._fleet.meant(self._clock.boot_s())
                before = Path(files[0]) if files else newest_before(RECEIPTS, system)
                self._begin(_Typed("rollback", before, despite_doubts=True, armed=ARMED in arguments))
            case _:
                return False
        return True

    def cancel(self) -> bool:
        """Stop the current session; False if none is running."""
        if self._work is None:
            return False
        session = self._work.session
        if session.step is Step.WRITING:
            if not session.stop("stopped by the user"):
                self._say("params: what is written is being switched to and can't be stopped now")
        else:
            self._work = None
            self._say("params: stopped, nothing was written")
        return True

    def end(self) -> None:
        """End the current session at once and send nothing more; let other programs write to its vehicle."""
        work = self._work
        if work is not None and work.session.step is Step.WRITING:
            work.session.give_up("MAVProxy took this module out meanwhile; upload again or roll back")
            self._work = None
            self._show_receipt(work)
        else:
            self.cancel()

    def status(self) -> list[str]:
        """A line about the current session, if any."""
        work = self._work
        if work is None:
            return []
        if work.session.step is Step.IDLE and work.plan is not None:
            return [
                f"params: waits for `seatrial params yes {work.plan.plan.code(armed=work.session.armed)}`"
            ]
        return [f"params: {self._progress(work.session)}"]

    def on_news(self, news: News) -> None:
        """Handle a message that the session may wait for."""
        if self._work is not None:
            self._work.session.on_news(news)

    def tick(self) -> list[Any]:
        work = self._work
        if work is None or (work.session.step is Step.IDLE and work.plan is not None):
            return []
        session, now_s = work.session, self._clock.boot_s()
        messages = session.tick()
        if session.step is Step.IDLE:
            self._show_plan(work)
        elif session.step is Step.ENDED:
            self._work = None
            if session.failure is not None:
                self._say(f"params: {session.failure}")
            else:
                self._show_receipt(work)
        elif now_s - work.shown_s >= SHOW_EVERY_S:
            work.shown_s = now_s
            self._say(f"params: {self._progress(session)}")
        return messages

    def _begin(self, asked: _Typed) -> None:
        if self.busy:
            raise ParamRejected("parameters are being read or written; wait, or `seatrial cancel`")
        now_s, file = self._clock.boot_s(), asked.file
        source = self._fleet.meant(now_s)
        wanted = wanted_by(file, DESPITE, despite_doubts=asked.despite_doubts)
        check_system(file, wanted.system, source[0], "")
        self._say(f"params: reading vehicle {source[0]}, component {source[1]}")
        session = Session(self._fleet.peers, source, self._clock)
        session.read()
        read_at = newest(RECEIPTS, source[0])
        self._work = _Running(session, asked, wanted.narrowed(file, asked.names or None), read_at, now_s)

    def _show_plan(self, work: _Running) -> None:
        """Show the plan once the vehicle was read, and go on as far as is allowed without a further command."""
        asked, file = work.asked, work.asked.file
        session, system, back = work.session, work.session.vehicle[0], asked.action == "rollback"
        try:
            if back:
                plan = propose_rollback(file, work.wanted, session.present, RECEIPTS, system)
            else:
                names = asked.names or None
                plan = propose_upload(
                    file, work.wanted, session.present, names, RECEIPTS, system, asked.accepts
                )
            work.plan = plan
            for note in plan.notes:
                self._say(note)
            hidden = (Verdict.READ_ONLY,) if asked.action == "diff" else (Verdict.READ_ONLY, Verdict.SAME)
            self._say_table(COLUMNS, plan.cells(hidden))
            self._say(plan.plan.summary())
            if asked.action == "diff":
                self._work = None
                return
            plan.plan.check()
            session.check_armed(plan.plan, even_armed=True)
            # Values that the vehicle holds already need no confirmation, but a receipt: they too can be rolled back
            # or accepted.
            if (back and (asked.armed or not session.armed)) or not plan.writes(session.vehicle):
                self._write(work, session.armed)
                return
            self._say(
                f"to {action_of(plan.plan)} on vehicle {system}{', which is ARMED' if session.armed else ''}:"
            )
            again = typed("rollback", file, ARMED) if back else f"yes {plan.plan.code(armed=session.armed)}"
            self._say(f"    seatrial params {again}")
            if back:
                self._work = None
        except SeatrialError as error:
            self._work = None
            self._say(str(error))

    def _agree(self, code: str) -> None:
        work, now_s = self._work, self._clock.boot_s()
        if work is None or work.plan is None or work.session.step is not Step.IDLE:
            raise ParamRejected("there is no plan to agree to; `seatrial params upload FILE` makes one")
        plan, session = work.plan.plan, work.session
        said_armed = code == plan.code(armed=True)
        if not said_armed and code != plan.code(armed=False):
            raise ParamRejected(
                f"{code} is not the code of the plan shown, {plan.code(armed=False)}; nothing was sent"
            )
        if now_s - session.read_s > AGREE_WITHIN_S:
            self._work = None
            raise ParamRejected(
                f"the plan is older than {AGREE_WITHIN_S:.0f} s and the vehicle may have changed; upload again"
            )
        if self._fleet.meant(now_s) != session.vehicle:
            self._work = None
            raise ParamRejected(
                f"the plan is for vehicle {session.vehicle[0]}, and another is meant now; upload again"
            )
        session.check_armed(plan, even_armed=True)
        if session.armed and not said_armed:
            raise ParamRejected(
                f"the vehicle is ARMED; to write all the same: seatrial params yes {plan.code(armed=True)}"
            )
        self._write(work, said_armed)

    def _write(self, work: _Running, even_armed: bool) -> None:
        assert work.plan is not None
        unix_s = self._clock.unix_s()
        work.session.write(work.plan.order(RECEIPTS, unix_s, even_armed=even_armed, read_at=work.read_at))

    def _show_receipt(self, work: _Running) -> None:
        receipt, plan = work.session.receipt, work.plan
        assert receipt is not None
        assert plan is not None
        self._say_table(RESULT_COLUMNS, receipt.cells(plan.plan))
        receipt, lines = plan.settled(receipt)
        for line in filter(None, (*lines, receipt.unkept)):
            self._say(f"params: {line}")

    def _say_table(self, columns: tuple[str, ...], rows: list[tuple[str, ...]]) -> None:
        """Names and units aligned left, numbers right, text last; nothing for a table without rows."""
        table = [columns, *rows] if rows else []
        widths = [max(map(len, column)) for column in zip(*table, strict=True)]
        for row in table:
            numbers = map(str.rjust, row[2:-1], widths[2:-1])
            self._say("  ".join((*map(str.ljust, row[:2], widths), *numbers, row[-1])))

    @staticmethod
    def _progress(session: Session) -> str:
        progress = session.progress
        return f"{progress.words}, {progress.done} of {progress.total or 'an unknown number'}"


def _split_accepts(names: list[str]) -> tuple[list[str], tuple[str, ...]]:
    """Split the words at the option that accepts implausible values: the words before it, the names after it."""
    if ACCEPT_IMPLAUSIBLE not in names:
        return names, ()
    place = names.index(ACCEPT_IMPLAUSIBLE)
    return names[:place], tuple(names[place + 1 :])
