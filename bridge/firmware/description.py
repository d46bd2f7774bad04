"""An autopilot's firmware, as the program has to know it to hear it, to ask it and to read its recordings."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.vehicle.config import Configuration

AUTOPILOT: Final = dialect.MAV_COMP_ID_AUTOPILOT1
"""The component that an autopilot speaks as."""


@dataclass(frozen=True)
class Wiring:
    """How an autopilot's outputs drive its motors.

    `frame` by name; `motors` the motor, from 1, of each output from the first on; `reversed` the motors that the
    autopilot's parameters turn round.
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


Values = Mapping[str, float]
"""An autopilot's parameters by name."""


@dataclass(frozen=True)
class Firmware:
    """The facts of a firmware; names are its own parameters'.

    How it is known: `name`, the `family` of programs that its parameters and logs are of, `autopilot` and `kind`, the
    MAV_AUTOPILOT and MAV_TYPE of its HEARTBEAT; `way`: advice for a firmware without FF_MODE.

    Asked of it for a dive: the rate of each message by id, in `rates_hz`; `stream` with `stream_hz`, the
    MAV_DATA_STREAM of messages without a rate of their own, if any; `least_hz`, a rate at which any ground
    station has its messages. `never_asked` are ids that it does not survive.

    How its recordings are read: `corners`, by signal (gyro, specific_force) the parameter with the corner frequency of
    its low-pass filter, Hz; `stamped_s`, how far its stamps and a companion's are apart; `loop_s`, the step of the loop
    whose pulses SERVO_OUTPUT_RAW samples, 0 where it sends each change, and `loop`, the parameter with that loop's
    rate, Hz; `holds_pressure`: SCALED_PRESSURE2 is older than its stamp; `system_names`, the parameters that may have
    its system id.

    How it behaves: `serves_unheard`: it executes orders to a component that it has not heard; `hides_companions`:
    it sends a companion's messages to those links alone on which it hears somebody; `holds_motor_test`: a motor
    test holds until the next, and its motors count from 0.

    The vehicle in its parameters: `frame`, the one that numbers the frames in `frames`, with the number of motors of
    each in `frame_motors` (0 for any); `files`, the vehicle file of a frame; `wiring`, given the parameters and the
    number of motors of each frame with a file, raises ConfigError where no file or no recording can go by it; `hints`
    are sentences on parameters that would trouble a companion. `turn` is the setting, `NAME VALUE`, that gives a motor
    a sign, and `drive` the one with which an output drives a motor; both count from 1.
    """

    name: str
    family: str
    autopilot: int
    kind: int
    way: str
    rates_hz: Mapping[int, float]
    least_hz: float
    stamped_s: float
    frame: str
    frames: tuple[str, ...]
    frame_motors: tuple[int, ...]
    files: Mapping[str, str]
    wiring: Callable[[Values, Mapping[str, int]], Wiring]
    turn: Callable[[int, int], str]
    drive: Callable[[int, int], str]
    hints: Callable[[Values], tuple[str, ...]] = lambda _: ()
    stream: int | None = None
    stream_hz: int = 0
    never_asked: frozenset[int] = frozenset()
    corners: Mapping[str, str] = field(default_factory=dict)
    loop_s: float = 0.0
    loop: str = ""
    holds_pressure: bool = False
    system_names: tuple[str, ...] = ()
    serves_unheard: bool = False
    hides_companions: bool = False
    holds_motor_test: bool = False

    def __post_init__(self) -> None:
        """Raises ValueError for a rate of a message that is never to be asked for."""
        if fatal := self.never_asked & self.rates_hz.keys():
            raise ValueError(f"{self.name}: never ask for {sorted(fatal)}")

    def motors_of(self, frame: float) -> int:
        """Number of motors of the frame with this number; 0 if any number may be wired to it, or it is unknown."""
        number = int(frame) if math.isfinite(frame) else -1
        return self.frame_motors[number] if 0 <= number < len(self.frame_motors) else 0
