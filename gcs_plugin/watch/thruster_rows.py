"""The thrusters of a picture: their names by their places, and the thrust asked of each and given."""

import math
from collections.abc import Callable
from typing import Final

from bridge.vehicle.config import Configuration
from gcs_plugin.watch.channels import Channel
from gcs_plugin.watch.picture import Freshness, ThrusterRow, freshness

ALONG_AXIS: Final = 0.8
"""Cosine of the angle up to which a thruster counts as pushing along an axis."""

OFF_CENTRE: Final = 0.2
"""Share of the farthest thruster's distance beyond which a thruster counts as off the centre line."""


def thruster_names(configuration: Configuration) -> tuple[str, ...]:
    """The name of each thruster, in the file's order: `fore port`, `vertical aft starboard`, `lateral fore`."""
    reach_m = max((math.hypot(*t.position_m[:2]) for t in configuration.thrusters), default=0.0)
    names = []
    for thruster in configuration.thrusters:
        x, y, _ = thruster.position_m
        _, sideways, down = (abs(c) for c in thruster.direction)
        words = ["vertical"] if down > ALONG_AXIS else ["lateral"] if sideways > ALONG_AXIS else []
        if abs(x) > OFF_CENTRE * reach_m:
            words.append("fore" if x > 0 else "aft")
        if abs(y) > OFF_CENTRE * reach_m:
            words.append("starboard" if y > 0 else "port")
        names.append(" ".join(words) or "midships")
    return tuple(names)


def thruster_rows(
    pwm: Channel, rpm: Channel, names: tuple[str, ...], now_s: float, expected_hz: Callable[[str], float]
) -> tuple[ThrusterRow, ...]:
    """A row for each thruster of the vehicle file; without a file, for each output. Speeds that come no more are NaN.

    `expected_hz` returns how often a signal should come.
    """
    count = len(names) or len(pwm.values)
    age_s = pwm.age_s(now_s)
    fresh = freshness(age_s, expected_hz("pwm"))
    is_gone = freshness(rpm.age_s(now_s), expected_hz("rpm")) is Freshness.GONE
    speeds = () if is_gone else rpm.values
    return tuple(
        ThrusterRow(
            k + 1,
            names[k] if names else "",
            pwm.values[k] if k < len(pwm.values) else math.nan,
            speeds[k] if k < len(speeds) else math.nan,
            age_s,
            fresh,
        )
        for k in range(count)
    )
