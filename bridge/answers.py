"""Answers to the ground, other than on parameters: arming, motor tests, TIMESYNC; any other request is refused."""

from collections.abc import Callable
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

_FTP_NAK: Final = 129
_FTP_UNKNOWN_COMMAND: Final = 7

Arm = Callable[[bool], bool]
Test = Callable[[Any], int]


def answer_timesync(message: Any, boot_s: float) -> list[Any]:
    """Return the answer to a TIMESYNC request, which has tc1 = 0; [] for another system's answer."""
    if message.tc1 != 0:
        return []
    return [dialect.MAVLink_timesync_message(round(boot_s * 1e9), message.ts1)]


def no_test(_: Any) -> int:
    """MAV_RESULT of a motor test if no program on board turns thrusters."""
    return int(dialect.MAV_RESULT_UNSUPPORTED)


def answer_command(message: Any, arm: Arm, test: Test = no_test) -> list[Any]:
    """Return the COMMAND_ACK to a COMMAND_LONG that was addressed here.

    `arm` returns whether it did as asked, `test` returns the MAV_RESULT of a motor test.
    """
    if message.command == dialect.MAV_CMD_DO_MOTOR_TEST:
        result = test(message)
    elif message.command != dialect.MAV_CMD_COMPONENT_ARM_DISARM:
        result = dialect.MAV_RESULT_UNSUPPORTED
    elif message.param1 not in (0.0, 1.0):
        result = dialect.MAV_RESULT_DENIED
    else:
        result = dialect.MAV_RESULT_ACCEPTED if arm(message.param1 == 1.0) else dialect.MAV_RESULT_DENIED
    sender = message.get_srcSystem(), message.get_srcComponent()
    return [dialect.MAVLink_command_ack_message(message.command, result, 0, 0, *sender)]


def deny_command(message: Any) -> list[Any]:
    """Return the COMMAND_ACK that denies a COMMAND_LONG of a sender that may not give orders here."""
    sender = message.get_srcSystem(), message.get_srcComponent()
    return [dialect.MAVLink_command_ack_message(message.command, dialect.MAV_RESULT_DENIED, 0, 0, *sender)]


def answer_file_transfer(message: Any) -> list[Any]:
    """Refuse a file transfer at once.

    A ground station that asks for parameters as a file then requests them one by one.
    """
    asked = message.payload
    sequence = (asked[0] | asked[1] << 8) + 1 & 0xFFFF
    head = [sequence & 0xFF, sequence >> 8, asked[2], _FTP_NAK, 1, asked[3], 0, 0, 0, 0, 0, 0]
    payload = [*head, _FTP_UNKNOWN_COMMAND]
    payload += [0] * (251 - len(payload))
    sender = message.get_srcSystem(), message.get_srcComponent()
    return [dialect.MAVLink_file_transfer_protocol_message(0, *sender, payload)]


def status_texts(text: str, severity: int, number: int) -> list[Any]:
    """Return a STATUSTEXT of any length in pieces of 50 bytes; `number` (1 to 65535) joins those of a long text."""
    data = text.encode("ascii", errors="replace")
    pieces = [data[i : i + 50] for i in range(0, len(data), 50)] or [b""]
    together = number if len(pieces) > 1 else 0
    return [
        dialect.MAVLink_statustext_message(severity, piece, together, i) for i, piece in enumerate(pieces)
    ]
