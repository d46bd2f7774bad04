"""The vehicle's parameter server: MAVLink's parameter protocol, REAL32 only.

Coefficients are written into a staged set. Writing its CRC to FF_COMMIT makes the whole set active at once: the vehicle
never runs on half of a model. FF_ACTIVE tells the CRC of the set in force. It is refused while armed and the
feed-forward acts: no model changes under a vehicle that flies by it.
"""

import math
import zlib
from collections.abc import Callable, Mapping, Sequence
from enum import IntEnum
from pathlib import Path
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import ConfigError, ParamError
from bridge.messages.readings import CONTRACT_VERSION
from bridge.parameter_memory import Memory
from bridge.parameter_row import FLOAT, Parameter, to_float32
from bridge.parameter_store import UNTOLD
from bridge.vehicle.coefficients import COEFFICIENTS, Coefficient
from bridge.vehicle.config import Configuration, Vehicle
from bridge.vehicle.effect_coefficients import effect_coefficients
from bridge.vehicle.feedforward import Mode
from bridge.vehicle.shadow import NONE_FLOWN

MODE: Final = "FF_MODE"
COMMIT: Final = "FF_COMMIT"
ACTIVE: Final = "FF_ACTIVE"
VERSION: Final = "FF_VERSION"
APPLYING_MODES: Final = (2.0, 3.0)
_SAID_AS: Final = {Mode.ALONE: "only", Mode.BOTH: "both"}
RAISED_ARMED: Final = "FF_MODE refused: armed, shadow not good yet"

# What no vehicle leaves, as parts of its dry mass and of its rigid body's inertia: a slender hull's added mass in
# heave or a flat one's in pitch is several times its own, and a dry mass in a vehicle file may be a guess.
TOTAL_MASS_PARTS: Final = (0.3, 30.0)
TOTAL_INERTIA_PARTS: Final = (0.1, 100.0)
# A damping, as a part of dry mass or inertia, is too small to be meant where the rigid body alone would coast for
# hours: the feed-forward would fly half a model by it. One that is left out is 0.
LEAST_DAMPING_PER_S: Final = 1e-4
# It is too large where all thrusters together couldn't keep up this crawl, each on an arm of this length.
CRAWL_M_S: Final = 0.05
CRAWL_RAD_S: Final = 0.02
ARM_M: Final = 1.0


def set_crc(values: Mapping[str, float]) -> int:
    """The number that stands for a set of parameters: 24 bits, so that a float32 carries it exactly; never 0.

    The low 24 bits of the CRC-32 of every name, "=" and its value's float32 bits (little-endian), by name.
    """
    text = b"".join(name.encode() + b"=" + FLOAT.pack(values[name] + 0.0) for name in sorted(values))
    return zlib.crc32(text) & 0xFFFFFF or 1


class Refusal(IntEnum):
    """Why a write was refused, as PARAM_ERROR says it (MAV_PARAM_ERROR)."""

    UNKNOWN = 1
    OUT_OF_RANGE = 2
    DENIED = 3
    READ_ONLY = 5
    WRONG_TYPE = 7


def vehicle_table(vehicle: Vehicle) -> tuple[Parameter, ...]:
    """The coefficients of every configuration, what the vehicle file gives as its model being the default; behind them
    those of effects, which are absent at first.

    Their bounds are those of the coefficients, drawn in to what a vehicle of this mass and thrust can have.
    Raises ConfigError where that model is out of bounds.
    """
    table = tuple(
        Parameter(
            coefficient.parameter_id(veh_cfg),
            *bounds(coefficient, shape),
            to_float32(shape.model.get(coefficient.name, 0.0)),
            veh_cfg,
            coefficient.name,
        )
        for name, shape in vehicle.configurations.items()
        for veh_cfg in (vehicle.veh_cfg(name),)
        for coefficient in COEFFICIENTS
    )
    for row in table:
        if not row.admits(row.default):
            raise ConfigError(
                f"vehicle '{vehicle.name}': model: {row.coefficient} is {row.default:g}; "
                f"give a value from {row.low:g} to {row.high:g}"
            )
    effects = tuple(
        Parameter(
            one.parameter_id(veh_cfg),
            to_float32(one.low),
            to_float32(one.high),
            0.0,
            veh_cfg,
            one.name,
            True,
        )
        for name, shape in vehicle.configurations.items()
        for veh_cfg in (vehicle.veh_cfg(name),)
        for one in effect_coefficients(shape)
    )
    return table + effects


def bounds(coefficient: Coefficient, shape: Configuration) -> tuple[float, float]:
    """The least and the greatest value of a coefficient that a vehicle of this configuration can have."""
    if coefficient.kind == "mass" and coefficient.dof < 3:
        low, high = (part * shape.dry_mass_kg for part in TOTAL_MASS_PARTS)
    elif coefficient.kind == "mass":
        low, high = (part * shape.inertia_kgm2[coefficient.dof - 3] for part in TOTAL_INERTIA_PARTS)
    else:
        thrust_n = shape.thruster_limit_n * sum(abs(thruster.gain) for thruster in shape.thrusters)
        low = LEAST_DAMPING_PER_S * shape.rigid_body(coefficient.dof)[0]
        high = thrust_n / CRAWL_M_S if coefficient.dof < 3 else thrust_n * ARM_M / CRAWL_RAD_S
    return to_float32(max(low, coefficient.low)), to_float32(min(high, coefficient.high))


class ParameterServer:
    """Answers parameter messages for one component; the file `store_path` keeps the committed set and the mode.

    A parameter's index is its place in the table; FF_MODE, FF_COMMIT, FF_ACTIVE and FF_VERSION follow. Where no set was
    ever committed, the table's defaults are active where they set anything. FF_COMMIT reads as FF_ACTIVE. `hull` is the
    mark of what a model hangs on (`hull_mark`): where sets were committed on other hulls alone, none is active.
    `trouble` says what was wrong with the file, or with the set in it, at the start, "" for nothing.

    While armed the mode is raised only where `unproven` gives "": why the feed-forward has not been good in shadow, as
    the controller sees it (`Autopilot.unproven`). Where no controller has set it nothing is proven. Disarmed it may be
    raised, lowered it may always be.
    """

    def __init__(
        self,
        store_path: Path | None,
        table: Sequence[Parameter],
        *,
        hull: str = UNTOLD,
        system: int = 1,
        component: int = 1,
    ) -> None:
        self.system = system
        self.component = component
        self._table = {parameter.name: parameter for parameter in table}
        self.names = (*self._table, MODE, COMMIT, ACTIVE, VERSION)
        self.unproven: Callable[[], str] = lambda: NONE_FLOWN
        self._memory = Memory(store_path, hull, self._table)
        self.trouble = self._memory.trouble
        self._texts = [*self._memory.texts]
        self._news: list[str] = []
        self._mode, self._is_stored = self._memory.mode, False
        defaults = {parameter.name: parameter.default for parameter in table}
        self._committed = self._memory.committed
        self._active = self._committed
        if self._active is None and any(defaults.values()) and not self._memory.why:
            self._active = defaults
        self._staged = dict(self._active or self._memory.offered or defaults)
        self._by_configuration = self._sorted_by_configuration()
        self._cursor = 0
        self._to_list = 0
        self._came_up_acting = self._mode in APPLYING_MODES and self._active is not None

    @property
    def mode(self) -> int:
        """FF_MODE."""
        return int(self._mode)

    @property
    def active_crc(self) -> int:
        """The CRC of the set in force, 0 where there is none."""
        return 0 if self._active is None else set_crc(self._active)

    @property
    def staged_crc(self) -> int:
        """The CRC that FF_COMMIT asks for."""
        return set_crc(self._staged)

    def active(self, veh_cfg: int) -> Mapping[str, float]:
        """The coefficients in force for a configuration, by name; what is not set, and so 0, is left out."""
        return self._by_configuration.get(veh_cfg, {})

    def value(self, name: str) -> float:
        """What a read answers. Raises KeyError for an unknown name."""
        if name == MODE:
            return self._mode
        if name in (COMMIT, ACTIVE):
            return float(self.active_crc)
        return float(CONTRACT_VERSION) if name == VERSION else self._staged[name]

    def write(self, name: str, value: float, armed: bool) -> Refusal | None:
        """Set one parameter as PARAM_SET does; why it was refused, None where it was taken."""
        if name not in self.names:
            return Refusal.UNKNOWN
        if name in (ACTIVE, VERSION):
            return Refusal.READ_ONLY
        value = to_float32(value)
        if not math.isfinite(value):
            return Refusal.OUT_OF_RANGE
        if name == MODE:
            return self._set_mode(value, armed)
        if name == COMMIT:
            return self._commit(value, armed)
        if not self._table[name].admits(value):
            return Refusal.OUT_OF_RANGE
        self._staged[name] = value
        return None

    def handle(self, message: Any, armed: bool) -> list[Any]:
        """The answers (pymavlink messages) to a message; none to what does not concern these parameters."""
        kind = message.get_type()
        if kind == "PARAM_REQUEST_LIST" and self._is_mine(message, broadcast=True):
            self._to_list = len(self.names)
        elif kind == "PARAM_REQUEST_READ" and self._is_mine(message, broadcast=False):
            return self._read(message)
        elif kind == "PARAM_SET" and self._is_mine(message, broadcast=False):
            return self._set(message, armed)
        return []

    def step(self, most: int) -> list[Any]:
        """Up to `most` values of a list that was asked for; a second request makes it go round once more."""
        count = min(most, self._to_list)
        values = []
        for _ in range(count):
            values.append(self._told(self.names[self._cursor]))
            self._cursor = (self._cursor + 1) % len(self.names)
        self._to_list -= count
        return values

    def take_texts(self) -> list[str]:
        """What the crew must know, each once, for STATUSTEXT; after a start that the feed-forward acts as stored."""
        texts, self._texts = self._texts, []
        came_up, self._came_up_acting = self._came_up_acting, False
        if came_up and self._mode in APPLYING_MODES:
            texts.append(f"FF {_SAID_AS[Mode(self.mode)]}: acts once armed")
        return texts

    def take_news(self) -> list[str]:
        """What went as it should, each once, for STATUSTEXT: nothing to warn of."""
        news, self._news = self._news, []
        return news

    def _set_mode(self, value: float, armed: bool) -> Refusal | None:
        if value not in (0.0, 1.0, 2.0, 3.0):
            return Refusal.OUT_OF_RANGE
        if value in APPLYING_MODES and self._active is None:
            # The crew may not have listened yet when the vehicle started.
            self._texts += (
                ["FF_MODE refused: no active set", *self._memory.why] if armed else self._memory.why
            )
            if armed:
                return Refusal.DENIED
        if value == self._mode and self._is_stored:
            return None
        unproven = self.unproven() if armed and Mode(int(value)).raises(Mode(self.mode)) else ""
        if unproven:
            self._texts += [RAISED_ARMED, unproven]
            return Refusal.DENIED
        self._mode = value
        # Switching off must work on a full disk too, so a mode that can't be stored is in force all the same.
        self._save()
        return None

    def _commit(self, value: float, armed: bool) -> Refusal | None:
        if value != self.staged_crc:
            self._texts.append("FF_COMMIT refused: CRC is not the staged set's")
            return Refusal.OUT_OF_RANGE
        before = self._active, self._committed
        if armed and self._mode in APPLYING_MODES:
            self._texts.append("FF_COMMIT refused: armed, force FF off first")
            return Refusal.DENIED
        self._active = self._committed = dict(self._staged)
        if not self._save():
            self._active, self._committed = before
            return Refusal.DENIED
        if self._active != before[0]:
            self._by_configuration = self._sorted_by_configuration()
            self._news.append(f"FF set {self.active_crc} active")
        return None

    def _is_mine(self, message: Any, broadcast: bool) -> bool:
        everyone = (0,) if broadcast else ()
        to_system = message.target_system in (self.system, *everyone)
        return to_system and message.target_component in (self.component, *everyone)

    def _read(self, message: Any) -> list[Any]:
        index, name = message.param_index, message.param_id
        if index >= 0:
            name = self.names[index] if index < len(self.names) else ""
        if name not in self.names:
            return [self._error(message, Refusal.UNKNOWN)]
        return [self._told(name)]

    def _set(self, message: Any, armed: bool) -> list[Any]:
        name = message.param_id
        if name in self.names and message.param_type != dialect.MAV_PARAM_TYPE_REAL32:
            refusal: Refusal | None = Refusal.WRONG_TYPE
        else:
            refusal = self.write(name, message.param_value, armed)
        answers = [] if refusal is None else [self._error(message, refusal)]
        # A refused write is also answered by the value that still holds: not all clients know PARAM_ERROR.
        return answers if refusal is Refusal.UNKNOWN else [*answers, self._told(name)]

    def deny(self, message: Any) -> list[Any]:
        """The answers to a PARAM_SET of somebody who may write nothing: that it is refused, and what still holds."""
        if message.param_id not in self.names:
            return [self._error(message, Refusal.UNKNOWN)]
        return [self._error(message, Refusal.DENIED), self._told(message.param_id)]

    def _told(self, name: str) -> Any:
        return dialect.MAVLink_param_value_message(
            name.encode(),
            self.value(name),
            dialect.MAV_PARAM_TYPE_REAL32,
            len(self.names),
            self.names.index(name),
        )

    def _error(self, message: Any, refusal: Refusal) -> Any:
        return dialect.MAVLink_param_error_message(
            message.get_srcSystem(),
            message.get_srcComponent(),
            message.param_id.encode("ascii", errors="replace"),
            getattr(message, "param_index", -1),
            int(refusal),
        )

    def _sorted_by_configuration(self) -> dict[int, dict[str, float]]:
        sets: dict[int, dict[str, float]] = {}
        for name, value in (self._active or {}).items():
            row = self._table[name]
            # No hull in water has a linear damping of exactly 0: taken for a value it would make half a model fly.
            if value != 0.0:
                sets.setdefault(row.veh_cfg, {})[row.coefficient] = value
        return sets

    def _save(self) -> bool:
        try:
            self._memory.save(self._mode, self._committed)
            self._is_stored = True
        except ParamError:
            self._texts.append("parameters can't be stored: check the disk")
            self._is_stored = False
        return self._is_stored
