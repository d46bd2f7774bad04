"""The supported firmwares. To add a firmware: a file in this folder, and a line here."""

from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.firmware.ardusub import ARDUSUB
from bridge.firmware.description import Firmware

FIRMWARES: Final[tuple[Firmware, ...]] = (ARDUSUB,)

_NONE: Final = (dialect.MAV_AUTOPILOT_GENERIC, dialect.MAV_AUTOPILOT_INVALID)
"""A vehicle of one's own, and a component that is no autopilot."""


def firmware_of(autopilot: int) -> Firmware | None:
    """The firmware with this MAV_AUTOPILOT; None for one that is not supported."""
    return next((firmware for firmware in FIRMWARES if firmware.autopilot == autopilot), None)


def not_supported(autopilot: int) -> str:
    """A sentence for an autopilot that is not supported, on the verbs that work all the same; "" for any other."""
    if autopilot in _NONE or firmware_of(autopilot) is not None:
        return ""
    known = dialect.enums["MAV_AUTOPILOT"].get(autopilot)
    name = f"autopilot {autopilot}" if known is None else known.name.removeprefix("MAV_AUTOPILOT_")
    supported = " or ".join(firmware.name for firmware in FIRMWARES)
    return (
        f"{name} is not supported, nothing is asked of it and it gets no feed-forward (use {supported} for one); what "
        "works: record, watch, import, identify, diagnose"
    )


def alone(autopilot: int) -> str:
    """A sentence on an autopilot beside which nothing answers for a feed-forward; "" for a component that is none."""
    firmware = firmware_of(autopilot)
    return (
        not_supported(autopilot) if firmware is None else f"an autopilot alone has no FF_MODE: {firmware.way}"
    )


def records_nothing(autopilot: int) -> str:
    """A sentence on an autopilot that is asked for the recording of a bridge; "" for a component that is none."""
    return (
        ""
        if autopilot in _NONE
        else "an autopilot alone keeps no recording to fetch: start seatrial bridge beside it, with --ring, or take "
        "the autopilot's own log, which import and identify read"
    )
