"""A vehicle that says what a test tells it to, frame by frame, for the watch."""

import math
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mav

from bridge.wire.framing import Encoder, Frame, Framer
from bridge.wire.readings import Reading, encode
from gcs_plugin.watch.watcher import Watcher

LINK = "udpin:127.0.0.1:14550"
LEVEL = (1.0, 0.0, 0.0, 0.0)
STILL = (0.0, 0.0, 0.0)


def frame_of(raw: bytes) -> Frame:
    framer = Framer()
    (frame,) = framer.feed(raw) + framer.flush()
    return frame


def heartbeat(
    *,
    armed: bool = False,
    kind: int = mav.MAV_TYPE_SUBMARINE,
    autopilot: int = mav.MAV_AUTOPILOT_GENERIC,
    status: int = mav.MAV_STATE_ACTIVE,
) -> Any:
    mode = mav.MAV_MODE_FLAG_SAFETY_ARMED if armed else 0
    return mav.MAVLink_heartbeat_message(kind, autopilot, mode, 0, status, 3)


class OnAir:
    """One sender whose frames `watcher` is fed on a link."""

    def __init__(self, watcher: Watcher, system: int = 1, component: int = 1, link: str = LINK) -> None:
        self.watcher, self.link = watcher, link
        self.encoder = Encoder(system, component)

    def raw(self, raw: bytes, at_s: float) -> None:
        self.watcher.feed(frame_of(raw), at_s, self.link)

    def says(self, message: Any, at_s: float) -> None:
        self.raw(self.encoder.encode(message), at_s)

    def beats(self, at_s: float, **how: Any) -> None:
        self.says(heartbeat(**how), at_s)

    def tells(self, signal: str, values: tuple[float, ...], at_s: float) -> None:
        self.raw(self.encoder.frame(*encode(Reading(signal, at_s, values))), at_s)


def dvl(u: float = 0.3, v: float = 0.0, w: float = 0.0) -> tuple[float, ...]:
    return (u, v, w, 0.005)


NO_LOCK = (math.nan, math.nan, math.nan, math.nan)


def imu(p: float = 0.0, q: float = 0.0, r: float = 0.0) -> tuple[float, ...]:
    return (0.0, 0.0, -9.81, p, q, r, 20.0)
