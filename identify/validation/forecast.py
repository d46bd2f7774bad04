"""Foretells the tracking error of the next dive with accepted causes, by a twin that flies the same mission.

The twin is the simulated vehicle without bytes (`bridge.simulator.direct`): the model that was accepted, with its
effects and the disturbance of the fit, under the vehicle's own controller. It flies the reference that the dive
recorded, and its error is measured as the dive's is (`tracking.WholeError`). First it flies the dive as it
was, in its mode and with the same coefficients: an axis in which it errs otherwise than the dive did by more than a
third is not foretold. Then it flies with the accepted values, by the feed-forward alone and with both.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bridge.arrays import Array
from bridge.errors import SeatrialError
from bridge.simulator.direct import Noise, TruthRun, simulate_truth
from bridge.simulator.truth import GAIN, PLANTED, Truth
from bridge.vehicle.coefficients import BY_NAME, DAMPINGS, DOFS, MASSES, QUADRATIC_NAMES, gain_name
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.feedforward import AXES, FEEDFORWARD_DOFS
from bridge.vehicle.forecast import TWICE, Credit, ForecastRow
from bridge.vehicle.mode import Mode
from bridge.vehicle.references import Reference, Six
from identify.diagnose.result import Accepted, Hull
from identify.dive import Dive, Signal
from identify.effects.library import not_simulated
from identify.thrust.thruster_allocation import allocated_gains
from identify.validation.against_forecast import SMALL, is_alike, rows_words
from identify.validation.raising import in_one_mode
from identify.validation.tracking import LEAST_SPEED, SETTLED_S, WholeError, lever_of, whole_errors
from identify.words import listed, speed

LONG_S, MOST_SEAS = 300.0, 3
"""A mission shorter than this is flown in several seas, and their mean is foretold."""
BRAKES_S = 1.0
"""Time constant of an axis whose damping was not fitted."""
LEAST_SEA = 1e-6


@dataclass(frozen=True)
class Forecast:
    """rows: by axis and mode. credits: of the thrusters with an accepted gain. why: sentences on axes without a row."""

    rows: tuple[ForecastRow, ...]
    credits: tuple[Credit, ...]
    why: tuple[str, ...] = ()


@dataclass(frozen=True)
class Again:
    """A recorded reference as a mission: `value` (n, 14) at `time_s` (n,), as in NU_REF."""

    time_s: Array
    value: Array

    @property
    def duration_s(self) -> float:
        return float(self.time_s[-1] - self.time_s[0])

    @property
    def start_heading_rad(self) -> float:
        return float(self.value[0, 12])

    @property
    def start_depth_m(self) -> float:
        return float(self.value[0, 13])

    def reference(self, time_s: float) -> Reference:
        """The reference `time_s` after the start, linear between its samples."""
        at = float(self.time_s[0]) + time_s
        after = min(max(int(np.searchsorted(self.time_s, at)), 1), len(self.time_s) - 1)
        begun, ended = self.time_s[after - 1], self.time_s[after]
        share = min(max((at - begun) / (ended - begun), 0.0), 1.0)
        row = ((1 - share) * self.value[after - 1] + share * self.value[after]).tolist()
        return Reference(_six(row[:6]), _six(row[6:12]), row[12], row[13])


def _six(values: list[float]) -> Six:
    a, b, c, d, e, f = values
    return a, b, c, d, e, f


def credits_of(accepted: Accepted, dive: Dive, file: VehicleFile, configuration: str) -> tuple[Credit, ...]:
    """The thrusters with an accepted gain, and how the vehicle's own allocation went by them in the dive."""
    thrusters = file.vehicle.configurations[configuration].thrusters
    named = {number: gain_name(number) for number in range(1, len(thrusters) + 1)}
    accepted_gains = {n: accepted.values[name].value for n, name in named.items() if name in accepted.values}
    if not accepted_gains:
        return ()
    gains = allocated_gains(dive, file, configuration)
    out = []
    for number, gain in accepted_gains.items():
        allocated = math.nan if gains is None else float(gains[number - 1])
        by_allocation = allocated if math.isfinite(allocated) else None
        out.append(Credit(number, thrusters[number - 1].gain, gain, by_allocation, dive.feedforward_acts))
    return tuple(out)


def forecast(
    accepted: Accepted,
    hull: Hull | None,
    dive: Dive,
    file: VehicleFile,
    configuration: str,
    progress: Callable[[float], None] = lambda _: None,
) -> Forecast:
    """Foretell the next dive with the accepted causes; `dive` is the diagnosed dive, `hull` its fit.

    `progress` gets the share of the simulated missions that are flown.
    """
    shape = file.vehicle.configurations[configuration]
    credits = credits_of(accepted, dive, file, configuration)

    def without(why: str) -> Forecast:
        return Forecast((), credits, (f"How the next dive tracks is not foretold: {why}.",))

    if any(_made_up_on_board(credit) for credit in credits):
        return without("the vehicle makes up for a thruster by itself")
    unable = not_simulated(accepted.effects, shape, file.vehicle.thrust_curve.lag_s)
    if unable:
        return without(f"the simulated vehicle has no {listed(unable)}")
    part = in_one_mode(dive)
    if part.mode is None or dive.runs or hull is None:
        return without("the dive tells no FF_MODE, or is made of several runs")
    mission = mission_in(part.dive)
    if mission is None:
        return without("the dive has no reference (NU_REF) that moves")
    flown = whole_errors(part.dive, lever_of(file))
    fed = fed_by(part.dive, file, configuration)
    values = {name: value.value for name, value in accepted.values.items()}
    try:
        truth = twin_of(hull, values)
        twin = Twin(file, configuration, mission, truth)
        again = twin.errors(part.mode, fed, lambda share: progress(share / 3))
        after = {name: value for name, value in fed.items() if name not in accepted.taken_back} | values
        alone = twin.errors(Mode.ALONE, after, lambda share: progress((1 + share) / 3))
        both = twin.errors(Mode.BOTH, after, lambda share: progress((2 + share) / 3))
    except (SeatrialError, ValueError) as error:
        return without(f"the model can't be flown ({error})")
    rows, why = _compared(flown, again, {Mode.ALONE: alone, Mode.BOTH: both}, part.mode)
    return Forecast(rows, credits, why)


def forecast_lines(foresight: Forecast) -> tuple[str, ...]:
    """Lines for a crew: the foretold errors of each mode, and reasons for axes that are not foretold."""
    return (*rows_words(foresight.rows), *filter(None, map(_credit_line, foresight.credits)), *foresight.why)


def _credit_line(credit: Credit) -> str:
    """A line on a thruster that was made up for in the dive already, "" for another."""
    if credit.allocated is None:
        return ""
    by = f"thruster {credit.thruster}: in this dive the vehicle asked it as if it gave {100 * credit.allocated:.0f} %"
    if _made_up_on_board(credit):
        return (
            f"{by} of its curve already, by itself; with what was found it would be made up for twice, so an upload "
            "is refused unless it is asked for by name"
        )
    if credit.acting and abs(credit.allocated / credit.true - 1) <= TWICE and credit.found != 1.0:
        return f"{by} of its curve already: it was accepted before, and accepting it again changes nothing"
    return ""


def _compared(
    flown: tuple[WholeError, ...],
    again: Mapping[str, WholeError],
    after: Mapping[Mode, Mapping[str, WholeError]],
    mode: Mode,
) -> tuple[tuple[ForecastRow, ...], tuple[str, ...]]:
    """again: the twin in the dive's own mode, by axis; after: in each mode with the accepted values."""
    rows, why = [], []
    for error in flown:
        if DOFS.index(error.axis) not in FEEDFORWARD_DOFS:
            continue
        twin = again[error.axis].rms
        small = max(twin, error.rms) < SMALL[error.unit]
        if not (small or is_alike(twin, error.rms)):
            why.append(
                f"How the next dive tracks in {error.axis} is not foretold: the model errs by "
                f"{speed(twin, error.unit)} where this dive did by {speed(error.rms, error.unit)}."
            )
            continue
        rows += [
            ForecastRow(
                error.axis, error.unit, to.word, mode.word, error.rms, by_axis[error.axis].rms, error.asked
            )
            for to, by_axis in after.items()
        ]
    return tuple(sorted(rows, key=lambda row: row.mode)), tuple(why)


def _made_up_on_board(credit: Credit) -> bool:
    if credit.allocated is None or credit.acting:
        return False
    return abs(credit.allocated / credit.assumed - 1) > TWICE


def mission_in(dive: Dive) -> Again | None:
    """The recorded reference from shortly before its first motion to the end of its last; None if it never moves."""
    if dive.nu_ref is None:
        return None
    reference = dive.nu_ref.finite()
    moving = np.flatnonzero((np.abs(reference.value[:, :6]) > LEAST_SPEED).any(axis=1))
    rising = np.flatnonzero(np.diff(reference.time_s, prepend=-np.inf) > 0)
    if not len(moving):
        return None
    time_s, value = reference.time_s[rising], reference.value[rising].copy()
    first_s, last_s = reference.time_s[moving[0]] - SETTLED_S, reference.time_s[moving[-1]] + SETTLED_S
    kept = (time_s >= first_s) & (time_s <= last_s)
    value[:, 12] = np.unwrap(value[:, 12])
    return Again(time_s[kept], value[kept]) if np.count_nonzero(kept) > 1 else None


def fed_by(dive: Dive, file: VehicleFile, configuration: str) -> dict[str, float]:
    """The coefficients by which the vehicle's feed-forward went in a dive: masses and dampings from TAU_FF, and the
    gains of thrusters from its allocation where that acted. Empty for a feed-forward of nothing."""
    if dive.tau_ff is None or dive.nu_ref is None or not len(dive.tau_ff):
        return {}
    wanted = dive.nu_ref.at(dive.tau_ff.time_s)
    out: dict[str, float] = {}
    for dof, mass, damping in AXES:
        fed = np.nan_to_num(dive.tau_ff.value[:, dof])
        if not fed.any():
            continue
        values, *_ = np.linalg.lstsq(wanted[:, [6 + dof, dof]], fed, rcond=None)
        for name, value in zip((mass, damping), values.tolist(), strict=True):
            if BY_NAME[name].low < value < BY_NAME[name].high:
                out[name] = value
    gains = allocated_gains(dive, file, configuration) if dive.feedforward_acts else None
    if gains is not None:
        thrusters = file.vehicle.configurations[configuration].thrusters
        for number, (gain, thruster) in enumerate(zip(gains, thrusters, strict=True), 1):
            if abs(gain / thruster.gain - 1) > TWICE:
                out[gain_name(number)] = float(gain / thruster.gain)
    return out


def twin_of(hull: Hull, values: Mapping[str, float]) -> Truth:
    """The accepted model as a vehicle in the water: fitted masses and dampings, replaced by accepted `values`."""
    model: dict[str, float] = {}
    effects = dict(zip(QUADRATIC_NAMES, hull.quadratic, strict=True))
    effects |= {name: value for name, value in values.items() if name in PLANTED or GAIN.fullmatch(name)}
    for dof in range(6):
        mass = values.get(MASSES[dof].name, hull.mass[dof])
        damping = values.get(DAMPINGS[dof].name, hull.damping[dof])
        if not damping and not effects[QUADRATIC_NAMES[dof]]:
            damping = mass / BRAKES_S
        model |= {MASSES[dof].name: mass, DAMPINGS[dof].name: damping}
    force = math.sqrt((hull.disturbance[0] ** 2 + hull.disturbance[1] ** 2) / 2)
    return Truth(model, force, hull.disturbance[5], max(hull.disturbance_time_s, LEAST_SEA), effects)


@dataclass(frozen=True)
class Twin:
    """A vehicle that is the accepted model, on the mission of a dive."""

    file: VehicleFile
    configuration: str
    mission: Again
    truth: Truth

    def errors(
        self, mode: Mode, fed: Mapping[str, float], progress: Callable[[float], None] = lambda _: None
    ) -> dict[str, WholeError]:
        """Its errors by axis, fed with these coefficients; rms over several seas if the mission is short."""
        seas = min(max(round(LONG_S / max(self.mission.duration_s, 1.0)), 1), MOST_SEAS)
        noise, each = Noise(), []
        for seed in range(seas):
            progress(seed / seas)
            run = simulate_truth(
                self.file,
                self.configuration,
                self.mission,
                seed=seed,
                parameters=fed,
                mode=mode,
                noise=noise,
                truth=self.truth,
            )
            each.append({error.axis: error for error in whole_errors(seen(run, noise))})
        return {axis: _mean([of[axis] for of in each]) for axis in each[0]}


def _mean(errors: list[WholeError]) -> WholeError:
    first = errors[0]
    rms = math.sqrt(sum(error.rms**2 for error in errors) / len(errors))
    return WholeError(first.axis, first.unit, rms, first.asked, first.unasked, first.rest, first.noise)


def seen(run: TruthRun, noise: Noise) -> Dive:
    """A run as its controller read it: velocity as often as it was renewed, rates at every tick."""
    read, each = run.column("nu_fb"), noise.velocity_ticks
    rates = np.array([actuation.reference.nu_dot for actuation in run.actuations])
    reference = np.column_stack([run.nu_ref, rates, np.zeros((len(rates), 2))])
    return Dive(
        "twin",
        Path("twin"),
        "",
        velocity=Signal(run.time_s[::each], read[::each, :3]),
        gyro=Signal(run.time_s, read[:, 3:]),
        nu_ref=Signal(run.time_s, reference),
    )
