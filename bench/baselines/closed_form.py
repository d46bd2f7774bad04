"""The source paper's method at its optimum: the closed form of its loss, at once instead of by training.

The result is that of converged training (`bench.reproduce.paper`), with the paper's filter before it; it
states no interval.
"""

import time

from bench.reproduce.paper import SMALL, closed_form, fixed_values, identification, lessons
from bridge.vehicle.config import VehicleFile
from identify.dive import Dive
from identify.identification import Identification
from identify.progress import Progress


def estimate(dive: Dive, file: VehicleFile, configuration: str, progress: Progress) -> Identification:
    """Coefficients that minimise the paper's loss. Raises FitError if the dive excites none of its axes."""
    started = time.perf_counter()
    learnt = lessons(dive, file, configuration, SMALL)
    values = closed_form(learnt.data, fixed_values(file.vehicle.configurations[configuration]))
    progress(1.0, "solved")
    return identification("closed form", values, learnt, dive, file, configuration, started)
