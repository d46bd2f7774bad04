"""ArduSub, as versions 4.5 and 4.6 have it: its parameters, messages, flight modes and habits.

Outputs and motors count from 1. Its mixer scales all outputs together, so that the directions of motors can be turned
round (Parameters.cpp, libraries/SRV_Channel, libraries/AP_Motors/AP_Motors6DOF.{h,cpp}).
"""

import math
from collections.abc import Mapping
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import ConfigError
from bridge.firmware.description import Firmware, Wiring

FRAME: Final = "FRAME_CONFIG"
FRAMES: Final = (
    "bluerov1", "vectored", "vectored_6dof", "vectored_6dof_90deg", "simplerov_3", "simplerov_4", "simplerov_5",
    "custom",
)  # fmt: skip
"""Names of the frames by FRAME_CONFIG."""
FILES: Final[Mapping[str, str]] = {"vectored": "bluerov2", "vectored_6dof": "bluerov2_heavy"}
"""The vehicle file of a frame."""
_FORE: Final = ((-1, 1, 1), (-1, -1, -1), (1, 1, -1), (1, -1, 1))
_VERTICAL: Final = (0, 0, 0)
MOTOR_FACTORS: Final[Mapping[int, tuple[tuple[int, int, int], ...]]] = {
    1: (*_FORE, *(_VERTICAL,) * 2),
    2: (*_FORE, *(_VERTICAL,) * 4),
}
"""Factors of forward, lateral and yaw of each motor, by FRAME_CONFIG: `vectored` and `vectored_6dof`."""
SCALES_TOGETHER: Final = (2,)
"""Frames in which outputs beyond full thrust are scaled down together; in the others each is cut off by itself."""
FIRST_MOTOR: Final = 33
"""The function of an output that drives motor 1."""
OUTPUTS: Final = 16
MOTORS: Final = 8

FAILSAFE: Final = "FS_GCS_ENABLE"
PILOT: Final = "SYSID_MYGCS"
"""Whose sticks are taken. Up to 4.6; 4.7 has MAV_GCS_SYSID in its place (by its source)."""
PILOT_FAILSAFE: Final = "FS_PILOT_INPUT"
PILOT_FAILSAFE_AFTER: Final = "FS_PILOT_TIMEOUT"
"""Seconds without sticks until PILOT_FAILSAFE acts, as delivered 3."""
WARNS_ALONE: Final = 1
"""The value of either fail-safe with which it warns, and stops nothing."""
HEAVE_GAIN: Final = "JS_THR_GAIN"
"""By so much a stick pushes more in heave than in the other axes; 1 as delivered."""
FAILSAFE_AFTER: Final = "FS_GCS_TIMEOUT"
"""Seconds of silence until FAILSAFE acts, from `TIMED_FROM` on, as delivered 5; before, always 2.5 (by its source)."""
TIMED_FROM: Final = (4, 6)
LONGEST_ALONE_S: Final = 5.0
"""Longest time for which a vehicle may go on by the last stick of a companion that died."""
DVL: Final = {"VISO_TYPE": 1.0, "EK3_SRC1_POSXY": 0.0, "EK3_SRC1_VELXY": 6.0}
"""Settings with which VISION_POSITION_DELTA is taken for velocity (measured, 4.5.7)."""

TRIED_FROM: Final = (4, 5)
"""The oldest version, major and minor, with which a companion was tried."""

COUPLING: Final = "MOT_FV_CPLNG_K"
COUPLED: Final = (1,)
"""Frames in which COUPLING times the vertical input bounds the forward input (AP_Motors6DOF.cpp)."""

STABILIZE, ALT_HOLD, MANUAL = 0, 2, 19
FLOWN_BY_STICKS: Final = (STABILIZE, ALT_HOLD, MANUAL)
"""Modes in which surge and sway go from the stick to the mixer; yaw does in MANUAL alone (measured, 4.5.7)."""


def version_of(number: int) -> tuple[int, int, int]:
    """Major, minor and patch of the flight_sw_version in AUTOPILOT_VERSION: a byte for each, and one for the kind."""
    major, minor, patch, _ = number.to_bytes(4, "big")
    return major, minor, patch


def function_name(output: int) -> str:
    """Name of the parameter of an output's function."""
    return f"SERVO{output}_FUNCTION"


def direction_name(motor: int) -> str:
    """Name of the parameter that turns a motor round."""
    return f"MOT_{motor}_DIRECTION"


def whole_number(values: Mapping[str, float], name: str, missing: int = 0) -> int:
    """The value of a parameter that counts, `missing` where it is not among `values`.

    Raises ConfigError for a value that is no whole number, as a damaged recording or a faulty autopilot has it.
    """
    value = values.get(name, float(missing))
    if not math.isfinite(value) or value != int(value):
        raise ConfigError(f"{name} is {value:g}, no whole number: set it in the autopilot, and read it anew")
    return int(value)


def wiring(values: Mapping[str, float], thrusters: Mapping[str, int]) -> Wiring:
    """The wiring that an autopilot's parameters state; `thrusters` has the number of motors of each frame with a file.

    Raises ConfigError with a sentence for parameters that are no ArduSub's, a frame without a file, and outputs that
    a recording can't be read by.
    """
    if FRAME not in values:
        raise ConfigError(
            f"no {FRAME} among the autopilot's {len(values)} parameters in it: that is no ArduSub's whole list; let "
            "the ground station read all parameters while it records"
        )
    number = whole_number(values, FRAME)
    frame = FRAMES[number] if 0 <= number < len(FRAMES) else f"{number}, which is not known,"
    if frame not in thrusters:
        raise ConfigError(
            f"{FRAME} {number}: no vehicle file comes with the frame {frame}; write one, with the thrusters in the "
            "order of the outputs (docs/howto/write_a_vehicle_file.md)"
        )
    count = thrusters[frame]
    driven: dict[int, int] = {}
    for output in range(1, OUTPUTS + 1):
        motor = whole_number(values, function_name(output)) - FIRST_MOTOR + 1
        if 1 <= motor <= MOTORS:
            # The lower of two outputs with one motor: where an applet drives the upper, the lower mirrors it.
            driven.setdefault(motor, output)
    if lacking := [motor for motor in range(1, count + 1) if motor not in driven]:
        raise ConfigError(
            f"no output drives motor {', '.join(map(str, lacking))} of the frame {frame}: set SERVOn_FUNCTION to "
            f"{', '.join(str(FIRST_MOTOR + motor - 1) for motor in lacking)} for the outputs that they are wired to"
        )
    order = sorted((output, motor) for motor, output in driven.items() if motor <= count)
    if [output for output, _ in order] != list(range(1, count + 1)):
        raise ConfigError(
            f"the motors are on outputs {', '.join(str(output) for output, _ in order)}: a recording is read by its "
            f"first {count} outputs; wire the motors to these, or mirror them there by SERVOn_FUNCTION"
        )
    motors = tuple(motor for _, motor in order)
    turned = tuple(motor for motor in range(1, count + 1) if values.get(direction_name(motor), 1.0) < 0)
    return Wiring(frame, motors, turned)


def _hints(values: Mapping[str, float]) -> tuple[str, ...]:
    """Sentences on parameters with which a companion takes no sticks, or a pilot has none."""
    said = []
    system = values.get("SYSID_THISMAV", 1.0)
    if values.get(PILOT) == system:
        said.append(
            f"{PILOT} is {system:g}, the vehicle's own system: a companion held the sticks. Where none runs any more "
            "no ground station's sticks are taken: start it again, which puts it back, or set "
            f"{PILOT} to the ground station's own, usually 255."
        )
    said += [
        f"{name} is {values[name]:g}: without it a companion that dies leaves the last sticks in force, and it takes "
        "none; set it to 2."
        for name in (FAILSAFE, PILOT_FAILSAFE)
        if name in values and not values[name] > WARNS_ALONE
    ]
    said += [
        f"{name} is {values[name]:g}: the last sticks of a companion that dies stay in force for so many "
        f"seconds, and it takes none; set it to {LONGEST_ALONE_S:g} or less."
        for name in (FAILSAFE_AFTER, PILOT_FAILSAFE_AFTER)
        if values.get(name, 0.0) > LONGEST_ALONE_S
    ]
    return tuple(said)


ARDUSUB: Final = Firmware(
    name="ArduSub",
    family="ArduPilot",
    autopilot=dialect.MAV_AUTOPILOT_ARDUPILOTMEGA,
    kind=dialect.MAV_TYPE_SUBMARINE,
    way="start seatrial bridge --ardusub beside it, or seatrial applet deploy",
    rates_hz={
        dialect.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: 200.0,
        dialect.MAVLINK_MSG_ID_ATTITUDE: 50.0,
        dialect.MAVLINK_MSG_ID_SCALED_IMU2: 50.0,
        dialect.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 20.0,
        dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: 20.0,
        dialect.MAVLINK_MSG_ID_SCALED_PRESSURE2: 10.0,
        dialect.MAVLINK_MSG_ID_SYS_STATUS: 2.0,
        dialect.MAVLINK_MSG_ID_SYSTEM_TIME: 1.0,
    },
    # The joystick's gain and switches come with this stream; a rate of their own is denied them.
    stream=dialect.MAV_DATA_STREAM_EXTENDED_STATUS,
    stream_hz=2,
    least_hz=2.0,
    # A simulated one aborts when it is asked for this, and a real one denies what it never sends.
    never_asked=frozenset((dialect.MAVLINK_MSG_ID_WIND,)),
    corners={"gyro": "INS_GYRO_FILTER", "specific_force": "INS_ACCEL_FILTER"},
    stamped_s=2.5e-3,
    loop_s=2.5e-3,
    loop="SCHED_LOOP_RATE",
    holds_pressure=True,
    # Before version 4.7 and since.
    system_names=("SYSID_THISMAV", "MAV_SYSID"),
    serves_unheard=True,
    hides_companions=True,
    holds_motor_test=True,
    frame=FRAME,
    frames=FRAMES,
    frame_motors=(6, 6, 8, 8, 3, 4, 5, 0),
    files=FILES,
    wiring=wiring,
    hints=_hints,
    turn=lambda motor, sign: f"{direction_name(motor)} {sign}",
    drive=lambda output, motor: f"{function_name(output)} {FIRST_MOTOR + motor - 1}",
)
