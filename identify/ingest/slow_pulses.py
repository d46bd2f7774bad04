"""Thruster pulses between the slow samples of a ground station's log, reckoned by the autopilot's own law.

Such a log has the pulses twice a second, and several times as often the signals that make them: the pilot's sticks,
and the attitude, rates and depth that the autopilot answers. But for its integrals, each output is a sum of these with
constant factors: the pulse, or the thrust where a mixer takes the thrusters' curve into account. The factors are those
that foretell each sample best from its two neighbours, and so are the sticks' delay and the choice of pulse or thrust;
by how much they miss it remains unknown between two samples.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.thrusters import thrust_curve
from identify.dive import TIMED_S, Dive, Reckoned, Signal
from identify.ingest.commands import sampled_seldom
from identify.ingest.rotation import euler_angles

STEP_S: Final = 0.02
DELAYS_S: Final = np.arange(-0.01, 0.305, 0.01)
"""Delays of a stick behind its arrival in the log at which it is tried: the link's, there and back. No pulse answers a
stick before it was sent, but for the milliseconds by which the stamps of a log are off."""

SAME_S: Final = 1e-4
"""Times closer than this are the same, because stamps are rounded."""

FAST_HZ: Final = 10.0
"""Rate of readings that change little until the next."""

LEAST_SAMPLES: Final = 10
"""Samples for each factor, at least."""

ALIKE: Final = 1.05
"""Misses, relative to the fewest, with which a delay of the sticks is as good."""

MOST_MISSED: Final = 0.5
"""Variance of the misses, relative to that of samples halfway between their neighbours, up to which pulses are
reckoned."""


@dataclass(frozen=True)
class Output:
    """The quantity that the law makes: `of` pulses (n, k), and the pulses `back` from it."""

    of: Callable[[Array], Array]
    back: Callable[[Array], Array]


PULSE: Final = Output(lambda pulses: pulses, lambda outputs: outputs)


@dataclass(frozen=True)
class Law:
    """The law of the pulses: sticks `delay_s` earlier, and `factors` (p, k) of all that makes each `output`.

    missed, straight (k, k): covariance of its misses of a sample, and of those of a sample halfway between its
    neighbours, in the output's unit; share: the one variance over the other, of all outputs; shares (k,): the same
    of each output, 1 at rest.
    """

    output: Output
    delay_s: float
    factors: Array
    missed: Array
    straight: Array
    share: float
    shares: Array


def with_reckoned_pulses(
    dive: Dive, vehicle: VehicleFile | None = None, thrusters: int | None = None
) -> Dive:
    """The dive with pulses every STEP_S in place of slow samples, and a note, if the pilot's sticks are recorded.

    Of the outputs only the first `thrusters` tell when a thrust acts. Raises ConfigError for a thrust table of the
    vehicle that can't be read.
    """
    pwm = dive.pwm
    if pwm is None or dive.sticks is None or not len(dive.sticks) or not sampled_seldom(pwm):
        return dive
    laws = [law for output in _outputs(vehicle) if (law := law_of(dive, pwm, output)) is not None]
    law = min(laws, key=lambda each: each.share, default=None)
    if law is None or law.share > MOST_MISSED:
        return dive
    time_s = _changes_s(dive, pwm, law.delay_s)
    # A pulse holds until the next, so that the middle of its step is what it stands for.
    at_s = time_s + 0.5 * np.diff(time_s, append=pwm.time_s[-1])
    acting = _acting(dive, pwm, at_s)[:, None]
    made = law.output.of(pwm.value)
    left = made - _makers(dive, pwm.time_s, law.delay_s) @ law.factors
    value = np.where(acting, _between(pwm.time_s, left, at_s), _between(pwm.time_s, made, at_s))
    value += np.where(acting, _makers(dive, at_s, law.delay_s) @ law.factors, 0.0)
    low, high = np.nanmin(pwm.value, axis=0), np.nanmax(pwm.value, axis=0)
    slope = _rms_slope(law.output, pwm.value)
    missed_us2, straight_us2 = (of / np.outer(slope, slope) for of in (law.missed, law.straight))
    known = Reckoned(
        1.0 / pwm.rate_hz,
        tuple(map(tuple, missed_us2.tolist())),
        tuple(map(tuple, straight_us2.tolist())),
        float(law.shares[:thrusters].min()),
    )
    note = (
        f"Thruster commands come at {pwm.rate_hz:.1f} Hz; between them they are reckoned from the sticks and the "
        f"attitude, which foretell {100 * (1 - law.share):.0f} % of what happens there. The rest is taken for a noise"
    )
    if not known.tells_timing:
        note += (
            ", and a delay or a lag of the thrusters can't be judged; record them at 10 Hz or more for that"
        )
    return replace(
        dive,
        pwm=Signal(time_s, np.clip(law.output.back(value), low, high)),
        reckoned=known,
        stamped_s=max(dive.stamped_s, TIMED_S),
        notes=(*dive.notes, f"{note}."),
    )


def _changes_s(dive: Dive, pwm: Signal, delay_s: float) -> Array:
    """Times (m,) from which the pulses change: every STEP_S, and at each stick and each frequent reading that makes
    them. Pulses that answered a reading before its time would know its noise."""
    assert dive.sticks is not None
    made_s = [dive.sticks.time_s + delay_s, np.arange(pwm.time_s[0], pwm.time_s[-1], STEP_S)]
    for signal in (
        dive.attitude,
        dive.gyro,
        dive.pressure if dive.depth is None else dive.depth,
        dive.velocity,
    ):
        if signal is not None and len(known := signal.finite()) and known.rate_hz >= FAST_HZ:
            made_s.append(known.time_s)
    every_s = np.unique(np.concatenate(made_s))
    every_s = every_s[(every_s >= pwm.time_s[0]) & (every_s < pwm.time_s[-1])]
    return np.asarray(every_s[np.diff(every_s, prepend=-np.inf) > SAME_S])


def _outputs(vehicle: VehicleFile | None) -> tuple[Output, ...]:
    if vehicle is None:
        return (PULSE,)
    curve = thrust_curve(vehicle.vehicle.thrust_curve, vehicle.path.parent)
    return PULSE, Output(curve.thrust, curve.pwm)


def law_of(dive: Dive, pwm: Signal, output: Output) -> Law | None:
    """The law that foretells the samples best from their neighbours; None with too few samples."""
    beyond = _beyond_neighbours(output.of(pwm.value))
    acting = _armed(dive, pwm.time_s)
    usable = np.isfinite(beyond).all(axis=1) & acting[:-2] & acting[1:-1] & acting[2:]
    laws = []
    for delay_s in DELAYS_S.tolist():
        makers = _beyond_neighbours(_makers(dive, pwm.time_s, delay_s))
        kept = usable & np.isfinite(makers).all(axis=1)
        freedom = int(kept.sum()) - makers.shape[1]
        if freedom < LEAST_SAMPLES * makers.shape[1]:
            return None
        factors, *_ = np.linalg.lstsq(makers[kept], beyond[kept], rcond=1e-8)
        left = beyond[kept] - makers[kept] @ factors
        missed, straight = left.T @ left / freedom, np.atleast_2d(np.cov(beyond[kept].T, bias=True))
        of_each, by_line = np.diag(missed), np.diag(straight)
        share = float(of_each.sum() / max(float(by_line.sum()), 1e-12))
        shares = np.divide(of_each, by_line, out=np.ones_like(of_each), where=by_line > 1e-12)
        laws.append(Law(output, delay_s, np.asarray(factors, np.float64), missed, straight, share, shares))
    # Sticks and pulses of one clock leave the delay open by up to a step of the sticks: the middle is taken.
    best = min(law.share for law in laws)
    alike = [law for law in laws if law.share <= ALIKE * best]
    return alike[len(alike) // 2]


def _rms_slope(output: Output, pulses_us: Array) -> Array:
    """Rms (k,) of the output's slope along the pulses (n, k), per us."""
    slope = 0.5 * (output.of(pulses_us + 1.0) - output.of(pulses_us - 1.0))
    return np.asarray(np.maximum(np.sqrt(np.nanmean(slope**2, axis=0)), 1e-9))


def _beyond_neighbours(values: Array) -> Array:
    """Each of the values (n, k) but the ends less the mean of its neighbours, (n - 2, k)."""
    return np.asarray(values[1:-1] - 0.5 * (values[:-2] + values[2:]))


def _armed(dive: Dive, time_s: Array) -> NDArray[np.bool_]:
    """Whether the autopilot's law acts at times (m,): a vehicle that is not armed has its pulses at rest."""
    if dive.armed is None or not len(dive.armed):
        return np.ones(len(time_s), np.bool_)
    return np.asarray(dive.armed.value[_latest(dive.armed.time_s, time_s), 0] > 0)


def _acting(dive: Dive, pwm: Signal, time_s: Array) -> NDArray[np.bool_]:
    """Whether the law acts at the samples before and behind each of the times (m,)."""
    armed, before = _armed(dive, pwm.time_s), _latest(pwm.time_s, time_s)
    return np.asarray(armed[before] & armed[np.minimum(before + 1, len(pwm) - 1)])


def _latest(of_s: Array, time_s: Array) -> NDArray[np.intp]:
    """Index (m,) of the last of the times `of_s` that is not later; 0 before the first."""
    return np.asarray(np.maximum(np.searchsorted(of_s, time_s, side="right") - 1, 0))


def _between(of_s: Array, values: Array, time_s: Array) -> Array:
    """Values (m, k) between those (n, k) at the times `of_s`, of which unknown ones are left out."""
    known = np.isfinite(values).all(axis=1)
    return np.column_stack([np.interp(time_s, of_s[known], column) for column in values[known].T])


def _at(signal: Signal, time_s: Array) -> Array:
    """Values (m, k) of a signal at times (m,): the last known, or between two known ones where it is slow."""
    known = signal.finite()
    if known.rate_hz < FAST_HZ:
        return _between(known.time_s, known.value, time_s)
    return np.asarray(known.value[_latest(known.time_s, time_s)])


def _readings(dive: Dive) -> tuple[Signal | None, ...]:
    """The readings, beside the attitude, that the autopilot answers."""
    return dive.gyro, dive.pressure if dive.depth is None else dive.depth, dive.velocity


def _makers(dive: Dive, time_s: Array, delay_s: float) -> Array:
    """The signals that make the pulses, (m, p): sticks `delay_s` earlier, angles, rates, depth or the pressure that
    tells it, velocity.

    Readings at FAST_HZ or more hold until the next: pulses reckoned from the later one, too, would know its noise, and
    a late thrust would explain that best. Slower ones change too much until then.
    """
    sticks = dive.sticks
    assert sticks is not None
    columns = [sticks.value[_latest(sticks.time_s, time_s - delay_s)]]
    if dive.attitude is not None and len(dive.attitude.finite()):
        # An unknown heading, unwrapped, would leave all later ones unknown.
        attitude = dive.attitude.finite()
        roll, pitch, yaw = euler_angles(attitude.value)
        angles = Signal(attitude.time_s, np.column_stack([roll, pitch, np.unwrap(yaw)]))
        columns.append(_at(angles, time_s))
    for signal in _readings(dive):
        if signal is not None and np.isfinite(signal.value).all(axis=1).any():
            columns.append(_at(signal, time_s))
    return np.hstack(columns)
