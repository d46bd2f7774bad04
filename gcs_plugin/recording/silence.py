"""The longest silence of a dive's vehicle, known while the dive is recorded, by the rules of `bridge.wire.silences`.

Boot times are from SYSTEM_TIME, which vehicles send once a second.
"""

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.wire.framing import Frame
from bridge.wire.silences import LEAST_S, ROUND, Pause, Spacing, of_clocks, unheard
from gcs_plugin.peers import MOST_PEERS, NAME_AT, Peer, Source

MOST_PAUSES: Final = 1000
"""Most pauses kept of a sender in a dive; beyond that, the shortest is dropped."""
_SYSTEM_TIME: Final[int] = dialect.MAVLINK_MSG_ID_SYSTEM_TIME
_NAMED_INT: Final[int] = dialect.MAVLINK_MSG_ID_NAMED_VALUE_INT
_BOOT_ID: Final = b"BOOT_ID"
_BOOT_MS: Final = struct.Struct("<I")


@dataclass(slots=True)
class _Sender:
    """State of a component.

    `ahead_s` is its boot clock minus the clock of the arrivals, NaN before its first boot time; `open` is the latest
    pause, as long as no boot time has arrived after it.
    """

    last_s: float
    number: int
    frames: int = 0
    is_vehicle: bool = False
    keeps_ring: bool = False
    ahead_s: float = math.nan
    open: Pause | None = None
    spacing: Spacing = field(default_factory=Spacing)
    pauses: list[Pause] = field(default_factory=list)

    def hear(self, frame: Frame, time_s: float) -> None:
        self.frames += 1
        step_s, goes_on = time_s - self.last_s, (frame.sequence - self.number) % ROUND == 1
        if step_s > LEAST_S:
            self.close(self.open)
            self.open = Pause(self.frames, self.last_s, step_s, goes_on)
        elif step_s > 0.0:
            self.spacing.seconds += step_s
            self.spacing.squares += step_s**2
        self.last_s, self.number = time_s, frame.sequence
        if frame.message_id == _SYSTEM_TIME:
            (boot_ms,) = _BOOT_MS.unpack_from(frame.payload.ljust(12, b"\0"), 8)
            self.tell(boot_ms / 1e3, time_s)
        elif frame.message_id == _NAMED_INT and frame.payload[NAME_AT:].rstrip(b"\0") == _BOOT_ID:
            self.keeps_ring = True

    def tell(self, boot_s: float, time_s: float) -> None:
        """A boot time arrived: close the open pause, or note a silence by the jump of the boot clock."""
        before_s, self.ahead_s = self.ahead_s, boot_s - time_s
        if math.isnan(before_s):
            self.close(self.open)
        elif self.open is not None:
            begins_s, step_s = self.open.begins_s, self.open.seconds
            seconds, anew = of_clocks(begins_s, step_s, before_s, self.ahead_s)
            self.close(Pause(self.open.row, begins_s, seconds, self.open.goes_on, by_clock=True, anew=anew))
        elif self.ahead_s - before_s > LEAST_S:
            self.close(Pause(self.frames, time_s, self.ahead_s - before_s, goes_on=False, by_clock=True))
        self.open = None

    def close(self, pause: Pause | None) -> None:
        if pause is None:
            return
        if len(self.pauses) >= MOST_PAUSES:
            self.pauses.remove(min(self.pauses, key=lambda kept: kept.seconds))
        self.pauses.append(pause)

    @property
    def silent_s(self) -> float:
        pauses: Sequence[Pause] = [*self.pauses, *([self.open] if self.open else [])]
        return max((pause.seconds for pause in unheard(pauses, self.spacing)), default=0.0)


class SilenceTracker:
    """Silences of a dive's vehicles over all links: a frame on any link counts as heard."""

    def __init__(self) -> None:
        self._senders: dict[Source, _Sender] = {}

    def on_frame(self, peer: Peer, frame: Frame, time_s: float) -> None:
        """A frame of `peer` arrived at `time_s`, which never runs back."""
        sender = self._senders.get(peer.source)
        if sender is None:
            if len(self._senders) >= MOST_PEERS:
                return
            sender = self._senders[peer.source] = _Sender(time_s, frame.sequence)
        sender.is_vehicle = peer.is_vehicle
        sender.hear(frame, time_s)

    @property
    def longest_s(self) -> float:
        """Longest silence, s, of the vehicle's component with the most frames; 0 for none."""
        most = max(self._vehicles, key=lambda sender: sender.frames, default=None)
        return 0.0 if most is None else most.silent_s

    @property
    def keeps_ring(self) -> bool:
        """Whether the vehicle keeps a recording onboard."""
        return any(sender.keeps_ring for sender in self._vehicles)

    @property
    def _vehicles(self) -> list[_Sender]:
        return [sender for sender in self._senders.values() if sender.is_vehicle]
