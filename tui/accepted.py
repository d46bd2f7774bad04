"""What an earlier, accepted identification is used for.

- Priors: its values, with widths enlarged for changes between dives.
- A diagnosis that looks for changes of the vehicle since then.
- The truth of a simulated vehicle.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from bridge.errors import ParamError
from bridge.exit_codes import UsageError
from bridge.simulator.truth import GAIN, PLANTED, Truth, load_truth
from bridge.vehicle.coefficients import BY_NAME, OF_HULL
from bridge.vehicle.config import Prior, VehicleFile
from bridge.vehicle.effect_coefficients import AcceptedEffect
from gcs_plugin.params.files import read_sidecar
from gcs_plugin.params.identified import doubt_lines, doubted_in
from identify.effects.effect import SIMULATED
from identify.effects.library import library
from identify.identification import Outcome
from identify.run.diagnose import Before
from identify.statistics import Z95
from tui.parameter_files import Leave, accepted_model, check_outcome, read_identification

AGEING = {"mass": 0.03, "damping": 0.10, "quadratic": 0.10}
"""Relative standard deviations: water and weed taken along, 1 to 5 kg on 100; fouling and a tether, tens of % over
weeks."""


@dataclass(frozen=True)
class _Origin:
    """Origin of accepted values: in words, the recording's identifiers, and the dives before it."""

    source: str
    dive_sha256: str
    dive_opening: str
    earlier_dives: tuple[str, ...]


def priors_of(path: Path, widen: float | None, leave: Leave) -> tuple[str, dict[str, Prior]]:
    """Configuration and priors from the JSON of `identify`, or a `.param` with its sidecar.

    The priors assume the thrust of the vehicle file: a correction of thrust by a weighed prior is taken out, because
    the weighed prior stays in the file and would apply it again. `widen` (relative) is added to every width in
    quadrature; None takes AGEING. Raises UsageError for another kind of file, and for an identification that did not
    converge, unless `leave` lets it pass.
    """
    return _of_json(path, widen, leave) if path.suffix == ".json" else _of_sidecar(path, widen, leave)


def doubted_of(path: Path) -> dict[str, str]:
    """The reason against each coefficient that the identification doubts, from either file. Raises UsageError."""
    if path.suffix == ".json":
        return doubted_in(read_identification(path))
    try:
        sidecar = read_sidecar(path)
    except ParamError as error:
        raise UsageError(str(error)) from None
    return {} if sidecar is None else sidecar.doubted


def effects_of(path: Path) -> tuple[AcceptedEffect, ...]:
    """The effects that `diagnose --accept` wrote into a `.param`'s sidecar; an identification has none."""
    sidecar = None if path.suffix == ".json" else read_sidecar(path)
    return () if sidecar is None else sidecar.effects


def merged(present: Mapping[str, Prior], accepted: Mapping[str, Prior]) -> dict[str, Prior]:
    """Replace earlier values by accepted ones, but keep weighed values: a dive is no better force standard."""
    weighed = {name: prior for name, prior in present.items() if prior.rests_on == "weight"}
    both = {**present, **accepted, **weighed}
    return {name: both[name] for name in OF_HULL if name in both}


def left_behind(present: Mapping[str, Prior], after: Mapping[str, Prior]) -> list[str]:
    """Names whose earlier dive is not among the dives of the new prior; a prior that names no dive is not judged."""
    own_dives = {name: set(before.dives) - set(before.earlier_dives) for name, before in present.items()}
    return [
        name
        for name, dives in own_dives.items()
        if name in after and dives and not dives.intersection(after[name].dives)
    ]


def _of_json(path: Path, widen: float | None, leave: Leave) -> tuple[str, dict[str, Prior]]:
    data = read_identification(path)
    check_outcome(path, data["outcome"], leave, "written")
    dive_data = data.get("dive")
    dive = dive_data if isinstance(dive_data, dict) else {}
    source = _source(dive.get("name"), dive.get("date"), str(data.get("method", "identified")))
    earlier = data.get("prior_dives")
    before = tuple(map(str, earlier)) if isinstance(earlier, list) else ()
    origin = _Origin(source, str(dive.get("sha256", "")), str(dive.get("opening", "")), before)
    priors = {}
    for parameter in data["parameters"]:
        name, value, std = (
            parameter.get("name"),
            parameter.get("given_thrust"),
            parameter.get("given_thrust_std"),
        )
        if name in OF_HULL and parameter.get("identifiable") is True and _positive(value) and _positive(std):
            priors[name] = _aged(name, value, std / value, widen, origin)
    return str(data["configuration"]), _some(path, priors)


def _of_sidecar(path: Path, widen: float | None, leave: Leave) -> tuple[str, dict[str, Prior]]:
    try:
        sidecar = read_sidecar(path)
    except ParamError as error:
        raise UsageError(str(error)) from None
    if sidecar is None:
        raise UsageError(f"{path}: {_why_no_sidecar(path)}")
    check_outcome(path, sidecar.outcome or Outcome.CONVERGED.value, leave, "written")
    source = _source(sidecar.dive, sidecar.dived, sidecar.method)
    origin = _Origin(source, sidecar.dive_sha256, sidecar.dive_opening, sidecar.prior_dives)
    # Next to effects, quadratic drag is itself an effect, of a hull that has none.
    known = BY_NAME if sidecar.effects else OF_HULL
    priors = {}
    for interval in sidecar.intervals.values():
        name, low, high = interval.coefficient, interval.low95, interval.high95
        if name in known and 0 < low < high:
            relative = math.log(high / low) / (2 * Z95)
            value = math.sqrt(low * high) / (1.0 + sidecar.thrust_shift)
            priors[name] = _aged(name, value, relative, widen, origin)
    return sidecar.configuration, _some(path, priors)


def _why_no_sidecar(path: Path) -> str:
    if not path.exists():
        return "no such file; check the name"
    problem = "is a folder" if path.is_dir() else "has no sidecar that tells its intervals"
    return f"{problem}; give the JSON of `seatrial identify`, or a .param with its sidecar"


def _source(dive: str | None, date: str | None, method: str) -> str:
    """Describe a source: `hovering-7 of 2026-11-20, likelihood`."""
    return f"{dive or 'a dive'}{f' of {date}' if date else ''}, {method}"


def _aged(name: str, value: float, relative_std: float, widen: float | None, origin: _Origin) -> Prior:
    """A prior of this value, widened for ageing."""
    share = AGEING[OF_HULL[name].kind] if widen is None else widen
    std = value * math.hypot(relative_std, share)
    return Prior(
        value, std, origin.source, "thrust", origin.dive_sha256, origin.earlier_dives, origin.dive_opening
    )


def _some(path: Path, priors: dict[str, Prior]) -> dict[str, Prior]:
    if not priors:
        raise UsageError(
            f"{path}: holds no identifiable parameter with an interval given the thrust; identify anew, or dive again"
        )
    return priors


def _positive(value: Any) -> bool:
    return (
        isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value) and value > 0
    )


def accepted_before(path: Path, configuration: str) -> Before:
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
    lines = doubt_lines(doubted, priors)
    taken = {name: prior for name, prior in priors.items() if name not in doubted}
    if not taken:
        raise UsageError(
            f"--accepted {path}: all that it holds is doubted ({lines[0]}), so no change could be told from it; give "
            "that of another dive"
        )
    notes = tuple(f"Of what was accepted, {line}; it was not held against this dive." for line in lines)
    return Before(taken, effects_of(path), notes)


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
    effects_held = {
        effect.label
        for effect in library(shape, file.vehicle.thrust_curve.lag_s)
        if effect.feedforward in SIMULATED
    }
    lost = [effect.label for effect in accepted.effects if effect.label not in effects_held]
    notes = (f"not simulated: {', '.join(lost)}",) if lost else ()
    return replace(truth, model=truth.model | linear, effects=held), notes
