"""Plan the next dive: from the vehicle file alone, or from all that an earlier dive tells."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

from bridge.vehicle.config import VehicleFile
from identify.dive import Dive
from identify.estimators.table import DEFAULT, estimator
from identify.planning.knowledge import after, before_any_dive
from identify.planning.limits import Limits, Tank
from identify.planning.propose import DOFS_PLANNED, NO_AIMS, Proposal, propose
from identify.progress import Step, Steps, ignore_step

OF: Final = "plan"


def plan(
    tank: Tank,
    limits: Limits,
    seconds: float,
    dofs: Sequence[int] = DOFS_PLANNED,
    progress: Steps = ignore_step,
    know: Sequence[str] = (),
    aims: Mapping[str, float] = NO_AIMS,
) -> Proposal:
    """Propose the manoeuvres for `seconds` in total, for the coefficients `know` or for all, first for those that are
    known worse than to their relative standard deviation in `aims`. Raises FitError if none fits."""
    return propose(tank, limits, seconds, dofs, _steps(progress), know, aims)


def before_dives(file: VehicleFile) -> Tank:
    """What is known from the vehicle file. Raises ConfigError if its configuration is open."""
    name = file.configuration_chosen()
    return Tank(file, name, before_any_dive(file, name))


def after_identification(identified: Mapping[str, Any], file: VehicleFile, source: str) -> Tank:
    """What is known after an identification, given as its JSON and named `source` in messages.

    Raises ConfigError if it fits neither vehicle nor configuration.
    """
    name = file.configuration or file.vehicle.configuration_named(str(identified.get("configuration")))
    return Tank(file, name, after(identified, file, name, source))


def after_dive(dive: Dive, file: VehicleFile, source: str, progress: Steps = ignore_step) -> Tank:
    """What is known after a dive, which is identified here. Raises ConfigError; FitError if the dive tells nothing."""
    name = file.configuration_of(dive.configuration_index())
    identified = estimator(DEFAULT)(dive, file, name, _steps(progress)).to_json()
    return Tank(file, name, after(identified, file, name, source))


def _steps(progress: Steps) -> Callable[..., None]:
    def step(share: float, words: str, *_: object) -> None:
        progress(Step(OF, share, words))

    return step
