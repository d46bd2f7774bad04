"""The result of an estimator: coefficients with intervals, doubts, an outcome in a sentence, the provenance."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import ADDED_MASS_NAMES, BY_NAME, MASSES, OF_HULL
from bridge.vehicle.config import Configuration
from identify.dive import Signal
from identify.doubt import Doubt, Outcome, worst
from identify.nuisance import Nuisance
from identify.statistics import Z95

LARGEST_RELATIVE_STD = 0.30
"""A coefficient with a larger relative standard error is called not identifiable."""

NEGLIGIBLE_CORRELATION = 0.1
"""Correlations up to this size are ignored."""


@dataclass(frozen=True)
class Information:
    """Information of the dive alone, without priors: Fisher information `matrix` (n, n) of the parameters `of`.

    Coefficients are listed by name and count in logarithms (1 is 100 %). The trim force of an axis, such as
    `surge_trim`, may be listed too, in shares of the force that drove that axis. All other fitted quantities are
    projected out.
    """

    of: tuple[str, ...]
    matrix: NDArray[np.float64]


@dataclass(frozen=True)
class Partner:
    """The coefficient that another coefficient correlates most with, and their correlation."""

    name: str
    correlation: float

    @property
    def is_close(self) -> bool:
        """Whether the correlation is large enough to report."""
        return abs(self.correlation) > NEGLIGIBLE_CORRELATION


@dataclass(frozen=True)
class NullDirection:
    """Coefficients that the dive alone can't separate, with a sentence on how to separate them.

    `weights` is the direction in logarithms, a unit vector. `relative_std` is the standard deviation along it (inf:
    unknown).
    """

    weights: dict[str, float]
    relative_std: float
    sentence: str

    def to_json(self) -> dict[str, Any]:
        known = self.relative_std if math.isfinite(self.relative_std) else None
        return {"weights": self.weights, "relative_std": known, "sentence": self.sentence}


@dataclass(frozen=True)
class ThrustScale:
    """How all masses and dampings together depend on the vehicle file's thrust.

    `shift` and `std` are relative: the correction of the thrust by a force standard, and its remaining uncertainty.
    `weighed`: a force standard corrected the thrust, so that the values hold the correction and `Estimate.std` the
    remaining uncertainty. Else they hold given the thrust, and `Estimate.scale_std` stands beside them.
    """

    shift: float
    std: float
    weighed: bool
    sentence: str

    def to_json(self) -> dict[str, Any]:
        return dict(vars(self))


@dataclass(frozen=True)
class ThrustDelay:
    """Extra delay of all thrust beyond the delay in the vehicle file (`in_file_s`), in seconds, with its 95 %
    interval."""

    later_s: float
    low95_s: float
    high95_s: float
    in_file_s: float

    @property
    def delay_s(self) -> float:
        """The total delay, to be written into the vehicle file."""
        return self.in_file_s + self.later_s

    @property
    def std_s(self) -> float:
        return (self.high95_s - self.low95_s) / (2.0 * Z95)

    def widened(self, variance_s2: float) -> "ThrustDelay":
        """The same delay with that much more variance."""
        reach_s = Z95 * math.sqrt(self.std_s**2 + variance_s2)
        return replace(self, low95_s=self.later_s - reach_s, high95_s=self.later_s + reach_s)

    def to_json(self) -> dict[str, Any]:
        return {**vars(self), "delay_s": self.delay_s}


@dataclass(frozen=True)
class DragForce:
    """Drag of an axis from its dampings `linear` and `quadratic` at `speed` (m/s or rad/s), the usual speed of the
    dive: `force` (N or N m), its standard error and 95 % interval, and the correlation of the two dampings."""

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


class Ends(NamedTuple):
    """The ends of a 95 % interval."""

    low95: float
    high95: float


@dataclass(frozen=True)
class Estimate:
    """One parameter: `value`, `std` and the 95 % interval in `unit`; the value is NaN if nothing can be said.

    `std`, `low95` and `high95` hold given the vehicle file's thrust, unless a force standard corrected it: these
    compare dives of one vehicle. Knowledge of the vehicle itself is `with_thrust`, the interval that users read
    first.

    `reason` says why the parameter is not identifiable; empty if it is. `scale_std` is what the uncertainty of the
    thrust scale would add to `std`, in `unit`; 0 if the interval includes it. `share_from_prior` is the share of the
    dive's own variance that priors removed, priors of this coefficient or of others: 1 if all knowledge comes from
    priors, 0 if none does. `given_thrust` and `given_thrust_std` hold for the thrust in the vehicle file, even if a
    force standard corrected it.
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
        """Standard error over value; NaN if the value is zero or NaN."""
        return self.std / abs(self.value) if self.value else math.nan

    @property
    def with_thrust(self) -> Ends:
        """The interval with the thrust's uncertainty.

        A common factor on the thrust adds to the logarithm of a total mass or damping. To an added mass, a difference,
        and to an interval that reaches zero, it adds as it is.
        """
        if not self.scale_std > 0.0:
            return Ends(self.low95, self.high95)
        if self.name in OF_HULL and 0.0 < self.low95 <= self.value:
            scale = Z95 * self.scale_std / self.value
            below = math.hypot(math.log(self.value / self.low95), scale)
            above = math.hypot(math.log(self.high95 / self.value), scale)
            return Ends(self.value * math.exp(-below), self.value * math.exp(above))
        scale = Z95 * self.scale_std
        return Ends(
            self.value - math.hypot(self.value - self.low95, scale),
            self.value + math.hypot(self.high95 - self.value, scale),
        )

    @property
    def at_thrust(self) -> Ends:
        """The interval given the vehicle file's thrust, about the value with that thrust."""
        if not self.given_thrust_std > 0.0 or math.isclose(self.given_thrust_std, self.std):
            return Ends(self.low95, self.high95)
        reach = Z95 * self.given_thrust_std / self.given_thrust
        return Ends(self.given_thrust * math.exp(-reach), self.given_thrust * math.exp(reach))

    @property
    def wider_std(self) -> float:
        """Relative standard error from the wider side of the interval: it decides whether the value may be used.

        In logarithms, as coefficients are fitted. An interval that reaches zero, and that of an added mass, has no
        logarithm; there the plain relative width is used.
        """
        below, above = self.value - self.low95, self.high95 - self.value
        if self.name in OF_HULL and 0.0 < self.low95 <= self.value:
            return math.log(max(self.value / self.low95, self.high95 / self.value)) / Z95
        return max(below, above) / Z95 / abs(self.value) if self.value else math.nan

    def to_json(self) -> dict[str, Any]:
        """Plain data, with the thrust's uncertainty in `std`, `low95` and `high95` and without it in `given_thrust_`;
        NaN and infinity become null."""
        std = math.hypot(self.std, self.scale_std) if self.scale_std > 0.0 else self.std
        data = {
            **vars(self),
            **self.with_thrust._asdict(),
            **{f"given_thrust_{end}": value for end, value in self.at_thrust._asdict().items()},
            "given_thrust_std": self.given_thrust_std if math.isfinite(self.given_thrust_std) else self.std,
            "std": std,
            "relative_std": std / abs(self.value) if self.value else math.nan,
        }
        data["partner"] = None if self.partner is None else dict(vars(self.partner))
        if not self.reason:
            del data["reason"]
        return {
            key: (None if isinstance(v, float) and not math.isfinite(v) else v) for key, v in data.items()
        }


@dataclass(frozen=True)
class Identification:
    """The result of an estimator for one dive.

    `covariance` (n, n), in the units of the parameters, belongs to `covariance_of`: all fitted coefficients,
    identifiable or not. `information` is the dive's own information about them. `doubts` give reasons to distrust
    values, `notes` give other remarks. `nuisance` holds the other fitted quantities (noise levels, time constants),
    `settings` the numbers that the method was run with, by name with the unit in the name. `innovations` holds, by
    degree of freedom, each reading's residual over its expected spread, (n, 1): white with unit spread if the model
    fits; for the report only, not in the JSON.

    `rest_on_righting` names the coefficients that were scaled by the vehicle's righting moment because no thruster
    pushed: thrust does not change them. `weighed_by_others` names the masses that were found only through the
    Coriolis forces in other axes, because their own controller used an unrecorded reading; None if the estimator does
    not check for this, and such masses are to be left out.

    `dived` is the date of the dive, empty if unknown. `prior_dives` marks the earlier dives behind the priors that
    were used. `dive_sha256` and `dive_opening` identify this dive. `usual_speeds`: root mean square of speed or rate
    of turn (m/s, rad/s) of each fitted axis, by name. `drag_forces`: drag at these speeds, for axes with both linear
    and quadratic damping. `thrust_delay`: set if thrust acts later than the vehicle file says; all values then
    include the delay.

    `null_directions` and `thrust_scale` are filled in by `identifiability` and `priors`, as are the partners and
    prior shares of the estimates: an estimator need not set them.
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
        """The identifiable coefficients (without the derived added mass) by name."""
        return {p.name: p.value for p in self.parameters if p.identifiable and p.name in OF_HULL}

    @property
    def sentences(self) -> tuple[str, ...]:
        """All that a user must read in addition to the numbers: doubts, then inseparable coefficients, then notes."""
        lines = [doubt.sentence for doubt in self.doubts]
        lines += [direction.sentence for direction in self.null_directions]
        if self.thrust_scale is not None:
            lines.append(self.thrust_scale.sentence)
        return tuple(dict.fromkeys((*lines, *self.notes)))

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
    """The worst outcome of the doubts; NOT_IDENTIFIABLE if no parameter is identifiable."""
    if not any(p.identifiable for p in parameters):
        return Outcome.NOT_IDENTIFIABLE
    return worst(doubt.outcome for doubt in doubts)


def estimate(name: str, value: float, std: float, low: float, high: float, reason: str = "") -> Estimate:
    """An Estimate of a listed coefficient, with its symbol and unit."""
    coefficient = OF_HULL[name]
    return Estimate(name, coefficient.symbol, coefficient.unit, value, std, low, high, not reason, reason)


def added_mass(total: Estimate, configuration: Configuration) -> Estimate:
    """Added mass from a total mass or inertia: the value less the rigid body's, as a positive number.

    The uncertainty of the rigid body widens the interval, and relative to the smaller value it widens further. If it
    becomes too wide, the added mass is not identifiable, even if the total is.
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
