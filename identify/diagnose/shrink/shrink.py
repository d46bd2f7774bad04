"""How far the gap shrinks: on held-out pieces, on a check dive, and whether the check dive contradicts the causes.

Every 5 s the simulation restarts from the measured velocity and then uses only recorded thrust and attitude, so the
shrink can be recomputed from these velocities alone.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.vehicle.coefficients import DOFS
from identify.diagnose.result import Prediction
from identify.diagnose.shrink.shrunk import CHANCE, AxisShrink, Shrink

HORIZON_S = 5.0

RESAMPLED, CONFIDENCE = 400, 0.9

LEAST_GAP = 0.1
"""Drift above the floor that leaves a gap to shrink; and the least change of drift in a degree of freedom that counts
as closing one."""

SYMBOLS = "uvwpqr"

UNITS = ("m/s",) * 3 + ("rad/s",) * 3


@dataclass(frozen=True)
class Windows:
    """Squares of the 5 s drift before and after (w, 6), in floors, and the piece (w,) of each window."""

    before: Array
    after: Array
    piece: NDArray[np.intp]

    def shrink(self, rng: np.random.Generator) -> Shrink:
        """Compute the shrink, with a 95 % interval by a bootstrap over pieces (Efron and Tibshirani 1993, section
        8.5)."""
        pieces = np.unique(self.piece)
        sums = np.stack(
            [
                np.stack([drift[self.piece == piece].sum(axis=0) for piece in pieces])
                for drift in (self.before, self.after)
            ]
        )
        counts = np.array([np.count_nonzero(self.piece == piece) for piece in pieces])
        all_axes = _by_axis(sums, counts, np.arange(len(pieces)))
        closes = np.abs(all_axes[0] - all_axes[1]) > LEAST_GAP
        again = (
            _by_axis(sums, counts, rng.integers(len(pieces), size=len(pieces))) for _ in range(RESAMPLED)
        )
        drawn = np.array([value for axes in again if np.isfinite(value := closed(*_totals(axes, closes)))])
        before, after, floor = _totals(all_axes, closes)
        value = closed(before, after, floor)
        if np.isnan(value) or len(drawn) < CONFIDENCE * RESAMPLED:
            return Shrink(before, after, np.nan, np.nan, np.nan, floor)
        if _overstated(after, floor):
            return Shrink(before, after, value, np.nan, np.nan, floor)
        low, high = np.quantile(drawn, [0.025, 0.975]).tolist()
        return Shrink(before, after, value, low, high, floor)


def overstated_note(shrink: Shrink) -> tuple[str, ...]:
    """A sentence on drift significantly below its floor; empty otherwise."""
    if not _overstated(shrink.after, shrink.floor):
        return ()
    return (
        f"With the causes in, the model drifts {shrink.after:.2f} times as far as noise makes it on pieces held out: "
        "what this dive's filters take for noise, as of velocities that were smoothed on board, is overstated, and "
        "what the causes close counts as 100 % at most, with no interval.",
    )


def _overstated(after: float, floor: float) -> bool:
    """Whether the floor is too high for an interval of a shrink near 100 %."""
    return after < floor - CHANCE


def floor_of(after: Array, closes: NDArray[np.bool_]) -> Array:
    """This dive's floor (6,) by degree of freedom.

    It is 1 in degrees of freedom that the causes close. In others the drift itself, within chance, is this dive's
    floor: before and after deviate from 1 alike there, and only noise explains it.
    """
    return np.asarray(np.where(closes, 1.0, np.clip(after, 1.0 - CHANCE, 1.0 + CHANCE)))


def _by_axis(sums: Array, counts: NDArray[np.intp], drawn: NDArray[np.intp]) -> Array:
    """Rms drifts (2, 6) before and after."""
    return np.asarray(np.sqrt(sums[:, drawn].sum(axis=1) / counts[drawn].sum()))


def _totals(axes: Array, closes: NDArray[np.bool_]) -> tuple[float, float, float]:
    """Rms over degrees of freedom of the drifts before and after (2, 6), and of the floor."""
    fitted = np.isfinite(axes[1])
    three = np.stack([*axes, floor_of(axes[1], closes)])[:, fitted]
    before, after, floor = np.sqrt(np.mean(three**2, axis=1)).tolist()
    return before, after, floor


def by_axis(drift: Windows, flown: Prediction) -> tuple[AxisShrink, ...]:
    """The shrink of each fitted degree of freedom, with the errors of the simulated velocities."""
    rms = np.sqrt(np.stack([np.mean(squares, axis=0) for squares in (drift.before, drift.after)]))
    spread = np.std(flown.measured, axis=0)
    errors = [
        np.sqrt(np.mean((simulated - flown.measured) ** 2, axis=0)) / np.where(spread > 0, spread, np.nan)
        for simulated in (flown.before, flown.after, flown.baseline)
    ]
    noise = floor_of(rms[1], np.abs(rms[0] - rms[1]) > LEAST_GAP)
    out = []
    for dof in np.flatnonzero(np.isfinite(flown.floor)).tolist():
        before, after = rms[:, dof].tolist()
        floor, value = float(flown.floor[dof]), closed(before, after, float(noise[dof]))
        nrmse = [float(squares[dof]) for squares in errors]
        out.append(AxisShrink(DOFS[dof], before * floor, after * floor, floor, value, *nrmse))
    return tuple(out)


def closed(before: float, after: float, floor: float = 1.0) -> float:
    """Share of the closable gap that closes; NaN without a gap.

    No model drifts by less than noise, so a drift below the floor is chance, or an overstated floor.
    """
    if before - floor <= LEAST_GAP:
        return float("nan")
    return (before - max(after, floor)) / (before - floor)


def csv_of(prediction: Prediction) -> str:
    """The prediction as CSV: header lines that begin with #, then a line per instant."""
    fitted = [dof for dof in range(6) if np.isfinite(prediction.floor[dof])]
    floors = ", ".join(f"{DOFS[dof]} {prediction.floor[dof]:.6g} {UNITS[dof]}" for dof in fitted)
    lines = [
        f"# {prediction.dive}: velocities in body axes (x forward, y right, z down), m/s and rad/s, open loop from the "
        f"measured velocity, started anew every {HORIZON_S:g} s (window).",
        "# measured: smoothed; before: the nominal model; after: with the causes in; baseline: least squares with "
        "linear and quadratic drag and a delay.",
        f"# floor, rms after {HORIZON_S:g} s by noise alone: {floors}.",
        "# drift: before, or after, less measured in the last line of each window, rms over windows, over the floor, "
        f"and the rms of that over {len(fitted)} degrees of freedom; shrink = (before - after) / (before - floor), "
        f"after no less than floor, and no number where before is no more than {LEAST_GAP:g} over floor: there is too "
        "little to shrink.",
        f"# floor of this dive: the rms over degrees of freedom of 1 where before and after differ by more than "
        f"{LEAST_GAP:g}, and else, for there no cause closes anything and noise is all that there is, of after within "
        f"{1 - CHANCE:g} and {1 + CHANCE:g}.",
    ]
    ways = {
        "measured": prediction.measured,
        "before": prediction.before,
        "after": prediction.after,
        "baseline": prediction.baseline,
    }
    names = [f"{what}_{SYMBOLS[dof]}" for what in ways for dof in fitted]
    lines.append(",".join(["time_s", "window", *names]))
    values = np.column_stack([way[:, fitted] for way in ways.values()])
    for at_s, window, row in zip(prediction.time_s, prediction.window, values, strict=True):
        lines.append(f"{at_s:.3f},{window}," + ",".join(f"{value:.6f}" for value in row))
    return "\n".join(lines) + "\n"
