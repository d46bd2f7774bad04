"""`seatrial params`: show, compare, upload and roll back the parameters of a vehicle."""

import argparse
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING

from tui import exit_codes

if TYPE_CHECKING:
    from gcs_plugin.params.client import ParameterClient
    from gcs_plugin.params.plan import Plan
    from tui.show import Tell

EXAMPLE = "seatrial params upload hovering.json --vehicle ruvifist --link udpin:127.0.0.1:14550"
_LINK = "--link udpin:127.0.0.1:14550"
_BEFORE = "receipts/2026-11-20T101500Z-before.param"
ACTIONS = {
    "show": ("what the vehicle holds", f"seatrial params show FF0_ {_LINK}"),
    "diff": ("what an upload would change; sends no write", f"seatrial params diff hovering.param {_LINK}"),
    "upload": ("write a file to the vehicle and prove it", EXAMPLE),
    "rollback": ("bring back the values before an upload", f"seatrial params rollback {_BEFORE} {_LINK}"),
}
FILES = {
    "diff": "a .param, .parm or .params file, or the JSON of identify",
    "upload": "a .param, .parm or .params file, or the JSON of identify",
    "rollback": "the -before.param that an upload kept",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    for name, (sentence, example) in ACTIONS.items():
        action = actions.add_parser(
            name,
            help=sentence,
            description=f"{sentence[0].upper()}{sentence[1:]}.",
            epilog=f"example:\n  {example}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        if name == "show":
            action.add_argument(
                "patterns", nargs="*", metavar="PATTERN", help="start of a name, or one with *"
            )
            action.add_argument("--out", metavar="FILE", help="write them as .param, .parm or .params")
        else:
            action.add_argument("file", metavar="FILE", help=FILES[name])
        if name in ("diff", "upload"):
            action.add_argument("--vehicle", metavar="FILE", help="the vehicle file, where FILE is JSON")
            action.add_argument("--only", nargs="+", metavar="NAME", help="these parameters alone")
        if name in ("upload", "rollback"):
            action.add_argument("--yes", action="store_true", help="do not ask")
            action.add_argument(
                "--receipts", default="receipts", metavar="FOLDER", help="where values before and receipt go"
            )
        action.add_argument("--link", required=True, metavar="SPEC", help="the link to the vehicle")
        action.add_argument("--system", type=int, metavar="N", help="its MAVLink system, where several beat")
        action.add_argument("--seconds", type=float, default=5.0, metavar="N", help="wait so long for it")
        action.add_argument("--json", metavar="FILE", help="write the result as JSON; - for standard output")


class Watch:
    """Where the client's progress goes: to the bar that is open, if one is."""

    def __init__(self) -> None:
        self._tell: Tell | None = None

    def __call__(self, stage: str, done: int, total: int) -> None:
        if self._tell is not None:
            self._tell(done / max(total, 1), stage)

    @contextmanager
    def bar(self, sentence: str) -> Iterator[None]:
        from tui import show

        with show.progress(sentence) as self._tell:
            yield
        self._tell = None


def run(arguments: argparse.Namespace) -> int:
    from bridge.clock import SystemClock
    from bridge.framing import Encoder
    from bridge.link.open import open_link
    from gcs_plugin.params.client import ParameterClient
    from gcs_plugin.station import GROUND_STATION, ground_heartbeat
    from tui.parameter_files import targets_of

    if arguments.action in ("diff", "upload"):
        targets = targets_of(Path(arguments.file), arguments.vehicle, arguments.only)
    elif arguments.action == "rollback":
        targets = targets_of(Path(arguments.file), None, None)
    else:
        targets = {}
    clock, watch = SystemClock(), Watch()
    link = open_link(arguments.link)
    try:
        # A vehicle that listens on UDP learns from this where the ground is.
        link.write(Encoder(*GROUND_STATION).encode(ground_heartbeat()))
        client = ParameterClient(link, clock, progress=watch)
        with watch.bar("looking for the vehicle"):
            client.find_vehicle(arguments.seconds, arguments.system)
            present = client.read_all()
        if arguments.action == "show":
            return show_values(arguments, present)
        if arguments.action == "diff":
            return show_difference(arguments, targets, present)
        return apply(arguments, client, watch, targets, present, clock.unix_s())
    finally:
        link.close()


def show_values(arguments: argparse.Namespace, present: Mapping[str, float]) -> int:
    """`params show`."""
    from gcs_plugin.params.files import write_parameters
    from gcs_plugin.params.plan import value_text
    from tui import show

    patterns = [p if "*" in p else p + "*" for p in map(str.upper, arguments.patterns)] or ["*"]
    shown = {name: v for name, v in present.items() if any(fnmatchcase(name, p) for p in patterns)}
    rows = [(name, value_text(value)) for name, value in shown.items()]
    show.results(arguments.json).print(show.table("", ("name", "value"), rows, numbers=("value",)))
    if arguments.out:
        write_parameters(Path(arguments.out), shown)
    show.write_json(shown, arguments.json)
    return exit_codes.DONE if shown else exit_codes.NO


def show_difference(
    arguments: argparse.Namespace, targets: Mapping[str, float], present: Mapping[str, float]
) -> int:
    """`params diff`."""
    from gcs_plugin.params.plan import Verdict, make_plan
    from tui import show

    plan = make_plan(targets, present)
    tell_plan(plan, arguments.json)
    show.results(arguments.json).print(plan.summary(), soft_wrap=True)
    rows = [
        {
            "name": r.name,
            "present": r.present,
            "target": r.target,
            "verdict": r.verdict.value,
            "reason": r.reason,
        }
        for r in plan.rows
    ]
    show.write_json({"summary": plan.summary(), "parameters": rows}, arguments.json)
    alike = all(row.verdict in (Verdict.SAME, Verdict.READ_ONLY) for row in plan.rows)
    return exit_codes.DONE if alike else exit_codes.NO


def apply(
    arguments: argparse.Namespace,
    client: "ParameterClient",
    watch: Watch,
    targets: Mapping[str, float],
    present: Mapping[str, float],
    unix_s: float,
) -> int:
    """`params upload` and `params rollback`: plan, question, upload, receipt."""
    from datetime import UTC, datetime

    from gcs_plugin.params.plan import Verdict, make_plan
    from tui import show

    plan = make_plan(targets, present)
    tell_plan(plan.chosen(r.name for r in plan.rows if r.verdict is not Verdict.SAME), arguments.json)
    show.results(arguments.json).print(plan.summary(), soft_wrap=True)
    plan.check()
    if plan.changes and not arguments.yes and not agreed(f"write {len(plan.changes)} parameters?"):
        show.words().print("nothing was sent")
        return exit_codes.INTERRUPTED
    stem = Path(arguments.receipts) / f"{datetime.fromtimestamp(unix_s, UTC):%Y-%m-%dT%H%M%SZ}"
    before = stem.with_name(f"{stem.name}-before.param")
    with watch.bar("uploading"):
        receipt = client.apply(plan, before)
    console = show.results(arguments.json)
    rows = [
        (line.name, _text(line.before), _text(line.after), line.sentence)
        for line in receipt.lines
        if line.name in plan.changes
    ]
    console.print(
        show.table("", ("name", "before", "now", "what became of it"), rows, numbers=("before", "now"))
    )
    console.print(f"{receipt.outcome.value}: {receipt.sentence}", soft_wrap=True)
    kept = stem.with_name(f"{stem.name}-receipt.json")
    show.write_json(receipt.to_json(), str(kept))
    console.print(f"receipt: {kept}\nvalues before: {before}", soft_wrap=True)
    show.write_json(receipt.to_json(), arguments.json)
    return exit_codes.DONE if receipt.good else exit_codes.NO


def _text(value: float | None) -> str:
    from gcs_plugin.params.plan import value_text

    return "-" if value is None else value_text(value)


def tell_plan(plan: "Plan", json_target: str | None) -> None:
    """The plan as a table."""
    from gcs_plugin.params.plan import printable
    from tui import show

    console = show.results(json_target)
    columns = ("name", "on the vehicle", "in the file", "verdict")
    console.print(show.table("", columns, printable(plan), numbers=columns[1:3]))


def agreed(question: str) -> bool:
    """Whether the user types yes. Raises UsageError where there is nobody to ask."""
    import sys

    if not sys.stdin.isatty():
        raise exit_codes.UsageError(
            "nobody to ask, standard input is no terminal; give --yes to write without asking"
        )
    print(f"{question} [yes/no] ", end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip().lower() in ("y", "yes")
