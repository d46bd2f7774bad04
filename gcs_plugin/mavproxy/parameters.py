# SPDX-License-Identifier: GPL-3.0-or-later
"""`seatrial params`: compare, upload and roll back, spread over MAVProxy's idle moments."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from bridge.clock import Clock
from bridge.errors import ParamRejected, SeatrialError
from gcs_plugin.fleet import Fleet, News
from gcs_plugin.off_orders import OffOrders
from gcs_plugin.params.client import obstacle
from gcs_plugin.params.errand import AGREE_WITHIN_S, Errand, Step, Told
from gcs_plugin.params.files import check_system
from gcs_plugin.params.last_accepted import (
    COLUMNS,
    before_newest,
    belongs,
    compared,
    keep_accepted,
    last_accepted,
    told,
    unfinished,
)
from gcs_plugin.params.plan import (
    ACCEPT_IMPLAUSIBLE,
    Plan,
    Verdict,
    action_of,
    staging_notes,
    unit_of,
    value_text,
)
from gcs_plugin.params.plausible import implausible
from gcs_plugin.params.receipt import (
    NONE_YET,
    RECEIPT,
    Line,
    Newest,
    Receipt,
    Turn,
    begin,
    finish,
    lines_of,
    new_preimage,
    newest,
    path_of,
)
from gcs_plugin.params.sidecar import Wanted, unchecked, wanted_by
from gcs_plugin.params.transfer import Outcome

TELL_EVERY_S: Final = 2.0
FRESH_BEAT_S: Final = 3.0
DESPITE: Final = "despite-doubts"
ARMED: Final = "armed"
RECEIPTS: Final = Path("receipts")


@dataclass
class _Work:
    """An errand together with the command that was typed for it."""

    errand: Errand
    wanted: Wanted
    file: Path
    action: str
    names: tuple[str, ...]
    armed_said: bool
    began_unix_s: float
    told_s: float
    began_s: float = 0.0
    receipt: Receipt | None = None
    accepts: tuple[str, ...] = ()
    read_at: Newest = NONE_YET
    turn: Turn | None = None
    orders: OffOrders = field(default_factory=OffOrders)


class Parameters:
    """Runs at most one errand at a time. `say` shows the crew a line, `clock` gives the time."""

    def __init__(self, fleet: Fleet, clock: Clock, say: Callable[[str], None]) -> None:
        self._fleet, self._clock, self._say = fleet, clock, say
        self._work: _Work | None = None

    @property
    def busy(self) -> bool:
        """Whether parameters are being read or written."""
        return self._work is not None and self._work.errand.step in (Step.READING, Step.WRITING)

    def command(self, words: list[str]) -> bool:
        """Handle `params WORDS`; False for an unknown command. Raises SeatrialError."""
        match words:
            case ["diff", file]:
                self._begin("diff", Path(file), (), False, False)
            case ["upload", file, *names]:
                arguments, accepts = _parted(names)
                chosen = tuple(name for name in arguments if name != DESPITE)
                self._begin("upload", Path(file), chosen, DESPITE in arguments, False, accepts)
            case ["yes", code]:
                self._agree(code)
            case ["rollback", *arguments] if len(arguments) <= 2:
                files = [word for word in arguments if word != ARMED]
                if len(files) > 1:
                    return False
                before = Path(files[0]) if files else self._before()
                self._begin("rollback", before, (), True, ARMED in arguments)
            case _:
                return False
        return True

    def _before(self) -> Path:
        """File with the values held before the last upload that still stands, whoever made it."""
        return before_newest(RECEIPTS, self._fleet.meant(self._clock.boot_s())[0])

    def cancel(self) -> bool:
        """Stop the current errand; False if none is running."""
        if self._work is None:
            return False
        work, reading = self._work, self._work.errand.step in (Step.READING, Step.AGREE)
        if not work.errand.stop("stopped by the user", self._clock.boot_s()):
            self._say("params: what is written is being switched to and can't be stopped now")
        if reading:
            self._work = None
            self._say("params: stopped, nothing was written")
        return True

    def status(self) -> list[str]:
        """A line about the current errand, if any."""
        if self._work is None:
            return []
        if self._work.errand.step is Step.AGREE:
            errand = self._work.errand
            code = errand.code(self._fleet.armed(errand.source[0]))
            return [f"params: waits for `seatrial params yes {code}`"]
        return [f"params: {self._progress(self._work)}"]

    def on_news(self, news: News) -> None:
        """Handle a message that the errand may wait for."""
        if self._work is not None:
            now_s = self._clock.boot_s()
            self._work.errand.on_message(news.message, news.source, now_s, news.rebooted)

    def tick(self) -> list[Any]:
        """Return the messages to send now."""
        work = self._work
        if work is None or work.errand.step is Step.AGREE:
            return []
        now_s, errand = self._clock.boot_s(), work.errand
        was = errand.step
        messages = errand.tick(now_s, self._told(work, now_s))
        if was is Step.READING and errand.step is Step.AGREE:
            self._planned(work, now_s)
        elif errand.step is Step.ENDED:
            self._work = None
            if errand.failure:
                self._say(f"params: {errand.failure}; nothing was sent")
            else:
                self._receive(work)
        elif now_s - work.told_s >= TELL_EVERY_S:
            work.told_s = now_s
            self._say(f"params: {self._progress(work)}")
        return messages

    def _begin(
        self,
        action: str,
        file: Path,
        names: tuple[str, ...],
        doubts: bool,
        armed: bool,
        accepts: tuple[str, ...] = (),
    ) -> None:
        if self.busy:
            raise ParamRejected("parameters are being read or written; wait, or `seatrial cancel`")
        now_s = self._clock.boot_s()
        source = self._fleet.meant(now_s)
        wanted = wanted_by(file, doubts)
        check_system(file, wanted.system, source[0], "")
        for note in (
            wanted.notes if action == "rollback" else (*unchecked(file, wanted.sidecar), *wanted.notes)
        ):
            self._say(note)
        self._say(f"params: reading vehicle {source[0]}, component {source[1]}")
        errand = Errand(source, wanted, now_s, going_back=action == "rollback")
        self._work = _Work(
            errand, wanted, file, action, names, armed, self._clock.unix_s(), now_s, accepts=accepts
        )
        self._work.read_at = newest(RECEIPTS, source[0])

    def _planned(self, work: _Work, now_s: float) -> None:
        """Show the plan once it is made, and go on as far as is allowed without a further command."""
        errand = work.errand
        try:
            if work.names:
                errand.choose(work.names)
            if work.action != "rollback":
                self._judge(work)
            plan = errand.plan
            assert plan is not None
            if errand.back:
                back = ", ".join(errand.back)
                self._say(
                    f"note: effects accepted before are no part of this model and are taken back: {back}"
                )
            for line in staging_notes(plan.present):
                self._say(line)
            left = unfinished(RECEIPTS, errand.source[0])
            if left is not None and not belongs(left, work.file):
                for line in told(left, plan.present):
                    self._say(line)
            self._show(plan, work)
            if work.action == "diff":
                self._work = None
                return
            plan.check()
            rehearsed = errand.rehearsed(now_s)
            armed = self._refuse_acting(errand, rehearsed.needs_disarmed)
            # Values that the vehicle holds already need no confirmation, but a receipt: they too can be rolled back
            # or accepted.
            at_once = work.action == "rollback" and (work.armed_said or not armed)
            if at_once or rehearsed.ending is not None:
                self._write(work, armed)
                return
            again = (
                f"rollback {work.file} {ARMED}" if work.action == "rollback" else f"yes {errand.code(armed)}"
            )
            self._say(
                f"to {action_of(plan)} on vehicle {errand.source[0]}{', which is ARMED' if armed else ''}:"
            )
            self._say(f"    seatrial params {again}")
            if work.action == "rollback":
                self._work = None
        except SeatrialError as error:
            self._work = None
            self._say(str(error))

    def _judge(self, work: _Work) -> None:
        """Take implausible values out of the plan, except those that the user accepted by name."""
        errand, sidecar = work.errand, work.wanted.sidecar
        assert errand.plan is not None
        accepted = last_accepted(RECEIPTS, errand.source[0])
        doubted = implausible(errand.plan, sidecar.intervals if sidecar else {}, accepted, {})
        errand.plan = errand.plan.judged({n: why for n, why in doubted.items() if n not in work.accepts})

    def _agree(self, code: str) -> None:
        work, now_s = self._work, self._clock.boot_s()
        if work is None or work.errand.step is not Step.AGREE:
            raise ParamRejected("there is no plan to agree to; `seatrial params upload FILE` makes one")
        errand = work.errand
        said_armed = code == errand.code(True)
        if not said_armed and code != errand.code(False):
            raise ParamRejected(
                f"{code} is not the code of the plan shown, {errand.code(False)}; nothing was sent"
            )
        if errand.is_old(now_s):
            self._work = None
            raise ParamRejected(
                f"the plan is older than {AGREE_WITHIN_S:.0f} s and the vehicle may have changed; upload again"
            )
        if self._fleet.meant(now_s) != errand.source:
            self._work = None
            raise ParamRejected(
                f"the plan is for vehicle {errand.source[0]}, and another is meant now; upload again"
            )
        if self._refuse_acting(errand, errand.rehearsed(now_s).needs_disarmed) and not said_armed:
            raise ParamRejected(
                f"the vehicle is ARMED; to write all the same: seatrial params yes {errand.code(True)}"
            )
        self._write(work, said_armed)

    def _refuse_acting(self, errand: Errand, needs_disarmed: bool) -> bool:
        """Return whether the vehicle is armed. Raises ParamRejected if it would refuse these writes while armed."""
        assert errand.plan is not None
        armed = self._fleet.armed(errand.source[0])
        against = obstacle(errand.plan.present)
        if armed and needs_disarmed and against:
            raise ParamRejected(f"vehicle {errand.source[0]} {against} (`seatrial ff off`); nothing was sent")
        return armed

    def _write(self, work: _Work, even_armed: bool) -> None:
        errand, plan, now_s = work.errand, work.errand.plan, self._clock.boot_s()
        assert plan is not None
        if self._fleet.beat_age_s(errand.source, now_s) > FRESH_BEAT_S:
            raise ParamRejected(
                f"no HEARTBEAT of the vehicle for {FRESH_BEAT_S:.0f} s; nothing was sent, check the link"
            )
        work.began_unix_s, work.began_s = self._clock.unix_s(), now_s
        upload, back = errand.rehearsed(now_s), work.action == "rollback"
        work.turn = Turn(RECEIPTS, errand.source[0], work.read_at)
        try:
            work.receipt = begin(
                plan,
                errand.source,
                new_preimage(RECEIPTS, work.began_unix_s),
                upload.crc if upload.commits else None,
                work.began_unix_s,
                str(work.file) if back else "",
                None if work.names or back else work.wanted.sidecar,
            )
            errand.agreed(now_s, even_armed)
        except SeatrialError:
            work.turn.end()
            raise

    def _receive(self, work: _Work) -> None:
        """Show the result of an upload and save its receipt."""
        ending, plan = work.errand.ending, work.errand.plan
        assert ending is not None
        assert plan is not None
        assert work.receipt is not None
        before, took_s = work.receipt.preimage, self._clock.boot_s() - work.began_s
        lines = lines_of(plan, ending.results)
        rows: list[Sequence[str]] = [("name", "unit", "before", "now", "what became of it")]
        rows += [_became(line) for line in lines if line.name in plan.changes | plan.staged]
        for row in _aligned(rows) if len(rows) > 1 else []:
            self._say(row)
        self._say(f"params: {ending.outcome.value}: {ending.sentence}")
        receipt = finish(work.receipt, plan, ending, took_s)
        if work.turn is not None:
            work.turn.end()
        if receipt.unkept:
            self._say(f"values before: {before}")
            self._say(f"params: {receipt.unkept}")
            return
        self._say(f"receipt: {path_of(before, RECEIPT)}; values before: {before}")
        try:
            accepted = keep_accepted(receipt, work.wanted.sidecar, work.wanted.whole and not work.names)
            if accepted is not None:
                self._say(f"accepted: {accepted}")
        except ParamRejected as error:
            self._say(str(error))

    def _show(self, plan: Plan, work: _Work) -> None:
        hidden = (Verdict.READ_ONLY,) if work.action == "diff" else (Verdict.READ_ONLY, Verdict.SAME)
        sidecar, accepted = work.wanted.sidecar, last_accepted(RECEIPTS, work.errand.source[0])
        lines = compared(plan, sidecar.intervals if sidecar else {}, accepted)
        rows: list[Sequence[str]] = [
            COLUMNS,
            *(comparison.cells() for comparison in lines if comparison.row.verdict not in hidden),
        ]
        for line in _aligned(rows) if len(rows) > 1 else []:
            self._say(line)
        self._say(plan.summary())

    def _told(self, work: _Work, now_s: float) -> Told:
        source, fleet = work.errand.source, self._fleet
        system = source[0]
        silent_s, off = fleet.silent_s(source, now_s), work.orders.given(system)
        return Told(fleet.armed(system), silent_s, fleet.fault(system), off)

    @staticmethod
    def _progress(work: _Work) -> str:
        stage, done, total = work.errand.progress
        return f"{stage}, {done} of {total or 'an unknown number'}"


def _parted(names: list[str]) -> tuple[list[str], tuple[str, ...]]:
    """Split the words at the option that accepts implausible values: the words before it, the names after it."""
    if ACCEPT_IMPLAUSIBLE not in names:
        return names, ()
    place = names.index(ACCEPT_IMPLAUSIBLE)
    return names[:place], tuple(names[place + 1 :])


def _became(line: Line) -> tuple[str, ...]:
    before, after = ("-" if value is None else value_text(value) for value in (line.before, line.after))
    unit = unit_of(line.name)
    return (
        line.name,
        unit,
        before,
        after,
        "read back equal" if line.outcome is Outcome.APPLIED else line.sentence,
    )


def _aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Format a table: names and units aligned left, numbers right, text last."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join((*map(str.ljust, row[:2], widths), *map(str.rjust, row[2:-1], widths[2:-1]), row[-1]))
        for row in rows
    ]
