"""What an armed vehicle may be given: a harder confirmation, not a locked door.

A sub that holds its place in a current is safer armed than not. What must not change under way is the model that acts
on the thrusters: the vehicle itself refuses a commit while its feed-forward acts, and so does the ground.
"""

from collections.abc import Mapping

from bridge.parameters import APPLYING_MODES, MODE


def obstacle(present: Mapping[str, float]) -> str:
    """Why an armed vehicle that holds `present` can't be given parameters, "" where it can."""
    if present.get(MODE) in APPLYING_MODES:
        return "is armed and its feed-forward acts on the thrusters: force the feed-forward off first"
    return ""


def not_raised(targets: Mapping[str, float], present: Mapping[str, float]) -> dict[str, float]:
    """`targets` without a mode of the feed-forward above the present one: going back is no order to act."""
    mode = present.get(MODE)
    return {name: value for name, value in targets.items() if name != MODE or mode is None or value <= mode}
