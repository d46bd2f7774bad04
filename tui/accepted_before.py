"""Load the values accepted earlier, for a diagnosis that looks for changes of the vehicle since then."""

from dataclasses import dataclass
from pathlib import Path

from bridge.vehicle.accepted_effect import AcceptedEffect
from bridge.vehicle.coefficients import BY_NAME
from bridge.vehicle.config import Prior
from tui.accepted import doubted_of, effects_of, priors_of
from tui.doubted import told
from tui.exit_codes import UsageError
from tui.parameter_files import Leave


@dataclass(frozen=True)
class AcceptedBefore:
    """Accepted values with their precision at the time, effects, and sentences about values that were not taken."""

    values: dict[str, Prior] | None = None
    effects: tuple[AcceptedEffect, ...] = ()
    notes: tuple[str, ...] = ()


def accepted_before(path: Path, configuration: str) -> AcceptedBefore:
    """Read a file of `identify` or of `diagnose --accept`, without ageing.

    A value that its identification doubts is not taken: its error would be reported as a change of the vehicle.
    Raises UsageError for a file of another configuration, and for a file in which every value is doubted.
    """
    of, known = priors_of(path, 0.0, Leave())
    # A diagnosis looks for changes of the linear model.
    priors = {name: prior for name, prior in known.items() if name in BY_NAME}
    if of != configuration:
        raise UsageError(
            f"--accepted {path}: is of configuration '{of}', the dive of '{configuration}'; give what was accepted for "
            "that one"
        )
    doubted = doubted_of(path)
    lines = told(doubted, priors)
    taken = {name: prior for name, prior in priors.items() if name not in doubted}
    if not taken:
        raise UsageError(
            f"--accepted {path}: all that it holds is doubted ({lines[0]}), so no change could be told from it; give "
            "that of another dive"
        )
    notes = tuple(f"Of what was accepted, {line}; it was not held against this dive." for line in lines)
    return AcceptedBefore(taken, effects_of(path), notes)
