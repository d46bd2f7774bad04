"""Rules for uploads to an armed vehicle: they need a stronger confirmation, but are possible.

A vehicle that holds its position in a current is safer armed than disarmed. Only the model that acts on the thrusters
must not change under way: the vehicle refuses a commit while its feed-forward acts, and so does the ground station.
"""

from collections.abc import Mapping

from bridge.parameters import APPLYING_MODES, MODE
from bridge.vehicle.feedforward import Mode


def obstacle(present: Mapping[str, float]) -> str:
    """Why an armed vehicle with the values `present` must not be given parameters, "" if it may."""
    if present.get(MODE) in APPLYING_MODES:
        return "is armed and its feed-forward acts on the thrusters: force the feed-forward off first"
    return ""


def not_raised(targets: Mapping[str, float], present: Mapping[str, float]) -> dict[str, float]:
    """`targets` without FF_MODE if that would raise the feed-forward's mode: a roll back is no order to act."""
    mode = present.get(MODE)
    return {
        name: value
        for name, value in targets.items()
        if name != MODE or mode is None or _is_no_rise(value, mode)
    }


def _is_no_rise(value: float, mode: float) -> bool:
    """Whether mode `value` gives the feed-forward no more authority than `mode`; the numbers are in another order."""
    if value not in set(Mode) or mode not in set(Mode):
        return value == mode
    if Mode(int(value)).applies_feedforward or Mode(int(mode)).applies_feedforward:
        return not Mode(int(value)).raises(Mode(int(mode)))
    return value <= mode
