"""Arming and disarming a vehicle, confirmed by its COMMAND_ACK."""

from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import Clock
from bridge.errors import LinkError, LinkTimeout
from bridge.framing import Encoder, Framer, decode
from bridge.link.base import Link
from gcs_plugin.peers import GROUND_STATION

POLL_S: Final = 0.02
ASK_EVERY_S: Final = 1.0
WITHIN_S: Final = 5.0


def arm(link: Link, clock: Clock, target: tuple[int, int]) -> None:
    """Arm the vehicle `target` (system, component).

    Raises LinkError if it refuses, LinkTimeout if it does not answer within WITHIN_S.
    """
    _order(link, clock, target, 1.0, "arm")


def disarm(link: Link, clock: Clock, target: tuple[int, int]) -> None:
    """Disarm the vehicle `target`. Raises as `arm` does."""
    _order(link, clock, target, 0.0, "disarm")


def _order(link: Link, clock: Clock, target: tuple[int, int], wanted: float, word: str) -> None:
    encoder, framer = Encoder(*GROUND_STATION), Framer()
    command = dialect.MAV_CMD_COMPONENT_ARM_DISARM
    order = dialect.MAVLink_command_long_message(*target, command, 0, wanted, 0, 0, 0, 0, 0, 0)
    start_s = ask_s = clock.boot_s()
    while (now_s := clock.boot_s()) - start_s < WITHIN_S:
        if now_s >= ask_s:
            ask_s = now_s + ASK_EVERY_S
            link.write(encoder.encode(order))
        for frame in framer.feed(link.read(POLL_S)):
            if (
                frame.message_id != dialect.MAVLINK_MSG_ID_COMMAND_ACK
                or (frame.system, frame.component) != target
            ):
                continue
            answer = decode(frame)
            if answer is None or answer.command != command:
                continue
            if answer.result == dialect.MAV_RESULT_ACCEPTED:
                return
            raise LinkError(
                f"{link.name}: the vehicle refused to {word} (answer {answer.result}); see what it says"
            )
    raise LinkTimeout(
        f"{link.name}: no answer to the order to {word} within {WITHIN_S:.0f} s; check the link"
    )
