"""Fisher scoring of a Gaussian innovations likelihood: maximise it, with Levenberg's damping, and compute its
information.

For innovations e with variance S (Gupta and Mehra 1974, IEEE TAC 19(6), eqs 27 and 35):
    log L = -1/2 sum(log S + e^2/S),   J_ij = sum(de_i de_j / S) + 1/2 sum(dS_i dS_j / S^2).
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from bridge.arrays import Array

MOST_STEPS = 60
LARGEST_MOVE = 7000.0
"""Largest step in units of `Problem.difference`: long enough for progress, short enough for the information to hold."""

ENOUGH = 1e-3

OVERSHOT = 3.0
"""A step that gains less than its slope over this has gone more than a third beyond the summit of its parabola."""

LEAPT = 4.0
"""A step that loses more than this many times its slope has left the parabola."""


class Problem(Protocol):
    """A likelihood of parameters theta (p,), with a Gaussian prior on each."""

    @property
    def difference(self) -> Array:
        """A small change (p,) of each parameter, in which steps are measured."""
        ...

    @property
    def prior_mean(self) -> Array:
        """Mean (p,) of the prior."""
        ...

    @property
    def prior_precision(self) -> Array:
        """One over the prior's variance, (p,); 0 for no prior."""
        ...

    def log_likelihood(self, theta: Array) -> float:
        """Log likelihood, without constants; -inf if rounding has spoilt a variance."""
        ...

    def score(self, theta: Array) -> tuple[Array, Array]:
        """Gradient (p,) of the log likelihood, and information (p, p)."""
        ...


@dataclass(frozen=True)
class Maximum:
    """End of the climb; `information` (p, p) is the data's alone, `precision` adds the prior's."""

    theta: Array
    log_likelihood: float
    information: Array
    precision: Array
    steps: int
    converged: bool


def log_posterior(problem: Problem, theta: Array) -> float:
    """log L plus the log of the prior, without constants; -inf if rounding has spoilt a variance."""
    off = theta - problem.prior_mean
    return problem.log_likelihood(theta) - 0.5 * float(np.sum(problem.prior_precision * off**2))


def slopes(
    innovations: Callable[[Array], tuple[Array, Array]], theta: Array, difference: Array, of: Iterable[int]
) -> tuple[Array, Array]:
    """Derivatives of innovations and of their variances by the parameters with indices `of`, (k, n) each, by central
    differences."""
    de, ds = [], []
    for i in of:
        h, moved = difference[i], theta.copy()
        moved[i] = theta[i] + h
        e_up, s_up = innovations(moved)
        moved[i] = theta[i] - h
        e_down, s_down = innovations(moved)
        de.append((e_up - e_down) / (2 * h))
        ds.append((s_up - s_down) / (2 * h))
    return np.array(de), np.array(ds)


def climb(problem: Problem, start: Array, enough: float = ENOUGH, least: float = -np.inf) -> Maximum:
    """Climb to the maximum of the posterior from `start`; converged when a step gains less than `enough` nats.

    A climb that twice the gain foretold at a step would not bring up to `least` ends there, not converged.

    Raises LinAlgError if the information has no inverse, or is not finite.
    """
    theta = start.copy()
    value = log_posterior(problem, theta)
    damping = 1e-3
    prior = np.diag(problem.prior_precision)
    for step in range(1, MOST_STEPS + 1):
        gradient, information = problem.score(theta)
        gradient = gradient - problem.prior_precision * (theta - problem.prior_mean)
        precision = information + prior
        if not np.isfinite(precision).all():
            raise np.linalg.LinAlgError("the information is no number")
        if value + float(gradient @ np.linalg.solve(precision, gradient)) < least:
            return Maximum(theta, value, information, precision, step, converged=False)
        scale = np.diag(precision) + 1e-12
        gain = 0.0
        while damping < 1e8:
            move: Array = np.asarray(np.linalg.solve(precision + damping * np.diag(scale), gradient))
            move *= min(1.0, LARGEST_MOVE / max(float(np.max(np.abs(move) / problem.difference)), 1e-12))
            rise = float(gradient @ move)
            move, trial = _not_beyond(problem, theta, value, move, rise)
            gain = trial - value
            if np.isfinite(trial) and gain >= 0:
                theta, value, damping = theta + move, trial, max(damping / 10, 1e-9)
                break
            if rise < enough:
                # No shorter step gains as much.
                break
            damping *= 10
        if gain < enough:
            converged = damping < 1e8
            return Maximum(theta, value, information, precision, step, converged)
    return Maximum(theta, value, information, precision, MOST_STEPS, False)


def _not_beyond(
    problem: Problem, theta: Array, value: float, move: Array, rise: float
) -> tuple[Array, float]:
    """Return a move from theta of slope `rise`, and the log posterior at its end; a shorter move if this one passes
    the summit.

    If the likelihood of the readings is twice as curved as expected, a whole step lands as far beyond the summit as
    it began before it, gains nothing, and would look converged. If it is more curved still, the step loses.
    """
    end = log_posterior(problem, theta + move)
    gain = end - value
    if not -LEAPT * rise <= gain < rise / OVERSHOT:
        return move, end
    nearer: Array = move * (rise / (2.0 * (rise - gain)))
    between = log_posterior(problem, theta + nearer)
    return (nearer, between) if between > end else (move, end)
