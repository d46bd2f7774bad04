"""Accept short runs that repeat one manoeuvre, and judge further ones by them.

usual = accept(runs, file, "quadrotor")
judged = judge(more_runs, file, "quadrotor", usual)
judged.verdict, judged.finding
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bridge.errors import FitError
from bridge.vehicle.config import VehicleFile
from identify.dive import Dive
from identify.repeats import judge as weigh
from identify.repeats.judge import Judged, causes_of
from identify.repeats.marks import FEWEST, Run, Usual, run_of, usual_of


def accept(dives: Sequence[Dive], file: VehicleFile, configuration_name: str) -> Usual:
    """Fit the marks that runs of a sound vehicle have in common; runs without a push from rest are left out.

    Raises FitError if too few are left.
    """
    return usual_of(_runs(dives, file, configuration_name), file.vehicle.configurations[configuration_name])


def judge(dives: Sequence[Dive], file: VehicleFile, configuration_name: str, usual: Usual) -> Judged:
    """Say which effect moved further runs, taken together, away from the accepted ones; the more runs, the smaller an
    effect that shows. Raises FitError if none of them goes from rest into a push, or the vehicle file has another
    number of thrusters than the accepted runs."""
    configuration = file.vehicle.configurations[configuration_name]
    if len(usual.thrust_n) != len(configuration.thrusters):
        raise FitError(
            f"the accepted runs are of {len(usual.thrust_n)} thrusters, the vehicle file has "
            f"{len(configuration.thrusters)}; give those that were accepted for this vehicle"
        )
    runs = _runs(dives, file, configuration_name)
    if not runs:
        raise FitError("none of the runs goes from rest into a push of some seconds")
    causes = causes_of(usual, configuration, file.vehicle.water)
    return weigh.judge(usual.marks_of(runs, configuration), usual, causes)


def runs_as_dives(dive: Dive) -> list[Dive]:
    """The runs that a dive is made of, each as a dive; the dive alone if it is one run."""
    if not dive.runs:
        return [dive]
    return [
        replace(dive.between(run.start_s, float(np.nextafter(run.end_s, np.inf))), name=run.name, runs=())
        for run in dive.runs
    ]


def repeats(dive: Dive, file: VehicleFile, configuration_name: str) -> bool:
    """Whether most runs of a dive go from rest into a steady push."""
    dives = runs_as_dives(dive)
    return len(_runs(dives, file, configuration_name)) > len(dives) / 2


def usual_in(dive: Dive, file: VehicleFile, configuration_name: str) -> Usual | None:
    """Marks that the runs of a dive have in common; None if too few of them go from rest into a push to tell."""
    dives = runs_as_dives(dive)
    if len(dives) < FEWEST:
        return None
    try:
        return accept(dives, file, configuration_name)
    except FitError:
        return None


def _runs(dives: Sequence[Dive], file: VehicleFile, configuration_name: str) -> list[Run]:
    runs = []
    for dive in dives:
        try:
            runs.append(run_of(dive, file, configuration_name))
        except FitError:
            continue
    return runs
