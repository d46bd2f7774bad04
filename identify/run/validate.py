"""Validate dives, one per mode of the feed-forward: how each followed its reference, and whether it may be raised."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np

from bridge.errors import ConfigError
from bridge.vehicle.config import Vector3, VehicleFile
from identify import validate as tracking
from identify.dive import Dive
from identify.glance.following import followed
from identify.glance.raising import Raising, go_no_go, in_one_mode
from identify.validate import Row, TrackingErrors, tracking_errors

MODES: Final = ("PID", "shadow", "FF", "both")
"""Labels by FF_MODE."""


@dataclass(frozen=True)
class Run:
    """A dive in one mode; `label` names it in tables, `raising` is None if that can't be judged."""

    label: str
    dive: Dive
    errors: TrackingErrors
    raising: Raising | None

    @property
    def compared(self) -> bool:
        """Whether any axis has an error."""
        return any(math.isfinite(axis.overall) for axis in self.errors.axes)


@dataclass(frozen=True)
class Validation:
    """The runs in the order of their modes, with `lever_m` the place of the DVL."""

    file: VehicleFile
    runs: tuple[Run, ...]
    lever_m: Vector3

    def rows(self) -> list[Row]:
        """The errors side by side, by axis and phase."""
        rows = tracking.compare({run.label: run.dive for run in self.runs}, self.lever_m)
        return [row for row in rows if not all(map(math.isnan, row.values))]

    def to_json(self) -> list[dict[str, Any]]:
        """The runs as plain data, with the curves of reference and response."""
        return [
            {
                "run": run.label,
                "mode": mode_of(run.dive),
                "dive": run.errors.dive,
                "axes": [asdict(axis) for axis in run.errors.axes],
                "raising": None if run.raising is None else run.raising.to_json(),
                "curves": [curve.to_json() for curve in followed(run.dive, self.lever_m)],
            }
            for run in self.runs
        ]


def validate(dives: Sequence[Dive], file: VehicleFile) -> Validation:
    """Compare each dive with its reference; of a dive in several modes the part in one of them counts."""
    whole = in_order(dives)
    # Errors averaged over two modes would describe neither.
    judged = [in_one_mode(dive).dive for dive in whole]
    dvl = file.vehicle.sensors.dvl
    lever_m = dvl.mounting.position_m if dvl else (0.0, 0.0, 0.0)
    runs = []
    for label, dive, all_of_it in zip(labels(judged), judged, whole, strict=True):
        run = Run(label, dive, tracking_errors(dive, lever_m), None)
        runs.append(Run(label, dive, run.errors, _raising(all_of_it, file)) if run.compared else run)
    return Validation(file, tuple(runs), lever_m)


def _raising(dive: Dive, file: VehicleFile) -> Raising | None:
    """Judge whether the feed-forward may be raised; None if the dive or the vehicle file can't decide that."""
    try:
        configuration = file.configuration_of(dive.configuration_index())
    except ConfigError:
        return None
    return go_no_go(dive, file, configuration)


def in_order(dives: Sequence[Dive]) -> list[Dive]:
    """Sort dives by the FF_MODE that is judged: PID, shadow, FF, both, then those without a known mode."""
    modes = [in_one_mode(dive).mode for dive in dives]
    ranks = [len(MODES) if mode is None else int(mode) for mode in modes]
    return [dives[n] for n in sorted(range(len(dives)), key=ranks.__getitem__)]


def labels(dives: Sequence[Dive]) -> list[str]:
    """Label of each dive in the table: its mode, with the dive's name if two dives share the mode."""
    modes = [mode_of(dive) for dive in dives]
    named = [
        m if m and modes.count(m) == 1 else f"{dive.name} {m}".strip()
        for m, dive in zip(modes, dives, strict=True)
    ]
    return [name if named.index(name) == i else f"{name} ({i + 1})" for i, name in enumerate(named)]


def mode_of(dive: Dive) -> str:
    if dive.ff_mode is None or not len(dive.ff_mode):
        return ""
    values, counts = np.unique(dive.ff_mode.value[:, 0], return_counts=True)
    mode = int(values[np.argmax(counts)])
    return MODES[mode] if 0 <= mode < len(MODES) else f"mode {mode}"
