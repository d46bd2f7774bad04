"""What a sensor reads otherwise than the vehicle moves."""

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course
from bridge.effects.effect import Act, Effect, Parameter
from bridge.vehicle.config import GRAVITY_M_S2

Array = NDArray[np.float64]


def _scale(course: Course, values: Array) -> Act:
    return Act(velocity=(values[0] - 1.0) * course.nu[:, :3])


DVL_SCALE = Effect(
    "dvl_scale",
    "a DVL that reads all speeds too large or too small, as with a wrong speed of sound",
    "reading",
    (Parameter("scale", "1", 1.03, low=0.5, high=2.0, none=1.0),),
    _scale,
    "the water's temperature; a taped or surveyed distance",
)


def _bias(course: Course, values: Array) -> Act:
    return Act(velocity=np.broadcast_to(values, (len(course.nu), 3)))


DVL_BIAS = Effect(
    "dvl_bias",
    "a DVL that reads a speed at rest",
    "reading",
    tuple(Parameter(name, "m/s", 0.005) for name in "xyz"),
    _bias,
    "a minute at rest, and opposite headings",
)


def _turned(course: Course, values: Array) -> Act:
    u, v, _ = course.nu[:, :3].T
    cos, sin = np.cos(values[0]), np.sin(values[0])
    read = np.column_stack([u * cos - v * sin - u, u * sin + v * cos - v, np.zeros_like(u)])
    return Act(velocity=read)


DVL_MISALIGNMENT = Effect(
    "dvl_misalignment",
    "a DVL that is turned about the vertical",
    "reading",
    (Parameter("yaw", "rad", 0.03, -0.8, 0.8),),
    _turned,
    "straight runs on two headings beside a track by satellite",
)


def _lever(course: Course, values: Array) -> Act:
    return Act(velocity=np.cross(course.nu[:, 3:], values))


DVL_LEVER_ARM = Effect(
    "dvl_lever_arm",
    "a DVL that sits elsewhere than the vehicle file says",
    "reading",
    tuple(Parameter(name, "m", 0.1, -3.0, 3.0) for name in "xyz"),
    _lever,
    "a spin in place both ways",
)


def _late(course: Course, values: Array) -> Act:
    at = course.time_s - values[0]
    late = np.column_stack([np.interp(at, course.time_s, column) for column in course.nu[:, :3].T])
    return Act(velocity=late - course.nu[:, :3])


DVL_DELAY = Effect(
    "dvl_delay",
    "a DVL whose readings are dated later than they were true",
    "reading",
    (Parameter("delay", "s", 0.05, -1.0, 1.0),),
    _late,
    "the DVL beside the integrated accelerometer",
    linear=False,
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
    "a minute at rest; two full turns",
)


def _leak(course: Course, values: Array) -> Act:
    """An IMU tilted by small angles sees gravity ahead and aside."""
    force = np.zeros((len(course.nu), 3))
    force[:, 0], force[:, 1] = GRAVITY_M_S2 * values[1], -GRAVITY_M_S2 * values[0]
    return Act(specific_force=force)


IMU_GRAVITY_LEAK = Effect(
    "imu_gravity_leak",
    "an accelerometer that is tilted, so that gravity leaks into it",
    "reading",
    (Parameter("roll", "rad", 0.005), Parameter("pitch", "rad", 0.005)),
    _leak,
    "leave the accelerometer out of the fit; estimate its tilt",
    needs=("specific_force", "attitude"),
)

EFFECTS = (DVL_SCALE, DVL_BIAS, DVL_MISALIGNMENT, DVL_LEVER_ARM, DVL_DELAY, GYRO_BIAS, IMU_GRAVITY_LEAK)
