"""The dataset type: the signals of one vehicle during one dive, as SI arrays on the vehicle's own clock."""

from dataclasses import dataclass, field, replace
from enum import Enum, auto
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.config import Water
from bridge.vehicle.mode import Mode


class Kind(Enum):
    """Notes on a recording that programs ask for; of RESTART too where the clock is that of two vehicles."""

    RESTART = auto()
    LACKING = auto()
    UNHEARD = auto()


class Note(str):
    """A sentence for the user on a recording, of a kind that programs know it by."""

    kind: Kind

    def __new__(cls, sentence: str, kind: Kind) -> "Note":
        note = super().__new__(cls, sentence)
        note.kind = kind
        return note

    def __getnewargs__(self) -> tuple[str, Kind]:  # type: ignore[override]
        return str(self), self.kind


BURST = 0.1
"""Part of an interval between readings within which another comes in the same burst, or is a copy."""
BETWEEN_BURSTS = 0.9
"""Quantile of the intervals of a signal that is one between readings, with up to nine of them in a burst."""


@dataclass(frozen=True)
class Signal:
    """Samples of one quantity: `time_s` (n,) rising boot time in s, `value` (n, k) in SI units.

    A NaN in `value` means that the vehicle reported the value as unknown (a DVL without bottom lock).
    """

    time_s: Array
    value: Array

    def __post_init__(self) -> None:
        if self.time_s.ndim != 1 or self.value.ndim != 2 or len(self.time_s) != len(self.value):
            raise ValueError(
                f"a signal is (n,) times and (n, k) values, not {self.time_s.shape}, {self.value.shape}"
            )

    def __len__(self) -> int:
        return len(self.time_s)

    @property
    def rate_hz(self) -> float:
        """Median rate of samples at different times; 0 for fewer than two of them."""
        step_s = np.diff(self.time_s)
        step_s = step_s[step_s > 0]
        return float(1.0 / np.median(step_s)) if len(step_s) else 0.0

    @property
    def counted_hz(self) -> float:
        """`rate_hz`, but of samples that come in bursts the mean rate, as a crew would count them."""
        step_s = np.diff(self.time_s)
        step_s = step_s[step_s > 0]
        in_bursts = len(step_s) > 0 and np.median(step_s) < BURST * np.quantile(step_s, BETWEEN_BURSTS)
        return float(1.0 / np.mean(step_s)) if in_bursts else self.rate_hz

    def between(self, start_s: float, end_s: float) -> "Signal":
        keep = (self.time_s >= start_s) & (self.time_s < end_s)
        return Signal(self.time_s[keep], self.value[keep])

    def in_order(self) -> "Signal":
        order = np.argsort(self.time_s, kind="stable")
        return Signal(self.time_s[order], self.value[order])

    def finite(self) -> "Signal":
        """The samples of which every value is known."""
        known = np.isfinite(self.value).all(axis=1)
        return Signal(self.time_s[known], self.value[known])

    def in_part(self) -> "Signal":
        """The samples (m, j) of the columns that are known at any time, of which every value is known."""
        return Signal(self.time_s, self.value[:, np.isfinite(self.value).any(axis=0)]).finite()

    def held_at(self, time_s: Array) -> Array:
        """The latest value at each time, (m, k); NaN before the first sample."""
        index = np.searchsorted(self.time_s, time_s, side="right") - 1
        out = np.full((len(time_s), self.value.shape[1]), np.nan)
        known = index >= 0
        out[known] = self.value[index[known]]
        return out

    def at(self, time_s: Array) -> Array:
        """Linear interpolation over the finite samples, (m, k), constant beyond the ends; NaN if no sample is
        finite."""
        out = np.full((len(time_s), self.value.shape[1]), np.nan)
        for column in range(self.value.shape[1]):
            good = np.isfinite(self.value[:, column])
            if good.any():
                out[:, column] = np.interp(time_s, self.time_s[good], self.value[good, column])
        return out


@dataclass(frozen=True)
class Run:
    """A recording that is part of a dive made of several: its name and source, and its span on the dive's clock, s."""

    name: str
    source: Path
    sha256: str
    start_s: float
    end_s: float

    @property
    def duration_s(self) -> float:
        return self.end_s - self.start_s


TIMED_S = 0.025
"""Standard error of the time at which reckoned pulses act, half a step of sticks at 20 Hz; and the interval of samples
up to which a delay of the thrusters is judged."""


@dataclass(frozen=True)
class Reckoned:
    """Pulses that stand between samples `step_s` apart.

    missed_us2, straight_us2 (k, k): covariance of the outputs' errors if a sample is reckoned from the samples before
    and after it, and if it is taken from a straight line between these. An autopilot's answer to an unrecorded reading
    moves several outputs together: the answer to its depth sensor lifts a vehicle and does not turn it.
    share: the ratio of the two variances for the thruster whose pulses are predicted best. That thruster shows the
    time at which thrusters act, however much a noisy depth sensor moves the others.
    """

    step_s: float
    missed_us2: tuple[tuple[float, ...], ...]
    straight_us2: tuple[tuple[float, ...], ...]
    share: float

    @property
    def tells_timing(self) -> bool:
        """Whether a delay or a lag of the thrusters shows beyond the misses of the reckoning."""
        return self.unknown_s <= TIMED_S

    @property
    def unknown_s(self) -> float:
        """Interval of samples that would leave as much unknown of when the pulses change."""
        return self.share * self.step_s


STAMPED_S = 0.5e-3
"""Many stamps are whole milliseconds, and a computer's tasks wait for each other. If masses are known to a tenth of a
per cent, this is most of the uncertainty."""


@dataclass(frozen=True)
class Dive:
    """A recording, or several runs of a vehicle on a common clock. Body frame FRD, radians, boot time; None if
    missing.

    velocity: (n, 3) m/s at the DVL's transducer, body axes, at its time of validity. velocity_at_origin: whether it is
    still that of the body's origin, as a companion tells it, for the DVL's place is in the vehicle file alone.
    velocity_is_filtered: whether velocity comes from an autopilot's own filter, turned from north-east-down into body
    axes. velocity_late_s: delay of its reports behind the times given here. velocity_smoothing_s: time constant of a
    first-order filter that smoothed it and so delayed it further.
    thrust_delay_s, thrust_lag_s: extra delay and extra lag of the thrusters beyond the vehicle file, as found when the
    dive was dated.
    stamped_s: standard error of the time at which thrust acts, relative to the readings.
    gyro: (n, 3) rad/s. fog: (n, 1) rad/s, means over intervals, each dated at the middle of its interval.
    specific_force: (n, 3) m/s2. attitude: (n, 4) w x y z. pressure: (n, 1) Pa absolute. depth: (n, 1) m, only if the
    recording states depth itself. altitude: (n, 1) m. pwm: (n, thrusters) microseconds. thrust_cmd: (n, thrusters) N
    that each thruster is asked for, before its lag, if the recording states them instead of pulses. effort: (n,
    thrusters) commands from -1 to 1, which are pulses once the vehicle is known. sticks: (n, 4) x y z r of the pilot,
    of 1000. commands_hold: whether each command holds until the next, rather than being a sample of a faster loop; None
    as its rate says. reckoned: how far pulses between slow samples are known. rpm: (n, thrusters), signed. voltage:
    (n, 1) V.
    tau_pid, tau_ff, tau_cmd: (n, 6) N and N m. nu_fb: (n, 6). nu_ref: (n, 14) velocity, acceleration,
    heading, depth. ff_mode, veh_cfg: (n, 1). armed: (n, 1), 1 for armed.
    gnss: (n, 4) latitude deg, longitude deg, speed m/s, course rad.
    recorded_at_boot_s: Unix time at boot time 0 by the clock of the computer that recorded the dive.
    motors: number of motors of the frame that an ArduSub states in the recording (FRAME_CONFIG), 0 if it states none.
    runs: the recordings that the dive is made of, in order of time; empty for a single one. left_out: names of those
    that were not used, each with the reason.
    notes: losses in the recording, in sentences for the user.
    frozen: by signal, the intervals in s in which its readings were frozen and therefore left out.
    sha256, opening: as defined in `ingest.same_dive`.
    """

    name: str
    source: Path
    sha256: str
    velocity: Signal | None = None
    gyro: Signal | None = None
    fog: Signal | None = None
    specific_force: Signal | None = None
    attitude: Signal | None = None
    pressure: Signal | None = None
    depth: Signal | None = None
    altitude: Signal | None = None
    pwm: Signal | None = None
    thrust_cmd: Signal | None = None
    effort: Signal | None = None
    sticks: Signal | None = None
    rpm: Signal | None = None
    voltage: Signal | None = None
    tau_pid: Signal | None = None
    tau_ff: Signal | None = None
    tau_cmd: Signal | None = None
    nu_fb: Signal | None = None
    nu_ref: Signal | None = None
    ff_mode: Signal | None = None
    veh_cfg: Signal | None = None
    armed: Signal | None = None
    gnss: Signal | None = None
    velocity_is_filtered: bool = False
    velocity_at_origin: bool = False
    velocity_late_s: float = 0.0
    velocity_smoothing_s: float = 0.0
    thrust_delay_s: float = 0.0
    thrust_lag_s: float = 0.0
    stamped_s: float = STAMPED_S
    unix_at_boot_s: float | None = None
    recorded_at_boot_s: float | None = None
    motors: int = 0
    commands_hold: bool | None = None
    reckoned: Reckoned | None = None
    opening: str = ""
    notes: tuple[str, ...] = ()
    frozen: dict[str, tuple[tuple[float, float], ...]] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    runs: tuple[Run, ...] = ()
    left_out: tuple[tuple[str, str], ...] = ()

    def note_of(self, kind: Kind) -> str:
        """The first note of that kind; "" without."""
        return next((note for note in self.notes if isinstance(note, Note) and note.kind is kind), "")

    def signals(self) -> dict[str, Signal]:
        """The signals that the recording has, by name."""
        return {name: value for name, value in vars(self).items() if isinstance(value, Signal)}

    @property
    def span_s(self) -> tuple[float, float]:
        """First and last boot time over all signals; (0, 0) for an empty dive."""
        present = [s.time_s for s in self.signals().values() if len(s)]
        if not present:
            return 0.0, 0.0
        return min(float(t[0]) for t in present), max(float(t[-1]) for t in present)

    @property
    def duration_s(self) -> float:
        """Time over which it was recorded, without the time between its runs."""
        start, end = self.span_s
        return end - start - sum(after.start_s - before.end_s for before, after in pairwise(self.runs))

    @property
    def breaks_s(self) -> Array:
        """Times (r - 1,) between its runs, across which nothing is known of how the vehicle moved."""
        return np.array([0.5 * (before.end_s + after.start_s) for before, after in pairwise(self.runs)])

    def between(self, start_s: float, end_s: float) -> "Dive":
        """The part of the dive in [start_s, end_s)."""
        cut: dict[str, Any] = {
            name: signal.between(start_s, end_s) for name, signal in self.signals().items()
        }
        kept = (
            replace(run, start_s=max(run.start_s, start_s), end_s=min(run.end_s, end_s)) for run in self.runs
        )
        return replace(self, **cut, runs=tuple(run for run in kept if run.start_s < run.end_s))

    @property
    def yaw_rate(self) -> Signal | None:
        """Rate of turn about z, (n, 1): the fibre-optic gyro's, else the IMU's; None without readings."""
        if self.fog is not None and len(self.fog):
            return self.fog
        if self.gyro is None or not len(self.gyro):
            return None
        return Signal(self.gyro.time_s, self.gyro.value[:, 2:])

    @property
    def thruster_commands(self) -> Signal | None:
        """The command of each thruster, (n, thrusters): pulses, or else newtons."""
        return self.pwm if self.pwm is not None else self.thrust_cmd

    @property
    def feedforward_acts(self) -> bool:
        """Whether the feed-forward was applied for most of the dive."""
        if self.ff_mode is None or not len(self.ff_mode):
            return False
        modes = [float(mode) for mode in Mode if mode.applies_feedforward]
        return bool(np.mean(np.isin(self.ff_mode.value[:, 0], modes)) > 0.5)

    def depth_by(self, water: Water) -> Signal | None:
        """Depth (n, 1) in m, positive down: as recorded, otherwise from pressure through the water's density."""
        if self.depth is not None or self.pressure is None:
            return self.depth
        return Signal(self.pressure.time_s, water.depth_m(self.pressure.value))

    def configuration_index(self) -> int | None:
        """The VEH_CFG value that held for most of the dive, None if it was never reported."""
        stated = np.zeros(0) if self.veh_cfg is None else self.veh_cfg.value[:, 0]
        values, counts = np.unique(stated[np.isfinite(stated)], return_counts=True)
        if not len(values):
            return None
        return int(values[np.argmax(counts)])
