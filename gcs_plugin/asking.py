"""Questions and orders to one component, each sent again until it is answered; every wait reads the link."""

from collections.abc import Callable
from typing import Any, Final, TypeVar

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import Clock
from bridge.errors import LinkTimeout
from bridge.links.link import Link
from bridge.wire.framing import Encoder, Framer, decode
from gcs_plugin.params.session import NO_INDEX
from gcs_plugin.peers import GROUND_STATION, Source

POLL_S: Final = 0.02
AGAIN_S: Final = 0.5
ANSWER_S: Final = 10.0
"""Time for an answer, unless the caller has another."""

Answer = TypeVar("Answer")


def command_long(target: Source, number: int, *parameters: float) -> dialect.MAVLink_command_long_message:
    """The order of a command to a component; parameters that are left out are 0."""
    filled = (*parameters, *(0.0,) * (7 - len(parameters)))
    return dialect.MAVLink_command_long_message(*target, number, 0, *filled)


class Asking:
    """The ground's questions to the component `target` on `link`. Every method raises LinkTimeout without an answer."""

    def __init__(self, link: Link, clock: Clock, target: Source) -> None:
        self._link, self._clock, self._target = link, clock, target
        self._framer, self._encoder = Framer(), Encoder(*GROUND_STATION)

    def until(
        self,
        accept: Callable[[Any], Answer | None],
        seconds: float,
        ask: Any = None,
        awaited: str = "an answer",
    ) -> Answer:
        """Wait for the message that `accept` takes, and return its result; `ask` is sent until then."""
        end_s, due_s = self._clock.boot_s() + seconds, 0.0
        while (now_s := self._clock.boot_s()) < end_s:
            if ask is not None and now_s >= due_s:
                due_s = now_s + AGAIN_S
                self._link.write(self._encoder.encode(ask))
            for message in self._hear():
                if (result := accept(message)) is not None:
                    return result
        raise LinkTimeout(f"{self._link.name}: {awaited} did not come within {seconds:g} s; check the link")

    def pause(self, seconds: float) -> None:
        """Let time pass, deaf."""
        end_s = self._clock.boot_s() + seconds
        while self._clock.boot_s() < end_s:
            self._hear()

    def command(self, number: int, *parameters: float, seconds: float = ANSWER_S, awaited: str = "") -> int:
        """Order a command (COMMAND_LONG); return the MAV_RESULT of its acknowledgement."""
        order = command_long(self._target, number, *parameters)

        def answered(message: Any) -> int | None:
            is_answer = message.get_type() == "COMMAND_ACK" and message.command == number
            # Another ground may order the same at the same time.
            mine = is_answer and message.target_system in (0, GROUND_STATION[0])
            return int(message.result) if mine else None

        return self.until(answered, seconds, order, awaited or f"the answer to command {number}")

    def read(self, name: str) -> float:
        """The value of a parameter, by a separate read."""

        def answered(message: Any) -> float | None:
            mine = message.get_type() == "PARAM_VALUE" and message.param_id == name
            return float(message.param_value) if mine else None

        ask = dialect.MAVLink_param_request_read_message(*self._target, name.encode(), NO_INDEX)
        return self.until(answered, ANSWER_S, ask, name)

    def _hear(self) -> list[Any]:
        frames = self._framer.feed(self._link.read(POLL_S))
        mine = (frame for frame in frames if (frame.system, frame.component) == self._target)
        return [message for message in map(decode, mine) if message is not None]
