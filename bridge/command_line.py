"""Shared by the command lines: options and actions, checked before anything begins, and a run until it is stopped.

argparse turns a ValueError or an ArgumentTypeError of an option's type into its own sentence.
"""

import argparse
import math
import os
import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final, NoReturn

from bridge.exit_codes import UsageError

if TYPE_CHECKING:
    from bridge.clock import Clock

LOOK_EVERY_S: Final = 0.25


class Parser(argparse.ArgumentParser):
    """A parser that reports errors as a UsageError: one sentence that names the help to read."""

    def error(self, message: str) -> NoReturn:
        raise UsageError(f"{message}; see {self.prog} --help")


def seconds(text: str) -> float:
    """A positive number of seconds."""
    return _above_zero(text, "a number of seconds")


def since(text: str) -> float:
    """A number of seconds from 0."""
    value = _number(text)
    if not 0 <= value < math.inf:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number of seconds from 0")
    return value


def above_zero(text: str) -> float:
    """A positive number."""
    return _above_zero(text, "a number")


def seed(text: str) -> int:
    """A whole number from 0."""
    return _whole(text, 0)


def size(text: str) -> int:
    """A whole number from 1."""
    return _whole(text, 1)


def port(text: str) -> int:
    """A TCP or UDP port; 0 means any free port."""
    value = _whole(text, 0)
    if value > 65535:
        raise argparse.ArgumentTypeError(f"'{text}' is no port; give a number up to 65535")
    return value


def system(text: str) -> int:
    """A MAVLink system, 1 to 255."""
    value = _whole(text, 1)
    if value > 255:
        raise argparse.ArgumentTypeError(f"'{text}' is no MAVLink system; give a number up to 255")
    return value


def _above_zero(text: str, quantity: str) -> float:
    value = _number(text)
    if not 0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"'{text}' is not {quantity} above 0")
    return value


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _whole(text: str, least: int) -> int:
    try:
        value = int(text)
    except ValueError:
        value = least - 1
    if value < least:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number from {least}")
    return value


def actions_of(
    parser: argparse.ArgumentParser, actions: Mapping[str, tuple[str, str]]
) -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """Add and yield a parser for each action of a command, by name; `actions` has a sentence and an example each."""
    parsers = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    for name, (sentence, example) in actions.items():
        yield (
            name,
            parsers.add_parser(
                name,
                help=sentence,
                description=f"{sentence[0].upper()}{sentence[1:]}.",
                epilog=f"example:\n  {example}",
                formatter_class=argparse.RawDescriptionHelpFormatter,
            ),
        )


def check_folder(option: str, target: str) -> None:
    """Raise UsageError if `option` names neither a folder nor a path at which a folder can be made."""
    path = Path(target)
    place = next(above for above in (path, *path.absolute().parents) if os.path.lexists(above))
    if place.is_symlink() and not place.exists():
        raise UsageError(f"{option} {target}: {place} is a link that leads nowhere; name another")
    if not place.is_dir():
        raise UsageError(f"{option} {target}: {place} is no folder; name another")
    if not os.access(place, os.W_OK):
        raise UsageError(f"{option} {target}: can't be written there; name another place")


def check_no_folder(option: str, target: str) -> None:
    """Raise UsageError if a folder is at the file path named by `option`."""
    if Path(target).is_dir():
        raise UsageError(f"{option} {target}: is a folder; name a file")


def until_stopped(
    work: Callable[[threading.Event], None],
    clock: "Clock",
    seconds: float | None,
    each: Callable[[float], bool | None],
) -> None:
    """Run `work` in a thread of its own until the user stops it or closes its terminal, `seconds` have passed, or it
    ends.

    `work` returns soon after its event is set. `each` is called a few times a second with the time since the start,
    and ends the run by returning True. An exception of `work` is raised here.
    """
    from concurrent.futures import ThreadPoolExecutor  # 10 ms, which no help needs

    stop = threading.Event()
    start_s = clock.boot_s()
    with _on_signals(stop.set, signal.SIGINT, signal.SIGTERM), ThreadPoolExecutor(1) as pool:
        job = pool.submit(work, stop)
        try:
            while not (job.done() or stop.is_set()) and (
                seconds is None or clock.boot_s() - start_s < seconds
            ):
                stop.wait(LOOK_EVERY_S)
                if each(clock.boot_s() - start_s):
                    break
        finally:
            stop.set()
        job.result()


@contextmanager
def interrupted_in_order() -> Iterator[None]:
    """Let SIGTERM and a closed terminal raise KeyboardInterrupt, as Ctrl-C does, so that a job can say that it was cut.

    Under nohup, which ignores a closed terminal, the job goes on.
    """

    def interrupt() -> None:
        raise KeyboardInterrupt

    with _on_signals(interrupt, signal.SIGTERM):
        yield


@contextmanager
def _on_signals(handle: Callable[[], None], *always: signal.Signals) -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    numbers = [*always]
    # Of a terminal that is closed; under nohup, which ignores it, the run goes on.
    if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) == signal.SIG_DFL:
        numbers.append(signal.SIGHUP)
    before = {number: signal.signal(number, lambda *_: handle()) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
