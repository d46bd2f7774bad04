"""What a thruster does otherwise than its curve, its lag and its mounting say: of each on its own thrust."""

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course, lagged
from bridge.effects.effect import Act, Effect, Parameter
from bridge.vehicle.config import Configuration

Array = NDArray[np.float64]


def _more(course: Course, thrust_n: Array) -> Act:
    """The wrench of what thrusts (n, k) exceed the nominal ones by."""
    return Act(wrench=course.wrench_of(thrust_n - course.thrust_n))


def _all(course: Course, values: Array) -> Act:
    return _more(course, values[0] * course.thrust_n)


THRUST_GAIN = Effect(
    "thrust_gain",
    "all thrusters push more or less than their curve",
    "thruster",
    (Parameter("gain", "1", 0.9, low=0.0, none=1.0),),
    _all,
    "a weighed mass, or 0.5 kg hung on it",
)


def _low_end(course: Course, values: Array) -> Act:
    asked = course.asked_n
    share = np.clip(1.0 - np.abs(asked) / course.configuration.thruster_limit_n, 0.0, 1.0)
    return _more(course, lagged(asked * (1.0 - values[0] * share), course.step_s, course.lag_s))


THRUST_CURVE = Effect(
    "thrust_curve",
    "thrust that falls short at the low end of the curve",
    "thruster",
    (Parameter("low_end_loss", "1", 0.2, high=1.0),),
    _low_end,
    "a staircase of thrust ahead and astern; shaft speeds",
)


def _astern(course: Course, values: Array) -> Act:
    asked = np.where(course.asked_n < 0, values[0] * course.asked_n, course.asked_n)
    return _more(course, lagged(asked, course.step_s, course.lag_s))


REVERSE_THRUST_LOSS = Effect(
    "reverse_thrust_loss",
    "thrusters that push less astern than their curve",
    "thruster",
    (Parameter("gain", "1", 0.8, low=0.0, none=1.0),),
    _astern,
    "steps ahead and astern; a spin both ways",
)


def _dead(course: Course, values: Array) -> Act:
    asked = course.asked_n
    kept = np.sign(asked) * np.maximum(np.abs(asked) - values[0], 0.0)
    return _more(course, lagged(kept, course.step_s, course.lag_s))


DEAD_ZONE = Effect(
    "dead_zone",
    "thrusters that give nothing below a least thrust",
    "thruster",
    (Parameter("half_width", "N", 0.5, low=0.0),),
    _dead,
    "a slow ramp through zero; shaft speeds",
    linear=False,
)


def _saturated(course: Course, values: Array) -> Act:
    limit = values[0] if values[0] > 0 else np.inf
    return _more(course, lagged(np.clip(course.asked_n, -limit, limit), course.step_s, course.lag_s))


SATURATION = Effect(
    "saturation",
    "thrusters that give no more than a limit",
    "thruster",
    (Parameter("limit", "N", 15.0, low=0.0, none=np.inf),),
    _saturated,
    "a ladder of amplitudes; shaft speeds",
    linear=False,
)


def inflow_m_s(course: Course) -> Array:
    """(n, k): the water's speed into each thruster, along its thrust."""
    places = np.array([t.position_m for t in course.configuration.thrusters])
    ways = np.array([t.direction for t in course.configuration.thrusters])
    turn = np.stack([np.cross(course.nu[:, 3:], place) for place in places], axis=1)
    return np.asarray(((course.nu[:, None, :3] + turn) * ways).sum(axis=2))


def _starved(course: Course, values: Array) -> Act:
    """T = T0 - slope sqrt|T0| ua: the loss goes as shaft speed times inflow, which helps where it comes from behind."""
    speed = np.sqrt(np.abs(course.thrust_n))
    return Act(wrench=course.wrench_of(-values[0] * speed * inflow_m_s(course)))


INFLOW_LOSS = Effect(
    "inflow_loss",
    "thrust that falls as the water comes at the propeller",
    "thruster",
    (Parameter("slope", "N^0.5 s/m", 0.5, low=0.0),),
    _starved,
    "one speed at different thrusts: accelerating, coasting, towed",
)


def _hull(course: Course, values: Array) -> Act:
    """The wash that meets the hull: of the thrusters ahead of midships as they push astern, and the other way round."""
    places = np.array([t.position_m[0] * t.direction[0] for t in course.configuration.thrusters])
    washing = np.where(np.sign(places) * course.thrust_n > 0, course.thrust_n, 0.0)
    return Act(wrench=course.wrench_of(-values[0] * washing))


HULL_INTERACTION = Effect(
    "hull_interaction",
    "thrusters whose wash meets the hull and lose a share of their thrust",
    "thruster",
    (Parameter("loss", "1", 0.1, low=0.0, high=1.0),),
    _hull,
    "pulses of one thruster at a time",
)


def _time(course: Course, values: Array) -> Act:
    return _more(course, lagged(course.asked_n, course.step_s, max(float(values[0]), 0.0)))


def thruster_lag(nominal_s: float) -> Effect:
    """A lag other than the vehicle file's."""
    return Effect(
        "thruster_lag",
        "thrusters that answer more slowly than the vehicle file says",
        "thruster",
        (Parameter("time_constant", "s", nominal_s + 0.05, low=0.0, none=nominal_s),),
        _time,
        "shaft speeds, and fast steps in a log of 50 Hz",
        linear=False,
    )


def _late(course: Course, values: Array) -> Act:
    at = course.time_s - values[0]
    late = np.column_stack([np.interp(at, course.time_s, column) for column in course.thrust_n.T])
    return _more(course, late)


COMMAND_DELAY = Effect(
    "command_delay",
    "commands that reach the propellers late",
    "thruster",
    (Parameter("delay", "s", 0.05, low=0.0, high=2.0),),
    _late,
    "shaft speeds beside the pulses",
    linear=False,
)


def _sagging(course: Course, values: Array) -> Act:
    since = course.time_s - course.time_s[0]
    return _more(course, course.thrust_n * (1.0 - values[0] * since)[:, None])


BATTERY_SAG = Effect(
    "battery_sag",
    "thrust that falls over the dive as the battery empties",
    "thruster",
    (Parameter("rate", "1/s", 2e-4, low=0.0),),
    _sagging,
    "the voltage; a leg at the beginning and again at the end; a coast-down",
)


def _loaded(course: Course, values: Array) -> Act:
    """V / V0 = 1 - R I with I going as the sum of |T|^1.5, thrust as the square of the voltage."""
    load = (np.abs(course.thrust_n) ** 1.5).sum(axis=1, keepdims=True)
    most = course.thrust_n.shape[1] * course.configuration.thruster_limit_n**1.5
    return _more(course, course.thrust_n * np.maximum(1.0 - values[0] * load / most, 0.0) ** 2)


LOAD_SAG = Effect(
    "load_sag",
    "thrust that falls while many thrusters push at once",
    "thruster",
    (Parameter("resistance", "1", 0.3, low=0.0, high=1.0),),
    _loaded,
    "surge alone against surge and heave at once; shaft speeds",
    linear=False,
)


def _torque(course: Course, values: Array) -> Act:
    """Every propeller turns the same way round: its reaction is about its own axis, here about x and z."""
    ways = np.array([t.direction for t in course.configuration.thrusters])
    wrench = np.zeros_like(course.nu)
    wrench[:, 3] = values[0] * (course.thrust_n * ways[:, 0]).sum(axis=1)
    wrench[:, 5] = values[1] * (course.thrust_n * ways[:, 2]).sum(axis=1)
    return Act(wrench=wrench)


PROPELLER_TORQUE = Effect(
    "propeller_torque",
    "propellers whose reaction torques do not cancel",
    "thruster",
    (Parameter("K", "m", 0.01), Parameter("N", "m", 0.01)),
    _torque,
    "a pulse of equal thrust on all",
)


def _bias(course: Course, values: Array) -> Act:
    wrench = np.zeros_like(course.nu)
    wrench[:, [0, 1, 2, 5]] = values
    return Act(wrench=wrench)


THRUST_BIAS = Effect(
    "thrust_bias",
    "a constant force on the body that no speed explains",
    "force",
    tuple(Parameter(n, u, 0.5) for n, u in zip("XYZN", ("N", "N", "N", "N m"), strict=True)),
    _bias,
    "a minute at rest, and opposite headings",
)


def _weak(number: int) -> Effect:
    def act(course: Course, values: Array) -> Act:
        thrust = course.thrust_n.copy()
        thrust[:, number - 1] *= values[0]
        return _more(course, thrust)

    return Effect(
        "weak_thruster",
        f"thruster {number} is weak, fouled or bent",
        "thruster",
        (Parameter("gain", "1", 0.8, none=1.0),),
        act,
        "pulses of one thruster at a time; current beside shaft speed",
        number=number,
    )


def _misaligned(number: int) -> Effect:
    def act(course: Course, values: Array) -> Act:
        """Turned about the vertical, or about the body's x for a thruster that pushes up and down."""
        thruster = course.configuration.thrusters[number - 1]
        way, place = np.array(thruster.direction), np.array(thruster.position_m)
        axis = np.array([1.0, 0.0, 0.0]) if abs(way[2]) > 0.7 else np.array([0.0, 0.0, 1.0])
        turned = (
            way * np.cos(values[0])
            + np.cross(axis, way) * np.sin(values[0])
            + axis * (axis @ way) * (1.0 - np.cos(values[0]))
        )
        change = thruster.gain * np.concatenate([turned - way, np.cross(place, turned - way)])
        return Act(wrench=np.outer(course.thrust_n[:, number - 1], change))

    return Effect(
        "thruster_misalignment",
        f"thruster {number} points elsewhere than the vehicle file says",
        "thruster",
        (Parameter("angle", "rad", 0.1, -1.6, 1.6),),
        act,
        "pulses in each degree of freedom at low speed",
        number=number,
    )


def of_each_thruster(configuration: Configuration) -> tuple[Effect, ...]:
    """One effect for each thruster."""
    numbers = range(1, len(configuration.thrusters) + 1)
    return (*map(_weak, numbers), *map(_misaligned, numbers))


EFFECTS = (
    THRUST_GAIN, THRUST_CURVE, REVERSE_THRUST_LOSS, DEAD_ZONE, SATURATION, INFLOW_LOSS, HULL_INTERACTION, COMMAND_DELAY,
    BATTERY_SAG, LOAD_SAG, PROPELLER_TORQUE, THRUST_BIAS,
)  # fmt: skip
