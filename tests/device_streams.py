"""What each kind of device on a line says in one go, with values that change: the n-th of its messages."""

import math
import random
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from typing import Final

from bridge.sensors.esc import encode_esc
from bridge.sensors.kvh1750 import encode_kvh1750
from bridge.sensors.kvh1760 import encode_kvh1760
from bridge.sensors.samples import GnssSample
from bridge.sensors.ublox import encode_nav_pvt
from bridge.sensors.waterlink import encode_waterlink_json, encode_waterlink_serial
from bridge.sensors.wayfinder import encode_wayfinder
from bridge.sensors.xsens import encode_xsens

BEGAN: Final = datetime(2026, 11, 20, 9, 12, tzinfo=UTC)
FRAMES: Final = 20


def _rng(n: int) -> random.Random:
    return random.Random(n)


def _surge(n: int) -> tuple[float, float, float]:
    return 0.4 * math.sin(n / 20), _rng(n).gauss(0.0, 0.02), _rng(n + 1).gauss(0.0, 0.02)


def _ranges(n: int) -> tuple[float, float, float, float]:
    first, second, third, fourth = (3.0 + _rng(4 * n + beam).gauss(0.0, 0.05) for beam in range(4))
    return first, second, third, fourth


def wayfinder(n: int) -> bytes:
    return encode_wayfinder(_surge(n), _ranges(n), 2.6, BEGAN + timedelta(seconds=n / 10))


def a50_sentence(n: int) -> bytes:
    return encode_waterlink_serial(_surge(n), 2.6, 0.005, _ranges(n), 100_000 * n, 100_000 * n + 50_000)


def a50_report(n: int) -> bytes:
    return encode_waterlink_json(_surge(n), 2.6, 0.005, _ranges(n), 100_000 * n, 100_000 * n + 50_000)


def mti300(n: int) -> bytes:
    turn = n / 100
    level = (math.cos(turn), 0.0, 0.0, math.sin(turn))
    return encode_xsens(n, n / 100, (*_surge(n)[:2], 9.81), _surge(n), level)


def kvh1750(n: int) -> bytes:
    rng = _rng(n)
    return encode_kvh1750([rng.gauss(0.2, 0.01) for _ in range(FRAMES)], FRAMES * n)


def kvh1760(n: int) -> bytes:
    rng = _rng(n)
    return b"".join(encode_kvh1760(rng.gauss(2e-4, 1e-5), FRAMES * n + i) for i in range(FRAMES))


def esc(n: int) -> bytes:
    return encode_esc(_rng(n).uniform(0.0, 3000.0), 14, 15.9, 5.0, 30.0)


def ublox(n: int) -> bytes:
    rng = _rng(n)
    return encode_nav_pvt(
        GnssSample(0.0, 3, 59.91 + rng.gauss(0.0, 1e-5), 10.75, 12.5, 2.1, 0.5, 1.0, 9), 200 * n
    )


Say = Callable[[int], bytes]

ON_A_LINE: Final[dict[str, tuple[str, str, Say, float]]] = {
    "Wayfinder": ("dvl", "wayfinder", wayfinder, 10.0),
    "A50": ("dvl", "a50", a50_sentence, 10.0),
    "MTi-300": ("imu", "mti300", mti300, 100.0),
    "DSP-1750": ("fog", "kvh1750", kvh1750, 50.0),
    "DSP-1760": ("fog", "kvh1760", kvh1760, 50.0),
    "ESC": ("esc", "esc", esc, 20.0),
    "u-blox": ("gnss", "ublox", ublox, 5.0),
}
"""By name: slot and kind in a vehicle file, what it says, how often a second."""
