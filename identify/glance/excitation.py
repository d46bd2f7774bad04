"""What a dive could identify, before anyone fits anything: how well each coefficient would be known from it alone.

The motion is that which the recorded thrust drives in the vehicle file's model, and the Coriolis forces of the
recorded velocities with it: what waves and sensor noise add to a recorded velocity tells nothing of the vehicle. What
such forces tell is `planning.information`'s; noise and disturbance are a typical vehicle's. A mass is known by its own
axis and by the Coriolis forces that it makes in others; roll and pitch, which right themselves, by how they swing, too,
as far as the vehicle file knows what rights them.
"""

import contextlib
import math
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from bridge.errors import FitError
from bridge.simulator.noise import TYPICAL
from bridge.vehicle.coefficients import COEFFICIENTS, DAMPINGS, DOFS, MASSES
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.dynamics import coriolis
from identify.dive import Array, Dive, Signal
from identify.estimators.axes import LEAST_COMMANDS_HZ
from identify.estimators.doubts import LATER_S
from identify.estimators.lasting import common_s
from identify.estimators.places import stiffness
from identify.estimators.said import SHORTEST_DIVE_S
from identify.estimators.smoothing import smoothed_velocity
from identify.forces import wrench
from identify.identification import LARGEST_RELATIVE_STD
from identify.planning.information import of_forces, of_swinging
from identify.planning.knowledge import NAMES, AxisNoise, Knowledge, before_any_dive
from identify.planning.propose import relative_std, stamped

STEP_S: Final = 0.05
FADE_S: Final = 20.0
"""A motion with which a recording ends is let fade over so long: an end at once would tell more than any manoeuvre."""

AT_FIRST_S: Final = 1.0
"""A dive begins in balance, at rest as a rule: what its thrust is then holds it against buoyancy."""

MISSED_PERIODS: Final = 3.0
YAW: Final = 5
LEAST_ENERGY: Final = 1e-18


@dataclass(frozen=True)
class Excited:
    """One coefficient; `relative_std` is inf where the dive says nothing of it."""

    name: str
    relative_std: float

    @property
    def identifiable(self) -> bool:
        return self.relative_std <= LARGEST_RELATIVE_STD


@dataclass(frozen=True)
class Excitation:
    """All twelve coefficients in their order, and `note`: why a dive says nothing at all, empty where it does."""

    coefficients: tuple[Excited, ...]
    note: str = ""

    def to_json(self) -> dict[str, Any]:
        rows = [
            {
                "name": c.name,
                "relative_std": c.relative_std if np.isfinite(c.relative_std) else None,
                "identifiable": c.identifiable,
            }
            for c in self.coefficients
        ]
        return {"coefficients": rows, "note": self.note}


@dataclass(frozen=True)
class Span:
    """One axis at a glance: for how many seconds thrust and speed were both recorded, and the 1 to 99 % span of each.

    `thrust` in N or N m, `speed` in m/s or rad/s; NaN where nothing was recorded.
    """

    axis: str
    seconds: float
    thrust: float
    speed: float


def excitation(dive: Dive, file: VehicleFile, configuration: str) -> Excitation:
    """How well each coefficient would be known from this dive alone, no prior."""
    try:
        forces = wrench(dive, file, configuration)
    except FitError as error:
        return _nothing(str(error))
    apart_s = np.diff(forces.time_s)
    rate_hz = 1.0 / max(float(np.median(apart_s)), 1e-9) if len(apart_s) else 0.0
    if rate_hz < LEAST_COMMANDS_HZ:
        return _nothing(
            f"thruster commands come at {rate_hz:.1f} Hz, too rarely to know the force between them"
        )
    read = tuple(dof for dof in range(len(DOFS)) if round(_common_s(dive, dof)) >= SHORTEST_DIVE_S)
    if not read:
        return _nothing(f"no axis has thrust and readings of motion together for {SHORTEST_DIVE_S:.0f} s")
    knowledge = _as_recorded(before_any_dive(file, configuration), dive)
    shape = file.vehicle.configurations[configuration]
    grid = np.arange(forces.time_s[0], forces.time_s[-1], STEP_S)
    thrust = forces.mean_between(grid, grid + STEP_S)
    thrust = thrust - thrust[: round(AT_FIRST_S / STEP_S)].mean(axis=0)
    speeds = smoothed_velocity(dive, grid + 0.5 * STEP_S)
    told, timing = np.zeros((len(NAMES), len(NAMES))), np.zeros((len(read), len(NAMES)))
    for row, dof in enumerate(read):
        axis = _Axis(dof, knowledge, stiffness(shape, dof))
        found, velocity = axis.information(thrust[:, dof], axis.coriolis(speeds))
        found *= _read_share(dive, dof, grid, velocity)
        told += found[:-1, :-1]
        timing[row] = found[-1, :-1]
        if axis.stiffness > 0:
            told += axis.by_swinging(_common_s(dive, dof))
    std = relative_std(stamped(told, timing))
    return Excitation(tuple(Excited(c.name, float(s)) for c, s in zip(COEFFICIENTS, std, strict=True)))


def spans(dive: Dive, file: VehicleFile | None = None, configuration: str = "") -> tuple[Span, ...]:
    """The six axes at a glance, without any model of the hull: thrust by TAU_CMD, else by the file's thrusters."""
    asked = dive.tau_cmd
    if asked is None and file is not None:
        with contextlib.suppress(FitError):
            forces = wrench(dive, file, configuration)
            asked = Signal(forces.time_s, forces.asked)
    return tuple(
        Span(
            axis,
            max(_common_s(dive, dof), 0.0),
            _span(asked, dof),
            _span(*_reading(dive, dof)),
        )
        for dof, axis in enumerate(DOFS)
    )


def _nothing(note: str) -> Excitation:
    return Excitation(tuple(Excited(c.name, math.inf) for c in COEFFICIENTS), note)


def _common_s(dive: Dive, dof: int) -> float:
    """For how long an axis has both thrust and readings; 0 where either lacks."""
    span_s = common_s(dive, dof)
    return 0.0 if math.isnan(span_s) else span_s


def _reading(dive: Dive, dof: int) -> tuple[Signal | None, int]:
    """The signal that reads an axis's velocity, and its column."""
    if dof < 3:
        return dive.velocity, dof
    return (dive.fog, 0) if dof == YAW and dive.fog is not None else (dive.gyro, dof - 3)


def _span(signal: Signal | None, column: int) -> float:
    known = np.zeros(0) if signal is None else signal.value[:, column]
    known = known[np.isfinite(known)]
    return float(np.diff(np.percentile(known, (1, 99)))[0]) if len(known) else math.nan


def _as_recorded(knowledge: Knowledge, dive: Dive) -> Knowledge:
    """With the DVL's noise at the rate that was recorded, and without depth where that was not."""
    noise = list(knowledge.noise)
    if dive.velocity is not None and dive.velocity.rate_hz > 0:
        slowest = TYPICAL.dvl_m_s**2 / dive.velocity.rate_hz
        noise[:3] = [replace(one, velocity=max(one.velocity, slowest)) for one in noise[:3]]
    if dive.pressure is None and dive.depth is None:
        noise[2] = replace(noise[2], position=math.inf)
    return replace(knowledge, noise=tuple(noise))


@dataclass(frozen=True)
class _Axis:
    """One degree of freedom of the vehicle file's model: M nu_dot + D nu + K int nu = thrust - Coriolis force."""

    dof: int
    knowledge: Knowledge
    stiffness: float

    @property
    def mass(self) -> float:
        return self.knowledge.values[MASSES[self.dof].name]

    @property
    def damping(self) -> float:
        return self.knowledge.values[DAMPINGS[self.dof].name]

    @property
    def noise(self) -> AxisNoise:
        return self.knowledge.noise[self.dof]

    def coriolis(self, nu: Array) -> Array:
        """(m, 6): what each of the six masses has in this axis's Coriolis force at velocities (m, 6)."""
        columns = []
        for place, mass in enumerate(self.knowledge.values[c.name] for c in MASSES):
            alone = [mass if place == k else 0.0 for k in range(len(MASSES))]
            columns.append(np.broadcast_to(np.asarray(coriolis(alone, tuple(nu.T))[self.dof]), len(nu)))
        return np.column_stack(columns)

    def information(self, thrust: Array, carried: Array) -> tuple[Array, Array]:
        """(13, 13) of log coefficients and of when thrust acts, s; the velocity (m,) that this takes.

        `thrust` (m,) beyond what balances the axis at first, `carried` (m, 6) as `coriolis` gives it.
        """
        velocity, acceleration, later = self._answer(thrust - carried.sum(axis=1), thrust)
        changed = np.zeros((len(thrust), len(NAMES) + 1))
        changed[:, : len(MASSES)] = carried
        changed[:, self.dof] += self.mass * acceleration
        changed[:, len(MASSES) + self.dof] = self.damping * velocity
        changed[:, -1] = later
        changed = np.concatenate([changed, changed[-1] * _fading()])
        found = of_forces(STEP_S, changed, self.mass, self.damping, self.noise, self.stiffness)
        return found, velocity

    def by_swinging(self, seconds: float) -> Array:
        """(12, 12) information of how an axis that rights itself swings."""
        out = np.zeros((len(NAMES), len(NAMES)))
        places = [self.dof, len(MASSES) + self.dof]
        out[np.ix_(places, places)] = of_swinging(
            seconds, self.mass, self.damping, self.noise, self.stiffness
        )
        return out

    def _answer(self, force: Array, thrust: Array) -> tuple[Array, Array, Array]:
        """Velocity and acceleration (m,) from balance, and what `thrust` changes by a second that it comes later."""
        # As much silence again behind it, or the end would come round to the beginning.
        count, twice = len(force), 2 * len(force)
        jw = 2j * np.pi * np.fft.rfftfreq(twice, STEP_S)
        righting = np.divide(self.stiffness, jw, out=np.zeros(len(jw), np.complex128), where=jw != 0)
        speed = np.fft.rfft(force, twice) / (jw * self.mass + self.damping + righting)
        later = np.fft.rfft(thrust, twice) * jw / (1 + jw * LATER_S)
        of_speed, of_slope, of_later = (np.fft.irfft(s, twice)[:count] for s in (speed, jw * speed, later))
        return of_speed, of_slope, of_later


def _fading() -> Array:
    """(k, 1) from 1 to 0 within FADE_S, as a cosine does."""
    return np.asarray(0.5 + 0.5 * np.cos(np.pi * np.arange(STEP_S, FADE_S, STEP_S) / FADE_S))[:, None]


def _read_share(dive: Dive, dof: int, grid: Array, velocity: Array) -> float:
    """Share of the motion's energy while its readings said something."""
    signal, column = _reading(dive, dof)
    energy = velocity**2
    if signal is None or not energy.sum() > LEAST_ENERGY:
        return 0.0
    known_s = signal.time_s[np.isfinite(signal.value[:, column])]
    if len(known_s) < 2:
        return 0.0
    after = np.clip(np.searchsorted(known_s, grid), 1, len(known_s) - 1)
    gap_s = known_s[after] - known_s[after - 1]
    inside = (grid >= known_s[0]) & (grid <= known_s[-1]) & (gap_s <= MISSED_PERIODS / signal.rate_hz)
    return float(energy[inside].sum() / energy.sum())
