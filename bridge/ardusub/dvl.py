"""Feeds a DVL to ArduSub as VISION_POSITION_DELTA: the one message that works without a position source (4.5.7, with
EK3_SRC1_POSXY 0, VELXY 6, VISO_TYPE 1; ODOMETRY and VISION_SPEED_ESTIMATE alone start no aiding)."""

import math
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.sensors.samples import DvlSample
from bridge.vehicle.navigation import Navigation
from bridge.wire.readings import microseconds

LONGEST_STEP_S: Final = 1.0
"""After a longer loss of the bottom the next delta starts anew: the way between was not measured."""
WORST_SIGMA_M_S: Final = 0.4


class VisionDeltas:
    """Makes a delta of each two successive locked readings, by the velocity of the body's origin."""

    def __init__(self) -> None:
        self._before_s = math.nan

    def take(self, sample: DvlSample, navigation: Navigation) -> list[Any]:
        """The message to send for a reading; `navigation` has taken it already."""
        if not sample.locked:
            return []
        step_s, self._before_s = sample.time_s - self._before_s, sample.time_s
        if not 0 < step_s <= LONGEST_STEP_S:
            return []
        confidence = (
            100.0 if math.isnan(sample.sigma) else 100 * (1 - min(sample.sigma / WORST_SIGMA_M_S, 1.0))
        )
        turned = [rate * step_s if math.isfinite(rate) else 0.0 for rate in navigation.rate]
        moved = [speed * step_s for speed in navigation.velocity]
        return [
            dialect.MAVLink_vision_position_delta_message(
                microseconds(sample.time_s), round(step_s * 1e6), turned, moved, max(confidence, 1.0)
            )
        ]
