"""The estimators by name. A method is imported when it is asked for: torch takes seconds to load."""

from collections.abc import Callable
from importlib import import_module
from typing import cast

from bridge.errors import ConfigError
from bridge.vehicle.config import VehicleFile
from identify.dive import Dive
from identify.identification import Identification

Progress = Callable[[float, str], None]
Estimator = Callable[[Dive, VehicleFile, str, Progress], Identification]

METHODS = {
    "likelihood": "identify.estimators.likelihood",
    "paper": "identify.estimators.paper",
}
DEFAULT = "likelihood"


def estimator(method: str) -> Estimator:
    """The `estimate` of a method. Raises ConfigError for a name that is not in METHODS."""
    if method not in METHODS:
        raise ConfigError(f"there is no method '{method}'; take one of {', '.join(METHODS)}")
    return cast(Estimator, import_module(METHODS[method]).estimate)
