"""The source paper's method at its optimum: the closed form of its loss, at once instead of by training.

The result is that of converged training (`bench.reproduce.paper`), with the paper's filter before it; it
states no interval.
"""

import math
import time

from bench.reproduce.paper import (
    AT_ZERO,
    PAPER_DOFS,
    SMALL,
    PaperOptions,
    closed_form,
    excited,
    fixed_values,
    samples,
    window_ends,
)
from bridge.errors import FitError
from bridge.vehicle.coefficients import COEFFICIENTS
from bridge.vehicle.config import VehicleFile
from identify.align import aligned
from identify.dive import Dive
from identify.doubt import Outcome
from identify.identification import Identification
from identify.identification import estimate as one_estimate
from identify.progress import Progress


def estimate(
    dive: Dive, file: VehicleFile, configuration: str, progress: Progress, options: PaperOptions = SMALL
) -> Identification:
    """Coefficients that minimise the paper's loss. Raises FitError if the dive excites none of its axes."""
    started = time.perf_counter()
    shape = file.vehicle.configurations[configuration]
    grid = aligned(dive, file, configuration, options.rate_hz, options.cutoff_hz)
    reasons, dofs = excited(grid)
    if not dofs:
        raise FitError(
            f"{dive.source}: nothing to learn ({'; '.join(reasons[d] for d in PAPER_DOFS)}); dive with more motion"
        )
    ends = window_ends(grid, options.window)
    values = closed_form(samples(grid, ends, shape, dofs), fixed_values(shape))
    progress(1.0, "solved")
    nan = math.nan
    return Identification(
        method="closed form",
        outcome=Outcome.AT_BOUND if min(values.values()) < AT_ZERO else Outcome.CONVERGED,
        parameters=tuple(
            one_estimate(c.name, values.get(c.name, nan), nan, nan, nan, reasons.get(c.dof, ""))
            for c in COEFFICIENTS
        ),
        configuration=configuration,
        dive=dive.name,
        dive_sha256=dive.sha256,
        vehicle=file.vehicle.name,
        vehicle_sha256=file.sha256,
        duration_s=dive.duration_s,
        samples=len(ends),
        wall_s=time.perf_counter() - started,
    )
