"""Compares surface fixes with dead reckoning, to check the DVL's scale and the heading.

Between two surfacings the fixes give a displacement over ground, and velocity turned by attitude gives another. As
complex numbers (north + i east) their ratio is a scale and a rotation, by least squares over all pairs of successive
surfacings.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from identify.dive import Dive
from identify.ingest.rotation import attitude_at, to_earth

EARTH_RADIUS_M = 6_371_008.8
APART_S = 10.0
FEWEST_FIXES = 3
LEAST_FIX_STD_M = 0.5
"""A receiver's errors are correlated over seconds: the mean of a surfacing is no better than this."""

STEP_S = 0.1


@dataclass(frozen=True)
class FixCheck:
    """Result of comparing fixes with dead reckoning.

    scale: distance over ground by distance of the DVL. heading_rad: angle of the true course clockwise of the
    reckoned course. Both with standard deviations. distance_m: length of the longest leg between two surfacings.
    """

    surfacings: int
    distance_m: float
    scale: float
    scale_std: float
    heading_rad: float
    heading_std_rad: float

    @property
    def sentence(self) -> str:
        if self.scale_std > 0.5:
            return (
                f"{self.surfacings} surfacings at most {self.distance_m:.0f} m apart: too near each other to check the "
                "DVL's scale and the heading by their fixes."
            )
        return (
            f"Surface fixes against dead reckoning over {self.distance_m:.0f} m: the DVL's distances times "
            f"{self.scale:.3f} +- {self.scale_std:.3f}, its course {math.degrees(self.heading_rad):+.1f} +- "
            f"{math.degrees(self.heading_std_rad):.1f} degrees (standard deviations)."
        )


def check_fixes(dive: Dive) -> FixCheck | None:
    """Run the check; None without two surfacings with fixes, or without velocity and attitude between them."""
    fixes = _fixes(dive)
    if fixes is None or dive.velocity is None or dive.attitude is None or len(dive.velocity) < 2:
        return None
    time_s, place = fixes
    runs = np.split(np.arange(len(time_s)), np.flatnonzero(np.diff(time_s) > APART_S) + 1)
    runs = [run for run in runs if len(run) >= FEWEST_FIXES]
    if len(runs) < 2:
        return None
    grid = np.arange(time_s[0], time_s[-1] + STEP_S, STEP_S)
    way = np.concatenate([[0j], np.cumsum(_over_ground(dive, grid)) * STEP_S])[:-1]
    reckoned = np.interp(time_s, grid, way.real) + 1j * np.interp(time_s, grid, way.imag)
    off = [float(np.std(place[run] - reckoned[run])) / math.sqrt(len(run)) for run in runs]
    spreads = np.maximum(off, LEAST_FIX_STD_M)
    measured = np.diff([place[run].mean() for run in runs])
    expected = np.diff([reckoned[run].mean() for run in runs])
    power = float(np.sum(np.abs(expected) ** 2))
    if power == 0.0:
        return None
    ratio = complex(np.sum(np.conj(expected) * measured) / power)
    noise = spreads[1:] ** 2 + spreads[:-1] ** 2
    std = math.sqrt(float(np.sum(np.abs(expected) ** 2 * noise))) / power
    size = abs(ratio)
    turn = math.atan2(ratio.imag, ratio.real)
    return FixCheck(len(runs), float(np.abs(measured).max()), size, std, turn, std / max(size, 1e-9))


def _fixes(dive: Dive) -> tuple[Array, NDArray[np.complex128]] | None:
    """Times and places (north + i east, m, from the first fix) of the fixes; None if there are too few."""
    if dive.gnss is None:
        return None
    good = np.isfinite(dive.gnss.value[:, :2]).all(axis=1)
    time_s, degrees = dive.gnss.time_s[good], dive.gnss.value[good, :2]
    if len(time_s) < FEWEST_FIXES:
        return None
    north = np.radians(degrees[:, 0] - degrees[0, 0]) * EARTH_RADIUS_M
    east = np.radians(degrees[:, 1] - degrees[0, 1]) * EARTH_RADIUS_M * math.cos(math.radians(degrees[0, 0]))
    return time_s, north + 1j * east


def _over_ground(dive: Dive, time_s: Array) -> NDArray[np.complex128]:
    """Velocity over ground (m,), north + i east, from body velocity and attitude."""
    assert dive.velocity is not None
    assert dive.attitude is not None
    north, east, _ = np.nan_to_num(to_earth(attitude_at(dive.attitude, time_s), dive.velocity.at(time_s))).T
    result: NDArray[np.complex128] = north + 1j * east
    return result
