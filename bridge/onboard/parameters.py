"""The vehicle's parameter server: MAVLink's parameter protocol, REAL32 only.

Coefficients are written into a staged set. Writing the CRC of that set to FF_COMMIT makes the whole set active at
once: the vehicle never runs on half of a model. Writing 0 leaves no set active. FF_ACTIVE reads as the CRC of the
active set, 0 for none. A commit is refused while the vehicle is armed and the feed-forward acts, and in a flight: no
model changes under a vehicle that flies by it, and no loop that steers waits for a disk.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, Future
from enum import IntEnum
from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import ParamError
from bridge.onboard.store import Memory, hull_mark
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.mode import Mode
from bridge.vehicle.parameters import (
    ACTIVE,
    COMMIT,
    MODE,
    VERSION,
    Parameter,
    set_crc,
    to_float32,
    vehicle_table,
)
from bridge.vehicle.shadow import NONE_FLOWN
from bridge.wire.readings import CONTRACT_VERSION
from bridge.wire.status_codes import Topic, coded


class Refusal(IntEnum):
    """Why a write was refused, as PARAM_ERROR reports it (MAV_PARAM_ERROR)."""

    UNKNOWN = 1
    OUT_OF_RANGE = 2
    DENIED = 3
    READ_ONLY = 5
    WRONG_TYPE = 7


class ParameterServer:
    """Answers parameter messages for one component. The file `store_path` keeps the committed set and the mode.

    A parameter's index is its row in the table; FF_MODE, FF_COMMIT, FF_ACTIVE and FF_VERSION follow. If no set
    was ever committed, none is active: the table's defaults are staged alone. FF_COMMIT reads as FF_ACTIVE. `hull` is
    the mark of everything that a model depends on (`hull_mark`): sets that were committed on other hulls are not active
    on this. `trouble` is the fault at the start of the file or of the set in it, "" for nothing.

    While armed, the mode can be raised only if `unproven` returns "". Otherwise it returns why the feed-forward has
    not been good in shadow, as judged by the controller (`Autopilot.unproven`). Until a controller sets it, nothing
    is proven. While disarmed the mode may be raised; it may always be lowered.

    `aside`, of one thread, stores the mode for a caller whose control loop must not wait for a disk that stalls; None
    stores it at once. A set is on the disk before its commit is answered, and is waited for.
    """

    def __init__(
        self,
        store_path: Path | None,
        table: Sequence[Parameter],
        *,
        hull: str = "",
        system: int = 1,
        component: int = 1,
        aside: Executor | None = None,
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
        self._mode, self._is_stored = Mode(int(self._memory.mode)), False
        self._aside = aside or InlineExecutor()
        self._storing: Future[None] | None = None
        self._active = self._memory.committed
        self._staged = dict(self._active or {parameter.name: parameter.default for parameter in table})
        self._by_configuration = self._sorted_by_configuration()
        self._cursor = 0
        self._to_list = 0
        self._came_up_acting = self._mode.applies_feedforward and self._active is not None

    @property
    def mode(self) -> Mode:
        """FF_MODE."""
        return self._mode

    @property
    def active_crc(self) -> int:
        """CRC of the active set, 0 if there is none."""
        return 0 if self._active is None else set_crc(self._active)

    @property
    def staged_crc(self) -> int:
        """CRC of the staged set, which a write to FF_COMMIT must match."""
        return set_crc(self._staged)

    def active(self, veh_cfg: int) -> Mapping[str, float]:
        """Active coefficients of a configuration, by name; coefficients that are not set (0) are left out."""
        return self._by_configuration.get(veh_cfg, {})

    def value(self, name: str) -> float:
        """Return the value that a read gets. Raises KeyError for an unknown name."""
        if name == MODE:
            return float(self._mode)
        if name in (COMMIT, ACTIVE):
            return float(self.active_crc)
        return float(CONTRACT_VERSION) if name == VERSION else self._staged[name]

    def write(self, name: str, value: float, armed: bool, *, in_flight: bool = False) -> Refusal | None:
        """Set one parameter as PARAM_SET does. Return why it was refused, or None if it was accepted.

        `armed`: the vehicle is, or may be; `in_flight`: a flight is under way, from its countdown on.
        """
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
            return self._commit(value, armed, in_flight)
        if not self._table[name].admits(value):
            return Refusal.OUT_OF_RANGE
        self._staged[name] = value
        return None

    def handle(self, message: Any, armed: bool, *, in_flight: bool = False) -> list[Any]:
        """Return the answers (pymavlink messages) to a message; [] if it does not concern these parameters.

        `armed` and `in_flight` as in `write`. The values of a requested list come from `step`.
        """
        kind = message.get_type()
        if kind == "PARAM_REQUEST_LIST" and self._is_mine(message, broadcast=True):
            self._to_list = len(self.names)
        elif kind == "PARAM_REQUEST_READ" and self._is_mine(message, broadcast=False):
            return self._read(message)
        elif kind == "PARAM_SET" and self._is_mine(message, broadcast=False):
            return self._set(message, armed, in_flight)
        return []

    def step(self, most: int) -> list[Any]:
        """Return up to `most` values of a requested list. A second request makes the list go round once more."""
        count = min(most, self._to_list)
        values = []
        for _ in range(count):
            values.append(self._value_message(self.names[self._cursor]))
            self._cursor = (self._cursor + 1) % len(self.names)
        self._to_list -= count
        return values

    def take_texts(self) -> list[str]:
        """Return the warnings for the crew since the last call, for STATUSTEXT.

        After a start with a stored mode that acts, they include that the feed-forward acts once armed.
        """
        self._end_storing_if_done()
        texts, self._texts = self._texts, []
        came_up, self._came_up_acting = self._came_up_acting, False
        if came_up and self._mode.applies_feedforward:
            texts.append(coded(Topic.ONCE_ARMED, f"FF {self._mode.word}: acts once armed"))
        return texts

    def take_news(self) -> list[str]:
        """Return the reports of success since the last call, for STATUSTEXT; none of them is a warning."""
        news, self._news = self._news, []
        return news

    def _set_mode(self, value: float, armed: bool) -> Refusal | None:
        if value not in set(Mode):
            return Refusal.OUT_OF_RANGE
        wanted = Mode(int(value))
        if wanted.applies_feedforward and self._active is None:
            # The crew may have missed the messages of the start.
            self._texts += (
                [coded(Topic.NO_SET, "FF_MODE refused: no active set"), *self._memory.why]
                if armed
                else self._memory.why
            )
            if armed:
                return Refusal.DENIED
        if wanted is self._mode and self._is_stored:
            return None
        unproven = self.unproven() if armed and wanted.raises(self._mode) else ""
        if unproven:
            why = "FF_MODE refused: armed, shadow not good yet"
            self._texts += [coded(Topic.UNPROVEN, why), coded(Topic.SHADOW, unproven)]
            return Refusal.DENIED
        self._mode = wanted
        # Switching off must work on a full disk too, so a mode takes effect even if it can't be stored.
        self._begin_storing()
        self._end_storing_if_done()
        return None

    def _commit(self, value: float, armed: bool, in_flight: bool) -> Refusal | None:
        if value not in (0.0, self.staged_crc):
            self._texts.append("FF_COMMIT refused: CRC is not the staged set's")
            return Refusal.OUT_OF_RANGE
        before = self._active
        if in_flight:
            self._texts.append("FF_COMMIT refused: in a flight, end it first")
            return Refusal.DENIED
        if armed and self._mode.applies_feedforward:
            self._texts.append("FF_COMMIT refused: armed, force FF off first")
            return Refusal.DENIED
        self._active = dict(self._staged) if value else None
        self._begin_storing()
        if not self._end_storing():
            self._active = before
            return Refusal.DENIED
        if self._active != before:
            self._by_configuration = self._sorted_by_configuration()
            number = self.active_crc
            said = f"FF set {number} active" if number else "no FF set active"
            self._news.append(coded(Topic.SET_ACTIVE, said, number))
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
        return [self._value_message(name)]

    def _set(self, message: Any, armed: bool, in_flight: bool) -> list[Any]:
        name = message.param_id
        if name in self.names and message.param_type != dialect.MAV_PARAM_TYPE_REAL32:
            refusal: Refusal | None = Refusal.WRONG_TYPE
        else:
            refusal = self.write(name, message.param_value, armed, in_flight=in_flight)
        answers = [] if refusal is None else [self._error(message, refusal)]
        # A refused write is also answered with the current value: not all clients know PARAM_ERROR.
        return answers if refusal is Refusal.UNKNOWN else [*answers, self._value_message(name)]

    def deny(self, message: Any) -> list[Any]:
        """Return the answers to a PARAM_SET of a sender that may write nothing: the refusal and the current value."""
        if message.param_id not in self.names:
            return [self._error(message, Refusal.UNKNOWN)]
        return [self._error(message, Refusal.DENIED), self._value_message(message.param_id)]

    def _value_message(self, name: str) -> Any:
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
            # No hull in water has a linear damping of exactly 0: as a value it would make half a model fly.
            if value != 0.0:
                sets.setdefault(row.veh_cfg, {})[row.coefficient] = value
        return sets

    def _begin_storing(self) -> None:
        self._storing = self._aside.submit(self._memory.save, float(self._mode), self._active)
        self._is_stored = True

    def _end_storing_if_done(self) -> None:
        if self._storing is not None and self._storing.done():
            self._end_storing()

    def _end_storing(self) -> bool:
        """Wait until mode and set are stored; return whether they are, and tell the crew if not."""
        storing, self._storing = self._storing, None
        try:
            if storing is not None:
                storing.result()
        except ParamError:
            self._texts.append("parameters can't be stored: check the disk")
            self._is_stored = False
        return self._is_stored


class InlineExecutor(Executor):
    """Does its work within `submit`, for a caller that may wait."""

    def submit(self, work: Callable[..., Any], /, *of: Any, **named: Any) -> Future[Any]:
        done: Future[Any] = Future()
        try:
            done.set_result(work(*of, **named))
        except Exception as error:  # noqa: BLE001 (raised where the result is asked for)
            done.set_exception(error)
        return done


def parameters_of(file: VehicleFile, store: Path | None, aside: Executor | None = None) -> ParameterServer:
    """Return the parameters of a vehicle file's vehicle, stored in `store`, or only in memory if that is None."""
    vehicle = file.vehicle
    return ParameterServer(
        store,
        vehicle_table(vehicle),
        hull=hull_mark(vehicle, file.path.parent),
        system=vehicle.system_id,
        component=vehicle.component_id,
        aside=aside,
    )
