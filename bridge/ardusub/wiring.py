"""How an ArduSub is wired, by its own parameters: its frame, which output drives which motor, which are reversed.

FRAME_CONFIG names the frame, SERVOn_FUNCTION the motor of output n (33 is motor 1), and MOT_k_DIRECTION turns motor k
round (ArduSub 4.5: Parameters.cpp, libraries/SRV_Channel, libraries/AP_Motors/AP_Motors6DOF.cpp).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

from bridge.ardusub.frames import (
    FIRST_MOTOR,
    FRAME,
    FRAMES,
    OUTPUTS,
    direction_name,
    function_name,
    whole_number,
)
from bridge.ardusub.mixing import MOTOR_FACTORS, Mixer
from bridge.errors import ConfigError
from bridge.vehicle.config import Configuration
from bridge.vehicle.thrusters import Curve

FILES: Final[Mapping[str, str]] = {"vectored": "bluerov2", "vectored_6dof": "bluerov2_heavy"}
"""The vehicle file of a frame."""
MOTORS: Final = 8


@dataclass(frozen=True)
class Wiring:
    """How an autopilot's outputs drive its motors.

    `frame` by name; `motors` the motor, from 1, of each output from the first on; `reversed` the motors that
    MOT_k_DIRECTION turns round.
    """

    frame: str
    motors: tuple[int, ...]
    reversed: tuple[int, ...]

    @property
    def swapped(self) -> tuple[tuple[int, int], ...]:
        """Outputs, from 1, that do not drive the motor of their own number, with the motor that they drive."""
        return tuple((output, motor) for output, motor in enumerate(self.motors, 1) if motor != output)

    @property
    def is_plain(self) -> bool:
        """Whether a vehicle file of the frame holds as it is."""
        return not self.swapped and not self.reversed

    def fitted(self, shape: Configuration) -> Configuration:
        """The configuration of the frame with its thrusters in the order and with the signs of the outputs."""
        turned = tuple(
            replace(thruster, direction=(-x, -y, -z)) if motor in self.reversed else thruster
            for motor in self.motors
            for thruster in (shape.thrusters[motor - 1],)
            for x, y, z in (thruster.direction,)
        )
        return replace(shape, thrusters=turned)


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


def mixer_of(values: Mapping[str, float], shape: Configuration, curve: Curve) -> Mixer:
    """The mixer of an autopilot with these parameters, its FRAME_CONFIG among them, for a vehicle file's thrusters.

    Raises ConfigError for a wiring that can't be read, or thrusters that push otherwise than the frame takes them to.
    """
    number, count = whole_number(values, FRAME, missing=-1), len(shape.thrusters)
    if number not in MOTOR_FACTORS:
        raise ConfigError(f"{FRAME} {number} is not supported: 1 (vectored) and 2 (vectored_6dof) are")
    wired = wiring(values, {FRAMES[number]: count})
    directions = [-1.0 if motor in wired.reversed else 1.0 for motor in range(1, count + 1)]
    return Mixer(number, directions, shape, curve, wired.motors)
