"""Refuses a dive that no method can identify: too short, never pushed, or with equations that have no solution."""

import math
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from bridge.arrays import Array
from bridge.errors import FitError
from bridge.vehicle.coefficients import DOFS, HEAVE, PITCH, ROLL, YAW
from bridge.vehicle.config import VehicleFile
from identify.dive import Dive
from identify.identification import Identification
from identify.thrust.wrench import wrench
from identify.thrust.wrench_history import WrenchHistory
from identify.words import axes_named

SHORTEST_DIVE_S = 20.0

FASTEST = 100.0
"""m/s, and rad/s: no underwater vehicle moves so fast, and such readings drown all others."""


BRAKED_S = 10.0
"""Longest time constant of a vehicle, mass over damping. Without added mass it overestimates the speed."""

LEAST_M_S, LEAST_RAD_S = 0.005, 0.01
"""Smallest speed under thrust that a DVL or a gyro resolves."""

MEAN_S, OFTEN = 1.0, 0.95
"""Interval of the means by which a vehicle is seen to move, and the share of them that may exceed its noise."""

DRIVEN = {0: LEAST_M_S, 1: LEAST_M_S, 2: LEAST_M_S, 3: LEAST_RAD_S, 4: LEAST_RAD_S, 5: LEAST_RAD_S}


def lasting(dive: Dive) -> None:
    """Raise FitError if a dive is too short to identify anything from it, or if no axis was read for long enough: a
    battery's voltage may be logged after all else ended."""
    if round(dive.duration_s) < SHORTEST_DIVE_S:
        raise FitError(
            f"the dive lasts {dive.duration_s:.0f} s, but identification needs at least "
            f"{SHORTEST_DIVE_S:.0f} s; record a longer one",
            of=dive.name,
        )
    together_s = longest_common_s(dive)
    if round(together_s) < SHORTEST_DIVE_S:
        raise FitError(
            f"thruster commands and readings of motion are both in it for {together_s:.0f} s of "
            f"{dive.duration_s:.0f} s, but identification needs at least {SHORTEST_DIVE_S:.0f} s; record a longer one",
            of=dive.name,
        )


def longest_common_s(dive: Dive) -> float:
    """Time for which a dive has thruster commands and readings of the axis that it reads for longest; the whole of it
    without either, and no longer than the dive, of whose runs the time between is none."""
    common = [span_s for dof in range(len(DOFS)) if not math.isnan(span_s := common_s(dive, dof))]
    return min(max(0.0, *common), dive.duration_s) if common else dive.duration_s


def too_short(dive: Dive, dof: int) -> str:
    """Why an axis was read for too short a time to be identified; empty if it was read for long enough.

    Rounded to a second, as in the sentence: the last reading of a recording of 20 s is from before its end.
    """
    span_s = common_s(dive, dof)
    if math.isnan(span_s) or round(span_s) >= SHORTEST_DIVE_S:
        return ""
    speed = "velocity" if dof < 3 else "rate of turn"
    return (
        f"thruster commands and the {speed} in {DOFS[dof]} were both recorded for {max(span_s, 0):.0f} s, but at least "
        f"{SHORTEST_DIVE_S:.0f} s are needed"
    )


def common_s(dive: Dive, dof: int) -> float:
    """Time for which a dive has both thruster commands and readings of an axis's velocity (or of its position or
    angle, if no sensor read the velocity); NaN if either is missing."""
    commands = [
        signal.time_s
        for signal in (dive.thruster_commands, dive.tau_cmd)
        if signal is not None and len(signal)
    ]
    columns = (
        [(dive.velocity, dof)]
        if dof < 3
        else [(dive.gyro, dof - 3), *([(dive.fog, 0)] if dof == YAW else [])]
    )
    known = [s.time_s[np.isfinite(s.value[:, column])] for s, column in columns if s is not None]
    if not any(len(read) for read in known):
        poses = {
            HEAVE: (dive.depth, dive.pressure),
            ROLL: (dive.attitude,),
            PITCH: (dive.attitude,),
            YAW: (dive.attitude,),
        }
        known = [s.time_s[np.isfinite(s.value[:, 0])] for s in poses.get(dof, ()) if s is not None]
    return max(
        (
            float(min(given[-1], read[-1]) - max(given[0], read[0]))
            for given in commands
            for read in known
            if len(read)
        ),
        default=math.nan,
    )


@contextmanager
def solvable(dive: Dive) -> Iterator[None]:
    """Context that raises FitError if the computation within meets a matrix without an inverse, or ends with a value
    that is not finite."""
    try:
        # An overflow shows up in the matrix that it spoils.
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            yield
    except np.linalg.LinAlgError as error:
        raise no_solution(dive) from error


def in_numbers(fit: Identification) -> Identification:
    """Return the fit itself. Raises LinAlgError if its values for the coefficients are not finite."""
    given = [p for p in fit.parameters if p.identifiable and p.name in fit.covariance_of]
    blocks = [fit.covariance, np.array([(p.value, p.std, p.low95, p.high95) for p in given])]
    if fit.information is not None:
        blocks.append(fit.information.matrix)
    if not all(np.isfinite(numbers).all() for numbers in blocks):
        raise np.linalg.LinAlgError("the fit ended at what is no number")
    return fit


def no_solution(dive: Dive) -> FitError:
    """The error that a dive's equations have no solution: in which axes, and what to do about it."""
    fastest = _fastest(dive)
    wild = {dof: speed for dof, speed in fastest.items() if speed > FASTEST}
    look = (
        "look there for readings and thrust that are wildly off, for readings that share one time, and for a mass or "
        "an inertia in the vehicle file that is not this vehicle's"
    )
    if wild:
        speed = max(wild.values())
        look = f"readings there reach {speed:.0e} m/s or rad/s, which no vehicle does: leave them out of the recording"
    axes = sorted(wild or fastest) or _told_by_place(dive)
    return FitError(f"the equations of {axes_named(axes)} have no solution; {look}", of=dive.name)


def _told_by_place(dive: Dive) -> list[int]:
    """The degrees of freedom of a dive without velocity and rates of turn: those that depth and attitude tell of."""
    by_depth = dive.depth is not None or dive.pressure is not None
    return [*([HEAVE] if by_depth else []), *([ROLL, PITCH, YAW] if dive.attitude is not None else [])]


def _fastest(dive: Dive) -> dict[int, float]:
    """Largest speed that was read, m/s or rad/s, by degree of freedom; axes that only read zero are left out."""
    largest: dict[int, float] = {}
    for dof, _, speed in _speeds(dive):
        known = speed[np.isfinite(speed)]
        if known.any():
            largest[dof] = max(largest.get(dof, 0.0), float(np.abs(known).max()))
    return largest


def _speeds(dive: Dive) -> Iterator[tuple[int, Array, Array]]:
    """The degree of freedom, times (n,) and values (n,) of each reading of a speed or a rate of turn."""
    for signal, first in ((dive.velocity, 0), (dive.gyro, 3), (dive.fog, YAW)):
        if signal is not None:
            for dof, column in enumerate(signal.value.T, first):
                yield dof, signal.time_s, column


def refuse_unpushed(dive: Dive, file: VehicleFile, configuration_name: str) -> None:
    """Raise FitError if no thruster pushed enough to move the vehicle."""
    if dive.armed is not None and len(dive.armed) and not np.any(dive.armed.value > 0):
        raise FitError(
            "the vehicle was never armed (HEARTBEAT), so no thruster pushed in all the dive and nothing "
            "can be told of what thrust does; arm it, and dive again with starts, stops and turns under thrust",
            of=dive.name,
        )
    configuration = file.vehicle.configurations[configuration_name]
    forces = wrench(dive, file, configuration_name)
    if not np.nanmax(np.abs(forces.asked), initial=0.0) > 0.0:
        raise FitError(
            "no thruster pushed in all the dive: every command is neutral, or too small to turn a "
            "propeller, so nothing can be told of what thrust does; dive again with starts, stops and turns under "
            "thrust, or check which outputs were recorded",
            of=dive.name,
        )
    mass = np.array([configuration.rigid_body(dof)[0] for dof in range(6)])
    fastest = np.max(np.abs(_driven(forces, mass)), axis=0)
    if all(fastest[dof] < least for dof, least in DRIVEN.items()):
        raise FitError(
            f"the thrusters hardly pushed: by them alone the vehicle never goes faster than "
            f"{1000 * max(fastest[:3]):.1f} mm/s, less than its sensors tell, so nothing can be told of what thrust "
            "does; dive again with starts, stops and turns under thrust",
            of=dive.name,
        )


def refuse_unmoved(dive: Dive) -> None:
    """Raise FitError if no reading of motion ever left its noise, whatever was commanded: a vehicle that is held.

    Speeds are means over MEAN_S, less a bias, at most as large as the least speed: a gyro at rest reads its own. A
    steady cruise is no rest.
    """
    read: dict[int, float] = {}
    for dof, time_s, column in _speeds(dive):
        means = _means(time_s, column)
        if len(means):
            bias = np.clip(np.median(means), -DRIVEN[dof], DRIVEN[dof])
            read[dof] = max(read.get(dof, 0.0), float(np.quantile(np.abs(means - bias), OFTEN)))
    if read and all(speed < DRIVEN[dof] for dof, speed in read.items()):
        raise FitError(
            f"the vehicle hardly moved: what was read of {axes_named(sorted(read))} stays within "
            f"{1000 * LEAST_M_S:.0f} mm/s and {math.degrees(LEAST_RAD_S):.1f} deg/s of rest, so nothing can be told of "
            "what thrust does; let it swim free, and dive again with starts, stops and turns under thrust",
            of=dive.name,
        )


def _means(time_s: Array, values: Array) -> Array:
    """Means of the finite values over intervals of MEAN_S, of intervals that hold any."""
    known = np.isfinite(values)
    if not known.any():
        return np.zeros(0)
    interval = ((time_s[known] - time_s[known][0]) / MEAN_S).astype(np.intp)
    count = np.bincount(interval)
    return np.asarray((np.bincount(interval, values[known]) / np.maximum(count, 1))[count > 0])


def _driven(forces: WrenchHistory, mass: Array) -> Array:
    """Speeds (m, 6) from the commands alone, for mass (6,) and the longest time constant."""
    held_s = np.diff(forces.time_s)
    keep = np.exp(-held_s / BRAKED_S)
    push = BRAKED_S * (1.0 - keep)[:, None] * np.nan_to_num(forces.asked[:-1]) / mass
    out, speed = np.zeros((len(forces.time_s), 6)), np.zeros(6)
    for k, factor in enumerate(keep.tolist()):
        speed = factor * speed + push[k]
        out[k + 1] = speed
    return out
