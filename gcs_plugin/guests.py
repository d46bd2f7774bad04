"""Guests of a recording's hub: clients that connect when all places are taken, and may listen and order OFF.

The feed-forward must go off whatever else runs, or was left running yesterday. OFF is sent to the vehicles that are
heard, and until their telemetry confirms it, so a guest receives all frames. Its other orders are not passed on: the
guest gets a message with the reason, and is disconnected.
"""

from functools import cache
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import Encoder, Frame, decode
from bridge.parameters import MODE
from bridge.vehicle.feedforward import Mode
from gcs_plugin.peers import GROUND_STATION

PLACES: Final = 16
"""Number of clients that may send any order."""
GUESTS: Final = 4
STAYS_S: Final = 5.0
"""Time for which a guest keeps its place for certain, from its connection and each OFF: enough to hear the vehicle."""

FULL: Final = (
    f"{PLACES} programs are connected to the recording already: those that come now can listen and force the "
    "feed-forward off, no more; end one of the others"
)
"""Warning to the operator of the recording."""


@cache
def farewell() -> bytes:
    """Last frame sent to a guest that is disconnected: a STATUSTEXT with the reason."""
    text = f"{PLACES} programs use this recording already; end one"
    message = dialect.MAVLink_statustext_message(dialect.MAV_SEVERITY_WARNING, text.encode("ascii"))
    return Encoder(*GROUND_STATION).encode(message)


def is_of_off(frame: Frame) -> bool:
    """Whether a frame orders the feed-forward off, or requests its mode."""
    message = decode(frame)
    if message is None:
        return False
    if message.get_type() == "PARAM_SET":
        return bool(message.param_id == MODE and message.param_value == Mode.OFF)
    return bool(message.get_type() == "PARAM_REQUEST_READ" and message.param_id == MODE)


def may_send(frame: Frame) -> bool:
    """Whether a guest's frame is passed on: those of `is_of_off`, and HEARTBEAT.

    A vehicle on UDP learns the ground station's address from its HEARTBEAT.
    """
    return frame.message_id == dialect.MAVLINK_MSG_ID_HEARTBEAT or is_of_off(frame)
