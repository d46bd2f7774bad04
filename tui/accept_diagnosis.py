"""Accepting a diagnosis: its model written as a parameter file, and the model accepted before, read for the next."""

import math
from collections.abc import Collection, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Final

from bridge.errors import ConfigError
from bridge.exit_codes import UsageError
from bridge.text import typed
from bridge.vehicle.coefficients import BY_NAME, DAMPINGS, OF_HULL, QUADRATICS, effect_coefficients
from bridge.vehicle.config import Configuration, VehicleFile, load_vehicle
from bridge.version import installed
from gcs_plugin.params import float32
from gcs_plugin.params.identified import doubt_lines, origin
from gcs_plugin.params.last_accepted import model_in_force
from gcs_plugin.params.sidecar import Interval, Sidecar, write_with_sidecar
from identify.batch.rows import clauses
from identify.checks.contradictions import contradictions
from identify.diagnose.accepted import none_accepted
from identify.diagnose.result import Diagnosis
from identify.diagnose.shrink.contradiction import contradicted
from identify.diagnose.words.diagnosis import sorted_by_likelihood
from identify.dive import Dive
from identify.doubt import Outcome, worst
from identify.run.diagnose import Before, published
from identify.run.in_force import before_in_force
from identify.validation.against_forecast import began, began_for_receipts
from tui import show
from tui.accepted_priors import accepted_in
from tui.options import NONE_ACCEPTED, RECEIPTS
from tui.parameter_files import Leave, check_outcome

if TYPE_CHECKING:
    from identify.validation.forecast import Forecast

FORETELLING: Final = "foretelling the next dive"


def accept(path: Path, diagnosis: Diagnosis, dive: Dive, file: VehicleFile) -> tuple[str, ...]:
    """Write the accepted model as a parameter file; return sentences on the effects that the feed-forward can't
    compensate and on how to upload the file. Without an accepted effect no file is written.
    """
    if diagnosis.first:
        return (
            f"{path} was not written: the motion does not go the way the thrust pushes; mend how the sensors or the "
            "thrusters are said to be mounted first.",
        )
    if diagnosis.verdict == "no_gap" and not diagnosis.findings and diagnosis.accepted.effects:
        return (f"{path} was not written: nothing differs from what was accepted before.",)
    if not diagnosis.accepted.effects:
        return (f"{path} was not written: {none_accepted(diagnosis.findings)}.",)
    if not diagnosis.accepted.tells:
        return (
            *diagnosis.accepted.sentences,
            f"{path} was not written: nothing is left of it that could be sent.",
        )
    fitted = diagnosis.accepted.values.keys()
    of_recording = [
        doubt
        for doubt in contradictions(dive, file, diagnosis.configuration, fitted)
        if not fitted.isdisjoint(doubt.about)
    ]
    doubts = [*diagnosis.accepted.doubts, *of_recording]
    doubted = {
        name: why for name, why in clauses(doubts, OF_HULL).items() if name in diagnosis.accepted.values
    }
    outcome = worst(doubt.outcome for doubt in doubts)
    from identify.validation.forecast import forecast, forecast_lines  # loads scipy.optimize

    with show.progress(FORETELLING) as tell:
        foresight = forecast(
            diagnosis.accepted,
            diagnosis.hull,
            dive,
            file,
            diagnosis.configuration,
            lambda share: tell(share, FORETELLING),
        )
    write_accepted(path, diagnosis, dive, file, doubted, outcome, foresight)
    shape = file.vehicle.configurations[diagnosis.configuration]
    how = f"accepted: {path}; {_sends(path, diagnosis, shape)}"
    if diagnosis.verdict in ("partly", "unknown"):
        how += " with --despite-doubts, because something is left that no cause explains"
    elif contradicted(diagnosis.heldout, diagnosis.check):
        how += " with --despite-doubts, because the check dive does not bear it out"
    elif outcome is not Outcome.CONVERGED:
        of_itself = worst(doubt.outcome for doubt in of_recording) is not Outcome.CONVERGED
        why = "the recording contradicts itself" if of_itself else "the model does not fit the dive"
        how += f" with --despite-doubts, because {why}"
    return (
        *diagnosis.accepted.sentences,
        *doubt_lines(doubted, tuple(doubted)),
        *forecast_lines(foresight),
        how,
    )


def _sends(path: Path, diagnosis: Diagnosis, shape: Configuration) -> str:
    """Describe the effect of uploading the file to the vehicle."""
    likely, _ = sorted_by_likelihood(diagnosis.findings)
    upload = f"{typed('seatrial', 'params', 'upload', path)} sends"
    by_masses = any(finding.cause.effect.feedforward == "nominal" for finding in likely)
    hull = coefficients_of_hull(shape)
    if (
        by_masses
        or diagnosis.accepted.taken_back
        or any(name not in hull for name in diagnosis.accepted.values)
    ):
        return f"{upload} it to the vehicle"
    if not diagnosis.accepted.values:
        return "nothing in it is for the vehicle; export and simulate --accepted take it"
    return (
        "the feed-forward can make up for none of its causes; "
        f"{upload} only the masses and dampings that were fitted beside them"
    )


def write_accepted(
    path: Path,
    diagnosis: Diagnosis,
    dive: Dive,
    file: VehicleFile,
    doubted: Mapping[str, str],
    by_recording: Outcome,
    foresight: "Forecast",
) -> None:
    """Write the result of accepting a diagnosis as a parameter file with its sidecar.

    `doubted`: the recording's evidence against values, by coefficient, and `by_recording` the outcome it leads to. If
    a gap is left that no cause explains, or the check dive contradicts the causes, the outcome is that data and model
    disagree. `foresight` is kept for comparison with the next dive. Raises ParamRejected.
    """
    accepted, configuration = diagnosis.accepted, diagnosis.configuration
    refuted = contradicted(diagnosis.heldout, diagnosis.check)
    outcome = Outcome.DISAGREES if refuted or diagnosis.verdict in ("partly", "unknown") else by_recording
    veh_cfg = file.vehicle.veh_cfg(configuration)
    shape = file.vehicle.configurations[configuration]
    ids = {item.name: item.parameter_id(veh_cfg) for item in OF_HULL.values()}
    ids |= {item.name: item.parameter_id(veh_cfg) for item in effect_coefficients(shape)}
    values = {ids[name]: float32.rounded(item.value) for name, item in accepted.values.items()}
    # Zero takes back an effect that was accepted earlier and is no longer, whichever tool sends the file.
    values |= {i: 0.0 for item in effect_coefficients(shape) if (i := ids[item.name]) not in values}
    if shape.damping == "quadratic":
        # No linear damping is a part of this hull's model.
        squared = [item.dof for item in QUADRATICS if item.name in accepted.values]
        values |= {ids[DAMPINGS[dof].name]: 0.0 for dof in squared}
    names = ", ".join(effect.label for effect in accepted.in_the_model)
    taken_back = ", ".join(sorted(accepted.taken_back))
    words = (
        origin(file.vehicle.name, configuration, "diagnose", dive.name),
        *((f"accepted: {names}",) if names else ()),
        *((f"taken back: {taken_back}",) if taken_back else ()),
        f"outcome: {outcome.value}",
        *doubt_lines(doubted, tuple(doubted)),
    )
    write_with_sidecar(
        path,
        values,
        words,
        Sidecar(
            dive.sha256,
            file.sha256,
            configuration,
            "diagnose",
            installed(),
            {
                ids[name]: Interval(name, item.unit, item.low95, item.high95)
                for name, item in accepted.values.items()
                if math.isfinite(item.low95) and math.isfinite(item.high95)
            },
            file.vehicle.name,
            dive.name,
            outcome.value,
            dived=began(dive),
            dive_opening=dive.opening,
            effects=accepted.in_the_model,
            doubted=dict(doubted),
            foretold=foresight.rows,
            credits=foresight.credits,
            unforetold=foresight.why,
        ),
    )


def coefficients_of_hull(shape: Configuration) -> Collection[str]:
    """Names of the coefficients of the hull's own model; the others are effects."""
    return BY_NAME if shape.damping == "linear" else OF_HULL


def before_of(
    accepted: str | None, dive: Dive, file: VehicleFile, configuration: str, leave: Leave
) -> Before:
    """The model that a dive is diagnosed against: that of --accepted, or else the set in force.

    That is told by the folder of receipts that --accepted names, RECEIPTS without it. Raises UsageError as
    `accepted_before` and `published` do.
    """
    if accepted == NONE_ACCEPTED:
        return Before()
    receipts = Path(RECEIPTS if accepted is None else accepted)
    if accepted is None or receipts.is_dir():
        return in_force_before(receipts, dive, file, configuration)
    return before_named(accepted, file, configuration, leave)


def in_force_before(receipts: Path, dive: Dive, file: VehicleFile, configuration: str) -> Before:
    """The model with accepted effects that was in force when a dive began; an empty one without, or for a dive that
    does not tell when that was."""
    begun = began_for_receipts(dive)
    model = model_in_force(receipts, file.vehicle.name, configuration, begun) if begun else None
    if model is None or not model.sidecar.effects:
        return Before()
    shape = file.vehicle.configurations[configuration]
    return before_in_force(asdict(model.sidecar), model.since, shape)


def before_named(accepted: str, file: VehicleFile, configuration: str, leave: Leave) -> Before:
    """The model that --accepted names: that of a vehicle file, or else of an identification or a diagnosis.

    Raises UsageError as `accepted_before` and `published` do.
    """
    name, _, _ = accepted.rpartition(":")
    if not any(part.endswith((".yaml", ".yml")) for part in (accepted, name)):
        return accepted_before(Path(accepted), file, configuration, leave)
    try:
        given = load_vehicle(accepted)
        shape = given.vehicle.configurations[
            given.vehicle.configuration_named(given.configuration or configuration)
        ]
        return published(shape, file.vehicle.configurations[configuration].damping)
    except ConfigError as error:
        raise UsageError(f"--accepted {accepted}: {error}") from None


def check_accepted(path: Path, vehicle: str, of: str, file: VehicleFile, configuration: str) -> None:
    """Raise UsageError for a file that is of another vehicle than the dive, if it says of which, or another
    configuration."""
    theirs = (
        ("vehicle", vehicle or file.vehicle.name, file.vehicle.name),
        ("configuration", of, configuration),
    )
    for what, accepted, dived in theirs:
        if accepted != dived:
            raise UsageError(
                f"--accepted {path}: is of {what} '{accepted}', the dive of '{dived}'; give what was accepted for "
                "that one"
            )


def accepted_before(path: Path, file: VehicleFile, configuration: str, leave: Leave) -> Before:
    """Read a file of `identify` or of `diagnose --accept`, without ageing.

    A value that its identification doubts is not taken, unless `leave` lets it pass: its error would be reported as a
    change of the vehicle. Raises UsageError for a file of another vehicle or configuration, for a fit that did not
    converge though none of its values is doubted, and for a file in which every value is doubted.
    """
    read = accepted_in(path, 0.0, Leave(doubts=True))
    if not read.doubted:
        check_outcome(path, read.outcome or Outcome.CONVERGED.value, leave, "compared")
    # A diagnosis looks for changes of the hull's own model.
    hull = coefficients_of_hull(file.vehicle.configurations[configuration])
    priors = {name: prior for name, prior in read.priors.items() if name in hull}
    check_accepted(path, read.vehicle, read.configuration, file, configuration)
    lines = doubt_lines(read.doubted, priors)
    if leave.doubts:
        return Before(priors, read.effects, tuple(f"Of what was accepted, {line}." for line in lines))
    taken = {name: prior for name, prior in priors.items() if name not in read.doubted}
    if not taken:
        raise UsageError(
            f"--accepted {path}: all that it holds is doubted ({lines[0]}), so no change could be told from it; give "
            "that of another dive, or --despite-doubts"
        )
    notes = tuple(f"Of what was accepted, {line}; not held against this dive." for line in lines)
    return Before(taken, read.effects, notes)
