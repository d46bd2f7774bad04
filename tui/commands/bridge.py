"""`seatrial bridge`: the vehicle's program, which `seatrial-bridge` starts without the ground's packages."""

from bridge.onboard.program import OPTIONS, add_arguments, run

__all__ = ["EXAMPLE", "add_arguments", "run"]

EXAMPLE = f"seatrial bridge {OPTIONS}"
