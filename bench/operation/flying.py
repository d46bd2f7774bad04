"""A plan that the simulated vehicle flies by itself against the mission that a crew flies by hand: time to know enough.

The hand-flown mission is the paper's own of each configuration, identified as a whole; `seatrial fly` is asked for the
widest interval that it leaves of any mass or damping, and in another flight for each as well as it leaves it. The
flown vehicle is in simulated time, and its identifications take as long as they take on this computer, while it flies
on.
"""

import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from bench.campaigns import CONFIGURATIONS, VEHICLE
from bench.remembered import Data, Remembered
from bench.stamp import PAPERS_VEHICLE, reached, stamp
from bench.words import blocks, paragraph, percent, table
from bridge.clock import Clock
from bridge.flight.limits import FlightLimits
from bridge.links.link import Link
from bridge.onboard.parameters import parameters_of
from bridge.simulator.missions import mission_named
from bridge.vehicle.config import VehicleFile, load_vehicle
from bridge.vehicle.mode import Mode
from gcs_plugin import simulated
from gcs_plugin.flying.plan import FlightPlan, flight_plan
from gcs_plugin.flying.run import Outcome, PlanFlight, Wanted, Widths
from identify.planning.limits import START_DEPTH_M, Limits
from identify.planning.propose import NO_AIMS
from identify.run.plan import before_dives, plan
from identify.statistics import Z95
from tui.flight_recording import recorded_crew, widths_of

SOURCES = (reached("bench/operation/flying.py"), *PAPERS_VEHICLE)
LIMITS = FlightLimits(0.3, 4.0, 1.0, 6.0, 0.8, 25.0, 13.0, 900.0)
PLAN_S, EACH_PLAN_S = 300.0, 900.0
COUNTDOWN_S = 3.0
SEED = 8700
HEAD = ("configuration", "dives", "asked for", "by hand", "flown", "share", "back where it began")
EACH = "each as by hand"
KNOWN = 0.1
"""Coefficients that the mission by hand does not tell this well are not asked for."""


class InTurn:
    """Identifies at once, for a vehicle in simulated time: its answer comes as much later as the work took."""

    def __init__(
        self, dive: Path, file: VehicleFile, configuration: str, clock: Clock, wall_s: Callable[[], float]
    ) -> None:
        self._of, self._clock, self._wall_s = (dive, str(file.path), configuration), clock, wall_s
        self._held: tuple[float, Widths] | None = None
        self.took_s: list[float] = []

    def ask(self) -> None:
        began_s = self._wall_s()
        known = widths_of(*self._of)
        self.took_s.append(self._wall_s() - began_s)
        self._held = self._clock.boot_s() + self.took_s[-1], known

    @property
    def busy(self) -> bool:
        return self._held is not None

    def answer(self) -> Widths | None:
        """The answer, once its time has come."""
        if self._held is None or self._clock.boot_s() < self._held[0]:
            return None
        known, self._held = self._held[1], None
        return known


def page(cache: Path, dives: int) -> str:
    """The section of docs/benchmarks.md, of so many dives of each configuration."""
    kept = Remembered(cache / f"flying-{stamp(*SOURCES)}.jsonl")
    jobs = {f"{c} {n}": partial(measured, c, SEED + n) for c in CONFIGURATIONS for n in range(dives)}
    return words(kept.fill(jobs, "flying"))


def measured(configuration: str, seed: int) -> Data:
    """A hand-flown mission and flights until it is as well known: seconds of all, and their widths in per cent."""
    file = load_vehicle(f"{VEHICLE}:{configuration}")
    flown_plan = plan_of(file, Limits())
    mission = mission_named(configuration, file.vehicle.configurations[configuration])
    with tempfile.TemporaryDirectory() as folder:
        hand = simulated.record_dive(
            file, configuration, mission, Path(folder), seed=seed, unix_s=time.time(), mode=Mode.OFF
        )
        by_hand = widths_of(hand.path, str(file.path), configuration)
        widest = as_well(by_hand, flown_plan.coefficients)
        aims = {name: by_hand[name] / Z95 for name in widest.names}
        of_all = plan_of(file, Limits(), widest.names, EACH_PLAN_S, aims)
        flights = []
        for pieces, wanted in ((flown_plan, widest), (of_all, replace(widest, each=by_hand))):
            link, clock = simulated.afloat(file, configuration, seed, parameters_of(file, None))
            flights.append(
                flight(link, clock, file, configuration, pieces, wanted, Path(folder), time.monotonic)
            )
    (outcome, took_s), (of_each, _) = flights
    return figures(mission.duration_s, by_hand, widest, outcome, took_s) | {
        "each_known_s": of_each.known_s,
        "each_whole_s": of_each.seconds,
        "each": {name: of_each.widths.get(name, np.inf) for name in widest.names},
    }


def as_well(by_hand: Widths, of: Sequence[str]) -> Wanted:
    """What a flight is asked for: the widest that a mission by hand leaves `of` these, as far as it tells them to
    KNOWN."""
    names = tuple(name for name in of if by_hand[name] <= KNOWN)
    return Wanted(names, max(by_hand[name] for name in names))


def figures(hand_s: float, by_hand: Widths, wanted: Wanted, outcome: Outcome, took_s: list[float]) -> Data:
    """Seconds of a mission by hand and of a flight until all is as well known, and the widths of both."""
    return {
        "hand_s": hand_s,
        "known_s": outcome.known_s,
        "whole_s": outcome.seconds,
        "identify_s": float(np.mean(took_s)),
        "share": wanted.share,
        "hand": {name: by_hand[name] for name in wanted.names},
        "flown": {name: outcome.widths.get(name, np.inf) for name in wanted.names},
    }


def plan_of(
    file: VehicleFile,
    limits: Limits,
    know: Sequence[str] = (),
    seconds: float = PLAN_S,
    aims: Mapping[str, float] = NO_AIMS,
) -> FlightPlan:
    """The plan of a vehicle file within limits, for the coefficients `know` or for all, to `aims`."""
    proposal = plan(before_dives(file), limits, seconds, know=know, aims=aims)
    return flight_plan("bench", START_DEPTH_M, [part.manoeuvre.steps for part in proposal.parts])


def flight(
    link: Link,
    clock: Clock,
    file: VehicleFile,
    configuration: str,
    flown_plan: FlightPlan,
    wanted: Wanted,
    root: Path,
    spent_s: Callable[[], float],
) -> tuple[Outcome, list[float]]:
    """Fly the plan until all that is wanted is known; the seconds that each identification took, by `spent_s`."""
    crew, recorder, folder = recorded_crew(link, file, configuration, root, clock, lambda _: None)
    identifying = InTurn(folder.path, file, configuration, clock, spent_s)
    try:
        crew.find(1)
        flying = PlanFlight(crew, flown_plan, LIMITS, wanted, identifying)
        flying.begin(COUNTDOWN_S)
        while not flying.over:
            flying.step()
    finally:
        recorder.close()
    return flying.outcome, identifying.took_s


def words(results: dict[str, Data]) -> str:
    rows, known_by = [], []
    for configuration in CONFIGURATIONS:
        data = [value for key, value in results.items() if key.startswith(f"{configuration} ")]
        share, hand_s = (float(np.median([d[key] for d in data])) for key in ("share", "hand_s"))
        for asked, prefix in ((f"{100 * share:.1f}%", ""), (EACH, "each_")):
            # A flight that never knew enough took for ever.
            known_s, whole_s = (
                float(np.median(np.nan_to_num([d[f"{prefix}{key}"] for d in data], nan=np.inf)))
                for key in ("known_s", "whole_s")
            )
            known = (
                (f"{known_s:.0f} s", f"1/{hand_s / known_s:.1f}") if np.isfinite(known_s) else ("never", "-")
            )
            rows.append((configuration, len(data), asked, f"{hand_s:.0f} s", *known, f"{whole_s:.0f} s"))
        names = list(data[0]["hand"])
        widths = [
            (by, *(percent(float(np.median([d[way][name] for d in data]))) for name in names))
            for way, by in (("hand", "by hand"), ("flown", "flown"), ("each", f"flown, {EACH}"))
        ]
        known_by.append(table((configuration, *names), widths))
    mean_s = float(np.mean([d["identify_s"] for d in results.values()]))
    return blocks(
        "## A plan that the vehicle flies by itself",
        paragraph(
            "`seatrial fly` on the simulated vehicle, asked for the widest interval that the paper's mission, flown as "
            "by hand, leaves of any mass or damping that it tells to a tenth, and in another flight for each of them "
            "as well as by hand. Times are from the start at the surface: the whole mission by hand, and the flight "
            "until all is known, countdown apart, with the ways to its station and the identifications beside it. "
            "Medians."
        ),
        table(HEAD, rows),
        "What each knew then, half of the 95 % interval in per cent of the value, by hand and flown:",
        *known_by,
        paragraph(
            f"Each identification of what was recorded so far took {mean_s:.1f} s on average, beside the flight."
        ),
    )
