"""What an armed vehicle may be given: a harder confirmation, not a locked door.

A sub that holds its place in a current is safer armed than not. What must not change under way is the model that acts
on the thrusters: the vehicle itself refuses a commit while its feed-forward acts, and so does the ground.
"""

from collections.abc import Mapping

from bridge.parameters import APPLYING_MODES, MODE
from bridge.vehicle.feedforward import Mode


def obstacle(present: Mapping[str, float]) -> str:
    """Why an armed vehicle that holds `present` can't be given parameters, "" where it can."""
    if present.get(MODE) in APPLYING_MODES:
        return "is armed and its feed-forward acts on the thrusters: force the feed-forward off first"
    return ""


def not_raised(targets: Mapping[str, float], present: Mapping[str, float]) -> dict[str, float]:
    """`targets` without a mode of the feed-forward above the present one: going back is no order to act."""
    mode = present.get(MODE)
    return {
        name: value
        for name, value in targets.items()
        if name != MODE or mode is None or _is_no_rise(value, mode)
    }


def _is_no_rise(value: float, mode: float) -> bool:
    """Whether a mode leaves no more to the feed-forward; their numbers do not rise as that does."""
    if value not in set(Mode) or mode not in set(Mode):
        return value == mode
    if Mode(int(value)).applies_feedforward or Mode(int(mode)).applies_feedforward:
        return not Mode(int(value)).raises(Mode(int(mode)))
    return value <= mode
