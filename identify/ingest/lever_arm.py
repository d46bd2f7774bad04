"""The velocity at the DVL's transducer, for recordings that give it at the body's origin."""

from dataclasses import replace

import numpy as np

from bridge.vehicle.config import Sensors
from identify.dive import Dive, Signal


def at_transducer(dive: Dive, sensors: Sensors) -> Dive:
    """The dive with its velocity at the DVL's place in the vehicle file; the dive itself if it is there already.

    With the DVL at r, in body axes from the origin, v_dvl = v + omega x r (Fossen 2011, ch. 2). A recording without
    rates of turn keeps the origin's velocity: without turning the two are equal.
    """
    velocity, gyro = dive.velocity, dive.gyro
    if not dive.velocity_at_origin or sensors.dvl is None or velocity is None or gyro is None:
        return dive
    turning = np.nan_to_num(gyro.at(velocity.time_s))
    carried = velocity.value + np.cross(turning, sensors.dvl.mounting.position_m)
    return replace(dive, velocity=Signal(velocity.time_s, carried), velocity_at_origin=False)
