"""Commands that are samples of a faster loop, by when their thrust acts.

Thrust of a loop that is much faster than the recording acts half a step earlier than thrust of commands that hold.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from identify.dive import Dive
from identify.estimators.missing_forces.drag_and_timing import Doubts
from identify.ingest.commands import commands_of_unknown_loop, sampled_slowly
from identify.statistics import Z95, birge_mean

EARLY = -0.1
"""Share of the step between two commands: thrust that acts earlier than by this is none of commands that hold."""


def mean_lateness_s(tests: Iterable[Doubts]) -> tuple[float, float] | None:
    """Mean lateness of the thrust over axes, and its standard error; None where no axis tells it.

    The axes are averaged by their precision; where they disagree beyond their errors, the error of the mean grows by as
    much (Birge 1932).
    """
    late = [test.late for test in tests if test.late.score and test.late.size]
    if not late:
        return None
    return birge_mean(
        np.array([test.size for test in late]), np.diag([(test.size / test.score) ** 2 for test in late])
    )


def with_samples(dive: Dive, tests: Iterable[Doubts]) -> Dive:
    """The dive with its commands taken for samples, straight between them, where thrust is early by part of their step;
    with a note. tests: of the axes of a fit to commands that hold.

    Slow commands are taken so from the start, and where the controller logs its wrench the loop is known.
    """
    commands = commands_of_unknown_loop(dive)
    if commands is None or sampled_slowly(commands) or (late := mean_lateness_s(tests)) is None:
        return dive
    step_s = 1.0 / commands.rate_hz
    if late[0] + Z95 * late[1] >= 0.0 or not -step_s < late[0] < EARLY * step_s:
        return dive
    note = (
        "Thruster commands are taken for samples of a faster loop, straight between them: thrust acts before the "
        "recorded commands come."
    )
    return replace(dive, commands_hold=False, notes=(*dive.notes, note))
