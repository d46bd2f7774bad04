"""The file that keeps a vehicle's parameters through a restart: small, replaced as a whole or not at all.

A model of another hull or other thrusters may lie within all bounds and still push a vehicle into the quay. So each
committed set is kept with the mark of its hull and is in force on that hull only. On other hulls it stays in the
file, and it is in force again when its hull is back.
"""

import hashlib
import json
import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from bridge.errors import ConfigError, LogError, ParamError
from bridge.files import read_small, replacing, sync_folder
from bridge.plain import from_json
from bridge.schema import build
from bridge.vehicle.coefficients import OF_ANY_VEHICLE
from bridge.vehicle.config import Vehicle
from bridge.vehicle.mode import Mode
from bridge.vehicle.parameters import Parameter, to_float32
from bridge.vehicle.thrusters import thrust_curve

DIGITS: Final = 16
PULSES_US: Final = np.arange(1000.0, 2001.0, 5.0)
THRUST_DECIMALS: Final = 3
"""Millinewtons: curves that differ by less give the same model, and rounding in a table does not look like a new
curve."""


def hull_mark(vehicle: Vehicle, directory: Path) -> str:
    """Return 16 hexadecimal digits that are equal for all files that describe the same hull and thrusters.

    The file lies in `directory`. The hash covers, for each configuration, its index, mass, inertia, trim and
    thrusters, and the conversion of pulses to thrust and shaft speed, with its lag and dead time (of a table, the
    numbers and not the name). It excludes names, devices, water, gains, priors and the file's own `model`. Raises
    ConfigError if a thrust table can't be read.
    """
    shapes = [
        (
            vehicle.veh_cfg(name),
            shape.dry_mass_kg,
            shape.inertia_kgm2,
            shape.centre_of_gravity_below_buoyancy_m,
            shape.net_buoyancy_n,
            shape.thruster_limit_n,
            [(thruster.direction, thruster.position_m, thruster.gain) for thruster in shape.thrusters],
        )
        for name, shape in vehicle.configurations.items()
    ]
    curve = vehicle.thrust_curve
    thrust_n = thrust_curve(curve, directory).thrust(PULSES_US)
    # A curve's zero may come out as -0.0, whose text differs.
    thrusts_n = (np.round(thrust_n, THRUST_DECIMALS) + 0.0).tolist()
    thrust = (curve.lag_s, curve.forward_n_s2, curve.reverse_n_s2, thrusts_n)
    # Without a dead time the mark is that of files written before there was one.
    dead_time = (curve.delay_s,) if curve.delay_s else ()
    description = json.dumps((sorted(shapes), *thrust, *dead_time))
    return hashlib.sha256(description.encode()).hexdigest()[:DIGITS]


@dataclass(frozen=True)
class Stored:
    """Mode and active set (by parameter id) of one hull; `active` is None if no set was ever committed on it."""

    mode: float
    active: dict[str, float] | None


@dataclass(frozen=True)
class Hulls:
    """The contents of the file: an entry for each hull mark."""

    hulls: dict[str, Stored]


def save(path: Path, hulls: Mapping[str, Stored]) -> None:
    """Replace the file in one step by the entries of `hulls`, by hull mark. It is on the disk when this returns.

    Raises ParamError if that fails.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path, "try again") as file:
            file.write(json.dumps(asdict(Hulls(dict(hulls))), indent=1).encode())
        sync_folder(path.parent)
        sync_folder(path.parent.parent)  # its folder may be new too
    except (OSError, LogError) as error:
        raise ParamError(f"parameters can't be stored ({error}); check the disk", path) from None


def load(path: Path) -> dict[str, Stored]:
    """Return the entry of each hull by its mark; {} if there is no file. Raises ParamError if the file is damaged."""
    try:
        return build(Hulls, from_json(read_small(path)), str(path)).hulls
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, ConfigError) as error:
        raise ParamError(f"stored parameters can't be read ({error}); upload them again", path) from None


OF_ANOTHER: Final = (
    "FF off: set is of another hull or thrusters",
    "upload a set, or put the vehicle file back",
)

NONE_YET: Final = ("FF zero: no set in force", "upload one: seatrial params upload")


class Memory:
    """Contents of the file at `path` for the hull with the mark `hull`; nothing is kept if `path` is None.

    `mode` is FF_MODE. `committed` is the complete set that was committed on this hull, None if there is none. `why`
    holds texts for the crew on why the feed-forward must then stay at zero, and the way out. `texts` and `trouble` say
    what is wrong with the file or its sets, for STATUSTEXT and as a sentence.
    """

    def __init__(self, path: Path | None, hull: str, table: Mapping[str, Parameter]) -> None:
        self.mode = 0.0
        self.committed: dict[str, float] | None = None
        self.why = NONE_YET
        self.texts: list[str] = []
        self.trouble = ""
        self._path, self._hull, self._table = path, hull, table
        self._others: dict[str, Stored] = {}
        if path is not None:
            self._load(path)

    def save(self, mode: float, committed: Mapping[str, float] | None) -> None:
        """Store mode and set of this hull next to those of other hulls. Raises ParamError if the disk refuses."""
        if self._path is not None:
            ours = Stored(mode, None if committed is None else dict(committed))
            save(self._path, {**self._others, self._hull: ours})

    def _load(self, path: Path) -> None:
        try:
            self._others = load(path)
            ours = self._others.pop(self._hull, None)
            if ours is not None and not self._fits(ours := self._completed(ours)):
                raise ParamError("stored parameters don't fit this vehicle file")
        except ParamError:
            self.texts.append("stored parameters unusable, no set in force")
            self._put_aside(path)
            return
        if ours is not None:
            self.mode, self.committed = ours.mode, ours.active
        if self.committed is None and any(stored.active is not None for stored in self._others.values()):
            self.why = OF_ANOTHER
            self.texts += self.why
            self.trouble = (
                f"{path}: the stored set was committed for another hull or other thrusters than the vehicle file has "
                "now; the feed-forward stays at zero: upload a set of this vehicle, or put the vehicle file back, "
                "which brings the stored set back"
            )

    def _completed(self, stored: Stored) -> Stored:
        """Add the coefficients of effects that came with a newer version of the program, as absent: the set is the
        same model without them."""
        if stored.active is None:
            return stored
        absent = {name: 0.0 for name, row in self._table.items() if row.coefficient in OF_ANY_VEHICLE}
        return replace(stored, active=absent | stored.active)

    def _fits(self, stored: Stored) -> bool:
        if stored.mode not in set(Mode):
            return False
        return stored.active is None or (
            stored.active.keys() == self._table.keys()
            and all(
                self._table[name].admits(value) and to_float32(value) == value
                for name, value in stored.active.items()
            )
        )

    def _put_aside(self, path: Path) -> None:
        """Rename a damaged file to a free name; the sets of other hulls that it holds stay where they were."""
        number = 1
        while (aside := path.with_name(f"{path.name}.damaged-{number}")).exists():
            number += 1
        try:
            os.replace(path, aside)
            self.texts.append(f"damaged file kept: {aside.name}"[:50])
            fate = f"can't be used and lie in {aside}"
            if self._others:
                with suppress(ParamError):  # then the next set is stored with them
                    save(path, self._others)
        except OSError:
            self.texts.append("damaged parameter file can't be put aside")
            fate = "can't be used, nor put aside"
        self.trouble = f"{path}: the stored parameters {fate}; no set is in force: upload one"
