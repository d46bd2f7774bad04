"""What a dive could identify, before anyone fits anything: how well each coefficient would be known from it alone.

The motion is that which the recorded thrust drives in the vehicle file's model, and the Coriolis forces of the
recorded velocities with it: what waves and sensor noise add to a recorded velocity tells nothing of the vehicle. What
such a motion tells is `planning.information`'s; noise and disturbance are a typical vehicle's. Roll and pitch, which
right themselves, are known by how they swing as well.
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
from identify.estimators.axes import LEAST_COMMANDS_HZ, commands_hz
from identify.estimators.lasting import common_s
from identify.estimators.places import stiffness
from identify.estimators.said import SHORTEST_DIVE_S
from identify.estimators.smoothing import smoothed_velocity
from identify.forces import WrenchHistory, wrench
from identify.identification import LARGEST_RELATIVE_STD
from identify.planning.information import of_motion, of_swinging, of_timing
from identify.planning.knowledge import NAMES, Knowledge, before_any_dive
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
    rate_hz = commands_hz(forces)
    if rate_hz < LEAST_COMMANDS_HZ:
        return _nothing(
            f"thruster commands come at {rate_hz:.1f} Hz, too rarely to know the force between them"
        )
    read = tuple(dof for dof in range(len(DOFS)) if round(_common_s(dive, dof)) >= SHORTEST_DIVE_S)
    if not read:
        return _nothing(f"no axis has thrust and readings of motion together for {SHORTEST_DIVE_S:.0f} s")
    knowledge = _as_recorded(before_any_dive(file, configuration), dive)
    right = [stiffness(file.vehicle.configurations[configuration], dof) for dof in range(len(DOFS))]
    grid = np.arange(forces.time_s[0], forces.time_s[-1], STEP_S)
    driving = _driving(dive, forces, knowledge, grid)
    motion = np.column_stack(
        [_answer(driving[:, dof], knowledge, dof, right[dof]) for dof in range(len(DOFS))]
    )
    share = np.sqrt([_read_share(dive, dof, grid, motion[:, dof]) for dof in range(len(DOFS))])
    motion = share * np.concatenate([motion, motion[-1] * _fading()])
    told = of_motion(STEP_S, motion, knowledge, read, right)
    for dof in read:
        if right[dof] > 0:
            told += _swinging(knowledge, dof, right[dof], _common_s(dive, dof))
    timing = of_timing(STEP_S, motion, knowledge, read, right)
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


def _driving(dive: Dive, forces: WrenchHistory, knowledge: Knowledge, grid: Array) -> Array:
    """Thrust and Coriolis forces (m, 6), means over the step from each time on, less what balances them at first."""
    mass = [knowledge.values[c.name] for c in MASSES]
    speeds = tuple(smoothed_velocity(dive, grid + 0.5 * STEP_S).T)
    carried = np.column_stack([np.broadcast_to(np.asarray(f), len(grid)) for f in coriolis(mass, speeds)])
    force = forces.mean_between(grid, grid + STEP_S) - carried
    return np.asarray(force - force[: round(AT_FIRST_S / STEP_S)].mean(axis=0))


def _answer(force: Array, knowledge: Knowledge, dof: int, stiffness_nm: float) -> Array:
    """The velocity (m,) of M nu_dot + D nu + K int nu = force, from balance, by the ratio of their spectra."""
    mass, damping = knowledge.values[MASSES[dof].name], knowledge.values[DAMPINGS[dof].name]
    # As much silence again behind it, or the end would come round to the beginning.
    spectrum = np.fft.rfft(force, 2 * len(force))
    w = 2 * np.pi * np.fft.rfftfreq(2 * len(force), STEP_S)
    righting = np.divide(stiffness_nm, 1j * w, out=np.zeros(len(w), np.complex128), where=w > 0)
    velocity: Array = np.fft.irfft(spectrum / (1j * w * mass + damping + righting), 2 * len(force))[
        : len(force)
    ]
    return velocity


def _swinging(knowledge: Knowledge, dof: int, stiffness_nm: float, seconds: float) -> Array:
    """(12, 12) information of how an axis that rights itself swings."""
    names = [MASSES[dof].name, DAMPINGS[dof].name]
    mass, damping = (knowledge.values[name] for name in names)
    out = np.zeros((len(NAMES), len(NAMES)))
    places = [NAMES.index(name) for name in names]
    out[np.ix_(places, places)] = of_swinging(seconds, mass, damping, knowledge.noise[dof], stiffness_nm)
    return out


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
