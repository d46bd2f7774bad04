"""What an estimator answers: coefficients with intervals, an outcome in a sentence, and where it came from."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import ADDED_MASS_NAMES, BY_NAME, MASSES, OF_HULL
from bridge.vehicle.config import Configuration
from identify.dive import Signal
from identify.nuisance import Nuisance

Z95 = 1.959963984540054
LARGEST_RELATIVE_STD = 0.30
"""A relative standard error above this is called not identifiable."""


class Outcome(Enum):
    """How an identification ended; the value is the sentence that a user reads. The worst comes last."""

    CONVERGED = "converged"
    AT_BOUND = "stopped at a bound"
    DISAGREES = "data and model disagree"
    NOT_IDENTIFIABLE = "not identifiable"


class Culprit(Enum):
    """What a doubt speaks against; the next dive of the same vehicle errs alike where it is the model."""

    RECORDING = "recording"
    MODEL = "model"
    PRIOR = "prior"


@dataclass(frozen=True)
class Doubt:
    """What speaks against the values of the coefficients `about`, in a sentence that says what to do.

    `outcome` is what the identification ends in because of it; CONVERGED for a warning alone. A doubt about a PRIOR
    is about no value that the dive told.
    """

    about: tuple[str, ...]
    sentence: str
    outcome: Outcome = Outcome.CONVERGED
    culprit: Culprit = Culprit.RECORDING

    @property
    def clause(self) -> str:
        """What is wrong, without what to do: up to the first colon, as part of another sentence."""
        clause = self.sentence.split(": ")[0].rstrip(".")
        return f"{clause[0].lower()}{clause[1:]}" if clause[1:2].islower() or clause[1:2] == " " else clause

    def to_json(self) -> dict[str, Any]:
        return {
            "about": list(self.about),
            "sentence": self.sentence,
            "outcome": self.outcome.value,
            "culprit": self.culprit.value,
        }


@dataclass(frozen=True)
class Information:
    """What the dive alone tells, no prior: Fisher information `matrix` (n, n) of the parameters `of`.

    Coefficients stand by name and count in logarithms (1 is 100 %). Beside them may stand the trim force of an axis,
    `surge_trim`, in shares of the force that drove that axis. All else that was fitted is projected out.
    """

    of: tuple[str, ...]
    matrix: NDArray[np.float64]


NEGLIGIBLE_CORRELATION = 0.1
"""Correlations up to this entangle nothing."""


@dataclass(frozen=True)
class Partner:
    """The coefficient that another is most entangled with, and their correlation."""

    name: str
    correlation: float

    @property
    def is_close(self) -> bool:
        """Whether the correlation is worth a reader's while."""
        return abs(self.correlation) > NEGLIGIBLE_CORRELATION


@dataclass(frozen=True)
class NullDirection:
    """Coefficients that the dive alone can't tell apart, and what would, in a sentence.

    `weights` is the direction in logarithms, of length 1; `relative_std` how far it is known (inf: not at all).
    """

    weights: dict[str, float]
    relative_std: float
    sentence: str

    def to_json(self) -> dict[str, Any]:
        known = self.relative_std if math.isfinite(self.relative_std) else None
        return {"weights": self.weights, "relative_std": known, "sentence": self.sentence}


@dataclass(frozen=True)
class ThrustScale:
    """How far all masses and dampings together hang on the vehicle file's thrust.

    `shift` and `std` are relative: what a force standard made of the thrust, and how well it is known. `in_intervals`
    says whether the intervals include it.
    """

    shift: float
    std: float
    in_intervals: bool
    sentence: str

    def to_json(self) -> dict[str, Any]:
        return dict(vars(self))


@dataclass(frozen=True)
class ThrustDelay:
    """By how many seconds later all thrust acts than the vehicle file says, with the 95 % interval; what the file says
    of its delay, `in_file_s`, not counted."""

    later_s: float
    low95_s: float
    high95_s: float
    in_file_s: float

    @property
    def delay_s(self) -> float:
        """What to write into the vehicle file."""
        return self.in_file_s + self.later_s

    @property
    def std_s(self) -> float:
        return (self.high95_s - self.low95_s) / (2.0 * Z95)

    def to_json(self) -> dict[str, Any]:
        return {**vars(self), "delay_s": self.delay_s}


@dataclass(frozen=True)
class DragForce:
    """What the dampings named `linear` and `quadratic` of an axis come to at `speed` (m/s or rad/s), the usual one of
    the dive: `force` (N or N m), its standard error and 95 % interval, and the correlation of the two."""

    axis: str
    linear: str
    quadratic: str
    speed: float
    force: float
    std: float
    low95: float
    high95: float
    correlation: float

    @property
    def relative_std(self) -> float:
        """Standard error over force."""
        return self.std / self.force if self.force > 0 else math.inf

    def to_json(self) -> dict[str, Any]:
        return dict(vars(self))


@dataclass(frozen=True)
class Estimate:
    """One parameter: `value`, `std` and the 95 % interval in `unit`; NaN value where nothing can be said.

    `reason` says why it is not identifiable, empty where it is. `scale_std` is what the thrust scale would add to
    `std`, in `unit`, 0 where the interval includes it. `share_from_prior` is the share of the dive's own variance that
    priors took away, its own or another's: 1 where all that is known comes from there, 0 where nothing does.
    `given_thrust` and `given_thrust_std` hold with the vehicle file's thrust as it stands there, whatever was weighed.
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
    scale_std: float = math.nan
    share_from_prior: float = 0.0
    partner: Partner | None = None
    given_thrust: float = math.nan
    given_thrust_std: float = math.nan

    @property
    def relative_std(self) -> float:
        """Standard error over value; NaN where there is none."""
        return self.std / abs(self.value) if self.value else math.nan

    def to_json(self) -> dict[str, Any]:
        """Plain data; numbers that do not exist become null."""
        data = {**vars(self), "relative_std": self.relative_std}
        data["partner"] = None if self.partner is None else dict(vars(self.partner))
        if not self.reason:
            del data["reason"]
        return {
            key: (None if isinstance(v, float) and not math.isfinite(v) else v) for key, v in data.items()
        }


@dataclass(frozen=True)
class Identification:
    """The answer of one estimator for one dive.

    `covariance` (n, n), in the units of the parameters, belongs to `covariance_of`: every coefficient that was
    fitted, identifiable or not. `information` is what the dive alone told of them. `doubts` speak against values,
    `notes` tell what else to know. `nuisance` holds what was fitted beside the coefficients (noise levels, time
    constants), `settings` the numbers that a method was run with, by name with the unit in the name. `innovations`
    holds, by degree of freedom, each reading's surprise over its expected spread, (n, 1): white, of spread 1, where
    the model fits. It is for the report and no part of the JSON. `rest_on_righting` names the coefficients that the
    vehicle's righting moment weighed, where no thruster pushed: thrust does not move them. `weighed_by_others` names
    the masses that only the other axes' Coriolis forces weighed, because their own controller used what was not
    recorded; None where the estimator does not ask for that, and they are to be left out. `dived` is the date of the
    dive, empty where nothing tells it.
    `prior_dives` marks the earlier dives that the priors in it came from; `dive_sha256` and `dive_opening` are what
    this dive is known by.
    `usual_speeds`: the root mean square of speed or rate of turn (m/s, rad/s) of each axis that was fitted, by name;
    `drag_forces`, from these, where quadratic damping was fitted beside linear.
    `thrust_delay`: where thrust acts later than the vehicle file says; all values are those with it.
    `null_directions` and `thrust_scale` are filled by `identifiability` and `priors`, as is what the estimates say of
    partners and priors: an estimator need not.
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
    nuisance: dict[Nuisance, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    wall_s: float = 0.0
    innovations: dict[str, Signal] = field(default_factory=dict)
    information: Information | None = None
    doubts: tuple[Doubt, ...] = ()
    null_directions: tuple[NullDirection, ...] = ()
    thrust_scale: ThrustScale | None = None
    rest_on_righting: tuple[str, ...] = ()
    dived: str = ""
    weighed_by_others: tuple[str, ...] | None = None
    prior_dives: tuple[str, ...] = ()
    dive_opening: str = ""
    usual_speeds: dict[str, float] = field(default_factory=dict)
    drag_forces: tuple[DragForce, ...] = ()
    thrust_delay: ThrustDelay | None = None
    settings: dict[str, float] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Estimate:
        return next(p for p in self.parameters if p.name == name)

    def values(self) -> dict[str, float]:
        """The identifiable coefficients (not the derived added mass) by name."""
        return {p.name: p.value for p in self.parameters if p.identifiable and p.name in OF_HULL}

    @property
    def sentences(self) -> tuple[str, ...]:
        """Doubts, then what the dive can't tell apart, then notes: all that a user must read beside the numbers."""
        told = [doubt.sentence for doubt in self.doubts]
        told += [direction.sentence for direction in self.null_directions]
        if self.thrust_scale is not None:
            told.append(self.thrust_scale.sentence)
        return tuple(dict.fromkeys((*told, *self.notes)))

    def to_json(self) -> dict[str, Any]:
        """The form that `--json` writes."""
        return {
            "method": self.method,
            "outcome": self.outcome.value,
            "parameters": [p.to_json() for p in self.parameters],
            "configuration": self.configuration,
            "dive": {"name": self.dive, "sha256": self.dive_sha256, "duration_s": self.duration_s,
                     "samples": self.samples, "date": self.dived, "opening": self.dive_opening},
            "vehicle": {"name": self.vehicle, "sha256": self.vehicle_sha256},
            "covariance": {"of": list(self.covariance_of), "matrix": self.covariance.tolist()},
            "null_directions": [direction.to_json() for direction in self.null_directions],
            "thrust_scale": None if self.thrust_scale is None else self.thrust_scale.to_json(),
            "doubts": [doubt.to_json() for doubt in self.doubts],
            "prior_dives": list(self.prior_dives),
            "drag_forces": [force.to_json() for force in self.drag_forces],
            "thrust_delay": None if self.thrust_delay is None else self.thrust_delay.to_json(),
            "nuisance": {each.name: value for each, value in self.nuisance.items()} | self.settings,
            "notes": list(self.notes),
            "wall_s": self.wall_s,
        }  # fmt: skip


def outcome_of(parameters: Sequence[Estimate], doubts: Sequence[Doubt]) -> Outcome:
    """What the doubts come to, the worst of them; NOT_IDENTIFIABLE where no parameter has a value to use."""
    if not any(p.identifiable for p in parameters):
        return Outcome.NOT_IDENTIFIABLE
    return worst(doubt.outcome for doubt in doubts)


def worst(outcomes: Iterable[Outcome]) -> Outcome:
    """The one that comes last in the list of outcomes; CONVERGED of none."""
    return max(outcomes, key=list(Outcome).index, default=Outcome.CONVERGED)


def estimate(name: str, value: float, std: float, low: float, high: float, reason: str = "") -> Estimate:
    """An Estimate of a coefficient of the list, with its symbol and unit."""
    coefficient = OF_HULL[name]
    return Estimate(name, coefficient.symbol, coefficient.unit, value, std, low, high, not reason, reason)


def added_mass(total: Estimate, configuration: Configuration) -> Estimate:
    """Added mass from a total mass or inertia: value less the rigid body's, as a positive number.

    Its interval is wider by what the rigid body may be off by, and as a share of so much less: where that is too wide
    to be called identifiable, the added mass is not, even if the total is.
    """
    dof = MASSES.index(BY_NAME[total.name])
    rigid, rigid_std = configuration.rigid_body(dof)
    name, reason, value = ADDED_MASS_NAMES[dof], total.reason, total.value - rigid
    if total.identifiable and total.high95 < rigid:
        reason = (
            f"{total.name} came out below the rigid body's own {rigid:g} {total.unit}: check the vehicle file"
        )
    below = math.hypot(total.value - total.low95, Z95 * rigid_std)
    above = math.hypot(total.high95 - total.value, Z95 * rigid_std)
    widest = max(below, above) / Z95
    if not reason and widest > LARGEST_RELATIVE_STD * abs(value):
        reason = (
            f"{name} is {total.name} less the rigid body's own {rigid:g} {total.unit}: the {value:.3g} that is left "
            f"has a standard error of {widest:.2g}"
        )
    return Estimate(
        name,
        name,
        total.unit,
        value,
        math.hypot(total.std, rigid_std),
        value - below,
        value + above,
        not reason,
        reason,
        total.scale_std,
        total.share_from_prior,
    )
