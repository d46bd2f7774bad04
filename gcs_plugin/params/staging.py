"""Messages about values that a vehicle holds in staging but does not fly, and about an upload's effect on them."""

from collections.abc import Mapping

from bridge.parameters import ACTIVE
from gcs_plugin.params.plan import Plan, in_force, is_staged, staged_crc


def told(present: Mapping[str, float]) -> tuple[str, ...]:
    """A line for the crew if the vehicle's staged set is not the set in force; otherwise empty."""
    active = present.get(ACTIVE)
    if in_force(present) is not False or active is None:
        return ()
    if active != 0.0:
        return (
            f"note: what the vehicle holds is staged as set {staged_crc(present)} and does not fly: set {active:.0f} "
            "does, which is another; an upload puts in force all that is staged",
        )
    waits = any(value for name, value in present.items() if is_staged(name))
    held = "what the vehicle holds is staged, and none of it flies: " if waits else ""
    return (
        f"note: {held}no set is in force on the vehicle ({ACTIVE} is 0), so its feed-forward is zero: upload one; "
        "where one was in force before, its vehicle file has another hull or other thrusters since",
    )


def about_to(plan: Plan) -> str:
    """What the upload of a plan does, for its confirmation prompt: `write 1 parameter and put 9 in force`."""
    changes, staged = len(plan.changes), len(plan.staged)
    if changes and staged:
        return f"write {_count(changes)} and put the {staged} staged in force"
    if staged:
        return f"put {_count(staged)} in force"
    return f"write {_count(changes)}" if changes else "put the staged set in force"


def _count(lines: int) -> str:
    return f"{lines} parameter{'' if lines == 1 else 's'}"
