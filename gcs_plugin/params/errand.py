"""Upload of a parameter file to a vehicle as a non-blocking state machine: read, compare, write.

    READING (every parameter) -> AGREE (the plan is ready; `agreed` goes on) -> WRITING -> ENDED

Pure: `tick` returns the messages to send, `on_message` takes the messages that arrived, and the caller is free to do
other work in between. `client.ParameterClient` does the same for a caller that has a link to itself and can wait.
"""

from dataclasses import dataclass, replace
from enum import Enum, auto
from typing import Any, Final

from bridge.parameters import set_crc
from gcs_plugin.params.client import GONE_S, message_of, not_raised
from gcs_plugin.params.deadline import Timing
from gcs_plugin.params.listing import Listing, ReadIndex, ReadList
from gcs_plugin.params.plan import Plan, make_plan, taken_back
from gcs_plugin.params.sidecar import Wanted
from gcs_plugin.params.transfer import ReadValue, SetValue, Source
from gcs_plugin.params.upload import Ending, Upload

READ_WITHIN_S: Final = 30.0
AGREE_WITHIN_S: Final = 120.0
"""Values read longer ago than this may have changed on the vehicle, so it is read again."""


class Step(Enum):
    """Stage of an errand."""

    READING = auto()
    AGREE = auto()
    WRITING = auto()
    ENDED = auto()


@dataclass(frozen=True, slots=True)
class Told:
    """State of the vehicle at an instant.

    `armed`; `silent_s`, the time since its last frame; `fault`, why it must not be sent orders, "" if it may;
    `off_ordered`, whether another program has ordered OFF meanwhile.
    """

    armed: bool
    silent_s: float
    fault: str
    off_ordered: bool = False


class Errand:
    """Reads the component `source` and, once `agreed`, brings it to the values of `wanted`.

    `going_back`: a roll back, which never raises the feed-forward's mode. `failure` says why the errand ended before
    its plan was carried out, "" if it did not; `ending` says how the upload ended; `back` lists the effects that are
    set to 0 since the new model lacks them.
    """

    def __init__(
        self,
        source: Source,
        wanted: Wanted,
        start_s: float,
        timing: Timing | None = None,
        *,
        going_back: bool = False,
    ) -> None:
        self.source = source
        self._going_back = going_back
        self.step = Step.READING
        self.failure = ""
        self.plan: Plan | None = None
        self.back: tuple[str, ...] = ()
        self._wanted = wanted
        self._timing = timing or Timing()
        self._listing = Listing(source, start_s, replace(self._timing, deadline_s=READ_WITHIN_S))
        self._read_s = start_s
        self._upload: Upload | None = None
        self._even_armed = False

    @property
    def progress(self) -> tuple[str, int, int]:
        """Name of the stage, number done, total."""
        if self._upload is not None:
            return (self._upload.stage.value, *self._upload.progress)
        return "reading", len(self._listing.values), self._listing.count or 0

    @property
    def ending(self) -> Ending | None:
        """How the upload ended, None before that."""
        return None if self._upload is None else self._upload.ending

    @property
    def active_crc(self) -> int | None:
        """CRC of the set that is to fly in the end, None if no set is committed."""
        return self._upload.crc if self._upload is not None and self._upload.commits else None

    def code(self, armed: bool) -> str:
        """Confirmation code of the plan: number of lines that it writes or puts in force, and the CRC of their names
        and values; prefixed with "armed-" for an armed vehicle.
        """
        assert self.plan is not None
        lines = self.plan.changes | self.plan.staged
        return f"{'armed-' if armed else ''}{len(lines)}-{set_crc(lines):06x}"

    def rehearsed(self, now_s: float) -> Upload:
        """The upload of the plan as it would begin now: says whether it writes anything or needs a disarmed vehicle."""
        assert self.plan is not None
        return Upload(self.plan, self.source, now_s, self._timing, set_crc)

    def is_old(self, now_s: float) -> bool:
        """Whether the values were read too long ago for the plan to be carried out."""
        return now_s - self._read_s > AGREE_WITHIN_S

    def choose(self, names: tuple[str, ...]) -> None:
        """Narrow the plan to the named lines. Raises ParamUnknown for a name that is not in it."""
        assert self.plan is not None
        self.plan = self.plan.chosen(names)

    def agreed(self, now_s: float, even_armed: bool = False) -> None:
        """Start carrying out the plan, also on an armed vehicle if `even_armed`.

        Raises ParamRejected or ParamUnknown for a plan that can't be sent.
        """
        assert self.plan is not None
        self.plan.check()
        self._even_armed = even_armed
        self._upload = self.rehearsed(now_s)
        self.step = Step.WRITING if self._upload.ending is None else Step.ENDED

    def stop(self, sentence: str, now_s: float) -> bool:
        """Stop and roll back the staged values; False from the commit on, when only the vehicle can still refuse."""
        if self._upload is None:
            self._fail(sentence)
            return True
        self._upload.abort(sentence, now_s)
        return self._upload.stage.name not in ("COMMIT", "LIVE")

    def tick(self, now_s: float, told: Told) -> list[Any]:
        """The messages to send now."""
        sends: list[ReadList | ReadIndex | ReadValue | SetValue] = []
        if self.step is Step.READING:
            sends += self._listing.tick(now_s)
            self._read_on(now_s, told)
        elif self._upload is not None and self.step is Step.WRITING:
            if told.armed and self._upload.needs_disarmed and not self._even_armed:
                self._upload.abort("the vehicle was armed during the upload", now_s)
            if told.off_ordered:
                self._upload.overrule(now_s)
            sends += self._upload.tick(now_s)
            gone = f"nothing came from the vehicle for {GONE_S:.0f} s" if told.silent_s >= GONE_S else ""
            trouble = told.fault or gone
            if trouble and self._upload.ending is None:
                # Send no further write: it would reach another vehicle too, or nobody.
                self._upload.give_up(f"{trouble}; {self._upload.left_behind}")
            if self._upload.ending is not None:
                self.step = Step.ENDED
        return [] if self.step is Step.ENDED else [message_of(send, self.source) for send in sends]

    def on_message(self, message: Any, source: Source, now_s: float, rebooted: bool) -> None:
        """A message arrived; `rebooted`: it shows that its sender has rebooted."""
        if rebooted and source == self.source:
            if self.step is Step.READING:
                self._listing.on_reboot(now_s)
            elif self._upload is not None:
                self._upload.on_reboot(now_s)
        kind = message.get_type()
        if kind == "PARAM_VALUE" and self.step is Step.READING:
            name, value = message.param_id, message.param_value
            self._listing.on_value(name, value, message.param_index, message.param_count, source, now_s)
        elif kind == "PARAM_VALUE" and self._upload is not None:
            self._upload.on_value(message.param_id, message.param_value, source, now_s)
        elif kind == "PARAM_ERROR" and self._upload is not None:
            self._upload.on_error(message.param_id, message.error, source, now_s)

    def _read_on(self, now_s: float, told: Told) -> None:
        system, component = self.source
        if told.fault:
            self._fail(told.fault)
        elif self._listing.complete:
            present = self._listing.values
            back = taken_back(self._wanted.values, present) if self._wanted.whole else {}
            self.back = tuple(back)
            values = {**self._wanted.values, **back}
            self.plan = make_plan(not_raised(values, present) if self._going_back else values, present)
            self._read_s, self.step = now_s, Step.AGREE
        elif self._listing.done and self._listing.count is None:
            self._fail(
                f"vehicle {system}, component {component} sent no parameter within {READ_WITHIN_S:.0f} s; "
                "check that the bridge runs"
            )
        elif self._listing.done:
            self._fail(
                f"{len(self._listing.missing)} of {self._listing.count} parameters of vehicle {system} did not come "
                f"within {READ_WITHIN_S:.0f} s; better the link and try again"
            )

    def _fail(self, sentence: str) -> None:
        self.failure, self.step = sentence, Step.ENDED
