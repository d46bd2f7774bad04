"""The vehicle that recorded a log: by its autopilot's own parameters, and by how it moved."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import yaml

from bridge.errors import LogError, SeatrialError
from bridge.firmware.description import Firmware, Wiring
from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import Configuration, VehicleFile, load_vehicle
from identify.checks.actuation.motors import FOLLOWS, Miswired, following, miswired
from identify.checks.actuation.thrust_response import PUSHED, mirrored, mounting_hints, swapped
from identify.checks.readings.missing_signals import never_armed
from identify.estimators.axes.build import build_axes
from identify.estimators.filter.state import POSITION
from identify.ingest.mavlink.autopilot_parameters import autopilot_parameters
from identify.ingest.open import read_dive
from identify.thrust.wrench import wrench
from identify.words import listed


@dataclass(frozen=True)
class Guess:
    """A vehicle file proposed for a recording, by the autopilot's parameters in it or by its motion alone.

    `file` fits the wiring; `base` names the bundled file that it comes from. `findings` are sentences on what the
    motion contradicts; `judged` the degrees of freedom that were compared, and `unjudged` why none was, if none;
    `hints` are sentences on parameters that would trouble a companion.
    """

    by: Literal["parameters", "motion"]

    firmware: Firmware
    base: str
    file: VehicleFile
    configuration: str
    wiring: Wiring
    findings: tuple[str, ...]
    judged: tuple[str, ...]
    unjudged: str
    hints: tuple[str, ...]

    def text(self, source: str) -> str:
        bundled = load_vehicle(self.base).path
        data = yaml.safe_load(bundled.read_text(encoding="utf-8"))
        configuration = data["configurations"][self.configuration]
        fitted = self.file.vehicle.configurations[self.configuration].thrusters
        configuration["thrusters"] = [
            {
                **configuration["thrusters"][motor - 1],
                "direction": [value + 0.0 for value in thruster.direction],
            }
            for motor, thruster in zip(self.wiring.motors, fitted, strict=True)
        ]
        known = "the autopilot's parameters" if self.by == "parameters" else "the motions"
        head = (
            f"# {self.base} of configs/vehicles, whose sources it names, with its thrusters in the order and with the\n"
            f"# signs that {known} in {source} show.\n"
        )
        return head + yaml.safe_dump(data, sort_keys=False, default_flow_style=None, width=116)

    def to_json(self) -> dict[str, Any]:
        return {
            "by": self.by,
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

    If the autopilot's parameters name no frame, the motion alone decides: the bundled file, and the signs of its
    thrusters, that fit it best.

    Raises LogError for a recording that has neither, ConfigError for parameters that fit no file.
    """
    firmware, values = autopilot_parameters(path)
    bases = {frame: load_vehicle(name) for frame, name in firmware.files.items()}
    if firmware.frame not in values:
        return _guessed_by_motion(path, firmware, bases, values)
    thrusters = {frame: len(_configuration(base)[1].thrusters) for frame, base in bases.items()}
    wired = firmware.wiring(values, thrusters)
    name, _ = _configuration(bases[wired.frame])
    file = _wired_file(bases[wired.frame], wired)
    findings, judged, unjudged = _by_motion(path, file, name, wired, firmware)
    hints, base = firmware.hints(values), firmware.files[wired.frame]
    return Guess("parameters", firmware, base, file, name, wired, findings, judged, unjudged, hints)


def _configuration(base: VehicleFile) -> tuple[str, Configuration]:
    return next(iter(base.vehicle.configurations.items()))


def _wired_file(base: VehicleFile, wired: Wiring) -> VehicleFile:
    """The bundled file with its thrusters as they are wired."""
    name, configuration = _configuration(base)
    vehicle = replace(base.vehicle, configurations={name: wired.fitted(configuration)})
    return replace(base, vehicle=vehicle, configuration=name)


def _guessed_by_motion(
    path: Path, firmware: Firmware, bases: Mapping[str, VehicleFile], values: Mapping[str, float]
) -> Guess:
    """The bundled file of the most thrusters, all of them used, that the motion follows, with those turned that it
    shows to be reversed.

    Raises LogError if it follows none.
    """
    for frame, base in sorted(bases.items(), key=lambda item: -len(_configuration(item[1])[1].thrusters)):
        name, configuration = _configuration(base)
        count = len(configuration.thrusters)
        dive = read_dive(path, vehicle=base)
        if dive.pwm is None or np.count_nonzero(dive.pwm.value[:, :count].std(axis=0)) < count:
            continue
        wrong = miswired(dive, base, name)
        turned = () if wrong is None or wrong.swapped else wrong.reversed
        wired = Wiring(frame, tuple(range(1, count + 1)), turned)
        file = _wired_file(base, wired)
        if following(dive, file, name) < FOLLOWS:
            continue
        findings, judged, unjudged = _by_motion(path, file, name, wired, firmware)
        hints = firmware.hints(values)
        return Guess(
            "motion", firmware, firmware.files[frame], file, name, wired, findings, judged, unjudged, hints
        )
    whole = (
        "give the whole log, at whose beginning they stand"
        if path.suffix.lower() == ".bin"
        else "let the ground station read all parameters while it records (QGroundControl does at each connection), "
        "give the autopilot's own log, the .BIN"
    )
    raise LogError(
        f"holds no {firmware.frame} of the autopilot, and its motion follows the thrust of no known frame; {whole}, or "
        "write a vehicle file (docs/howto/write_a_vehicle_file.md)",
        path,
    )


def _by_motion(
    path: Path, file: VehicleFile, configuration_name: str, wired: Wiring, firmware: Firmware
) -> tuple[tuple[str, ...], tuple[str, ...], str]:
    """Findings, the degrees of freedom that they rest on, and why there are none of these."""
    try:
        dive = read_dive(path, vehicle=file)
        if never_armed(dive):
            return (), (), "the vehicle was never armed, so that the thrusters did not push"
        axes = build_axes(dive, file, configuration_name).axes
        pushed = np.ptp(wrench(dive, file, configuration_name).asked, axis=0) > 0.0
    except SeatrialError as error:
        return (), (), str(error)
    read = [axis.dof for axis in axes if axis.dof in PUSHED and (axis.state_read != POSITION).any()]
    if not read:
        return (), (), "it holds no velocity and no rate of turn"
    judged = tuple(DOFS[dof] for dof in read if pushed[dof])
    if not judged:
        return (), (), "every command is neutral, or too small to turn a propeller"
    wrong = miswired(dive, file, configuration_name)
    if wrong is not None:
        return (_sentence(wrong, wired, firmware),), judged, ""
    return mounting_hints(mirrored(axes), swapped(axes)), judged, ""


def _sentence(wrong: Miswired, wired: Wiring, firmware: Firmware) -> str:
    if not wrong.swapped:
        motors = [wired.motors[place - 1] for place in wrong.reversed]
        now, then = (
            listed([firmware.turn(motor, sign if motor in wired.reversed else -sign) for motor in motors])
            for sign in (-1, 1)
        )
        many, push, says, wires = (
            ("Motor", "pushes", "says", "its three wires")
            if len(motors) == 1
            else ("Motors", "push", "say", "the three wires of each")
        )
        numbers = listed([str(motor) for motor in motors])
        return (
            f"{many} {numbers} {push} the other way than {now} {says} ({wrong.agreement}): set {then}, or swap two of "
            f"{wires}."
        )
    first, second = (wired.motors[place - 1] for place in wrong.swapped)
    outputs = " and ".join(str(place) for place in wrong.swapped)
    # Once they are exchanged, an output drives the other motor of the two.
    turned = [second if place == wrong.swapped[0] else first for place in wrong.reversed]
    also = " and ".join(firmware.turn(motor, 1 if motor in wired.reversed else -1) for motor in turned)
    return (
        f"Motors {first} and {second} are swapped{', with a wrong sign' if turned else ''} ({wrong.agreement}): swap "
        f"their plugs on outputs {outputs}, or {firmware.drive(wrong.swapped[0], second)} and "
        f"{firmware.drive(wrong.swapped[1], first)}{f'; and set {also}' if also else ''}."
    )
