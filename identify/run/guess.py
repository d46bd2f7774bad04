"""The vehicle that recorded a log, by its autopilot's own parameters and by how it moved."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import yaml

from bridge.ardusub.settings import FAILSAFE, PILOT_FAILSAFE, WARNS_ALONE, direction_name
from bridge.ardusub.wiring import FILES, FIRST_MOTOR, Wiring, wiring
from bridge.errors import SeatrialError
from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import VehicleFile, load_vehicle
from identify.checks.gaps import never_armed
from identify.diagnose.motors import Miswired, miswired
from identify.diagnose.mounting import PUSHED, mirrored, mounting_hints, swapped
from identify.estimators.axes import build_axes
from identify.estimators.innovations import POSITION
from identify.ingest.autopilot_parameters import autopilot_parameters
from identify.ingest.open import read_dive

HOLDER: Final = "SYSID_MYGCS"


@dataclass(frozen=True)
class Guess:
    """A vehicle file made from an autopilot's parameters, and what the motion of a recording says of it.

    `file` fits the wiring; `base` names the bundled file that it comes from. `findings` are sentences on
    what the motion contradicts; `judged` the degrees of freedom that were compared, and `unjudged` why none was, if
    none; `hints` are sentences on parameters that would trouble a companion.
    """

    base: str
    file: VehicleFile
    configuration: str
    wiring: Wiring
    findings: tuple[str, ...]
    judged: tuple[str, ...]
    unjudged: str
    hints: tuple[str, ...]

    def text(self, source: str) -> str:
        """The vehicle file, as YAML."""
        bundled = load_vehicle(self.base).path
        data = yaml.safe_load(bundled.read_text(encoding="utf-8"))
        shape = data["configurations"][self.configuration]
        fitted = self.file.vehicle.configurations[self.configuration].thrusters
        shape["thrusters"] = [
            {**shape["thrusters"][motor - 1], "direction": [value + 0.0 for value in thruster.direction]}
            for motor, thruster in zip(self.wiring.motors, fitted, strict=True)
        ]
        head = (
            f"# {self.base} of configs/vehicles, whose sources it names, with its thrusters in the order and with the\n"
            f"# signs that the autopilot's parameters in {source} state.\n"
        )
        return head + yaml.safe_dump(data, sort_keys=False, default_flow_style=None, width=116)

    def to_json(self) -> dict[str, Any]:
        return {
            "vehicle": self.base,
            "configuration": self.configuration,
            "frame": self.wiring.frame,
            "motor_of_output": list(self.wiring.motors),
            "reversed": list(self.wiring.reversed),
            "fits_as_it_is": self.wiring.is_plain,
            "judged": list(self.judged),
            "unjudged": self.unjudged,
            "findings": list(self.findings),
            "hints": list(self.hints),
        }


def guess(path: Path) -> Guess:
    """Propose a vehicle file for a recording, and compare it with the recorded motion.

    Raises LogError for a recording without an ArduPilot's parameters, ConfigError for parameters that fit no file.
    """
    values = autopilot_parameters(path)
    bases = {frame: load_vehicle(name) for frame, name in FILES.items()}
    shapes = {frame: next(iter(base.vehicle.configurations.items())) for frame, base in bases.items()}
    wired = wiring(values, {frame: len(shape.thrusters) for frame, (_, shape) in shapes.items()})
    base, (configuration, shape) = bases[wired.frame], shapes[wired.frame]
    vehicle = replace(base.vehicle, configurations={configuration: wired.fitted(shape)})
    file = replace(base, vehicle=vehicle, configuration=configuration)
    findings, judged, unjudged = _by_motion(path, file, configuration, wired)
    name = FILES[wired.frame]
    return Guess(name, file, configuration, wired, findings, judged, unjudged, companion_hints(values))


def companion_hints(values: Mapping[str, float]) -> tuple[str, ...]:
    """Sentences on parameters with which a companion takes no sticks, or a pilot has none."""
    said = []
    system = values.get("SYSID_THISMAV", 1.0)
    if values.get(HOLDER) == system:
        said.append(
            f"{HOLDER} is {system:g}, the vehicle's own system: a companion held the sticks and did not give them "
            "back, and no ground station's sticks are taken; start the companion again, which puts it back, or set "
            f"{HOLDER} to the ground station's own, usually 255."
        )
    said += [
        f"{name} is {values[name]:g}: without it a companion that dies leaves the last sticks in force, and it takes "
        "none; set it to 2."
        for name, least in ((FAILSAFE, WARNS_ALONE), (PILOT_FAILSAFE, 0))
        if name in values and not values[name] > least
    ]
    return tuple(said)


def _by_motion(
    path: Path, file: VehicleFile, configuration: str, wired: Wiring
) -> tuple[tuple[str, ...], tuple[str, ...], str]:
    """Findings, the degrees of freedom that they rest on, and why there are none of these."""
    try:
        dive = read_dive(path, vehicle=file)
        if never_armed(dive):
            return (), (), "the vehicle was never armed, so that the thrusters did not push"
        axes = build_axes(dive, file, configuration).axes
    except SeatrialError as error:
        return (), (), str(error)
    judged = tuple(
        DOFS[axis.dof] for axis in axes if axis.dof in PUSHED and (axis.state_read != POSITION).any()
    )
    if not judged:
        return (), (), "it holds no velocity and no rate of turn"
    wrong = miswired(dive, file, configuration, axes)
    if wrong is not None:
        return (_sentence(wrong, wired),), judged, ""
    return mounting_hints(mirrored(axes), swapped(axes)), judged, ""


def _sentence(wrong: Miswired, wired: Wiring) -> str:
    motors = [wired.motors[place - 1] for place in wrong.motors]
    so = f"the recorded motion follows the thrust then by {wrong.follows:.2f}, and by {wrong.followed:.2f} as it is"
    if len(motors) == 1:
        name = direction_name(motors[0])
        now = -1 if motors[0] in wired.reversed else 1
        return (
            f"Motor {motors[0]} pushes the other way than {name} {now} says ({so}): set {name} to {-now}, or swap two "
            "of its three wires."
        )
    first, second = motors
    outputs = " and ".join(str(place) for place in wrong.motors)
    return (
        f"Motors {first} and {second} are swapped ({so}): swap their plugs on outputs {outputs}, or "
        f"SERVO{wrong.motors[0]}_FUNCTION {FIRST_MOTOR + first - 1} and SERVO{wrong.motors[1]}_FUNCTION "
        f"{FIRST_MOTOR + second - 1}."
    )
