"""The estimators by name. A method is imported when it starts: while torch loads, another method is already running."""

from collections.abc import Callable
from importlib import import_module
from typing import cast

from bridge.errors import ConfigError, FitError
from bridge.vehicle.config import VehicleFile
from identify.dive import Dive
from identify.estimators.answer import answered
from identify.estimators.refusals import in_numbers, solvable
from identify.identification import Identification
from identify.progress import Progress

Estimator = Callable[[Dive, VehicleFile, str, Progress], Identification]

METHODS = {"likelihood": "identify.estimators.likelihood.answer", "pinn": "identify.estimators.pinn.answer"}
DEFAULT = "likelihood"
SIDE_BY_SIDE = (DEFAULT, "pinn")
"""The methods that `identify` runs on every dive if no method is named; the second is compared with the first."""
OF_QUADRATIC = (DEFAULT,)
"""The methods whose model has quadratic damping, for vehicle files with such a hull."""


def estimator(method: str) -> Estimator:
    """Return a method's `estimate`, with its result judged as for every method: see `identify.estimators.answer`.

    `method` is a name of METHODS, or the module of a method that lives elsewhere, named after it. Raises ConfigError
    for any other name.
    """
    if method not in METHODS and "." not in method:
        raise ConfigError(f"there is no method '{method}'; take one of {', '.join(METHODS)}")

    def fit(dive: Dive, file: VehicleFile, configuration_name: str, progress: Progress) -> Identification:
        refuse_damping(method.rpartition(".")[2], file, configuration_name)
        module = import_module(METHODS.get(method, method))
        return cast(Estimator, module.estimate)(dive, file, configuration_name, progress)

    return judged(fit)


def refuse_damping(method: str, file: VehicleFile, configuration_name: str) -> None:
    """Raise FitError if the hull has a damping that the method's model lacks: its values would be wrong."""
    damping = file.vehicle.configurations[configuration_name].damping
    if damping != "linear" and method not in OF_QUADRATIC:
        raise FitError(
            f"the vehicle file says damping: {damping}, and the model of method '{method}' has linear damping alone: "
            f"its values would be wrong; take --method {DEFAULT}"
        )


def judged(fit: Estimator) -> Estimator:
    """Return the estimator with its results passed through `answered`; it refuses a dive without a solution."""

    def estimate(
        dive: Dive, file: VehicleFile, configuration_name: str, progress: Progress
    ) -> Identification:
        with solvable(dive):
            return answered(in_numbers(fit(dive, file, configuration_name, progress)), dive, file)

    return estimate
