"""The file that keeps a vehicle's parameters through a restart: small, replaced as a whole or not at all.

A model of another hull or other thrusters may lie within all bounds and still push a vehicle into the quay. So each
committed set is kept with the mark of its hull and is in force on that hull only. On other hulls it stays in the
file, and it is in force again when its hull is back.
"""

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from bridge.errors import ParamError
from bridge.files import read_small, sync_folder
from bridge.plain import from_json, is_number
from bridge.vehicle.config import Vehicle
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


UNTOLD: Final = ""
"""Stands for the hull mark in data of an earlier version, which stored none."""


@dataclass(frozen=True)
class Stored:
    """Mode and active set (by parameter id) of one hull; `active` is None if no set was ever committed on it."""

    mode: float
    active: Mapping[str, float] | None


def save(path: Path, hulls: Mapping[str, Stored]) -> None:
    """Replace the file in one step by the entries of `hulls`, by hull mark. It is on the disk when this returns.

    Raises ParamError if that fails.
    """
    kept = {
        mark: {"mode": stored.mode, "active": None if stored.active is None else dict(stored.active)}
        for mark, stored in hulls.items()
    }
    text = json.dumps({"hulls": kept}, indent=1)
    new = path.with_name(path.name + ".new")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with open(new, "w", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        os.replace(new, path)
        sync_folder(path.parent)
    except OSError as error:
        raise ParamError(f"{path}: parameters can't be stored ({error.strerror}); check the disk") from None


def load(path: Path) -> dict[str, Stored]:
    """Return the entry of each hull by its mark; {} if there is no file.

    The data of an earlier version is the entry of `UNTOLD`. Raises ParamError if the file is damaged.
    """
    try:
        data = from_json(read_small(path))
    except FileNotFoundError:
        return {}
    except (OSError, ValueError) as error:
        raise ParamError(f"{path}: stored parameters can't be read ({error}); upload them again") from None
    kept = data["hulls"] if isinstance(data, dict) and set(data) == {"hulls"} else {UNTOLD: data}
    hulls = (
        {mark: _checked(entry) for mark, entry in kept.items()} if isinstance(kept, dict) else {UNTOLD: None}
    )
    whole = {mark: stored for mark, stored in hulls.items() if stored is not None}
    if len(whole) < len(hulls):
        raise ParamError(f"{path}: stored parameters are damaged; upload them again")
    return whole


def put_aside(path: Path) -> Path:
    """Rename a damaged file to a free name and return its new path. Raises ParamError if that fails."""
    number = 1
    while (aside := path.with_name(f"{path.name}.damaged-{number}")).exists():
        number += 1
    try:
        os.replace(path, aside)
    except OSError as error:
        raise ParamError(f"{path}: can't be put aside ({error.strerror}); move it away") from None
    return aside


def _checked(data: Any) -> Stored | None:
    if not isinstance(data, dict) or set(data) != {"mode", "active"} or not is_number(data["mode"]):
        return None
    active = data["active"]
    if active is None:
        return Stored(float(data["mode"]), None)
    if not isinstance(active, dict) or not all(is_number(value) for value in active.values()):
        return None
    return Stored(float(data["mode"]), {name: float(value) for name, value in active.items()})


OF_ANOTHER: Final = (
    "FF off: set is of another hull or thrusters",
    "upload a set, or put the vehicle file back",
)
OF_NONE: Final = (
    "FF off: no telling of which hull the set is",
    "look at the vehicle file, then upload again",
)


class Memory:
    """Contents of the file at `path` for the hull with the mark `hull`; nothing is kept if `path` is None.

    `mode` is FF_MODE. `committed` is the complete set that was committed on this hull, None if there is none. `why`
    holds texts for the crew about why the feed-forward must stay at zero although the store holds a set: the set is
    of another hull, or of an unknown one; () if there is no such reason. `offered` is the set to stage in that case,
    which an earlier version stored without a hull mark; None stands for the vehicle file's model. `texts` and
    `trouble` say what is wrong with the file or its sets, for STATUSTEXT and as a sentence.
    """

    def __init__(self, path: Path | None, hull: str, table: Mapping[str, Parameter]) -> None:
        self.mode = 0.0
        self.committed: dict[str, float] | None = None
        self.offered: dict[str, float] | None = None
        self.why: tuple[str, ...] = ()
        self.texts: list[str] = []
        self.trouble = ""
        self._path, self._hull, self._table = path, hull, table
        self._others: dict[str, Stored] = {}
        if path is not None:
            self._load(path)

    def save(self, mode: float, committed: Mapping[str, float] | None) -> None:
        """Store mode and set of this hull next to those of other hulls. Raises ParamError if the disk refuses."""
        if self._path is not None:
            save(self._path, {**self._others, self._hull: Stored(mode, committed)})

    def _load(self, path: Path) -> None:
        try:
            self._others = load(path)
            ours = self._others.pop(self._hull, None)
            if ours is not None and not self._fits(ours):
                raise ParamError("stored parameters don't fit this vehicle file")
        except ParamError:
            self._others = {}
            self.texts.append("stored parameters unusable, defaults in force")
            self._put_aside(path)
            return
        if ours is None:
            ours = self._the_files_own_model()
        if ours is not None:
            self.mode, self.committed = ours.mode, self._whole(ours)
        if self.committed is None:
            self._doubt(path)

    def _the_files_own_model(self) -> Stored | None:
        """Take over the mode that an earlier version stored if no set was committed then, and return it.

        A stored set that equals this vehicle file's model counts as not committed. None if another set was committed,
        or if nothing is stored by an earlier version.
        """
        untold = self._others.get(UNTOLD)
        if untold is None or not self._fits(untold):
            return None
        defaults = {name: row.default for name, row in self._table.items()}
        if self._whole(untold) not in (None, defaults):
            return None
        del self._others[UNTOLD]
        return Stored(untold.mode, None)

    def _doubt(self, path: Path) -> None:
        """Report that nothing was committed on this hull if something was committed on another."""
        hulls = {hull for hull, stored in self._others.items() if stored.active is not None}
        if hulls == {UNTOLD}:
            untold = self._others[UNTOLD]
            self.offered = self._whole(untold) if self._fits(untold) else None
            self.why = OF_NONE
            known = "an earlier version committed the stored set and did not keep of which hull and thrusters it is"
            do = "if the vehicle file is the one that it was identified with, upload it again; else identify anew"
        elif hulls:
            self.why = OF_ANOTHER
            known = "the stored set was committed for another hull or other thrusters than the vehicle file has now"
            do = (
                "upload a set of this vehicle, or put the vehicle file back, which brings the stored set back"
            )
        else:
            return
        self.texts += self.why
        self.trouble = f"{path}: {known}; the feed-forward stays at zero: {do}"

    def _fits(self, stored: Stored) -> bool:
        if stored.mode not in (0.0, 1.0, 2.0, 3.0):
            return False
        if stored.active is None:
            return True
        needed = {name for name, row in self._table.items() if not row.later}
        return needed <= set(stored.active) <= set(self._table) and all(
            self._table[name].admits(value) and to_float32(value) == value
            for name, value in stored.active.items()
        )

    def _whole(self, stored: Stored) -> dict[str, float] | None:
        """Return the stored set with a value for every row of the table, or None if no set is stored."""
        if stored.active is None:
            return None
        return {name: stored.active.get(name, row.default) for name, row in self._table.items()}

    def _put_aside(self, path: Path) -> None:
        try:
            aside = put_aside(path)
            self.texts.append(f"damaged file kept: {aside.name}"[:50])
            self.trouble = (
                f"{path}: the stored parameters can't be used and lie in {aside}; defaults are in force"
            )
        except ParamError:
            self.texts.append("damaged parameter file can't be put aside")
            self.trouble = (
                f"{path}: the stored parameters can't be used, nor put aside; defaults are in force"
            )
