"""Differences between a sensor's readings, or the recording, and the vehicle's motion."""

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.config import GRAVITY_M_S2
from identify.effects.course import Course, delayed, runs_at
from identify.effects.effect import OWN_DESCENT, OWN_VELOCITY, SIZES, Act, Effect, Parameter, Separation


def _scale(course: Course, values: Array) -> Act:
    return Act(velocity=(values[0] - 1.0) * course.over_ground[0][:, :3])


DVL_SCALE = Effect(
    "dvl_scale",
    "a DVL that reads all speeds too large or too small, as with a wrong speed of sound",
    "reading",
    (Parameter("scale", "1", 1.03, low=0.5, high=2.0, none=1.0),),
    _scale,
    Separation(manoeuvres=("a taped or surveyed distance",), sensors=("the water's temperature",)),
    refit_absorbs=True,
)


def _deep(course: Course, values: Array) -> Act:
    """z_m = k z, by the way down since the start: a depth that was read must not explain itself."""
    sinking = np.sum(course.world[2] * course.over_ground[0][:, :3], axis=1)
    return Act(depth=(values[0] - 1.0) * (np.cumsum(sinking) * course.step_s)[:, None])


DEPTH_SCALE = Effect(
    "depth_scale",
    "a depth sensor that reads all depths too large or too small, as a blocked or ageing cell does, and the sea by "
    "1.027 where the vehicle file's water is fresh",
    "reading",
    (Parameter("scale", "1", 1.1, low=0.3, high=3.0, none=1.0),),
    _deep,
    Separation(
        manoeuvres=("known steps of depth, and the reading at the surface",),
        sensors=("a second depth sensor, an altimeter over a flat bottom, or a DVL's heave",),
    ),
    needs=(OWN_DESCENT,),
    # Depth beside the speed up and down tells the ratio of both scales.
    may_be=(DVL_SCALE, np.reciprocal),
)


def _bias(course: Course, values: Array) -> Act:
    return Act(velocity=np.broadcast_to(values, (len(course.nu), 3)))


DVL_BIAS = Effect(
    "dvl_bias",
    "a DVL that reads a speed at rest",
    "reading",
    tuple(Parameter(name, "m/s", 0.005) for name in "xyz"),
    _bias,
    Separation(manoeuvres=("a minute at rest, and opposite headings",)),
)


def _turned(course: Course, values: Array) -> Act:
    """v_m = R(yaw) v."""
    u, v, _ = course.over_ground[0][:, :3].T
    cos, sin = np.cos(values[0]), np.sin(values[0])
    read = np.stack([u * cos - v * sin - u, u * sin + v * cos - v, np.zeros_like(u)]).T
    return Act(velocity=read)


DVL_MISALIGNMENT = Effect(
    "dvl_misalignment",
    "a DVL that is turned about the vertical",
    "reading",
    (Parameter("yaw", "rad", 0.03, -0.8, 0.8),),
    _turned,
    Separation(sensors=("straight runs on two headings beside a track by satellite",)),
    linear=False,
)


def _lever(course: Course, values: Array) -> Act:
    """v_m = v + omega x l."""
    p, q, r = course.nu[:, 3:].T
    x, y, z = values.tolist()
    return Act(velocity=np.stack([q * z - r * y, r * x - p * z, p * y - q * x]).T)


DVL_LEVER_ARM = Effect(
    "dvl_lever_arm",
    "a DVL that sits elsewhere than the vehicle file says",
    "reading",
    tuple(Parameter(name, "m", 0.1, -3.0, 3.0) for name in "xyz"),
    _lever,
    Separation(manoeuvres=("a spin in place both ways",)),
    caveat="Add the lever arm to position_m of the DVL's mounting in the vehicle file, and diagnose the dive again.",
)


def _late(course: Course, values: Array) -> Act:
    """Delays the integral of the acceleration: a filter's velocity jumps with every reading, which is no motion of
    the vehicle."""
    rate, late = course.over_ground[1][:, :3], np.zeros((len(course.nu), 3))
    for run in runs_at(course.time_s, course.runs_s):
        way = np.cumsum(rate[run], axis=0) * course.step_s
        late[run] = delayed(way, course.step_s, float(values[0])) - way
    return Act(velocity=late)


DVL_DELAY = Effect(
    "dvl_delay",
    "a DVL whose readings are dated later than they were true",
    "reading",
    (Parameter("delay", "s", 0.05, -1.0, 1.0),),
    _late,
    Separation(sensors=("the DVL beside the integrated accelerometer",)),
    linear=False,
    needs=(OWN_VELOCITY,),
    sizes=SIZES,
)


def _gyro(course: Course, values: Array) -> Act:
    gyro = np.zeros((len(course.nu), 3))
    gyro[:, 2] = values[0]
    return Act(gyro=gyro)


GYRO_BIAS = Effect(
    "gyro_bias",
    "a gyro that reads a turn at rest",
    "reading",
    (Parameter("z", "rad/s", 0.002),),
    _gyro,
    Separation(manoeuvres=("a minute at rest", "two full turns")),
    witnessed=True,
)


def _gyro_scale(course: Course, values: Array) -> Act:
    gyro = np.zeros((len(course.nu), 3))
    gyro[:, 2] = (values[0] - 1.0) * course.nu[:, 5]
    return Act(gyro=gyro)


def _turns_round(course: Course, _: Array) -> bool:
    """Whether the heading goes three quarters of a turn round: over less, the four coefficients of a compass' deviation
    take up nine tenths of a scale."""
    return float(np.ptp(np.unwrap(course.euler[:, 2]))) >= 1.5 * np.pi


GYRO_SCALE = Effect(
    "gyro_bias",
    "a gyro that reads all turning about the vertical too large or too small",
    "reading",
    # A healthy gyro's scale is off by up to half a per cent, and less than an eighth of this start is none.
    (Parameter("scale", "1", 1.05, low=0.5, high=2.0, none=1.0),),
    _gyro_scale,
    Separation(manoeuvres=("two full turns beside the compass",)),
    variant="scale",
    possible=_turns_round,
    # Of this name answers have a bias alone.
    telling=lambda _: {},
    witnessed=True,
)


def _leak(course: Course, values: Array) -> Act:
    """An IMU tilted by small angles t reads f - t x f instead of the specific force f = d(v)/dt + omega x v - g: at
    rest and level this adds g pitch ahead and -g roll aside."""
    nu, nu_dot = course.over_ground
    (u, v, w, p, q, r), down = nu.T, course.world[2]
    ahead = nu_dot[:, 0] + w * q - v * r - GRAVITY_M_S2 * down[:, 0]
    aside = nu_dot[:, 1] + u * r - w * p - GRAVITY_M_S2 * down[:, 1]
    below = nu_dot[:, 2] + v * p - u * q - GRAVITY_M_S2 * down[:, 2]
    roll, pitch = values.tolist()
    return Act(specific_force=np.column_stack([-pitch * below, roll * below, pitch * ahead - roll * aside]))


IMU_GRAVITY_LEAK = Effect(
    "imu_gravity_leak",
    "an accelerometer that is tilted, so that gravity leaks into it",
    "reading",
    (Parameter("roll", "rad", 0.015), Parameter("pitch", "rad", 0.015)),
    _leak,
    Separation(manoeuvres=("a minute at rest, level and heeled",)),
    witnessed=True,
    needs=("specific_force", "attitude"),
)

WRONG_FEEDBACK_LOG = Effect(
    "wrong_feedback_log",
    "a recording that lacks the very signal that the controller used, or the thrust that was applied",
    "log",
    (),
    lambda _course, _values: Act(),
    Separation(sensors=("the applied output and the very signal fed back, recorded",)),
    lasting=False,
    evidence="it makes no force that could foretell anything, and rests on another test, of whether the recorded "
    "readings make up what the controller asked for",
)
"""Velocities alone can't show this effect; the evidence is a controller wrench that no recorded reading explains."""

EFFECTS = (
    DVL_SCALE,
    DEPTH_SCALE,
    DVL_BIAS,
    DVL_MISALIGNMENT,
    DVL_LEVER_ARM,
    DVL_DELAY,
    GYRO_BIAS,
    GYRO_SCALE,
    IMU_GRAVITY_LEAK,
    WRONG_FEEDBACK_LOG,
)
