"""An upload from plan to outcome: a pure state machine over transfers.

    STAGE (write and verify, confirm the unchanged values of the staged set) -> COMMIT (write the CRC to FF_COMMIT,
    read it back in FF_ACTIVE) -> LIVE (parameters that take effect at once: FF_MODE) -> done
    without COMMIT, and after LIVE -> WITHDRAW, for a plan that leaves no set in force -> done
    after a failure -> UNDO (restore and verify the values that were written) -> UNDO_COMMIT if the set was active:
    the old set, or FF_COMMIT 0 where none was in force -> done

STAGE to LIVE share a deadline, and rolling back has a separate deadline, so that a vehicle that reboots or does not
answer holds nobody up. A vehicle that answers nothing for `UNANSWERED_S` ends either phase at once.

The vehicle flies the old set until FF_ACTIVE is the new set's CRC, so a set is never half-applied. Just before the
commit, FF_ACTIVE must be the value that was read with the plan, or already the new CRC; otherwise another program has
written meanwhile. A commit that the vehicle neither accepted nor refused is left alone and reported as unverified: only
a later reading of FF_ACTIVE can settle it.

An applet takes a set out of force at its start alone, if the set's mark of the hull (FF_HULL) is not its own. The mark
was written and read back before, in STAGE. So in WITHDRAW the scripts are started anew, and again until FF_ACTIVE, read
once they had time to load, is 0. A restart that is late, or a reboot in its place, comes to the same.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import Final

from bridge.vehicle.parameters import ACTIVE, COMMIT, MODE, set_crc
from gcs_plugin.params import float32
from gcs_plugin.params.deadline import DEADLINE_S, QUIET_S, RoundTrips, deadline_s
from gcs_plugin.params.meaning import is_staged
from gcs_plugin.params.plan import HULL, Plan, Verdict
from gcs_plugin.params.transfer import (
    Outcome,
    RestartScripts,
    Result,
    Send,
    SetValue,
    Task,
    Transfer,
    confirm,
    write,
)
from gcs_plugin.peers import Source

UNANSWERED_S: Final = 20.0  # at 30 % loss each way and one attempt per second, once in a million
LOAD_S: Final = 5.0
"""For scripts to end and load: until then the autopilot answers for those before."""
LOADED_READ_S: Final = 5.0
OFF_WINS: Final = "OFF was ordered meanwhile and wins: FF_MODE is not raised"
OVERTAKEN: Final = "another program changed which set the vehicle flies since it was read"


class Stage(Enum):
    """Stage of an upload; the value is the word shown to the operator."""

    STAGE = "staging"
    COMMIT = "committing"
    LIVE = "switching"
    WITHDRAW = "taking the set out of force"
    UNDO = "rolling back"
    UNDO_COMMIT = "committing the old values"
    DONE = "done"


@dataclass(frozen=True)
class Ending:
    """How an upload ended: the outcome with a sentence, and the result of each parameter by name."""

    outcome: Outcome
    sentence: str
    results: Mapping[str, Result]


class Upload:
    """Brings one vehicle component from `plan.present` to the plan's targets, or back.

    Call `on_value`, `on_error` and `on_reboot` as messages arrive, and send the messages that `tick` returns, until
    `ending` is set.
    """

    def __init__(self, plan: Plan, source: Source, start_s: float = 0.0) -> None:
        self._plan, self._source = plan, source
        self._trips = RoundTrips()
        present, changes = plan.present, plan.changes
        self._commits = COMMIT in present and ACTIVE in present
        staged = [name for name in present if is_staged(name)] if self._commits else []
        self._old_set = {name: present[name] for name in staged}
        self._new_set = {name: changes.get(name, present[name]) for name in staged}
        self._crc_old, self._crc_new = (set_crc(s) if s else 0 for s in (self._old_set, self._new_set))
        if present.get(ACTIVE) == 0.0 and HULL not in present:
            self._crc_old = 0  # no applet's: FF_COMMIT 0 leaves no set in force
        self._live = {name: value for name, value in changes.items() if self._commits and name not in staged}
        self._direct = {name: value for name, value in changes.items() if name not in self._live}
        self._written: set[str] = set()
        self._committed = self._needs_commit = self._undoing = self._overruled = False
        self._checks_active = self._asked_to_commit = self._restarts = False
        self._undone: dict[str, Result] = {}
        self._results: dict[str, Result] = {}
        self._failure: Result | None = None
        self.ending: Ending | None = None
        self._answered_s = start_s
        self._withdraws = plan.withdraws and self._commits and present[ACTIVE] != 0.0
        tasks = len({*self._direct, *self._new_set}) + len(self._live) + 1
        self._end_s = start_s + max(DEADLINE_S, deadline_s(tasks))
        self._begin(start_s)

    @property
    def stage(self) -> Stage:
        return self._stage

    @property
    def progress(self) -> tuple[int, int]:
        """Tasks done and total: of staging, commit and live writes together, or of rolling back."""
        done, total = self._transfer.progress
        if self._undoing:
            return done, total
        staged = len(self._stage_tasks())
        done = staged if self._checks_active else done
        committed = staged + int(self._needs_commit)
        switched = committed + len(self._live)
        total = switched + int(self._withdraws)
        if self.ending is not None and self.ending.outcome in (Outcome.APPLIED, Outcome.SAME):
            return total, total
        earlier = {Stage.COMMIT: staged, Stage.LIVE: committed, Stage.WITHDRAW: switched}
        return earlier.get(self._stage, 0) + done, total

    @property
    def proven(self) -> dict[str, Result]:
        """Newest result so far of each parameter that changes, by name."""
        known = {**self._results, **self._undone, **self._transfer.results}
        return {name: result for name, result in known.items() if name in self._plan.changes}

    @property
    def left_behind(self) -> str:
        """Sentence about the state of the vehicle if the upload ended now, and about the remedy."""
        if not self._written:
            return "nothing was written"
        now = "values were written and not all read back"
        if self._commits and self._stage is Stage.STAGE:
            now = "values were staged and none of them flies"
        return f"{now}: mend that, then upload again or roll back to the values before"

    def unanswered_s(self, time_s: float) -> float:
        """Seconds since the vehicle's last answer."""
        return max(0.0, time_s - self._answered_s)

    @property
    def crc(self) -> int | None:
        """The CRC that FF_ACTIVE must hold in the end, 0 for no set; None for a vehicle that takes no sets."""
        return (0 if self._withdraws else self._crc_new) if self._commits else None

    def on_value(self, name: str, value: float, source: Source, time_s: float) -> None:
        self._answered(source, time_s)
        self._transfer.on_value(name, value, source, time_s)
        self._advance(time_s)

    def on_error(self, name: str, code: int, source: Source, time_s: float) -> None:
        self._answered(source, time_s)
        self._transfer.on_error(name, code, source)
        self._advance(time_s)

    def on_reboot(self, time_s: float) -> None:
        """The vehicle rebooted and may have lost its staged set: verify the whole set again."""
        self._answered_s = time_s
        if self._checks_active or self._stage in (Stage.COMMIT, Stage.LIVE):
            self._committed = self._asked_to_commit  # a set that is in force outlives a start
            self._enter_stage(time_s + self._trips.quiet_s)
        elif self._stage is Stage.WITHDRAW and self._plan.restarts_scripts:
            self._read_once_loaded(time_s)
        elif self._stage is Stage.UNDO_COMMIT:
            self._restore(time_s + self._trips.quiet_s)  # what was staged for it is lost
        elif self._stage is not Stage.DONE:
            self._transfer.on_reboot(time_s)

    def abort(self, sentence: str, time_s: float) -> None:
        """Stop and roll back, as when the vehicle was armed. Only during staging: later only the vehicle can refuse."""
        if self._stage is Stage.STAGE:
            self._transfer.abort(sentence)
            self._advance(time_s)

    def overrule(self, time_s: float) -> None:
        """Another program ordered OFF: write no mode but OFF, and never restore FF_MODE; all else goes on."""
        if not self._overruled:
            self._overruled = True
            if self._stage is Stage.UNDO and MODE in self._written:
                self._undo(time_s)  # anew without the mode, of which any write may be repeated
            self._give_way()
            self._advance(time_s)

    @property
    def needs_disarmed(self) -> bool:
        """Whether the upload changes more than the feed-forward's mode, which alone an armed vehicle may take."""
        return self._needs_commit or self._withdraws or bool(self._direct)

    def give_up(self, sentence: str) -> None:
        """End at once and send nothing more to the vehicle, as when the link is lost."""
        if self._stage is not Stage.DONE:
            self._transfer.abort(sentence)
            self._collect()
            self._end(Outcome.UNVERIFIED if self._written else Outcome.NOT_SENT, sentence)

    def tick(self, time_s: float) -> list[Send]:
        if self._stage is Stage.DONE:
            return []
        if self._trips.known and self._transfer.waits:
            self._answered_s = time_s  # a quiet period: no request is open
        if self.unanswered_s(time_s) >= UNANSWERED_S:
            self._transfer.abort(
                f"the vehicle has answered nothing for {UNANSWERED_S:.0f} s: the link may carry one way only, "
                "or what keeps its parameters has stopped"
            )
            self._answered_s = time_s
        sends: list[Send] = [*self._transfer.tick(time_s)]
        if self._restarts:
            self._restarts = False
            sends.append(RestartScripts())
        self._written.update(send.name for send in sends if isinstance(send, SetValue))
        self._advance(time_s)
        return sends

    def _begin(self, time_s: float) -> None:
        active = self._plan.present.get(ACTIVE)
        about_set = any(row.name in self._new_set for row in self._plan.rows)
        inactive = about_set and active is not None and not float32.same(active, float(self._crc_new))
        if self._plan.changes or self._withdraws or (inactive and not self._plan.withdraws):
            self._needs_commit = (
                self._commits and not self._plan.withdraws and (bool(self._direct) or inactive)
            )
            self._enter_stage(time_s)
            self._advance(time_s)
        else:
            self._stage, self._transfer = Stage.DONE, self._transfer_of([], time_s)
            self._end(Outcome.SAME, "the vehicle holds all of it already; nothing was written")

    def _answered(self, source: Source, time_s: float) -> None:
        if source == self._source:
            self._answered_s = time_s

    def _transfer_of(self, tasks: Iterable[Task], start_s: float) -> Transfer:
        # A transfer that begins too late still gets a short deadline, so that it ends with its own sentence.
        within_s = max(self._end_s - start_s, QUIET_S)
        return Transfer(tasks, self._source, start_s, within_s, self._trips)

    def _stage_tasks(self) -> list[Task]:
        tasks = [write(name, value) for name, value in self._direct.items()]
        if self._needs_commit:
            tasks += [confirm(n, v) for n, v in self._new_set.items() if n not in self._direct]
        return tasks

    def _enter_stage(self, time_s: float) -> None:
        self._stage, self._checks_active = Stage.STAGE, False
        self._transfer = self._transfer_of(self._stage_tasks(), time_s)

    def _advance(self, time_s: float) -> None:
        while self._stage is not Stage.DONE and self._transfer.done:
            self._collect()
            if self._stage is Stage.STAGE:
                self._after_check(time_s) if self._checks_active else self._after_staging(time_s)
            elif self._stage is Stage.COMMIT:
                self._after_commit(time_s)
            elif self._stage is Stage.LIVE:
                self._after_live(time_s) if self._transfer.succeeded else self._undo(time_s)
            elif self._stage is Stage.WITHDRAW:
                self._after_withdrawal(time_s)
            elif self._stage is Stage.UNDO:
                self._after_undo(time_s)
            else:
                self._end_undone(self._transfer.failure())

    def _collect(self) -> None:
        if self._stage in (Stage.STAGE, Stage.LIVE):
            self._results.update(self._transfer.results)
        if self._stage in (Stage.STAGE, Stage.COMMIT, Stage.LIVE, Stage.WITHDRAW):
            self._failure = self._transfer.failure()

    def _after_staging(self, time_s: float) -> None:
        if not self._transfer.succeeded:
            self._undo(time_s)
        elif not self._needs_commit:
            self._enter_live(time_s)
        elif self._asked_to_commit:
            self._enter_commit(time_s)  # rebooted after the commit: it may already fly the new set
        else:
            self._checks_active = True
            self._transfer = self._transfer_of([confirm(ACTIVE, self._plan.present[ACTIVE])], time_s)

    def _after_check(self, time_s: float) -> None:
        """FF_ACTIVE was read just before the commit: commit if it is still the old set or already the new one."""
        seen = self._transfer.results[ACTIVE].seen
        if self._transfer.succeeded or (seen is not None and float32.same(seen, float(self._crc_new))):
            self._enter_commit(time_s)
            return
        if seen is not None:
            self._failure = Result(Outcome.REFUSED, OVERTAKEN, seen)
        self._undo(time_s)

    def _enter_commit(self, time_s: float) -> None:
        self._checks_active, self._asked_to_commit = False, True
        task = Task(ACTIVE, float(self._crc_new), COMMIT)
        self._stage, self._transfer = Stage.COMMIT, self._transfer_of([task], time_s)

    def _after_commit(self, time_s: float) -> None:
        if self._transfer.succeeded:
            self._committed = True
            self._enter_live(time_s)
        elif self._failure is not None and self._failure.outcome is Outcome.UNVERIFIED:
            self._end(
                Outcome.UNVERIFIED,
                f"{self._failure.sentence}; the vehicle flies the new values if {ACTIVE} reads "
                f"{self._crc_new}, else the old: connect again and read it",
            )
        else:
            self._undo(time_s)

    def _enter_live(self, time_s: float) -> None:
        tasks = [write(name, value) for name, value in self._live.items()]
        self._stage, self._transfer = Stage.LIVE, self._transfer_of(tasks, time_s)
        self._give_way()

    def _give_way(self) -> None:
        """Once OFF was ordered, write no mode but OFF."""
        if self._overruled and self._stage is Stage.LIVE and self._live.get(MODE):
            self._transfer.abort(OFF_WINS)

    def _after_live(self, time_s: float) -> None:
        if self._withdraws:
            self._enter_withdraw(time_s)
        else:
            self._finish()

    def _enter_withdraw(self, time_s: float) -> None:
        self._stage, self._restarts = Stage.WITHDRAW, self._plan.restarts_scripts
        if self._restarts:
            self._read_once_loaded(time_s)
        else:
            self._transfer = self._transfer_of([Task(ACTIVE, 0.0, COMMIT)], time_s)

    def _read_once_loaded(self, time_s: float) -> None:
        """Read whether no set is in force, once scripts that start at `time_s` had time to load."""
        tasks, within_s = [confirm(ACTIVE, 0.0)], LOADED_READ_S + QUIET_S
        self._transfer = Transfer(tasks, self._source, time_s + LOAD_S, within_s, self._trips)

    def _after_withdrawal(self, time_s: float) -> None:
        if self._failure is None:
            self._finish()
            return
        was_aborted = self._failure.outcome is Outcome.NOT_SENT
        if self._plan.restarts_scripts and not was_aborted and time_s < self._end_s:
            self._enter_withdraw(time_s)
            return
        way = "connect again and roll back to the values before"
        if self._plan.restarts_scripts:
            way = "reboot the autopilot: no set is in force after its start, as before the upload"
        self._end(Outcome.UNVERIFIED, f"{self._failure.sentence}; {way}")

    def _undo(self, time_s: float) -> None:
        # A quiet period first, so that a write still under way can't arrive after the write that restores the value.
        start_s = time_s + self._trips.quiet_s
        self._undoing, self._checks_active = True, False
        self._end_s, self._answered_s = start_s + deadline_s(len(self._taken_back) + 1), start_s
        self._restore(start_s)

    def _restore(self, start_s: float) -> None:
        """Write the values from before, from `start_s` on."""
        tasks = [write(name, self._plan.present[name]) for name in self._taken_back]
        self._stage, self._transfer = Stage.UNDO, self._transfer_of(tasks, start_s)

    @property
    def _taken_back(self) -> list[str]:
        """The parameters that a roll back restores; once OFF was ordered, not the mode."""
        return sorted(n for n in self._written if n != COMMIT and not (n == MODE and self._overruled))

    def _after_undo(self, time_s: float) -> None:
        self._undone = dict(self._transfer.results)
        if self._committed and self._transfer.succeeded:
            task = Task(ACTIVE, float(self._crc_old), COMMIT)
            self._stage, self._transfer = Stage.UNDO_COMMIT, self._transfer_of([task], time_s)
        else:
            self._end_undone(self._transfer.failure())

    def _end_undone(self, trouble: Result | None) -> None:
        cause = self._failure.sentence if self._failure else "stopped"
        for name, result in self._undone.items():
            first = self._results.get(name)
            back = result.outcome is Outcome.APPLIED
            if not back:
                self._results[name] = Result(
                    Outcome.UNVERIFIED, f"not rolled back: {result.sentence}", result.seen
                )
            elif first is None or first.outcome is not Outcome.REFUSED:
                self._results[name] = Result(
                    Outcome.ROLLED_BACK, f"{name} is {result.seen:.9g} again", result.seen
                )
            else:
                self._results[name] = replace(first, seen=result.seen)
        if trouble is not None:
            again = "nor did it answer the roll back" if trouble.sentence == cause else ""
            again = again or f"and the roll back failed: {trouble.sentence}"
            flies = "what it flies was not changed; " if self._commits and not self._committed else ""
            self._end(
                Outcome.UNVERIFIED,
                f"{cause}; {again}; {flies}connect again and roll back to the values before",
            )
        elif self._undone and all(self._results[name].outcome is Outcome.REFUSED for name in self._undone):
            self._end(Outcome.REFUSED, f"{cause}; the vehicle took none of the values that were sent")
        elif self._undone:
            now = "every value that was written is back as it was"
            if self._committed and not float32.same(self._plan.present[ACTIVE], float(self._crc_old)):
                now = (
                    f"the staged values are back and active as set {self._crc_old}; no set of them was before"
                )
            if self._overruled and MODE in self._written:
                now = f"{now}, but for {MODE}: OFF was ordered meanwhile and wins"
            self._end(Outcome.ROLLED_BACK, f"{cause}; {now}")
        elif self._overruled and MODE in self._written:
            self._end(Outcome.UNVERIFIED, f"{cause}; read it from the vehicle")
        else:
            refused = self._failure is not None and self._failure.outcome is Outcome.REFUSED
            self._end(Outcome.REFUSED if refused else Outcome.NOT_SENT, f"{cause}; nothing was written")

    def _finish(self) -> None:
        parts = [
            f"{count} {kind}parameter{'s' if count != 1 else ''} {done}"
            for count, kind, done in (
                (len(self._plan.changes), "", "written and read back"),
                (len(self._plan.staged), "staged ", "read back"),
            )
            if count
        ]
        active = (f"set {self._crc_new} is active",) if self._needs_commit else ()
        if self._withdraws:
            active = ("no set is in force, as before the upload",)
        self._end(Outcome.APPLIED, ", ".join((*parts, *active)))

    def _end(self, outcome: Outcome, sentence: str) -> None:
        self._stage = Stage.DONE
        if outcome is not Outcome.APPLIED and (self._commits or self._undoing):
            # The values were read back from staging, but whether they fly is not known.
            for name, result in self._results.items():
                if result.outcome is Outcome.APPLIED:
                    staged = f"{result.sentence} was staged, and not seen in force"
                    self._results[name] = replace(result, outcome=Outcome.UNVERIFIED, sentence=staged)
        results = {}
        for row in self._plan.rows:
            if row.verdict is Verdict.SAME:
                results[row.name] = Result(Outcome.SAME, "it was so already", row.present)
            elif row.verdict in (Verdict.CHANGED, Verdict.STAGED):
                results[row.name] = self._results.get(row.name, Result(Outcome.NOT_SENT, "not sent", None))
            else:
                results[row.name] = Result(Outcome.NOT_SENT, row.reason, row.present)
        self.ending = Ending(outcome, sentence, results)
