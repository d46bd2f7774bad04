"""The `seatrial` command: finds the verb, reads its arguments, answers errors with one sentence."""

import argparse
import difflib
import gc
import importlib
import os
import signal
import sys
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from typing import Protocol, cast

from bridge import exit_codes, reports
from bridge.command_line import Parser
from bridge.errors import SeatrialError
from bridge.text import printable, say

VERBS = {
    "demo": "dive, record, identify, upload and dive again with a simulated vehicle",
    "bridge": "run on the vehicle: read its sensors, stream MAVLink, hold its parameters",
    "simulate": "dive a mission with a simulated vehicle and its simulated devices",
    "tui": "the terminal app: watch the vehicle live, over ssh and in tmux as well",
    "record": "record every frame of one or more links into a dive folder",
    "fetch": "bring what the vehicle kept of a dive and the ground did not hear, and make the dive whole",
    "merge": "put what another recorder kept of a dive to it, on one clock: the autopilot's log, another .tlog",
    "note": "write down what happens in the dive that is being recorded",
    "conditions": "what a dive was made under: water, tether, ballast, payload, weather",
    "watch": "what an operator sees now of a vehicle: armed, link, sensors, depth, velocities, battery",
    "dives": "list dive folders: when, how long, what was lost, what each could identify, what was learnt",
    "import": "say what a recording holds and file it as a dive folder",
    "identify": "identify mass and damping from dives, with intervals",
    "batch": "identify many dives, here or on a Dask cluster: one table, and how the vehicle drifts",
    "plan": "propose what to dive next, and how well each parameter would be known after it",
    "prior": "take what was identified and accepted into the vehicle file, as known before the next dive",
    "params": "show, compare, upload and roll back the parameters of a vehicle",
    "ff": "switch the feed-forward of a vehicle: off, shadow, ff or both",
    "export": "write the identified model in the files of other simulators",
    "diagnose": "say where model and recording differ, what causes it, and how far that shrinks the difference",
    "validate": "tracking errors of dives in acceleration, steady state and deceleration",
    "replay": "send a recorded dive to a link, on its own clock",
    "challenge": "make dives with hidden effects and locked answers, and score those who named them",
    "reproduce": "the source paper's campaigns and figures on the simulated vehicle, on one page",
    "keys": "make a key that signs the link, and tell which key a file holds",
    "doctor": "check vehicle file, links, clocks, disk and sensors; with --wet, thrusters and mountings",
}


ROOMS = ("bench", "bridge", "configs", "gcs_plugin", "identify", "tui")
STOPPED = "stopped before it was done"


class Command(Protocol):
    """Interface of a module of `tui.commands`."""

    EXAMPLE: str

    def add_arguments(self, parser: argparse.ArgumentParser) -> None: ...

    def run(self, arguments: argparse.Namespace) -> int: ...


def command() -> int:
    """Run `main` as a whole process, without the collector's slow last pass: the system frees all memory anyway."""
    try:
        code = main()
        # All output is written: an interrupt now would only disturb the interpreter's exit.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        return code
    finally:
        gc.freeze()


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command line and return its exit code."""
    # Set before numpy is imported: matrices are small here, and a second thread would spin on another method's core.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        return _run(sys.argv[1:] if argv is None else list(argv))
    except SeatrialError as error:
        return _complain(str(error), exit_codes.of(error), type(error).__name__)
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] in ROOMS:
            raise
        return _complain(f"{error.name} is not installed: this is the bridge alone; install the ground station "
                         "too, as seatrial[ground], or by install.sh", exit_codes.BAD_INPUT)  # fmt: skip
    except BrokenPipeError:  # the reader of a pipe, such as `head`, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return exit_codes.DONE
    except OSError as error:
        subject = f"{error.filename}: " if error.filename else ""
        return _complain(f"{subject}{error.strerror or error}; check the path, its permissions and the disk",
                         exit_codes.BAD_INPUT)  # fmt: skip
    except KeyboardInterrupt:
        return _complain(STOPPED, exit_codes.INTERRUPTED)
    except SystemError as error:
        if not _is_interrupt(error):
            raise
        return _complain(STOPPED, exit_codes.INTERRUPTED)


def load(verb: str) -> Command:
    """Load the module of a verb; `import` is a Python keyword, so its module is named `import_`."""
    return cast(Command, importlib.import_module(f"tui.commands.{'import_' if verb == 'import' else verb}"))


def verb_parser(verb: str) -> argparse.ArgumentParser:
    """Make the parser of a verb."""
    command = load(verb)
    parser = Parser(
        prog=f"seatrial {verb}",
        description=f"{VERBS[verb][0].upper()}{VERBS[verb][1:]}.",
        epilog=f"example:\n  {command.EXAMPLE}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    command.add_arguments(parser)
    return parser


def _run(argv: list[str]) -> int:
    try:
        parser = _top_parser()
        verb = parser.parse_args(argv[:1]).verb
        if verb is None:
            parser.print_help(sys.stderr)
            return exit_codes.BAD_INPUT
        if verb not in VERBS:
            near = difflib.get_close_matches(verb, VERBS, n=1)
            hint = f"did you mean '{near[0]}'?" if near else f"the verbs are {', '.join(VERBS)}"
            raise exit_codes.UsageError(f"unknown verb '{verb}'; {hint}")
        arguments = verb_parser(verb).parse_args(argv[1:])
        from tui.files import check_inputs_stay

        check_inputs_stay(arguments)
        return load(verb).run(arguments)
    except SystemExit as stop:
        return int(stop.code or 0)


def _top_parser() -> argparse.ArgumentParser:
    verbs = "\n".join(f"  {name:<10} {sentence}" for name, sentence in VERBS.items())
    examples = "example:\n  seatrial demo\n  seatrial identify --help"
    codes = "\n".join(f"  {code}  {meaning}" for code, meaning in exit_codes.MEANINGS.items())
    parser = Parser(
        prog="seatrial",
        usage="seatrial VERB ...",
        description="Identify an underwater vehicle's hydrodynamics from a dive, and fly the better for it.",
        epilog=f"verbs:\n{verbs}\n\nexit codes:\n{codes}\n\n{examples}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"seatrial {_version()}")
    parser.add_argument("verb", nargs="?", metavar="VERB", help="one of the verbs below")
    return parser


def _version() -> str:
    try:
        return version("seatrial")
    except PackageNotFoundError:
        return "(not installed)"


def _is_interrupt(error: BaseException | None) -> bool:
    """Whether Ctrl-C caused an error: compiled code that is interrupted raises a SystemError from it."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def _complain(sentence: str, code: int, error: str = "") -> int:
    """Print one line on standard error, on a terminal broken between words; return `code`.

    A program that reads the progress gets a report of it instead, with the name of the error (`bridge.reports`).
    """
    if reports.asked(os.environ):
        report = reports.Report(reports.ERROR, 1.0, printable(" ".join(sentence.split()), "?"), stage=error)
        print(reports.line(report), end="", file=sys.stderr)
        return code
    say(f"seatrial: {' '.join(sentence.split())}")
    return code
