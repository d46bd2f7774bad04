"""Fly: the vehicle flies a plan by itself, which is then identified, and uploaded in shadow.

The verb `calibrate` does all of it: without `--armed` it answers with the plan, with it it flies.
"""

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import compress
from pathlib import Path
from typing import ClassVar, Final

from textual.app import ComposeResult
from textual.containers import VerticalScroll

from bridge import exit_codes
from bridge.errors import ConfigError
from bridge.flight.limits import FlightLimits, load_limits
from bridge.reports import FLIGHT, SAID
from bridge.schema import build
from bridge.vehicle.coefficients import DAMPINGS, MASSES
from gcs_plugin.flying.run import per_cent
from gcs_plugin.watch.picture import Picture
from tui.app.drawing import Lines, Span, hanging, heading, number, stacked
from tui.app.jobs import Jobs, JobState, job_lines
from tui.app.keys import Action, bindings
from tui.app.next_step import Flight
from tui.app.screens.frame import Drawn, StationScreen
from tui.app.screens.overlays import AskScreen, FormScreen
from tui.app.screens.parameters_transfer import agrees
from tui.app.view import View, heard_of

PLAN, FLY = "calibrate plan", "calibrate"
"""Names of the jobs: PLAN asks for the plan, FLY flies it."""
WORD: Final = "FLY"
LIMITS, TO, MINUTES, KNOW = "limits", "to", "minutes", "know"
TITLES: Final = {
    LIMITS: "limit file",
    TO: "known to, per cent",
    MINUTES: "longest flight, minutes",
    KNOW: "parameters (empty: all)",
}
USUAL: Final = {LIMITS: "limits.yaml", TO: "3", MINUTES: "5", KNOW: ""}
NAMES: Final = tuple(coefficient.name for coefficient in (*MASSES, *DAMPINGS))
KNOWN, UNKNOWN = "●", "○"
WIDTH_CELLS: Final = 18
NOW_CELLS: Final = 30


@dataclass(frozen=True)
class Proposed:
    """A plan to be flown, as the verb answers it: the lengths in seconds of each manoeuvre's pieces, by its title.

    `sha256` is that of its file; `refused`: why it will not be flown, "" if it may.
    """

    plan: str
    file: str
    sha256: str
    manoeuvres: dict[str, tuple[float, ...]]
    limits: FlightLimits
    know: tuple[str, ...]
    asked_percent: float
    refused: str


def is_unchanged(proposed: Proposed) -> bool:
    """Whether the file still holds the plan that is shown: every planning into one folder writes the same file."""
    try:
        return hashlib.sha256(Path(proposed.file).read_bytes()).hexdigest() == proposed.sha256
    except OSError:
        return False


def mistakes(texts: Mapping[str, str]) -> dict[str, str]:
    """The fault of each text of the form."""
    wrong = {}
    try:
        load_limits(Path(texts[LIMITS].strip()))
    except ConfigError as error:
        wrong[LIMITS] = str(error)
    for name in (TO, MINUTES):
        if not _is_positive(texts[name]):
            wrong[name] = "give a number above 0"
    if unknown := [name for name in texts[KNOW].split() if name not in NAMES]:
        wrong[KNOW] = f"{' '.join(unknown)}: the parameters are {' '.join(NAMES)}"
    return wrong


def _is_positive(text: str) -> bool:
    try:
        return 0.0 < float(text) < math.inf
    except ValueError:
        return False


def proposed_lines(proposed: Proposed, cells: int) -> Lines:
    """The pieces, the limits, and the parameters asked for."""
    limits, seconds = proposed.limits, sum(map(sum, proposed.manoeuvres.values()))
    within = (
        f"depth {limits.shallowest_m:g} to {limits.deepest_m:g} m",
        f"{limits.altitude_m:g} m over the bottom" if limits.altitude_m else "altitude not measured",
        f"{limits.distance_m:g} m from the start",
        f"{limits.speed_m_s:g} m/s",
        f"tilt {limits.tilt_deg:g} deg",
        f"battery {limits.battery_v:g} V" if limits.battery_v else "battery not measured",
        f"{limits.time_s:g} s in all",
        f"{limits.link_s:g} s without a word from here",
    )
    longest = max(map(len, proposed.manoeuvres), default=0)
    pieces = (
        f"{title:<{longest}}  {' + '.join(f'{s:g}' for s in lengths)} s"
        for title, lengths in proposed.manoeuvres.items()
    )
    return (
        heading("ASKED FOR", "", cells),
        *hanging(f"{', '.join(proposed.know)} known to {proposed.asked_percent:g} %", "strong", cells),
        heading("LIMITS, held by the vehicle", "", cells),
        *hanging(", ".join(within), "strong", cells),
        heading(f"PLAN, {seconds:.0f} s at most, piece by piece", "", cells),
        *stacked(pieces, "plain", cells, hanging),
    )


def now_lines(picture: Picture, limits: FlightLimits, cells: int) -> Lines:
    """What the ground sees of that which the vehicle limits: values now, each with its limits."""
    depth_m, altitude_m, voltage_v = map(picture.newest, ("depth", "altitude", "voltage"))
    speed_m_s = math.hypot(*map(picture.newest, "uvw"))
    shown = (
        f"depth {number(depth_m, 2)} m, {limits.shallowest_m:g} to {limits.deepest_m:g}",
        f"speed {number(speed_m_s, 2)} m/s, {limits.speed_m_s:g} at most",
        f"altitude {number(altitude_m, 2)} m, {limits.altitude_m:g} at least",
        f"battery {number(voltage_v, 2)} V, {limits.battery_v:g} at least",
    )
    measured = (True, True, limits.altitude_m > 0, limits.battery_v > 0)
    return in_rows([(text, "strong") for text in compress(shown, measured)], NOW_CELLS, cells)


def flight_of(jobs: Jobs) -> Flight:
    """Where the flight stands that Fly plans and lets fly."""
    plan, flight = jobs.state(PLAN), jobs.state(FLY)
    if flight is not None and flight.runs:
        newest = next((report.of for report in reversed(flight.reports) if report.of != SAID), FLIGHT)
        return Flight.UNDER_WAY if newest == FLIGHT else Flight.WORKED_ON
    if plan is None or (flight is not None and flight.began_s > plan.began_s):
        return Flight.NONE
    if plan.done is None:
        return Flight.BEING_PLANNED
    return Flight.PLANNED if plan.done.code == exit_codes.DONE else Flight.NONE


def width_lines(known: Mapping[str, tuple[float, float]], cells: int) -> Lines:
    """The live intervals: half of each over the value, marked where it is as asked."""
    entries: list[Span] = []
    for name, (half, asked) in known.items():
        mark = KNOWN if half <= asked else UNKNOWN
        entries.append((f"{mark} {name} ± {per_cent(half, asked)}", "strong" if half <= asked else "plain"))
    return in_rows(entries, WIDTH_CELLS, cells)


def in_rows(entries: Sequence[Span], each: int, cells: int) -> Lines:
    """Entries of `each` cells, as many in a row as fit."""
    padded = [(f"{text:<{each}}", role) for text, role in entries]
    across = max(cells // each, 1)
    return tuple(tuple(padded[at : at + across]) for at in range(0, len(padded), across))


class FlyScreen(StationScreen):
    """The plan with its limits; during the flight the vehicle's activity, and the live intervals."""

    ACTIONS: ClassVar[tuple[Action, ...]] = (
        Action("fly.plan", "p", "Plan", "what would be flown; nothing is sent"),
        Action("fly.settings", "e", "Limits", "limit file, accuracy, time, parameters"),
        Action("fly.fly", "f", "Fly", "arms the vehicle and flies the plan; asks for a word", call="launch"),
        Action("fly.end", "x", "End", "the vehicle holds its place; again disarms it"),
        Action("fly.stop", "ctrl+r", "Stop planning", "plan no further", call="stop_planning"),
    )
    BINDINGS = bindings(ACTIONS)  # type: ignore[assignment]
    LEGEND: ClassVar[tuple[tuple[str, str], ...]] = (
        (KNOWN, "known as well as was asked"),
        (UNKNOWN, "not yet"),
    )

    _texts: Mapping[str, str] = USUAL
    _seen: object = None

    def body(self) -> ComposeResult:
        yield Drawn(self._top, id="fly-top")
        with VerticalScroll(id="fly-scroll", can_focus=False):
            yield Drawn(self._below, id="fly-below")

    def show(self, view: View) -> None:
        seen = self._flight, self._planning, self._obstacle
        if seen != self._seen:
            self._seen = seen
            self.refresh_bindings()
        super().show(view)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        plans = self.desk.jobs.runs(PLAN)
        if action in ("plan", "settings"):
            return not plans and not self.flies and bool(self._vehicle)
        if action == "stop_planning":
            return plans
        if action == "launch":
            return self._may_fly
        if action == "end":
            return self.flies
        return super().check_action(action, parameters)

    def begin(self) -> None:
        if self.check_action("plan", ()):
            self.action_plan()

    def action_plan(self) -> None:
        """Ask the verb for a plan; ask for its limits first where they can't be read."""
        if mistakes(self._texts):
            self.action_settings()
            return
        self.desk.jobs.start(PLAN, self._words)
        self.draw()

    def action_stop_planning(self) -> None:
        self.desk.jobs.cancel(PLAN)

    def action_settings(self) -> None:
        def keep(texts: Mapping[str, str]) -> None:
            self._texts = {name: text.strip() for name, text in texts.items()}
            self.action_plan()

        self.app.push_screen(FormScreen("What is flown", TITLES, self._texts, mistakes, keep))

    def action_end(self) -> None:
        self._station_app.action_end_flight()

    def action_launch(self) -> None:
        """Ask for the word, and let it fly."""
        system, proposed = self._system, self._proposed
        if not self._may_fly or system is None or proposed is None:
            return
        words = (*self._words, "--plan", proposed.file)

        def answered(typed: str | None) -> None:
            if typed is None:
                return
            if not agrees(typed, WORD):
                self.notify(f"'{typed}' is not {WORD}: nothing was sent", severity="warning")
            elif other := self._is_other(system, proposed):
                self.notify(f"nothing was sent: {other}", severity="error")
            else:
                self.desk.jobs.start(FLY, (*words, "--system", str(system), *self.desk.way, "--armed"))

        title = f"Type {WORD} to arm vehicle {system} and let it fly; keep a hand on the sticks"
        self.app.push_screen(AskScreen(title, "begins the countdown"), answered)

    def _is_other(self, system: int, proposed: Proposed) -> str:
        """What is no longer as it was when the word was asked for; "" if all is."""
        if self._obstacle:
            return self._obstacle
        if self._system != system:
            return "another vehicle is heard"
        limits = mistakes(self._texts) or load_limits(Path(self._texts[LIMITS])) != proposed.limits
        others = limits or self._proposed != proposed or not is_unchanged(proposed)
        return "plan or limits are others by now; plan again" if others else ""

    @property
    def flies(self) -> bool:
        return self.desk.jobs.runs(FLY)

    @property
    def _stands(self) -> Flight:
        return flight_of(self.desk.jobs)

    @property
    def _flight(self) -> JobState | None:
        return self.desk.jobs.state(FLY)

    @property
    def _planning(self) -> JobState | None:
        """The plan that is being made, or the newest if it is one of these limits and this vehicle."""
        state = self.desk.jobs.state(PLAN)
        return state if state is not None and (state.runs or state.words == self._words) else None

    @property
    def _proposed(self) -> Proposed | None:
        state = self._planning
        if state is None or state.done is None:
            return None
        try:
            return build(Proposed, state.done.result, PLAN)
        except ConfigError:
            return None

    @property
    def _vehicle(self) -> str:
        """FILE[:CONFIGURATION], of the app or of the dive shown."""
        dive = self.desk.chosen()
        return self.desk.vehicle or (self.desk.vehicle_of(dive) if dive is not None else "")

    @property
    def _system(self) -> int | None:
        return heard_of(self.view.picture) if self.view is not None else None

    @property
    def _words(self) -> tuple[str, ...]:
        """The command line that answers with a plan."""
        texts = self._texts
        know = ("--know", *texts[KNOW].split()) if texts[KNOW] else ()
        words = ("calibrate", "--limits", texts[LIMITS], "--vehicle", self._vehicle, "--to", texts[TO])
        folders = ("--out", str(self.desk.out), "--receipts", str(self.desk.receipts))
        return (*words, "--minutes", texts[MINUTES], *folders, *know)

    @property
    def _may_fly(self) -> bool:
        return self._proposed is not None and not self._obstacle

    @property
    def _obstacle(self) -> str:
        """Why nothing can be flown now; "" if a plan may."""
        if not self._vehicle:
            key = self._station_app.key_of_action("vehicle.name")
            return f"no vehicle file is known{'' if self.view_only else f'; {key} says which'}"
        if self.flies:
            return "it flies already"
        if self._system is None:
            return "no vehicle is heard"
        if self.view is None or not self.view.records:
            return "the flight goes by the recording, and none runs"
        if self.view.picture.twins:
            return self.view.picture.twins
        if not self.view.picture.flies:
            return "this vehicle says nothing of flying by itself; fly the plan by hand"
        proposed = self._proposed
        return proposed.refused if proposed is not None else ""

    def _top(self, cells: int, _: int) -> Lines:
        state = self._flight
        if state is not None and state.runs:
            return self._flying(state, cells)
        lines: Lines = ()
        if state is not None:
            lines = (*lines, *self._flown(state, cells))
        planning = self._planning
        if planning is not None and (planning.runs or planning.cancelled or self._proposed is None):
            lines = (*lines, *job_lines("plan", planning, self.desk.jobs.now_s(), cells))
        if self._obstacle:
            lines = (*lines, *hanging(self._obstacle, "warn", cells))
        return (*lines, *hanging(self._offer(), "quiet", cells))

    def _offer(self) -> str:
        """Sentence on the keys that begin something."""
        if self.view_only:
            return "This view only looks, and lets nothing fly."
        if key := self.key_of("fly.fly"):
            return f"[{key}] counts down, flies this, identifies it, and uploads it in shadow."
        key = self.key_of("fly.plan")
        plans = (
            f"[{key}] plans what tells its masses and dampings, within the limits of {self._texts[LIMITS]}; "
            f"nothing is sent before {WORD} is typed."
        )
        return plans if key and self._proposed is None else ""

    def _flying(self, state: JobState, cells: int) -> Lines:
        shown = tuple(report for report in state.reports if report.of != SAID)
        now = job_lines("calibrate", replace(state, reports=shown), self.desk.jobs.now_s(), cells)
        key = self.key_of("fly.end")
        if self._stands is not Flight.UNDER_WAY:
            ends = "" if self.view_only else f"; [{key}] ends that"
            return (*now, *hanging(f"The flight is over, and is being worked on{ends}.", "quiet", cells))
        end = "the recording, the pilot's sticks and every limit can still end it"
        if not self.view_only:
            end = f"[{key}] ends it: it holds its place; again disarms it. Any stick takes over"
        return (*now, *hanging(f"{end}.", "warn", cells))

    def _flown(self, state: JobState, cells: int) -> Lines:
        """How the last flight ended."""
        ended = job_lines("calibrate", state, self.desk.jobs.now_s(), cells)
        said = [report.words for report in state.reports if report.of == SAID]
        return (*ended, *(hanging(said[-1], "strong", cells) if said else ()))

    def _below(self, cells: int, _: int) -> Lines:
        state, proposed = self._flight, self._proposed
        lines: Lines = ()
        if state is not None:
            if self._stands is Flight.UNDER_WAY and proposed is not None and self.view is not None:
                now = now_lines(self.view.picture, proposed.limits, cells)
                lines = (heading("NOW, and its limits", "", cells), *now)
            known = next((r.values for r in reversed(state.reports) if r.of == FLIGHT and r.values), {})
            if known:
                title = heading("KNOWN, half of the 95 % interval", "", cells)
                lines = (*lines, title, *width_lines(known, cells))
            said = [report.words for report in reversed(state.reports) if report.of == SAID]
            sentences = stacked(said, "plain", cells, hanging)
            lines = (*lines, heading("SAID, the newest first", "", cells), *sentences)
        if proposed is None or self.flies:
            return lines
        plan = proposed_lines(proposed, cells)
        return (*plan, *lines) if self._stands is Flight.PLANNED else (*lines, *plan)
