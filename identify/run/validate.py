"""Validate dives, one per mode of the feed-forward: how each followed its reference, and whether it may be raised."""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Final

from bridge.arrays import Vector3
from bridge.errors import ConfigError, FitError
from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.forecast import Credit
from bridge.vehicle.mode import Mode
from identify.dive import Dive
from identify.estimators.axes.another_vehicle import strange
from identify.thrust.given_thrust import given_thrust, pushes
from identify.thrust.thruster_allocation import allocated_gains
from identify.thrust.wrench import wrench
from identify.validation import tracking
from identify.validation.against_forecast import (
    Foretellings,
    Held,
    MadeUp,
    held_against,
    is_next,
    made_up,
    nothing_foretold,
    to_make_up,
    verdict_of,
)
from identify.validation.raising import Raising, go_no_go, in_one_mode
from identify.validation.tracking import (
    TRACKED_DOFS,
    Row,
    TrackingErrors,
    lever_of,
    tracking_errors,
    with_reference_rates,
)
from identify.validation.tracking_curves import followed
from identify.words import fixed, speed

DAY: Final = re.compile(r"\d{4}-\d\d-\d\dT")
"""With it the name of a dated dive begins."""

ALIKE: Final = 0.05
"""Modes whose errors differ by a smaller share are called alike in a sentence."""


@dataclass(frozen=True)
class Run:
    """A dive in one mode (its word, "" if unknown); `label` names it in tables, `raising` is None if that can't
    be judged. `held`: axes with the errors foretold for them."""

    label: str
    dive: Dive
    errors: TrackingErrors
    raising: Raising | None
    mode: str = ""
    held: tuple[Held, ...] = ()

    @property
    def compared(self) -> bool:
        return any(math.isfinite(axis.overall) for axis in self.errors.axes)

    @property
    def is_baseline(self) -> bool:
        """Whether nothing was fed forward in it, so that nothing is judged."""
        return self.raising is None and self.mode == Mode.OFF.word and self.compared


@dataclass(frozen=True)
class Validation:
    """The runs in the order of their modes, with `lever_m` the place of the DVL."""

    file: VehicleFile
    runs: tuple[Run, ...]
    lever_m: Vector3

    def rows(self) -> list[Row]:
        rows = tracking.compare({run.label: run.errors for run in self.runs})
        return [row for row in rows if not all(map(math.isnan, row.values))]

    def to_json(self) -> list[dict[str, Any]]:
        """The runs as plain data, with the curves of reference and response."""
        return [
            {
                "run": run.label,
                "mode": run.mode,
                "dive": run.errors.dive,
                "axes": [asdict(axis) for axis in run.errors.axes],
                "whole": [asdict(error) for error in run.errors.whole],
                "foretold": [held.to_json() for held in run.held],
                "as_foretold": verdict_of(run.held),
                "raising": None if run.raising is None else run.raising.to_json(),
                "curves": [curve.to_json() for curve in followed(run.dive, self.lever_m)],
            }
            for run in self.runs
        ]


Advice = Callable[[Dive, str], str]
"""The advice where a dive of a configuration, by name, moves an axis that it should not; "" for the usual."""


def validate(
    dives: Sequence[Dive],
    file: VehicleFile,
    foretold: Foretellings = nothing_foretold,
    advice: Advice = lambda _dive, _configuration: "",
) -> Validation:
    """Compare each dive with its reference; of a dive in several modes the part in one of them counts.

    `foretold` gives, for that part, the contents of the sidecar of the accepted diagnosis that it is compared with.
    Raises ConfigError or FitError for a dive of another vehicle or configuration than the file's.
    """
    # Errors averaged over two modes would describe neither.
    parts = [(in_one_mode(dive), dive) for dive in map(with_reference_rates, dives)]
    parts.sort(key=lambda pair: len(Mode) if pair[0].mode is None else int(pair[0].mode))
    lever_m = lever_of(file)
    modes = ["" if part.mode is None else part.mode.word for part, _ in parts]
    runs = []
    for label, mode, (part, whole) in zip(
        _labels(modes, [dive for _, dive in parts]), modes, parts, strict=True
    ):
        run = Run(label, part.dive, tracking_errors(part.dive, lever_m), None, mode)
        runs.append(_judged(run, whole, part.mode, file, foretold, advice) if run.compared else run)
    return Validation(file, tuple(runs), lever_m)


def _labels(modes: Sequence[str], dives: Sequence[Dive]) -> list[str]:
    """Label of each dive in the table: its mode, after the dive's name if two dives share the mode; without the day
    that all share."""
    day = DAY.match(dives[0].name) if len(dives) > 1 else None
    shared = day[0] if day and all(dive.name.startswith(day[0]) for dive in dives) else ""
    names = [dive.name.removeprefix(shared) for dive in dives]
    named = [
        mode if mode and modes.count(mode) == 1 else f"{name.removesuffix(f'-{mode}')} {mode}".strip()
        for mode, name in zip(modes, names, strict=True)
    ]
    return [name if named.index(name) == i else f"{name} ({i + 1})" for i, name in enumerate(named)]


def _judged(
    run: Run, whole: Dive, mode: Mode | None, file: VehicleFile, foretold: Foretellings, advice: Advice
) -> Run:
    """The run compared with the foretold errors, and whether the feed-forward may be raised: None if the dive or the
    vehicle file can't decide that.

    Raises ConfigError or FitError if the dive is of another vehicle or configuration: its limits judge nothing here.
    """
    recorded = whole.configuration_index()
    try:
        configuration_name = file.configuration_of(recorded)
    except ConfigError as error:
        if recorded is not None:
            raise ConfigError(f"{whole.source}: {error}") from None
        return run
    if another := _another_vehicle(run.dive, file, configuration_name):
        raise FitError(
            f"{another}; give the vehicle file and the configuration that it was dived with", of=whole.source
        )
    held: tuple[Held, ...] = ()
    gains: tuple[MadeUp, ...] = ()
    foretelling = None if mode is None else foretold(run.dive, mode, configuration_name)
    is_of_it = foretelling is not None and (foretelling.vehicle, foretelling.configuration) == (
        file.vehicle.name,
        configuration_name,
    )
    if foretelling is not None and is_of_it and mode is not None and is_next(whole, foretelling):
        gains = _made_up(run.dive, mode, file, configuration_name, foretelling.credits)
        # A dive in which the accepted values were not in force is not the one that was foretold.
        in_force = mode.applies_feedforward and not any(gain.unmended for gain in gains)
        held = held_against(run.errors.whole, foretelling.rows, mode) if in_force else ()
    instead = advice(run.dive, configuration_name)
    return replace(run, held=held, raising=go_no_go(whole, file, configuration_name, held, gains, instead))


def _another_vehicle(dive: Dive, file: VehicleFile, configuration_name: str) -> str:
    """Why the dive can hardly be of this vehicle and configuration; "" if nothing says so."""
    try:
        forces = wrench(dive, file, configuration_name)
    except FitError:
        return ""
    return strange(dive, forces, file.vehicle, configuration_name)


def _made_up(
    dive: Dive, mode: Mode, file: VehicleFile, configuration_name: str, credits: Sequence[Credit]
) -> tuple[MadeUp, ...]:
    """How thrusters with an accepted gain were made up for in a dive in one mode, or will be once that is raised."""
    if not credits:
        return ()
    numbers = [credit.thruster for credit in credits]
    gains = allocated_gains(dive, file, configuration_name)
    gave = given_thrust(dive, file, configuration_name, numbers)
    if mode.applies_feedforward:
        return made_up(gains, credits, gave)
    shape = file.vehicle.configurations[configuration_name]
    return to_make_up(gains, credits, gave, [number for number in numbers if not pushes(shape, number)])


def verdict(errors: Mapping[str, TrackingErrors]) -> str:
    """Which mode errs least, axis by axis, by its mean absolute error while it is asked to move, and by how much less
    than the first of the others; apart from these, the errors in axes that one mode alone tells. A mode is named again
    only where it is another: names are long."""
    axes_by_mode: dict[tuple[str, bool], list[str]] = {}
    named: dict[str, str] = {}
    for dof in TRACKED_DOFS:
        axis_errors = {
            label: axis for label, run in errors.items() if (axis := run.axis(DOFS[dof])) is not None
        }
        known = {label: axis.overall for label, axis in axis_errors.items() if math.isfinite(axis.overall)}
        if known:
            best = min(known, key=known.__getitem__)
            other = next((label for label in known if label != best), "")
            name = f"'{other}'" if other != named.get(best) else ""
            less = f" ({_less(known[best], known[other], name)})" if other else ""
            named[best] = other
            axes_by_mode.setdefault((best, bool(other)), []).append(
                f"{DOFS[dof]} {speed(known[best], axis_errors[best].unit)}{less}"
            )
    if not axes_by_mode:
        return "No dive has a reference that moves and a measured speed beside it: nothing to compare."
    return " ".join(
        f"'{best}' errs{' least' if compared else ''}, mean absolute: {', '.join(axes)}."
        for (best, compared), axes in axes_by_mode.items()
    )


def _less(error: float, other: float, name: str) -> str:
    """`75 % less than 'off'`, `75 % less` without a name."""
    share = 1 - error / other if other > 0 else 0.0
    if share < ALIKE:
        return f"like {name}" if name else "alike"
    return f"{fixed(100 * share, 0)} % less{f' than {name}' if name else ''}"
