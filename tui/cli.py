"""The `seatrial` command: finds the verb, reads its arguments, answers errors with one sentence."""

import argparse
import contextlib
import difflib
import gc
import importlib
import io
import math
import os
import signal
import sys
from collections.abc import Sequence
from types import ModuleType

from bridge import exit_codes, reports
from bridge.command_line import Parser
from bridge.errors import SeatrialError
from bridge.text import printable, say
from bridge.version import installed
from tui import BEGAN_UNIX_S
from tui.options import Options
from tui.verbs import VERBS

PACKAGES = ("bench", "bridge", "configs", "gcs_plugin", "identify", "tui")
STOPPED = "stopped before it was done"


def command() -> int:
    """Run `main` as a whole process, without the collector's slow last pass: the system frees all memory anyway."""
    _mark_characters_beyond_the_locale()
    try:
        code = main(began_unix_s=BEGAN_UNIX_S)
        # All output is written: an interrupt now would only disturb the interpreter's exit.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        return code
    finally:
        gc.freeze()


def _mark_characters_beyond_the_locale() -> None:
    """Let both outputs write a mark for a character that their encoding lacks, such as a table's rule in Latin-1."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper) and not stream.encoding.lower().startswith("utf"):
            stream.reconfigure(errors="replace")


def main(argv: Sequence[str] | None = None, began_unix_s: float = math.inf) -> int:
    """Run a command line and return its exit code. `began_unix_s`: when its program began to start, where known."""
    # Set before numpy is imported: matrices are small here, and a second thread would spin on another method's core.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        return _run(sys.argv[1:] if argv is None else list(argv), began_unix_s)
    except SeatrialError as error:
        return _complain(str(error), exit_codes.of(error), type(error).__name__)
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] in PACKAGES:
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


def module_of(verb: str) -> ModuleType:
    """Import the module that runs a verb; `import` is a Python keyword, so its module is named `import_`."""
    if verb == "bridge":  # runs on a vehicle that has no other package
        return importlib.import_module("bridge.onboard.program")
    return importlib.import_module(f"tui.commands.{'import_' if verb == 'import' else verb}")


def verb_parser(name: str) -> argparse.ArgumentParser:
    verb = VERBS[name]
    parser = Parser(
        prog=f"seatrial {name}",
        description=f"{verb.sentence[0].upper()}{verb.sentence[1:]}.",
        epilog=f"example:\n  {verb.example}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    verb.add_options(Options(parser))
    return parser


def _run(argv: list[str], began_unix_s: float) -> int:
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
        arguments.began_unix_s = began_unix_s
        from tui.files import check_places  # not for help

        check_places(arguments)
        return int(module_of(verb).run(arguments))
    except SystemExit as stop:
        return int(stop.code or 0)


def _top_parser() -> argparse.ArgumentParser:
    verbs = "\n".join(f"  {name:<10} {verb.sentence}" for name, verb in VERBS.items())
    examples = "example:\n  seatrial demo\n  seatrial identify --help"
    codes = "\n".join(f"  {code}  {meaning}" for code, meaning in exit_codes.MEANINGS.items())
    parser = Parser(
        prog="seatrial",
        usage="seatrial VERB ...",
        description="Identify an underwater vehicle's hydrodynamics from a dive, and fly the better for it.",
        epilog=f"verbs:\n{verbs}\n\nexit codes:\n{codes}\n\n{examples}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"seatrial {installed()}")
    parser.add_argument("verb", nargs="?", metavar="VERB", help="one of the verbs below")
    return parser


def _is_interrupt(error: BaseException | None) -> bool:
    """Whether Ctrl-C caused an error: compiled code that is interrupted raises a SystemError from it."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def complain(sentence: str, error: str = "") -> None:
    """Print an error in one line on standard error, on a terminal broken between words.

    A program that reads the progress gets a report of it instead, with the name of the error (`bridge.reports`).
    """
    text = " ".join(sentence.split())
    if reports.asked(os.environ):
        report = reports.Report(reports.ERROR, 1.0, printable(text, "?"), stage=error)
        with contextlib.suppress(BrokenPipeError):  # a verb goes on when its listener is gone
            print(reports.line(report), end="", file=sys.stderr, flush=True)
    else:
        say(f"seatrial: {text}")


def _complain(sentence: str, code: int, error: str = "") -> int:
    complain(sentence, error)
    return code
