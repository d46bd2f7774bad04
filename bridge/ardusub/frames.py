"""ArduSub's frames, as FRAME_CONFIG numbers them, and the parameters of its outputs and motors, both numbered from 1
(ArduSub 4.5, libraries/AP_Motors/AP_Motors6DOF.h, libraries/SRV_Channel)."""

import math
from collections.abc import Mapping
from typing import Final

from bridge.errors import ConfigError

FRAME: Final = "FRAME_CONFIG"
FRAMES: Final = (
    "bluerov1", "vectored", "vectored_6dof", "vectored_6dof_90deg", "simplerov_3", "simplerov_4", "simplerov_5",
    "custom",
)  # fmt: skip
"""Names of the frames by FRAME_CONFIG."""
FRAME_MOTORS: Final = (6, 6, 8, 8, 3, 4, 5, 0)
"""Number of motors of each of FRAMES; 0 for any."""
FIRST_MOTOR: Final = 33
"""The function of an output that drives motor 1."""
OUTPUTS: Final = 16


def function_name(output: int) -> str:
    """Name of the parameter of what an output drives."""
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


def motors_of(frame_config: float) -> int:
    """Number of motors of the frame that FRAME_CONFIG states; 0 if any number may be wired to it, or it is unknown."""
    number = int(frame_config) if math.isfinite(frame_config) else -1
    return FRAME_MOTORS[number] if 0 <= number < len(FRAME_MOTORS) else 0
