"""Orders and questions of the ground, other than on parameters: arming, motor tests, TIMESYNC, file transfers.

Orders are taken from one address only; any other request is refused.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.wire.ftp import PAYLOAD_BYTES, Fault, decode, refused

STATION_SYSTEM = 255


@dataclass(frozen=True, slots=True)
class Ground:
    """MAVLink address whose writes and commands are accepted; `component` None accepts all of the system."""

    system: int = STATION_SYSTEM
    component: int | None = None

    def gives(self, system: int, component: int) -> bool:
        """Whether an order from this address comes from the ground."""
        return system == self.system and self.component in (None, component)

    def __str__(self) -> str:
        return f"system {self.system}" + ("" if self.component is None else f", component {self.component}")


ArmHandler = Callable[[bool], bool]
MotorTestHandler = Callable[[Any], int]


def answer_timesync(message: Any, boot_s: float) -> list[Any]:
    """Return the answer to a TIMESYNC request, which has tc1 = 0; [] for another system's answer."""
    if message.tc1 != 0:
        return []
    return [dialect.MAVLink_timesync_message(round(boot_s * 1e9), message.ts1)]


def answer_command(message: Any, arm: ArmHandler, test: MotorTestHandler | None = None) -> list[Any]:
    """Return the COMMAND_ACK to a COMMAND_LONG that was addressed here.

    `arm` returns whether it did as asked, `test` returns the MAV_RESULT of a motor test; None if no program on board
    turns thrusters.
    """
    if message.command == dialect.MAV_CMD_DO_MOTOR_TEST and test is not None:
        return acknowledge(message, test(message))
    if message.command != dialect.MAV_CMD_COMPONENT_ARM_DISARM:
        return acknowledge(message, dialect.MAV_RESULT_UNSUPPORTED)
    if message.param1 not in (0.0, 1.0) or not arm(message.param1 == 1.0):
        return deny_command(message)
    return acknowledge(message, dialect.MAV_RESULT_ACCEPTED)


def deny_command(message: Any) -> list[Any]:
    """Return the COMMAND_ACK that denies a COMMAND_LONG, as to a sender that may not give orders here."""
    return acknowledge(message, dialect.MAV_RESULT_DENIED)


def acknowledge(message: Any, result: int, of: int = 0) -> list[Any]:
    """Return the COMMAND_ACK of a COMMAND_LONG; `of` goes into result_param2."""
    sender = message.get_srcSystem(), message.get_srcComponent()
    return [dialect.MAVLink_command_ack_message(message.command, result, 0, of, *sender)]


def refuse_file_transfer(message: Any) -> list[Any]:
    """Refuse a file transfer at once.

    A ground station that asks for parameters as a file then requests them one by one.
    """
    answer = refused(decode(bytes(message.payload)), Fault.UNKNOWN).encode()
    sender = message.get_srcSystem(), message.get_srcComponent()
    payload = answer.ljust(PAYLOAD_BYTES, b"\0")
    return [dialect.MAVLink_file_transfer_protocol_message(0, *sender, list(payload))]
