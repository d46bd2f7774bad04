"""Name thrusters by their position and direction, and show the state of each."""

import math
from typing import Final

from bridge.vehicle.config import Configuration, Thruster
from gcs_plugin.watch.channels import Channel
from gcs_plugin.watch.freshness import freshness
from gcs_plugin.watch.picture import ThrusterRow

MOSTLY: Final = 0.8
"""Cosine of the angle up to which a thruster counts as pushing along an axis."""

OFF_CENTRE: Final = 0.2
"""Share of the farthest thruster's distance beyond which a thruster counts as off the centre line."""


def name_of(thruster: Thruster, reach_m: float) -> str:
    """`fore port`, `vertical aft starboard`, `lateral fore`; `reach_m` is the farthest thruster's distance."""
    x, y, _ = thruster.position_m
    _, sideways, down = (abs(c) for c in thruster.direction)
    words = ["vertical"] if down > MOSTLY else ["lateral"] if sideways > MOSTLY else []
    if abs(x) > OFF_CENTRE * reach_m:
        words.append("fore" if x > 0 else "aft")
    if abs(y) > OFF_CENTRE * reach_m:
        words.append("starboard" if y > 0 else "port")
    return " ".join(words) or "midships"


def names_of(configuration: Configuration) -> tuple[str, ...]:
    """The name of each thruster, in the file's order."""
    reach_m = max((math.hypot(*t.position_m[:2]) for t in configuration.thrusters), default=0.0)
    return tuple(name_of(thruster, reach_m) for thruster in configuration.thrusters)


def thruster_rows(
    pwm: Channel, rpm: Channel, names: tuple[str, ...], now_s: float, expected_hz: float
) -> tuple[ThrusterRow, ...]:
    """A row for each thruster of the vehicle file; without a file, for each output."""
    count = len(names) or len(pwm.values)
    age_s = pwm.age_s(now_s)
    fresh = freshness(age_s, expected_hz)
    return tuple(
        ThrusterRow(
            k + 1,
            names[k] if names else "",
            pwm.values[k] if k < len(pwm.values) else math.nan,
            rpm.values[k] if k < len(rpm.values) else math.nan,
            age_s,
            fresh,
        )
        for k in range(count)
    )
