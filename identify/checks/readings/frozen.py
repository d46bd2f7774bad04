"""Removes readings that stand still while the vehicle moves: a sensor, or its driver, that repeats its last value.

A repeated value alone proves nothing: a sensor with a coarse resolution repeats at rest, a sensor that is polled
faster than it measures repeats always, and a simulated sensor without noise is as still as its vehicle. A long run of
equal values in all axes therefore counts as frozen only while the thrusters push, and only if the signal's own noise
never repeats that long by chance, or another recorded signal shows that the vehicle moved meanwhile. A single axis
may well stand still; for it only its own noise counts, provided that the noise is at least a step of its resolution.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import Water
from bridge.vehicle.thrusters import NEUTRAL_US
from identify.dive import Dive, Signal

SHORTEST_S, FEWEST = 2.0, 8
"""Least duration and number of equal values: shorter repetitions are left alone."""

ENOUGH = 20
"""Number of different values from which the noise of a signal counts as known."""

CHANCE = 1e-3
"""Largest number of runs this long expected by chance in a dive, for a run to be called frozen."""

SETTLING_S = 1.0
"""The last part of a run in which pushes don't count: they move the vehicle only later."""

IDLE_US = 30.0
FORCE_SHARE = 0.1
MOVED, TURNED_RAD, SANK_M = 0.03, 0.2, 0.2
"""Thresholds of motion during a run: FORCE_SHARE of the dive's range of thrust; MOVED in m/s or rad/s; TURNED_RAD;
SANK_M."""

THIRD_DIFFERENCE = 0.6745 * 20**0.5
"""Median size of white noise's third differences, over its standard deviation."""

STEADY = 0.4
"""Largest share of readings that repeat their predecessor, for white noise with a standard deviation of one step."""

AXES = {"velocity": DOFS[:3], "gyro": DOFS[3:]}
"""Signals whose axes are also checked individually."""

WORDS = {
    "velocity": "The velocity",
    "gyro": "The rate of turn of the gyro",
    "fog": "The rate of turn of the fibre-optic gyro",
    "attitude": "The attitude",
    "pressure": "The pressure of the depth sensor",
    "depth": "The depth",
}


@dataclass(frozen=True)
class Runs:
    """Runs of equal values in all axes of a signal: first and last sample (k,) of each run, and their times."""

    first: NDArray[np.int64]
    last: NDArray[np.int64]
    start_s: Array
    end_s: Array

    def spans(self, chosen: NDArray[np.bool_]) -> tuple[tuple[float, float], ...]:
        """Start and end of the chosen runs (k,)."""
        return tuple(zip(self.start_s[chosen].tolist(), self.end_s[chosen].tolist(), strict=True))

    def repeats(self, chosen: NDArray[np.bool_]) -> NDArray[np.int64]:
        """The samples of the chosen runs (k,), at least one of them, after the first of each run."""
        edges = zip(self.first[chosen], self.last[chosen], strict=True)
        return np.concatenate([np.arange(first + 1, last + 1) for first, last in edges])

    @property
    def count(self) -> NDArray[np.int64]:
        return self.last - self.first + 1

    @property
    def long(self) -> NDArray[np.bool_]:
        return (self.count >= FEWEST) & (self.end_s - self.start_s >= SHORTEST_S)


def without_frozen(dive: Dive, rest_us: float = NEUTRAL_US, thrusters: int | None = None) -> Dive:
    """The dive without frozen readings, with a note for each sensor; the first reading of each run stays.

    rest_us: the pulse of a thruster at rest. thrusters: how many of the first outputs are thrusters, None if unknown.

    A signal with no other readings left is removed.
    """
    commands = _commands(dive, rest_us, thrusters)
    kept: dict[str, Any] = {}
    stretches: dict[str, tuple[tuple[float, float], ...]] = {}
    notes = []
    for name, words in WORDS.items():
        signal = dive.signals().get(name)
        known = signal.in_part() if signal is not None else None
        if signal is None or known is None or len(known) < FEWEST:
            continue
        runs = _runs(known)
        frozen = _frozen(dive, name, runs, _log_chance(known, runs), commands)
        if not frozen.any():
            continue
        stretches[name], index = runs.spans(frozen), runs.repeats(frozen)
        stays = ~np.isin(signal.time_s, known.time_s[index])
        left = Signal(signal.time_s[stays], signal.value[stays])
        kept[name] = left if len(left.in_part()) > np.count_nonzero(frozen) else None
        notes.append(_note(words, stretches[name], len(index) / len(known)))
    if stretches:
        dive = replace(dive, **kept, frozen=stretches, notes=dive.notes + tuple(notes))
    for name, axes in AXES.items():
        for column, axis in enumerate(axes):
            dive = _without_frozen_axis(dive, name, column, axis, commands)
    return dive


def axis_key(name: str, axis: str) -> str:
    """Key of an axis of a signal in `Dive.frozen`."""
    return f"{name} in {axis}"


def _without_frozen_axis(dive: Dive, name: str, column: int, axis: str, commands: "_Commands | None") -> Dive:
    """The dive with NaN where a single axis of a signal is frozen, except for the first reading of each run."""
    signal = dive.signals().get(name)
    if signal is None:
        return dive
    rows = np.flatnonzero(np.isfinite(signal.value[:, column]))
    known = Signal(signal.time_s[rows], signal.value[rows, column : column + 1])
    if len(known) < FEWEST or not _has_noise_of_a_step(known):
        return dive
    runs = _runs(known)
    frozen = _frozen(dive, "", runs, _log_chance(known, runs, STEADY), commands)
    if not frozen.any():
        return dive
    spans, index = runs.spans(frozen), runs.repeats(frozen)
    value = signal.value.copy()
    value[rows[index], column] = np.nan
    kept: dict[str, Any] = {name: Signal(signal.time_s, value)}
    return replace(
        dive,
        **kept,
        frozen={**dive.frozen, axis_key(name, axis): spans},
        notes=(*dive.notes, _note(f"{WORDS[name]} in {axis}", spans, len(index) / len(known))),
    )


def _has_noise_of_a_step(signal: Signal) -> bool:
    """Whether the white noise of a signal (n, 1) is at least its step size, as far as that is known."""
    value = signal.value[:, 0]
    steps = np.abs(np.diff(value))
    moved = steps[steps > 0]
    white = float(np.median(np.abs(np.diff(value, 3)))) / THIRD_DIFFERENCE
    return len(moved) >= ENOUGH and white >= float(moved.min())


def _note(words: str, stretches: tuple[tuple[float, float], ...], share: float) -> str:
    seconds = sum(end - start for start, end in stretches)
    where = "" if len(stretches) == 1 else f" in {len(stretches)} stretches"
    return (
        f"{words} repeats one value for {seconds:.0f} s{where} ({100 * share:.1f} % of its readings) while the vehicle "
        "goes on: what stands still is left out; check that sensor, and what passes its readings on."
    )


def _runs(signal: Signal) -> Runs:
    changed = np.concatenate([[True], (signal.value[1:] != signal.value[:-1]).any(axis=1), [True]])
    edges = np.flatnonzero(changed)
    first, last = edges[:-1], edges[1:] - 1
    return Runs(first, last, signal.time_s[first], signal.time_s[last])


def _frozen(
    dive: Dive, name: str, runs: Runs, log_chance: float | None, commands: "_Commands | None"
) -> NDArray[np.bool_]:
    """Which runs (k,) are frozen, given the logarithm of the chance that a sample repeats its predecessor.

    name: of the signal, which others may show to move; empty for a single axis, which may well stand still.
    """
    frozen = np.zeros(len(runs.first), dtype=np.bool_)
    samples = int(runs.count.sum())
    for i in np.flatnonzero(runs.long):
        span_s = float(runs.start_s[i]), float(runs.end_s[i]) - SETTLING_S
        # A run this long is very unlikely by chance.
        by_noise = log_chance is not None and bool(
            (runs.count[i] - 1) * log_chance + np.log(samples) < np.log(CHANCE)
        )
        frozen[i] = _pushed(dive, span_s, commands) and (
            by_noise or (name != "" and _moved(dive, name, span_s, commands))
        )
    return frozen


def _log_chance(signal: Signal, runs: Runs, least: float = 1e-3) -> float | None:
    """Logarithm of the chance that a sample repeats its predecessor, outside the long runs; None without visible noise.

    Noise makes third differences larger than first differences, motion makes them smaller. Never below `least`.
    """
    usual = ~runs.long
    if np.count_nonzero(usual) < ENOUGH:
        return None
    fresh = signal.value[runs.first[usual]]
    slope, third = (np.median(np.abs(np.diff(fresh, n, axis=0)), axis=0) for n in (1, 3))
    if not (third > slope).any():
        return None
    count = runs.count[usual]
    again = int((count - 1).sum())
    # With a coarse resolution, a value that repeated once is likely to repeat again.
    twice = int(np.maximum(count - 2, 0).sum())
    likely = max(again / int(count.sum()), twice / again if again else 0.0)
    return float(np.log(max(likely, least)))


@dataclass(frozen=True)
class _Commands:
    """Thruster commands (n, thrusters) of a dive. rest: what a thruster at rest is sent; least: how far from that
    a push is."""

    signal: Signal
    rest: float
    least: float

    def pushed(self, span_s: tuple[float, float]) -> bool:
        off = np.abs(self.signal.between(*span_s).value - self.rest)
        return bool((off[np.isfinite(off)] > self.least).any())


def _commands(dive: Dive, rest_us: float, thrusters: int | None) -> _Commands | None:
    """The commands of a dive's thrusters, of all outputs if their number is unknown; an output without a pulse pushes
    nothing."""
    if dive.pwm is None or not len(dive.pwm):
        signal = dive.thrust_cmd
        return None if signal is None else _Commands(signal, 0.0, 0.0)
    us = dive.pwm.value[:, :thrusters]
    return _Commands(Signal(dive.pwm.time_s, np.where(us > 0.0, us, np.nan)), rest_us, IDLE_US)


def _pushed(dive: Dive, span_s: tuple[float, float], commands: _Commands | None) -> bool:
    """Whether thrust was commanded within a span of time."""
    if dive.tau_cmd is not None and (dive.pwm is None or not len(dive.pwm)):
        return bool((np.nan_to_num(dive.tau_cmd.between(*span_s).value) != 0.0).any())
    return commands is not None and commands.pushed(span_s)


def _moved(dive: Dive, name: str, span_s: tuple[float, float], commands: _Commands | None) -> bool:
    """Whether another recorded signal shows that this signal can't have stood still."""
    if name == "attitude":
        return _turn_rad(dive.gyro, span_s) > TURNED_RAD
    columns = {"velocity": slice(0, 3), "gyro": slice(3, 6), "fog": slice(5, 6)}.get(name)
    if columns is None:  # at the surface or at the bottom, depth stands still whatever the vehicle does
        other, per_m = (dive.pressure, Water().weight_n_m3) if name == "depth" else (dive.depth, 1.0)
        return other is not None and _range(other.between(*span_s).value) > SANK_M * per_m
    used, thrust = dive.nu_fb, dive.tau_cmd
    if used is not None and _range(used.between(*span_s).value[:, columns]) > MOVED:
        return True
    if thrust is not None:
        return _range(thrust.between(*span_s).value[:, columns]) > FORCE_SHARE * _range(
            thrust.value[:, columns]
        )
    if name != "velocity" or commands is None:
        return False
    return _range(commands.signal.between(*span_s).value) > FORCE_SHARE * _range(commands.signal.value)


def _turn_rad(gyro: Signal | None, span_s: tuple[float, float]) -> float:
    """Largest angle, about any axis, to which the rates of a span of time integrate; 0 if the rates stand still too."""
    part = None if gyro is None else gyro.between(*span_s)
    if part is None or _range(part.value) == 0.0:
        return 0.0
    step_s = np.diff(part.time_s, prepend=part.time_s[:1])
    return _range(np.cumsum(np.nan_to_num(part.value) * step_s[:, None], axis=0))


def _range(value: Array) -> float:
    """Largest difference within a column of (n, k); 0 without finite values."""
    if not len(value) or not np.isfinite(value).any():
        return 0.0
    return float(np.nanmax(np.fmax.reduce(value, axis=0) - np.fmin.reduce(value, axis=0)))
