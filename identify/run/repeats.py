"""Accept short runs that repeat one manoeuvre, and judge further ones by them.

usual = accept(runs, file, "quadrotor")
judged = judge(more_runs, file, "quadrotor", usual)
judged.verdict, judged.effect, judged.parameters
"""

from collections.abc import Sequence

from bridge.errors import FitError
from bridge.vehicle.config import VehicleFile
from identify.dive import Dive
from identify.repeats import judge as weigh
from identify.repeats.causes import causes_of
from identify.repeats.judge import Judged
from identify.repeats.marks import Run, run_of
from identify.repeats.usual import Usual, usual_of


def accept(dives: Sequence[Dive], file: VehicleFile, configuration: str) -> Usual:
    """Fit what runs of a sound vehicle have in common; runs without a push from rest are left out.

    Raises FitError if too few are left.
    """
    return usual_of(_runs(dives, file, configuration), file.vehicle.configurations[configuration])


def judge(dives: Sequence[Dive], file: VehicleFile, configuration: str, usual: Usual) -> Judged:
    """Say which effect moved further runs, taken together, away from the accepted ones; the more runs, the smaller an
    effect that shows. Raises FitError if none of them goes from rest into a push."""
    runs = _runs(dives, file, configuration)
    if not runs:
        raise FitError("none of the runs goes from rest into a push of some seconds")
    shape = file.vehicle.configurations[configuration]
    causes = causes_of(usual, shape, file.vehicle.water)
    return weigh.judge(usual.marks_of(runs, shape), usual, causes)


def _runs(dives: Sequence[Dive], file: VehicleFile, configuration: str) -> list[Run]:
    runs = []
    for dive in dives:
        try:
            runs.append(run_of(dive, file, configuration))
        except FitError:
            continue
    return runs
