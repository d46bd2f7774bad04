"""How late the thrust acts by slow samples of its commands, which hide when each command changed."""

from dataclasses import replace
from typing import Any

import numpy as np

from identify.dive import Dive, Signal
from identify.estimators.likelihood.joint import JointLikelihood
from identify.estimators.likelihood.start import StartFit
from identify.ingest.commands import SELDOM_HZ

HALF_STEP, OF_FIT = 0.5, 0.25
"""Delays, in samples: of commands that hold until the next, and by the error of the fit."""

MOST_LATE = HALF_STEP + OF_FIT
"""Largest delay, in samples, that slow sampling explains where each command may hold until the next."""


def late_samples_s(start: StartFit) -> float:
    """Delay with which slow samples of the commands act, s; 0 for commands that are known all the time.

    Estimated from all axes that hold information on it, under one prior. A command that holds until the next sample
    acts later, by half the sampling interval, than a command that a fast loop leaves behind.
    """
    axes = [
        (problem, of_axis.start + problem.noise_index - len(problem.axis.timing))
        for problem, of_axis in zip(start.joint.problems, start.joint.slices, strict=True)
        if problem.axis.sampled_s and problem.axis.timing and not problem.axis.is_coloured
    ]
    if not axes:
        return 0.0
    prior = float(start.joint.prior_precision[axes[0][1]])
    _, information = start.joint.score(start.theta)
    variance = np.diag(np.linalg.inv(information + np.diag(start.joint.prior_precision)))
    precision = np.array([1.0 / variance[at] for _, at in axes])
    weighted = precision @ np.array([start.theta[at] for _, at in axes])
    return float(weighted / (np.sum(precision - prior) + prior))


def is_delayed(late_s: float, dive: Dive, start: StartFit) -> bool:
    """Whether the thrust is later than sampling can explain, in a recording from which a delay can be known at all."""
    sampled_s = max(problem.axis.sampled_s for problem in start.joint.problems)
    most = OF_FIT if dive.commands_hold is False else MOST_LATE
    return dive.reckoned is None and most * sampled_s < late_s and sampled_s <= 1.0 / SELDOM_HZ


def is_early(late_s: float, joint: JointLikelihood) -> bool:
    """Whether the thrust is earlier than the error of the fit explains."""
    return late_s < -OF_FIT * max(problem.axis.sampled_s for problem in joint.problems)


def with_later_commands(dive: Dive, by_s: float) -> Dive:
    """The dive with its thruster commands delayed by `by_s`."""
    later: dict[str, Any] = {
        name: Signal(signal.time_s + by_s, signal.value)
        for name, signal in dive.signals().items()
        if name in ("pwm", "thrust_cmd", "tau_cmd")
    }
    return replace(dive, **later)
