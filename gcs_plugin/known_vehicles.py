"""Vehicles heard lately, and whether they reported FF_MODE: an OFF goes to them even if none is heard now. Pure."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import Frame, decode
from bridge.messages.readings import decode as decode_reading
from bridge.parameters import MODE
from gcs_plugin.params.client import Heard
from gcs_plugin.senders import Senders, Source

KNOWN_FOR_S: Final = 3600.0
"""Time for which a vehicle that reported FF_MODE is still sent OFF: a dive out of range is shorter."""
PASSED_BY_S: Final = 60.0
"""The same for a vehicle that only sent HEARTBEATs: it may have no feed-forward, or belong to a boat that passed by."""

_NAME: Final = MODE.encode()


@dataclass(frozen=True, slots=True)
class KnownVehicle:
    """Component of a vehicle; `holds`: it has reported FF_MODE; `heard_s`: time of its last HEARTBEAT or FF_MODE."""

    source: Source
    holds: bool
    heard_s: float


class KnownVehicles:
    """Table of the vehicles heard. Takes every frame of all links; decodes only HEARTBEATs and reports of FF_MODE."""

    def __init__(self) -> None:
        self._known: Senders[KnownVehicle] = Senders()

    def on_frame(self, frame: Frame, time_s: float) -> None:
        """A frame arrived at `time_s`."""
        holds = _tells_mode(frame)
        if holds or _beats(frame):
            source = (frame.system, frame.component)
            before = self._known.get(source)
            holds = holds or (before is not None and before.holds)
            self._known.put(source, time_s, KnownVehicle(source, holds, time_s))

    def at(self, now_s: float) -> tuple[KnownVehicle, ...]:
        """The vehicles that an OFF must go to."""
        return tuple(vehicle for _, vehicle in self._known.items() if still_known(vehicle, now_s))


def still_known(vehicle: KnownVehicle, now_s: float) -> bool:
    """Whether a vehicle was heard recently enough to be sent OFF."""
    return now_s - vehicle.heard_s <= (KNOWN_FOR_S if vehicle.holds else PASSED_BY_S)


def newest(vehicles: Iterable[KnownVehicle]) -> tuple[KnownVehicle, ...]:
    """The newest entry of each source."""
    in_order = sorted(vehicles, key=lambda one: one.heard_s)
    return tuple({vehicle.source: vehicle for vehicle in in_order}.values())


def _beats(frame: Frame) -> bool:
    if frame.message_id != dialect.MAVLINK_MSG_ID_HEARTBEAT:
        return False
    message = decode(frame)
    if message is None:
        return False
    return Heard((frame.system, frame.component), message.type, message.autopilot, False, 0.0).is_vehicle


def _tells_mode(frame: Frame) -> bool:
    if _NAME not in frame.payload:
        return False
    if frame.message_id == dialect.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT:
        reading = decode_reading(frame)
        return reading is not None and reading.signal == "ff_mode"
    if frame.message_id == dialect.MAVLINK_MSG_ID_PARAM_VALUE:
        message = decode(frame)
        return message is not None and bool(message.param_id == MODE)
    return False
