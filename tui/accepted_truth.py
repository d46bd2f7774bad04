"""Use the model that `diagnose --accept` wrote as the truth of a simulated vehicle."""

from dataclasses import replace
from pathlib import Path

from bridge.simulator.truth import GAIN, PLANTED, Truth, load_truth
from bridge.vehicle.coefficients import BY_NAME
from bridge.vehicle.config import VehicleFile
from identify.export.effects import IN_COEFFICIENTS
from tui.exit_codes import UsageError
from tui.parameter_files import Leave, accepted_model

SIMULATED = (
    *IN_COEFFICIENTS,
    "quadratic_drag",
    "dead_zone",
    "weak_thruster",
    "reverse_thrust_loss",
)
"""Names and labels of effects whose coefficients the simulator has."""


def accepted_truth(path: Path, file: VehicleFile, configuration: str) -> tuple[Truth, tuple[str, ...]]:
    """The model of an accepted `.param` in the water of the vehicle's own truth, and its parts left out.

    Values that were not identified come from that truth, otherwise from the vehicle file's model. Raises UsageError
    for a file of another vehicle or configuration, ConfigError if a coefficient is found nowhere.
    """
    accepted = accepted_model(path, file, Leave(doubts=True))
    if accepted.configuration != configuration:
        raise UsageError(
            f"{path}: is of configuration '{accepted.configuration}', not '{configuration}'; name its own"
        )
    linear = {name: value for name, value in accepted.values.items() if name in BY_NAME}
    shape = file.vehicle.configurations[configuration]
    shapes = file.vehicle.configurations | {configuration: replace(shape, model=shape.model | linear)}
    truth = load_truth(replace(file, vehicle=replace(file.vehicle, configurations=shapes)), configuration)
    effects = {name: value for name, value in accepted.values.items() if name not in linear}
    held = {name: value for name, value in effects.items() if name in PLANTED or GAIN.fullmatch(name)}
    lost = [
        effect.label
        for effect in accepted.effects
        if effect.name not in SIMULATED and effect.label not in SIMULATED
    ]
    notes = (f"not simulated: {', '.join(lost)}",) if lost else ()
    return replace(truth, model=truth.model | linear, effects=held), notes
