"""What an estimator answers: coefficients with intervals, an outcome in a sentence, and where it came from."""

import math
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import ADDED_MASS_NAMES, BY_NAME, MASSES
from bridge.vehicle.config import Configuration
from identify.dive import Signal


class Outcome(Enum):
    """How an identification ended; the value is the sentence that a user reads."""

    CONVERGED = "converged"
    AT_BOUND = "stopped at a bound"
    UNSETTLED = "stopped before it settled"
    NOT_IDENTIFIABLE = "not identifiable"
    DISAGREES = "data and model disagree"


@dataclass(frozen=True)
class Estimate:
    """One parameter: `value`, `std` and the 95 % interval in `unit`; NaN value where nothing can be said.

    `reason` says why it is not identifiable, empty where it is.
    """

    name: str
    symbol: str
    unit: str
    value: float
    std: float
    low95: float
    high95: float
    identifiable: bool = True
    reason: str = ""

    def to_json(self) -> dict[str, Any]:
        """Plain data; numbers that do not exist become null."""
        data = {
            key: (None if isinstance(v, float) and not math.isfinite(v) else v)
            for key, v in vars(self).items()
        }
        if not data["reason"]:
            del data["reason"]
        return data


@dataclass(frozen=True)
class Identification:
    """The answer of one estimator for one dive.

    `covariance` (n, n) belongs to `covariance_of`, the names of its rows. `nuisance` holds what was fitted
    beside the coefficients (noise levels, time constants), by name with the unit in the name. `innovations` holds,
    by degree of freedom, each reading's surprise over its expected spread, (n, 1): white, of spread 1, where the
    model fits. It is for the report and no part of the JSON.
    """

    method: str
    outcome: Outcome
    parameters: tuple[Estimate, ...]
    configuration: str
    dive: str
    dive_sha256: str
    vehicle: str
    vehicle_sha256: str
    duration_s: float
    samples: int
    covariance: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 0)))
    covariance_of: tuple[str, ...] = ()
    nuisance: dict[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    wall_s: float = 0.0
    innovations: dict[str, Signal] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Estimate:
        return next(p for p in self.parameters if p.name == name)

    def values(self) -> dict[str, float]:
        """The identifiable coefficients (not the derived added mass) by name."""
        return {p.name: p.value for p in self.parameters if p.identifiable and p.name in BY_NAME}

    def to_json(self) -> dict[str, Any]:
        """The form that `--json` writes."""
        return {
            "method": self.method,
            "outcome": self.outcome.value,
            "parameters": [p.to_json() for p in self.parameters],
            "configuration": self.configuration,
            "dive": {"name": self.dive, "sha256": self.dive_sha256, "duration_s": self.duration_s,
                     "samples": self.samples},
            "vehicle": {"name": self.vehicle, "sha256": self.vehicle_sha256},
            "covariance": {"of": list(self.covariance_of), "matrix": self.covariance.tolist()},
            "nuisance": self.nuisance,
            "notes": list(self.notes),
            "wall_s": self.wall_s,
        }  # fmt: skip


def estimate(name: str, value: float, std: float, low: float, high: float, reason: str = "") -> Estimate:
    """An Estimate of a coefficient of the list, with its symbol and unit."""
    coefficient = BY_NAME[name]
    return Estimate(name, coefficient.symbol, coefficient.unit, value, std, low, high, not reason, reason)


def added_mass(total: Estimate, configuration: Configuration) -> Estimate:
    """Added mass from a total mass or inertia: value minus the rigid body's, as a positive number."""
    dof = MASSES.index(BY_NAME[total.name])
    rigid = configuration.dry_mass_kg if dof < 3 else configuration.inertia_kgm2[dof - 3]
    name, reason = ADDED_MASS_NAMES[dof], total.reason
    if total.identifiable and total.high95 < rigid:
        reason = (
            f"{total.name} came out below the rigid body's own {rigid:g} {total.unit}: check the vehicle file"
        )
    return Estimate(
        name,
        name,
        total.unit,
        total.value - rigid,
        total.std,
        total.low95 - rigid,
        total.high95 - rigid,
        not reason,
        reason,
    )
