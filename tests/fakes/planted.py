"""Drawn and planted dives with their nominal models and diagnoses, and nobody who watches their progress."""

from dataclasses import replace
from functools import cache

from bench.missions.mission import draw_one
from bridge.vehicle.config import Damping, VehicleFile
from identify.challenge.case import Case, dive_of
from identify.diagnose.causes.search import Explanation, explain
from identify.diagnose.diagnose import diagnose
from identify.diagnose.filters.nominal import Nominal, nominal_of
from identify.diagnose.result import Diagnosis
from identify.dive import Dive


def quiet(*_report: object) -> None:
    """Progress that nobody watches."""


@cache
def drawn_nominal(seed: int = 100_300, seconds: float = 120.0) -> Nominal:
    """The nominal model of a drawn dive without any effect."""
    mission = draw_one(seed, seconds=seconds)
    return nominal_of(mission.dive, mission.file, mission.configuration)


def damped(file: VehicleFile, damping: Damping) -> VehicleFile:
    """A drawn vehicle's file that gives its hull such a damping."""
    ((name, shape),) = file.vehicle.configurations.items()
    hulls = {name: replace(shape, damping=damping)}
    return replace(file, vehicle=replace(file.vehicle, configurations=hulls))


def planted_nominal(case: Case, dive: Dive | None = None) -> Nominal:
    """The nominal model of a case's dive, or of another one of its vehicle."""
    return nominal_of(dive or dive_of(case), case.file, case.configuration)


def explained(nominal: Nominal, *library) -> Explanation:
    return explain(nominal, library, quiet)


def diagnosed(case: Case, *library, dive: Dive | None = None, **options) -> Diagnosis:
    """The diagnosis of a case's dive, or of another one of its vehicle, with a library of its own if one is given."""
    return diagnose(
        dive or dive_of(case),
        case.file,
        case.configuration,
        effects=library or None,
        progress=quiet,
        **options,
    )
