"""ArduSub's frames, as FRAME_CONFIG numbers them (ArduSub 4.5, libraries/AP_Motors/AP_Motors6DOF.h)."""

import math
from typing import Final

FRAME: Final = "FRAME_CONFIG"
FRAMES: Final = (
    "bluerov1", "vectored", "vectored_6dof", "vectored_6dof_90deg", "simplerov_3", "simplerov_4", "simplerov_5",
    "custom",
)  # fmt: skip
"""Names of the frames by FRAME_CONFIG."""
FRAME_MOTORS: Final = (6, 6, 8, 8, 3, 4, 5, 0)
"""Number of motors of each of FRAMES; 0 for any."""


def motors_of(frame_config: float) -> int:
    """Number of motors of the frame that FRAME_CONFIG states; 0 if any number may be wired to it, or it is unknown."""
    number = int(frame_config) if math.isfinite(frame_config) else -1
    return FRAME_MOTORS[number] if 0 <= number < len(FRAME_MOTORS) else 0
