"""`seatrial params`: show, compare, upload and roll back the parameters of a vehicle."""

import argparse
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING

from bridge import exit_codes
from bridge.command_line import actions_of, seconds
from bridge.links import secured

if TYPE_CHECKING:
    from gcs_plugin.params.client import ParameterClient
    from gcs_plugin.params.comparison import Planned, Wanted
    from gcs_plugin.params.plan import Verdict
    from gcs_plugin.params.receipt import Newest
    from gcs_plugin.params.session import Progress
    from gcs_plugin.params.transfer import Result, Source
    from tui.show import Tell

EXAMPLE = "seatrial params upload hovering.json --vehicle ruvifist --link udpin:127.0.0.1:14550"
_LINK = "--link udpin:127.0.0.1:14550"
ACTIONS = {
    "show": ("what the vehicle holds", f"seatrial params show FF0_ {_LINK}"),
    "diff": ("what an upload would change; sends no write", f"seatrial params diff hovering.param {_LINK}"),
    "upload": ("write a file to the vehicle and prove it", EXAMPLE),
    "rollback": ("bring back the values before an upload", f"seatrial params rollback {_LINK}"),
}
FILES = {
    "diff": "a .param, .parm or .params file, or the JSON of identify",
    "upload": "a .param, .parm or .params file, or the JSON of identify",
    "rollback": "the -before.param that an upload kept (default: that of the last upload that stands)",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    for name, action in actions_of(parser, ACTIONS):
        if name == "show":
            action.add_argument(
                "patterns", nargs="*", metavar="PATTERN", help="start of a name, or one with *"
            )
            action.add_argument("--out", metavar="FILE", help="write them as .param, .parm or .params")
        else:
            nargs = "?" if name == "rollback" else None
            action.add_argument("file", metavar="FILE", help=FILES[name], nargs=nargs)
        if name in ("diff", "upload"):
            action.add_argument(
                "--vehicle", metavar="FILE", help="the vehicle file; needed where FILE is JSON"
            )
            action.add_argument("--only", nargs="+", metavar="NAME", help="these parameters alone")
        if name != "show":
            action.add_argument(
                "--any-vehicle", action="store_true", help="take what is of another vehicle all the same"
            )
        if name == "upload":
            action.add_argument(
                "--despite-doubts", action="store_true", help="take an identification that did not converge"
            )
            action.add_argument(
                "--accept-implausible",
                dest="accepts",
                nargs="+",
                default=[],
                metavar="NAME",
                help="write these although they are implausible, half of a model, or raise the feed-forward",
            )
        if name in ("upload", "rollback"):
            action.add_argument("--yes", action="store_true", help="do not ask")
            action.add_argument(
                "--dry-run", action="store_true", help="show what it would change; sends no write"
            )
            action.add_argument(
                "--armed",
                action="store_true",
                help="write to an armed vehicle too, while its feed-forward is off",
            )
        action.add_argument(
            "--receipts",
            default="receipts",
            metavar="FOLDER",
            help="where values before, receipts and what was accepted lie (default: receipts)",
        )
        action.add_argument(
            "--link",
            metavar="SPEC",
            help="the link to the vehicle (default: that of the recording that runs)",
        )
        secured.add_argument(action)
        action.add_argument("--system", type=int, metavar="N", help="its MAVLink system, where several beat")
        action.add_argument("--seconds", type=seconds, default=5.0, metavar="N", help="wait so long for it")
        action.add_argument("--json", metavar="FILE", help="write the result as JSON; - for standard output")


def check_outputs(arguments: argparse.Namespace) -> None:
    """Raise UsageError if an output file could not be written."""
    from bridge.command_line import check_folder
    from tui.files import PARAMETER_SUFFIXES, check_file, check_files

    output = getattr(arguments, "out", None)
    check_files({"--json": arguments.json, "--out": output})
    check_file("--out", output, PARAMETER_SUFFIXES)
    if arguments.action in ("upload", "rollback"):
        check_folder("--receipts", arguments.receipts)


def targets_for(arguments: argparse.Namespace) -> "Wanted":
    """Return the parameters that the action's file requests; none for `show`. Raises UsageError if it can't be sent."""
    from gcs_plugin.params.comparison import Wanted
    from tui.parameter_files import Leave, targets_of, targets_of_identification

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

    def __call__(self, progress: "Progress") -> None:
        self._share = progress.done / max(progress.total, 1)
        if self._tell is not None:
            stage = "" if progress.stage is None else progress.stage.name
            self._tell(self._share, progress.words, stage=stage)

    def line(self, name: str, result: "Result") -> None:
        """Report the result of one parameter to a program that reads the progress; a bar has no line for it."""
        import os

        from bridge import reports
        from gcs_plugin.params.plan import value_text
        from gcs_plugin.params.transfer import Outcome

        if self._tell is not None and reports.asked(os.environ):
            words = result.sentence
            if result.outcome is Outcome.APPLIED and result.seen is not None:
                words = f"{value_text(result.seen)} read back equal"
            self._tell(self._share, name, written=reports.Written(name, result.outcome.name.lower(), words))

    @contextmanager
    def bar(self, sentence: str) -> Iterator[None]:
        from tui import show

        with show.progress(sentence) as self._tell:
            yield
        self._tell = None


def run(arguments: argparse.Namespace) -> int:
    from bridge.clock import SystemClock
    from bridge.errors import ParamError
    from bridge.wire.framing import Encoder
    from gcs_plugin.params.client import ParameterClient
    from gcs_plugin.params.comparison import left_behind, planned, planned_back
    from gcs_plugin.params.files import check_system
    from gcs_plugin.params.last_accepted import newest_before
    from gcs_plugin.params.receipt import newest
    from gcs_plugin.peers import GROUND_STATION, ground_heartbeat
    from tui import show
    from tui.links import link_for

    check_outputs(arguments)
    targets = targets_for(arguments)
    clock, watch = SystemClock(), Watch()
    opener = secured.Opener(arguments.sign_key, clock, secured.on_words)
    link = link_for(arguments.link, opener.open)
    try:
        # A vehicle that listens on UDP learns the ground's address from this message.
        link.write(Encoder(*GROUND_STATION).encode(ground_heartbeat()))
        client = ParameterClient(link, clock, progress=watch, line=watch.line)
        with watch.bar("looking for the vehicle"):
            client.find_vehicle(arguments.seconds, arguments.system)
            receipts, system = Path(arguments.receipts), client.vehicle[0]
            read_at = newest(receipts, system)
            present = client.read_all()
        if arguments.action == "show":
            for note in left_behind(receipts, system, present):
                show.say(show.words(), note)
            return show_values(arguments, present, client.vehicle)
        try:
            if arguments.file is None:
                arguments.file = str(newest_before(receipts, system))
                targets = targets_for(arguments)
        except ParamError as error:
            raise exit_codes.NothingLeft(str(error)) from None
        file = Path(arguments.file)
        try:
            check_system(file, targets.system, system, ", or --any-vehicle")
            if arguments.action == "rollback":
                plan = planned_back(file, targets, present, receipts, system)
            else:
                accepts = getattr(arguments, "accepts", ())
                plan = planned(file, targets, present, arguments.only, receipts, system, accepts)
        except ParamError as error:
            raise exit_codes.UsageError(str(error)) from None
        for note in plan.notes:
            show.say(show.results(arguments.json), note)
        if arguments.action == "diff" or arguments.dry_run:
            return show_difference(arguments, plan, client)
        return apply(arguments, client, watch, plan, clock.unix_s(), read_at)
    finally:
        link.close()


def show_values(arguments: argparse.Namespace, present: Mapping[str, float], vehicle: "Source") -> int:
    """`params show`."""
    from gcs_plugin.params.files import write_parameters
    from gcs_plugin.params.plan import unit_of, value_text
    from tui import show
    from tui.files import Files

    patterns = {given: _pattern(given) for given in arguments.patterns or ["*"]}
    shown = {name: v for name, v in present.items() if any(fnmatchcase(name, p) for p in patterns.values())}
    missed = [given for given, p in patterns.items() if not any(fnmatchcase(name, p) for name in present)]
    if shown:
        rows = [(name, value_text(value), unit_of(name)) for name, value in shown.items()]
        show.put(
            show.results(arguments.json),
            show.table("", ("name", "value", "unit"), rows, numbers=("value",)),
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


def _pattern(given: str) -> str:
    return given.upper() if "*" in given else f"{given.upper()}*"


def show_plan(arguments: argparse.Namespace, planned: "Planned", hidden: Collection["Verdict"]) -> None:
    """Print the plan's lines, without those of the `hidden` verdicts, and its summary."""
    from gcs_plugin.params.comparison import COLUMNS, LEGEND, NUMBERS
    from tui import show

    console, cells = show.results(arguments.json), planned.cells(hidden)
    if cells:
        show.put(console, show.table("", COLUMNS, cells, numbers=NUMBERS))
    if any(line.change is not None for line in planned.lines):
        show.say(console, LEGEND)
    show.say(console, planned.plan.summary())


def show_difference(arguments: argparse.Namespace, planned: "Planned", client: "ParameterClient") -> int:
    """`params diff`, and `upload` and `rollback` with `--dry-run`."""
    from gcs_plugin.params.plan import Verdict
    from tui import show

    show_plan(arguments, planned, (Verdict.READ_ONLY,))
    show.write_json(planned.to_json(client.vehicle, armed=client.armed), arguments.json)
    alike = all(row.verdict in (Verdict.SAME, Verdict.READ_ONLY) for row in planned.plan.rows)
    return exit_codes.DONE if alike else exit_codes.NO


def apply(
    arguments: argparse.Namespace,
    client: "ParameterClient",
    watch: Watch,
    planned: "Planned",
    unix_s: float,
    read_at: "Newest",
) -> int:
    """`params upload` and `params rollback`: plan, question, upload, receipt."""
    from dataclasses import replace

    from bridge import reports
    from bridge.errors import ParamError
    from gcs_plugin.params.plan import Verdict, action_of
    from gcs_plugin.params.receipt import RECEIPT, RESULT_COLUMNS, path_of
    from tui import show

    plan = planned.plan
    show_plan(arguments, planned, (Verdict.READ_ONLY, Verdict.SAME))
    plan.check()
    if planned.writes(client.vehicle) and not arguments.yes and not agreed(client, f"{action_of(plan)}?"):
        show.say(show.words(), "nothing was sent")
        return exit_codes.INTERRUPTED
    with watch.bar(reports.WRITING):
        receipt = client.apply(
            planned.order(Path(arguments.receipts), unix_s, even_armed=arguments.armed, read_at=read_at)
        )
    before = receipt.preimage
    console = show.results(arguments.json)
    rows = receipt.cells(plan)
    if rows:
        show.put(console, show.table("", RESULT_COLUMNS, rows, numbers=RESULT_COLUMNS[2:4]))
    show.say(console, f"{receipt.outcome.value}: {receipt.sentence}")
    kept = "" if receipt.unkept else f"receipt: {path_of(before, RECEIPT)}\n"
    show.say(console, f"{kept}values before: {before}")
    try:
        accepted = None if receipt.unkept else planned.keep(receipt)
        if accepted is not None:
            show.say(console, f"accepted: {accepted}")
    except ParamError as error:
        receipt = replace(receipt, unkept=str(error))
    if receipt.unkept:
        show.say(show.words(), receipt.unkept)
    show.write_json(receipt.to_json(), arguments.json)
    if not receipt.good:
        return exit_codes.NO
    return exit_codes.BAD_INPUT if receipt.unkept else exit_codes.DONE


def agreed(client: "ParameterClient", question: str) -> bool:
    """Whether the user types yes. Raises UsageError if nobody can be asked."""
    from tui.show import asked

    return asked(client, f"{question} [yes/no] ", "write").lower() in ("y", "yes")
