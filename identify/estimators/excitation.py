"""Predicts how well a dive alone would identify each coefficient, before any fit.

The prediction comes from the start of the likelihood's ascent, with its own equations: near the maximum the
information in the readings is known to a few per cent, at a third of the work. Forces that the model lacks widen the
prediction as they widen the fit's intervals, through one scoring step with those forces admitted. Roll and pitch are
not promised if no thruster drove them: their only information is then how the vehicle rights itself after a
disturbance.
"""

import contextlib
import math
from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import numpy as np

from bridge.arrays import Array
from bridge.errors import FitError
from bridge.vehicle.coefficients import COEFFICIENTS, DOFS, OF_HULL, YAW
from bridge.vehicle.config import VehicleFile
from identify.axis_span import Span
from identify.checks.actuation.controller import unrecorded
from identify.dive import Dive, Signal
from identify.estimators.likelihood.fit import Begun, rough_fit
from identify.estimators.likelihood.joint import coefficients
from identify.estimators.missing_forces.drag_and_timing import (
    Force,
    doubts_of,
    lacking_drags,
    timing_of,
    with_forces,
)
from identify.estimators.refusals import SHORTEST_DIVE_S, common_s, solvable
from identify.estimators.timing.autopilot_velocity import lasting_axes
from identify.identification import LARGEST_RELATIVE_STD
from identify.thrust.wrench import wrench


@dataclass(frozen=True)
class Excited:
    """A coefficient; `relative_std` is inf if the dive says nothing about it."""

    name: str
    relative_std: float

    @property
    def identifiable(self) -> bool:
        return self.relative_std <= LARGEST_RELATIVE_STD


@dataclass(frozen=True)
class Excitation:
    """All twelve coefficients in their order; `note` says why a dive shows nothing at all, empty otherwise."""

    coefficients: tuple[Excited, ...]
    note: str = ""

    def to_json(self) -> dict[str, Any]:
        rows = [
            {
                "name": c.name,
                "relative_std": c.relative_std if np.isfinite(c.relative_std) else None,
                "identifiable": c.identifiable,
            }
            for c in self.coefficients
        ]
        return {"coefficients": rows, "note": self.note}


def excitation(dive: Dive, file: VehicleFile, configuration: str) -> Excitation:
    """How well this dive alone, without a prior, would identify each coefficient."""
    try:
        with solvable(dive):
            return _foretold(dive, file, configuration)
    except FitError as error:
        return _nothing(error.reason)


def spans(dive: Dive, file: VehicleFile | None = None, configuration: str = "") -> tuple[Span, ...]:
    """Overview of the six axes without a model of the hull: thrust from TAU_CMD, else from the file's thrusters."""
    asked = dive.tau_cmd
    if asked is None and file is not None:
        with contextlib.suppress(FitError):
            forces = wrench(dive, file, configuration)
            asked = Signal(forces.time_s, forces.asked)
    return tuple(
        Span(
            axis,
            max(float(np.nan_to_num(common_s(dive, dof))), 0.0),
            _span(asked, dof),
            _span(*_reading(dive, dof)),
        )
        for dof, axis in enumerate(DOFS)
    )


def _foretold(dive: Dive, file: VehicleFile, configuration: str) -> Excitation:
    built = lasting_axes(dive, file, configuration)
    if not built.axes:
        reasons = set(built.missing.values())
        none = f"no axis has thrust and readings of motion together for {SHORTEST_DIVE_S:.0f} s"
        return _nothing(reasons.pop() if len(reasons) == 1 else none)
    unseen = tuple(sorted(axis.dof for axis in unrecorded(dive, file.vehicle.water)))
    begun = rough_fit(built, file.vehicle.configurations[configuration], unseen).value
    std = _relative_std(begun, unseen)
    return Excitation(
        tuple(
            Excited(c.name, math.inf if c.name in built.rest_on_righting else float(std[row]))
            for row, c in enumerate(COEFFICIENTS)
        )
    )


def _relative_std(begun: Begun, unseen: Collection[int]) -> Array:
    """Relative standard errors of all coefficients (18,); inf without readings.

    They include the shift of each coefficient by forces that the model lacks. The thrust of the `unseen` degrees of
    freedom follows readings that were not recorded, and so appears to come late.
    """
    joint, theta = begun.joint, begun.maximum.theta
    doubts = doubts_of(joint, theta)
    lacking = lacking_drags(joint, theta, [dof for dof, doubt in doubts.items() if doubt.lacks_drag])
    late = [
        Force(problem.axis.dof, problem.axis.by_lateness())
        for problem in joint.problems
        if doubts[problem.axis.dof].is_late and problem.axis.dof not in unseen
    ]
    wider = with_forces(joint, theta, [*lacking, *late])
    gradient, information = wider.slope()
    covariance = np.linalg.inv(information)
    shift = covariance @ gradient
    rows, columns = coefficients(joint)
    at = wider.kept[columns]
    timing = np.linalg.norm(timing_of(doubts), axis=0)
    std = np.full(len(OF_HULL), np.inf)
    # For a loosely known value the likelihood falls more slowly on one side, by about that standard error itself.
    std_of_value = np.sqrt(np.diag(covariance)[at])
    std[rows] = np.sqrt((std_of_value * (1.0 + std_of_value)) ** 2 + shift[at] ** 2 + timing[rows] ** 2)
    return np.asarray(np.where(np.isnan(std), np.inf, std))


def _nothing(note: str) -> Excitation:
    return Excitation(tuple(Excited(c.name, math.inf) for c in COEFFICIENTS), note)


def _reading(dive: Dive, dof: int) -> tuple[Signal | None, int]:
    """Signal that measures an axis's velocity, and its column."""
    if dof < 3:
        return dive.velocity, dof
    return (dive.yaw_rate, 0) if dof == YAW else (dive.gyro, dof - 3)


def _span(signal: Signal | None, column: int) -> float:
    known = np.zeros(0) if signal is None else signal.value[:, column]
    known = known[np.isfinite(known)]
    return float(np.diff(np.percentile(known, (1, 99)))[0]) if len(known) else math.nan
