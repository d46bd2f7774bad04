"""Who comes to a recording's hub when all its places are taken: a guest, who listens and may say OFF.

Whatever else runs, or was left running yesterday, the feed-forward must go off. OFF is sent to who was heard, and until
telemetry says so; so a guest hears all. What else it orders is not passed on: it is told why, and let go.
"""

from functools import cache
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import Encoder, Frame, decode
from bridge.parameters import MODE
from bridge.vehicle.feedforward import Mode
from gcs_plugin.station import GROUND_STATION

PLACES: Final = 16
"""Programs that may order anything."""
GUESTS: Final = 4
STAYS_S: Final = 5.0
"""A guest keeps its place so long for certain, from its coming and from each OFF: time to hear the vehicle."""

FULL: Final = (
    f"{PLACES} programs are connected to the recording already: those that come now can listen and force the "
    "feed-forward off, no more; end one of the others"
)
"""For who records."""


@cache
def farewell() -> bytes:
    """The frame that is the last one for who is let go since all places are taken; for whoever speaks MAVLink."""
    text = f"{PLACES} programs use this recording already; end one"
    message = dialect.MAVLink_statustext_message(dialect.MAV_SEVERITY_WARNING, text.encode("ascii"))
    return Encoder(*GROUND_STATION).encode(message)


def is_of_off(frame: Frame) -> bool:
    """Whether a frame orders that the feed-forward be off, or asks for its mode."""
    message = decode(frame)
    if message is None:
        return False
    if message.get_type() == "PARAM_SET":
        return bool(message.param_id == MODE and message.param_value == Mode.OFF)
    return bool(message.get_type() == "PARAM_REQUEST_READ" and message.param_id == MODE)


def may_send(frame: Frame) -> bool:
    """Whether a guest's frame is passed on: from HEARTBEAT a vehicle on UDP learns where the ground is."""
    return frame.message_id == dialect.MAVLINK_MSG_ID_HEARTBEAT or is_of_off(frame)
