"""How far the gap shrinks: on pieces of the dive that the fit was not taught, and on another dive."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.diagnose.cause import Cause
from identify.diagnose.diagnosis import Shrink
from identify.diagnose.evidence import SCARCE, inverse
from identify.diagnose.flown import Flown, flown, logarithms, slope_of, spoilt_by, wrench_of
from identify.diagnose.nominal import Nominal
from identify.diagnose.search import SEAS, Explanation
from identify.diagnose.whitened import PIECE_S, Whitened, of_the_mean, whitened
from identify.estimators.likelihood_joint import JointLikelihood

Array = NDArray[np.float64]

HORIZON_S = 5.0
FOLDS = 12
"""Pieces of 20 s that are held out lie so many apart: with more at once whole legs would be gone, and what only they
tell."""

LEAST_LEFT = 0.2
"""Share of a mass or a damping that a step leaves at least."""

RESAMPLED, SURE = 400, 0.9
LEAST_GAP = 0.1
"""A drift that exceeds its floor by no more, or no more than chance lets it, leaves nothing to shrink; and a cause that
changes that of a degree of freedom by no more closes nothing there."""

CHANCE = 0.2
"""So far from 1 the drift of a dive of five minutes may be in a degree of freedom by its noise: two standard errors of
an rms over some sixty windows, and what its floor is uncertain by."""


@dataclass(frozen=True)
class Windows:
    """Squares of the 5 s drift before and after (w, 6), in floors, and the piece (w,) in which each window lies."""

    before: Array
    after: Array
    piece: NDArray[np.intp]

    def shrink(self, rng: np.random.Generator) -> Shrink:
        """With a 95 % interval by drawing pieces anew (Efron and Tibshirani 1993, section 8.5)."""
        pieces = np.unique(self.piece)
        sums = np.stack(
            [
                np.stack([one[self.piece == piece].sum(axis=0) for piece in pieces])
                for one in (self.before, self.after)
            ]
        )
        counts = np.array([np.count_nonzero(self.piece == piece) for piece in pieces])
        whole = _by_axis(sums, counts, np.arange(len(pieces)))
        closes = np.abs(whole[0] - whole[1]) > LEAST_GAP
        again = (
            _by_axis(sums, counts, rng.integers(len(pieces), size=len(pieces))) for _ in range(RESAMPLED)
        )
        drawn = np.array([value for one in again if np.isfinite(value := _value(*_totals(one, closes)))])
        before, after, floor = _totals(whole, closes)
        value = _value(before, after, floor)
        if np.isnan(value) or len(drawn) < SURE * RESAMPLED:
            return Shrink(before, after, np.nan, np.nan, np.nan, floor)
        if _overstated(after, floor):
            return Shrink(before, after, value, np.nan, np.nan, floor)
        low, high = np.quantile(drawn, [0.025, 0.975]).tolist()
        return Shrink(before, after, value, low, high, floor)


def overstated(told: Shrink) -> tuple[str, ...]:
    """In a sentence, that a drift lies further below its floor than chance lets it; nothing where it does not."""
    if not _overstated(told.after, told.floor):
        return ()
    return (
        f"With the causes in, the model drifts by {told.after:.2f} floors on pieces held out: what this dive's filters "
        "take for noise, as of velocities that were smoothed on board, overstates the floor, and what the gap shrinks "
        "by counts as 100 % at most, with no interval.",
    )


def _overstated(after: float, floor: float) -> bool:
    """Whether a floor is told too high: nothing then says how sure a shrink is that it makes 100 %."""
    return after < floor - CHANCE


def floor_of(after: Array, closes: NDArray[np.bool_]) -> Array:
    """(6,): the floor of this very dive by degree of freedom.

    It is 1 where the causes close something. Where they change nothing, what is there is what noise comes to in this
    dive, as far as chance lets it: there before and after are off from 1 by the same, and only their difference from
    it would tell of the noise.
    """
    return np.asarray(np.where(closes, 1.0, np.clip(after, 1.0 - CHANCE, 1.0 + CHANCE)))


def _by_axis(sums: Array, counts: NDArray[np.intp], drawn: NDArray[np.intp]) -> Array:
    """(2, 6) rms drifts before and after."""
    return np.asarray(np.sqrt(sums[:, drawn].sum(axis=1) / counts[drawn].sum()))


def _totals(axes: Array, closes: NDArray[np.bool_]) -> tuple[float, float, float]:
    """Rms over degrees of freedom of what drifts before and after (2, 6), and of the floor."""
    fitted = np.isfinite(axes[1])
    three = np.stack([*axes, floor_of(axes[1], closes)])[:, fitted]
    before, after, floor = np.sqrt(np.mean(three**2, axis=1)).tolist()
    return before, after, floor


def _value(before: float, after: float, floor: float) -> float:
    """No model drifts by less than noise: below the floor is chance, or a floor that is told too high."""
    if before - floor <= LEAST_GAP:
        return float("nan")
    return (before - max(after, floor)) / (before - floor)


def held_out(found: Explanation, nominal: Nominal, floor: Array, rng: np.random.Generator) -> Shrink:
    """The prediction for a further dive: every piece by models whose parameters were fitted on the others.

    They are one step of Gauss and Newton away from those of the whole dive. floor (6,): of the 5 s drift. To both
    models the seas of this dive are known: to a further one they are noise.
    """
    ground, fit = found.ground, found.fit
    course, nu, causes = found.now.course, found.now.motion.nu, found.causes
    own = Taught(ground.rows, found.now, fit.slopes, fit.value)
    plain_rows = whitened(nominal.joint, nominal.theta, nominal.doubted)
    plain = Taught(plain_rows, nominal, np.zeros((len(plain_rows.value), 0)), plain_rows.value)
    slope, whole, wrong = slope_of(causes, course), wrench_of(causes, course), spoilt_by(causes, course)
    seas = whole - wrench_of(without_seas(causes), course)
    squares: list[tuple[Array, Array, NDArray[np.intp]]] = []
    for fold in range(FOLDS):
        theta, step = own.without(fold)
        moved = list(causes)
        for (k, p), by in zip(fit.at, step.tolist(), strict=True):
            moved[k] = moved[k].moved(p, by)
        more = wrench_of(moved, course) - whole
        after = flown(found.now, theta, nu, more, slope)
        before = flown(nominal, plain.without(fold)[0], nu + wrong, seas)
        starts, piece = held_windows(after, fold)
        squares.append((squared(before, starts, floor), squared(after, starts, floor), piece))
    return Windows(*(np.concatenate(one) for one in zip(*squares, strict=True))).shrink(rng)


def without_seas(causes: Sequence[Cause]) -> list[Cause]:
    """Those whose forces a further dive meets again; when a wave comes there, nobody knows ahead."""
    return [cause for cause in causes if cause.effect.name not in SEAS]


def unforeseen(causes: Sequence[Cause]) -> tuple[str, ...]:
    """In a sentence, that a shrink is told without seas; nothing where there are none."""
    if len(without_seas(causes)) == len(causes):
        return ()
    return (
        "How far the gap shrinks is told beside waves and currents that come and go, which are noise to any further "
        "dive: no model knows ahead when they do.",
    )


@dataclass(frozen=True)
class Taught:
    """A regression's equations by piece, at a fit: what it would be without some of them."""

    rows: Whitened
    model: Nominal
    slopes: Array
    value: Array

    @cached_property
    def _whole(self) -> Array:
        """Columns (rows, k + 1), what they are to explain last. A rise of a nominal parameter adds its column to the
        innovations, a force that is missing takes its own out."""
        return np.column_stack([-self.rows.nominal, self.slopes, self.value])

    @cached_property
    def _products(self) -> Array:
        """(F, k + 1, k + 1): the columns' products within the pieces of each fold."""
        fold = self.rows.piece % FOLDS
        return np.array([(own := self._whole[fold == k]).T @ own for k in range(FOLDS)])

    def without(self, fold: int) -> tuple[Array, Array]:
        """The fit's theta, and what the slopes' parameters change by, where the pieces of a fold are left out.

        Where nearly all that tells of a parameter lies in these, as in the only leg that dives, the others would move
        it by their noise: as much as is SCARCE speaks for what it is.
        """
        joint, theta = self.model.joint, self.model.theta
        kept = sorted({*joint.mass_places, *of_the_mean(joint)})
        taught = self._products.sum(axis=0) - self._products[fold]
        scarce = SCARCE * np.diag(self._products.sum(axis=0))[:-1]
        precision = scarce + np.concatenate([self.rows.nominal_precision, np.zeros(self.slopes.shape[1])])
        pull = np.zeros(len(precision))
        pull[: len(kept)] = (joint.prior_precision * (joint.prior_mean - theta))[kept]
        step = inverse(taught[:-1, :-1] + np.diag(precision)) @ (taught[:-1, -1] + pull)
        theta = _moved(theta, joint, kept, step[: len(kept)])
        return theta, step[self.rows.nominal.shape[1] :]


def _moved(theta: Array, joint: JointLikelihood, places: Sequence[int], step: Array) -> Array:
    """Theta with some of it a step further: forces are linear in masses and dampings, not in their logarithms, so that
    a long step is one of these."""
    out = theta.copy()
    for at, by in zip(places, step.tolist(), strict=True):
        out[at] += np.log(max(1.0 + by, LEAST_LEFT)) if at in logarithms(joint) else by
    return out


def held_windows(model: Flown, fold: int) -> tuple[NDArray[np.int64], NDArray[np.intp]]:
    """Starts (w,) of the windows that lie whole in the pieces of a fold, a second apart, and their pieces."""
    length = round(HORIZON_S / model.step_s)
    starts = np.arange(0, len(model.time_s) - length - 1, max(round(1.0 / model.step_s), 1))
    piece = ((model.time_s - model.time_s[0]) / PIECE_S).astype(np.intp)
    inside = (piece[starts] == piece[starts + length]) & (piece[starts] % FOLDS == fold)
    return starts[inside], piece[starts[inside]]


def squared(model: Flown, starts: NDArray[np.int64], floor: Array) -> Array:
    """(w, 6) squares of the 5 s drift, in floors; NaN in axes that are not fitted."""
    off = model.off(starts, [round(HORIZON_S / model.step_s)], np.zeros_like(model.nu))[:, 0]
    return np.asarray((off / floor) ** 2)
