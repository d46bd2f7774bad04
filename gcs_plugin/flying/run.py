"""Flies a plan until enough is known: which piece is next, when to stop, and how it ended."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final, Protocol

from bridge.flight.flight import BLIND, End, State
from bridge.flight.limits import FlightLimits
from bridge.text import beyond
from gcs_plugin.flying.crew import Crew
from gcs_plugin.flying.plan import FlightPlan, Piece

UNHEARD_S: Final = 60.0
"""A vehicle unheard for so long after its own limits have ended the flight is given up."""
DESERTED_S: Final = 15.0
"""A companion that is silent beside its beating autopilot for so long is dead, and not on a link that loses much."""
WORDS_S: Final = 1.5
"""The pieces of a long text come within a moment; one whose last piece is lost is told at the next heartbeat."""

Widths = Mapping[str, float]
"""Half of the 95 % interval over the value, by the name of a coefficient."""


class Identifying(Protocol):
    """Identifies the recording so far, during the flight."""

    def ask(self) -> None:
        """Begin, if it is not at work."""

    @property
    def busy(self) -> bool:
        """Whether an answer is still to come."""

    def answer(self) -> Widths | None:
        """The answer that has come since the last call, None if none has."""


@dataclass(frozen=True)
class Wanted:
    """The coefficients to be known, each to `share` of its value (half of the 95 % interval, given the thrust), or to
    that of `each`."""

    names: tuple[str, ...]
    share: float
    each: Widths = field(default_factory=dict)

    def width(self, name: str) -> float:
        return self.each.get(name, self.share)

    def missing(self, widths: Widths) -> dict[str, float]:
        """Those that are not known to the width asked for: how many times as wide each is, inf where unknown."""
        times = {name: widths.get(name, math.inf) / self.width(name) for name in self.names}
        return {name: wide for name, wide in times.items() if not wide <= 1.0}


@dataclass(frozen=True)
class Progress:
    """Where a flight is: the share of its pieces that is flown, the vehicle's activity in words, the last widths."""

    share: float
    words: str
    widths: Widths


@dataclass
class Outcome:
    """How a flight went: `widths` of its last identification, `known_s` after take-off if all is known."""

    end: End = End.NONE
    words: str = ""
    pieces: int = 0
    flown_s: float = 0.0
    known_s: float = math.nan
    seconds: float = 0.0
    widths: Widths = field(default_factory=dict)

    @property
    def all_known(self) -> bool:
        return math.isfinite(self.known_s)


class PlanFlight:
    """One flight of a plan. `step` until `over`; `key` is the end key: it holds, and pressed again it disarms.

    `tell` gets a sentence at each turn of the flight, `follow` its progress whenever that has changed.

    A flight that is finished is over once all that it flew is identified, which may take longer than the flight.
    """

    def __init__(
        self,
        crew: Crew,
        plan: FlightPlan,
        limits: FlightLimits,
        wanted: Wanted,
        identifying: Identifying,
        tell: Callable[[str], None] = lambda _: None,
        follow: Callable[[Progress], None] = lambda _: None,
    ) -> None:
        self.outcome = Outcome()
        self.over = False
        self._crew, self._plan, self._limits = crew, plan, limits
        self._wanted, self._identifying, self._tell = wanted, identifying, tell
        self._follow, self._progress = follow, Progress(0.0, "", {})
        self._left = list(plan.pieces)
        self._flown: Piece | None = None
        self._unasked = self._finishing = self._keyed = self._disarming = self._landed = False
        self._begun_s = self._took_off_s = crew.clock.boot_s()
        self._was: tuple[State, str] = (State.IDLE, "")

    def begin(self, countdown_s: float) -> None:
        self._crew.session.begin(self._limits, self._plan.depth_m, countdown_s)

    def key(self) -> None:
        """The end key."""
        if self._keyed:
            # Asked anew by each key: the one before may have gone unanswered, and been given up.
            self._disarming = True
            self._crew.session.disarm()
        else:
            self._keyed = True
            self._crew.session.stop()

    def step(self) -> None:
        """Record, hear, judge and ask."""
        self._crew.step()
        now_s = self._crew.clock.boot_s()
        self._tell_state()
        if not self._keyed and (fault := self._crew.fault):
            self._tell(fault)
            self.key()
        widths = self._identifying.answer()
        if widths is not None:
            self._weigh(widths, now_s)
        if not self._landed:
            self._go_on(now_s)
        self.over = self._landed and not self._concludes() and not self._listens(now_s)
        progress = self._where()
        if progress != self._progress:
            self._progress = progress
            self._follow(progress)

    def _where(self) -> Progress:
        words = self._activity()
        if self._landed and not self.over and not self._crew.session.refused:
            words = "lies still; what it flew is identified"
        return Progress(self.outcome.pieces / len(self._plan.pieces), words, self.outcome.widths)

    def _activity(self) -> str:
        session, flown = self._crew.session, self._flown
        left_s = session.heard.left_s if session.heard is not None else 0.0
        return DOES[session.state].format(left_s, flown.name if flown is not None else "")

    def _go_on(self, now_s: float) -> None:
        """Ask for the next piece, or end a flight that is over."""
        session = self._crew.session
        if session.idle and session.state is State.GOING:
            self._piece_over()
        if session.over:
            self._end(now_s)
        elif now_s - max(session.heard_s, self._begun_s) > DESERTED_S and self._crew.deserted:
            session.fail(
                "the companion is not heard any more, and the autopilot is, which disarms by itself: start the "
                "companion again"
            )
            self._end(now_s)
        elif now_s - max(session.heard_s, self._begun_s) > UNHEARD_S + self._limits.link_s:
            session.fail("the vehicle is not heard any more; if it still runs, it goes back by itself")
            self._end(now_s)
        elif session.ready and not self._keyed and not self._finishing:
            self._next()

    def _concludes(self) -> bool:
        """Whether the identification of all that was flown is still to come."""
        if self._keyed or self.outcome.end is not End.FINISHED or self.outcome.all_known:
            return False
        self._ask()
        return self._identifying.busy

    def _listens(self, now_s: float) -> bool:
        """Whether words on a refusal may still come: a long text comes in pieces, after the refusal itself."""
        return self._crew.session.refused and now_s - self._begun_s < self.outcome.seconds + WORDS_S

    def _weigh(self, widths: Widths, now_s: float) -> None:
        self.outcome.widths = widths
        missing = self._wanted.missing(widths)
        self._tell(known_so_far(widths, self._wanted))
        if not missing and not self.outcome.all_known:
            self.outcome.known_s = now_s - self._took_off_s
            if not self._finishing and not self._keyed and not self._crew.session.over:
                self._finish("all that was asked for is known; it goes back")

    def _next(self) -> None:
        """Fly the first piece that tells the widest of the missing coefficients, or go back where none is left."""
        self._piece_over()
        self._ask()
        missing = self._wanted.missing(self.outcome.widths)
        useful = [piece for piece in self._left if missing.keys() & {*piece.coefficients}]
        if useful:
            piece = max(useful, key=lambda piece: max(missing.get(name, 0.0) for name in piece.coefficients))
            self._left.remove(piece)
            self._flown = piece
            self._tell(f"flies {piece.name}")
            self._crew.session.fly(piece.legs)
        else:
            self._finish("the plan is flown; it goes back")

    def _piece_over(self) -> None:
        """Count the piece that was flown, and identify at once, while the vehicle goes back to its station."""
        if self._flown is not None:
            self.outcome.pieces += 1
            self.outcome.flown_s += self._flown.duration_s
            self._flown, self._unasked = None, True
            self._ask()

    def _ask(self) -> None:
        """Identify the recording so far, where that is worth it."""
        if self._unasked and not self._identifying.busy:
            self._identifying.ask()
            self._unasked = False

    def _finish(self, words: str) -> None:
        self._finishing = True
        self._tell(words)
        self._crew.session.finish()

    def _end(self, now_s: float) -> None:
        """The vehicle holds or lies still: disarm it where it began, or wait."""
        session = self._crew.session
        end = End.NONE if session.heard is None else session.heard.end
        self.outcome.end, self.outcome.words = end, session.words
        self.outcome.seconds = now_s - self._begun_s
        if session.failure or session.state is State.IDLE:
            self._landed = session.idle or bool(session.failure)
        elif end not in (End.KEY, *BLIND):
            self._disarm()

    def _disarm(self) -> None:
        if not self._disarming:
            self._disarming = True
            self._crew.session.disarm()

    def _tell_state(self) -> None:
        session = self._crew.session
        now = (session.state, session.words)
        if now == self._was:
            return
        if self._was[0] is State.COUNTDOWN and now[0] is State.GOING:
            self._took_off_s = self._crew.clock.boot_s()
        self._was = now
        if session.state in TURNS:
            self._tell(f"{self._activity()}{f': {session.words}' if session.words else ''}")


DOES: Final = {
    State.IDLE: "lies still",
    State.COUNTDOWN: "counts down: {:.0f} s",
    State.GOING: "goes to its station",
    State.WAITING: "waits on its station",
    State.FLYING: "flies {1}: {0:.0f} s left",
    State.RETURNING: "goes back to where it began",
    State.HOLDING: "holds its place, disarms in {:.0f} s",
}
TURNS: Final = {State.COUNTDOWN, State.RETURNING, State.HOLDING}
"""Activities that are worth a sentence when they begin."""


def per_cent(width: float, asked: float) -> str:
    """A width in two digits, or with as many more as it takes to read on its side of the width asked for."""
    text = f"{100 * width:.2g}" if width < 0.995 else f"{100 * width:.0f}"
    reads_known = float(text) <= 100 * asked + 1e-9
    return f"{text if reads_known == (width <= asked) else beyond(100 * width, 100 * asked)} %"


def known_so_far(widths: Widths, wanted: Wanted) -> str:
    """The live intervals in a line, each with its mark where it is known as asked."""
    shown = (
        f"{name} ± {per_cent(widths[name], wanted.width(name))}"
        f"{'' if widths[name] <= wanted.width(name) else ' (not yet)'}"
        if math.isfinite(widths.get(name, math.inf))
        else f"{name} unknown"
        for name in wanted.names
    )
    return f"known so far: {', '.join(shown)}"
