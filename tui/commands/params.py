"""`seatrial params`: show, compare, upload and roll back the parameters of a vehicle."""

import argparse
import os
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, replace
from fnmatch import fnmatchcase
from pathlib import Path

from bridge import clock as clocks
from bridge import exit_codes, reports
from bridge.command_line import check_folder
from bridge.errors import ParamError
from bridge.exit_codes import UsageError
from bridge.links import secured
from bridge.vehicle.coefficients import COEFFICIENTS, MASSES, effect_coefficients, gain_name
from bridge.vehicle.config import VehicleFile, load_vehicle
from bridge.vehicle.parameters import bounds, to_float32
from gcs_plugin.params.client import ParameterClient
from gcs_plugin.params.comparison import COLUMNS, LEGEND, NUMBERS
from gcs_plugin.params.files import check_system, write_parameters
from gcs_plugin.params.identified import origin_in, parameters_from_identification, sidecar_of
from gcs_plugin.params.last_accepted import newest_before
from gcs_plugin.params.meaning import acting_text, unit_of, value_text
from gcs_plugin.params.plan import Verdict, action_of
from gcs_plugin.params.proposal import Proposal, left_behind, propose_rollback, propose_upload
from gcs_plugin.params.receipt import RESULT_COLUMNS, Newest, newest
from gcs_plugin.params.session import Progress
from gcs_plugin.params.transfer import Outcome, Result
from gcs_plugin.params.wanted import Wanted, wanted_by
from gcs_plugin.peers import Source
from tui import links, show
from tui.files import Files
from tui.parameter_files import Leave, check_outcome, read_identification
from tui.show import Tell


def targets_for(arguments: argparse.Namespace) -> Wanted:
    """Return the parameters that the action's file requests; none for `show`. Raises UsageError if it can't be sent."""
    if arguments.action == "show" or arguments.file is None:
        return Wanted({})
    path, only = Path(arguments.file), getattr(arguments, "only", None)
    leave = Leave(arguments.any_vehicle, getattr(arguments, "despite_doubts", True))
    if path.suffix == ".json" and arguments.action != "rollback":
        return targets_of_identification(path, arguments.vehicle, leave, only)
    return targets_of(path, leave, only, getattr(arguments, "vehicle", None))


class Watch:
    """Forwards the client's progress to the progress bar, if one is open."""

    def __init__(self) -> None:
        self._tell: Tell | None = None
        self._share = 0.0

    def __call__(self, progress: Progress) -> None:
        self._share = progress.done / max(progress.total, 1)
        if self._tell is not None:
            stage = "" if progress.stage is None else progress.stage.name
            self._tell(self._share, progress.words, stage=stage)

    def line(self, name: str, result: Result) -> None:
        """Report the result of one parameter to a program that reads the progress; a bar has no line for it."""
        if self._tell is not None and reports.asked(os.environ):
            words = result.sentence
            if result.outcome is Outcome.APPLIED and result.seen is not None:
                words = f"{acting_text(name, result.seen)} read back equal"
            self._tell(self._share, name, written=reports.Written(name, result.outcome.name.lower(), words))

    @contextmanager
    def bar(self, sentence: str) -> Iterator[None]:
        with show.progress(sentence) as self._tell:
            yield
        self._tell = None


def run(arguments: argparse.Namespace) -> int:
    if arguments.action in ("upload", "rollback"):
        check_folder("--receipts", arguments.receipts)
    targets = targets_for(arguments)
    clock, watch = clocks.SystemClock(), Watch()
    opener = secured.Opener(arguments.sign_key, clock, secured.on_words)
    link = links.link_for(arguments.link, opener.open)
    try:
        client = ParameterClient(link, clock, progress=watch, line=watch.line)
        with watch.bar("looking for the vehicle"):
            client.find_vehicle(arguments.seconds, arguments.system)
            receipts, system = Path(arguments.receipts), client.vehicle[0]
            read_at = newest(receipts, system)
            present = client.read_all()
        if arguments.action == "show":
            show.say(show.words(), *left_behind(receipts, system, present))
            return show_values(arguments, present, client.vehicle)
        try:
            if arguments.file is None:
                arguments.file = str(newest_before(receipts, system))
                targets = targets_for(arguments)
        except ParamError as error:
            raise exit_codes.NothingLeft(str(error)) from None
        file = Path(arguments.file)
        try:
            targets = _of_system(file, targets, system, arguments.any_vehicle)
            if arguments.action == "rollback":
                plan = propose_rollback(file, targets, present, receipts, system)
            else:
                accepts = getattr(arguments, "accepts", ())
                plan = propose_upload(file, targets, present, arguments.only, receipts, system, accepts)
        except ParamError as error:
            raise exit_codes.UsageError(str(error)) from None
        show.say(show.results(arguments.json), *plan.notes)
        if arguments.action == "diff" or arguments.dry_run:
            return show_difference(arguments, plan, client)
        return apply(arguments, client, watch, plan, clock.unix_s(), read_at)
    finally:
        link.close()


def show_values(arguments: argparse.Namespace, present: Mapping[str, float], vehicle: Source) -> int:
    """`params show`."""
    patterns = {
        given: given.upper() if "*" in given else f"{given.upper()}*" for given in arguments.patterns or ["*"]
    }
    shown = {name: v for name, v in present.items() if any(fnmatchcase(name, p) for p in patterns.values())}
    missed = [given for given, p in patterns.items() if not any(fnmatchcase(name, p) for name in present)]
    if shown:
        rows = [(name, value_text(value), unit_of(name)) for name, value in shown.items()]
        show.put(
            show.results(arguments.json), show.Table("", ("name", "value", "unit"), rows, numbers=("value",))
        )
    with Files() as files:
        if arguments.out and shown:
            files.attempt(lambda: write_parameters(Path(arguments.out), shown, (), *vehicle))
        files.json(shown, arguments.json)
    for given in missed:
        show.say(
            show.words(),
            f"the vehicle has no parameter like '{given}'; it has {len(present)}: give none to see them all",
        )
    return files.code(exit_codes.NO if missed else exit_codes.DONE)


def show_plan(arguments: argparse.Namespace, proposal: Proposal, hidden: Collection[Verdict]) -> None:
    """Print the plan's lines, without those of the `hidden` verdicts, and its summary."""
    console, cells = show.results(arguments.json), proposal.cells(hidden)
    if cells:
        show.put(console, show.Table("", COLUMNS, cells, numbers=NUMBERS))
    if any(line.change is not None for line in proposal.lines):
        show.say(console, LEGEND)
    show.say(console, proposal.plan.summary())


def show_difference(arguments: argparse.Namespace, proposal: Proposal, client: ParameterClient) -> int:
    """`params diff`, and `upload` and `rollback` with `--dry-run`."""
    show_plan(arguments, proposal, (Verdict.READ_ONLY,))
    show.write_json(asdict(proposal.comparison(client.vehicle, armed=client.armed)), arguments.json)
    alike = all(row.verdict in (Verdict.SAME, Verdict.READ_ONLY) for row in proposal.plan.rows)
    return exit_codes.DONE if alike else exit_codes.NO


def apply(
    arguments: argparse.Namespace,
    client: ParameterClient,
    watch: Watch,
    proposal: Proposal,
    unix_s: float,
    read_at: Newest,
) -> int:
    """`params upload` and `params rollback`: plan, question, upload, receipt."""
    plan = proposal.plan
    show_plan(arguments, proposal, (Verdict.READ_ONLY, Verdict.SAME))
    plan.check()
    if proposal.writes(client.vehicle):
        client.session.check_armed(plan, arguments.armed)
        if not arguments.yes and not show.agreed(client, f"{action_of(plan)}?", "write"):
            show.say(show.words(), "nothing was sent")
            return exit_codes.INTERRUPTED
    with watch.bar(reports.WRITING):
        receipt = client.apply(
            proposal.order(Path(arguments.receipts), unix_s, even_armed=arguments.armed, read_at=read_at)
        )
    console = show.results(arguments.json)
    rows = receipt.cells(plan)
    if rows:
        show.put(console, show.Table("", RESULT_COLUMNS, rows, numbers=RESULT_COLUMNS[2:4]))
    receipt, lines = proposal.settled(receipt)
    show.say(console, "\n".join(lines))
    if receipt.unkept:
        show.say(show.words(), receipt.unkept)
    show.write_json(receipt.to_json(), arguments.json)
    if not receipt.good:
        return exit_codes.NO
    return exit_codes.BAD_INPUT if receipt.unkept else exit_codes.DONE


def targets_of(
    path: Path, leave: Leave, only: Collection[str] | None = None, vehicle: str | None = None
) -> Wanted:
    """Read a parameter file with its sidecar, if it has one.

    If `vehicle` names a vehicle file, the values must be of that vehicle, by the sidecar or else by the file's own
    header. Raises UsageError for a file that can't or should not be sent: nothing was sent then.
    """
    file = None if vehicle is None else load_vehicle(vehicle)
    try:
        wanted = wanted_by(path, "--despite-doubts", despite_doubts=leave.doubts)
    except ParamError as error:
        raise UsageError(str(error)) from None
    return _chosen(path, wanted, file, leave, only)


def targets_of_identification(
    path: Path, vehicle: str | None, leave: Leave, only: Collection[str] | None = None
) -> Wanted:
    """Values of the JSON that `identify` wrote. Raises UsageError for a file that can't or should not be sent."""
    if vehicle is None:
        raise UsageError(f"{path}: an identification needs --vehicle FILE, to know its VEH_CFG; add it")
    file = load_vehicle(vehicle)
    data = read_identification(path)
    check_outcome(path, data["outcome"], leave, "sent")
    configuration = file.configuration or file.vehicle.configuration_named(data["configuration"])
    veh_cfg = file.vehicle.veh_cfg(configuration)
    doubts = (f"warning: {doubt['sentence']}" for doubt in data.get("doubts", ()))
    notes = (f"outcome: {data['outcome']}", *doubts, *(f"note: {note}" for note in data.get("notes", ())))
    try:
        values, sidecar = parameters_from_identification(data, veh_cfg), sidecar_of(data, veh_cfg)
    except ParamError as error:
        raise UsageError(f"{path}: {error}") from None
    return _chosen(path, Wanted(values, notes, True, sidecar), file, leave, only)


def _of_system(path: Path, wanted: Wanted, system: int, any_vehicle: bool) -> Wanted:
    """The values for the vehicle `system`, with a warning if they were saved from another one and may be sent all the
    same. Raises ParamRejected if they may not."""
    if not any_vehicle:
        check_system(path, wanted.system, system, ", or --any-vehicle")
    elif wanted.system not in (None, system):
        warning = f"warning: {path} was saved from vehicle {wanted.system}, and this is vehicle {system}"
        return replace(wanted, notes=(warning, *wanted.notes))
    return wanted


def _chosen(
    path: Path, wanted: Wanted, file: VehicleFile | None, leave: Leave, only: Collection[str] | None
) -> Wanted:
    """The values that the user chose, checked against the vehicle file if there is one. Raises UsageError."""
    try:
        if file is not None:
            sidecar, warnings = wanted.sidecar, []
            owner = origin_in(path) if sidecar is None else (sidecar.vehicle, sidecar.configuration)
            if owner is not None and owner[0]:
                sha256 = None if sidecar is None else sidecar.vehicle_sha256
                warnings = _check_vehicle(path, *owner, sha256, file, leave.any_vehicle)
            wanted = replace(
                wanted,
                notes=(*warnings, *wanted.notes),
                rigid=_rigid_bodies(file),
                kept=_kept_by(file),
                gains=_gains_of(file),
            )
        return wanted.narrowed(path, only)
    except ParamError as error:
        raise UsageError(str(error)) from None


def _rigid_bodies(file: VehicleFile) -> dict[str, tuple[float, float]]:
    """Mass or inertia of the rigid body and its standard deviation, by the id of each total mass."""
    return {
        mass.parameter_id(file.vehicle.veh_cfg(name)): shape.rigid_body(mass.dof)
        for name, shape in file.vehicle.configurations.items()
        for mass in MASSES
    }


def _kept_by(file: VehicleFile) -> dict[str, tuple[float, float]]:
    """The least and the greatest value of each parameter that a vehicle of this file takes, in any configuration."""
    limits: dict[str, tuple[float, float]] = {}
    for name, shape in file.vehicle.configurations.items():
        veh_cfg = file.vehicle.veh_cfg(name)
        limits |= {c.parameter_id(veh_cfg): bounds(c, shape) for c in COEFFICIENTS}
        of_effects = effect_coefficients(shape)
        limits |= {c.parameter_id(veh_cfg): (to_float32(c.low), to_float32(c.high)) for c in of_effects}
    return limits


def _gains_of(file: VehicleFile) -> dict[str, float]:
    """The file's own gain of each thruster, by the id of its accepted gain."""
    ids = {
        (name, number): f"FF{file.vehicle.veh_cfg(name)}_{gain_name(number).upper()}"
        for name, shape in file.vehicle.configurations.items()
        for number in range(1, len(shape.thrusters) + 1)
    }
    return {
        parameter: file.vehicle.configurations[name].thrusters[number - 1].gain
        for (name, number), parameter in ids.items()
    }


def _check_vehicle(
    path: Path, name: str, configuration: str, sha256: str | None, file: VehicleFile, any_vehicle: bool
) -> list[str]:
    """Return warnings about values of the vehicle `name`, identified with the vehicle file of that hash, if known.

    Raises UsageError if the values belong to another vehicle or another configuration of it.
    """
    misfits = []
    if name != file.vehicle.name:
        misfits.append(f"is of vehicle '{name}', and {file.path} is of '{file.vehicle.name}'")
    if file.configuration not in (None, configuration):
        misfits.append(f"is of configuration '{configuration}', and --vehicle names '{file.configuration}'")
    if misfits and not any_vehicle:
        raise UsageError(
            f"{path}: {'; it '.join(misfits)}: nothing was sent; name its own vehicle, or give --any-vehicle"
        )
    warnings = [f"warning: {path} {misfit}" for misfit in misfits]
    if not misfits and sha256 not in (None, file.sha256):
        warnings.append(f"warning: {file.path} has changed since {path} was identified with it")
    return warnings
