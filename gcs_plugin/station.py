"""Identity of the ground station on a link: its MAVLink system and component, and its HEARTBEAT."""

from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

GROUND_STATION: Final = (255, 190)


def ground_heartbeat() -> dialect.MAVLink_heartbeat_message:
    """The HEARTBEAT of a ground station."""
    return dialect.MAVLink_heartbeat_message(
        dialect.MAV_TYPE_GCS, dialect.MAV_AUTOPILOT_INVALID, 0, 0, dialect.MAV_STATE_ACTIVE, 3
    )
