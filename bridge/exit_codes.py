"""Meaning of every verb's exit codes: a single list, shown by `seatrial --help` and in docs/commands.md."""

from bridge.errors import FitError, LinkError, LinkSpecError, ParamError, ParamUnwritten, SeatrialError

DONE = 0
NO = 1
BAD_INPUT = 2
LINK = 3
INTERRUPTED = 4
PARTLY = 5

MEANINGS = {
    DONE: "done",
    NO: "it ran and the answer is no: nothing identifiable, a check failed, the vehicle refused",
    BAD_INPUT: "wrong usage, or a file or place that can't be read, used or written",
    LINK: "a port or a network link does not work, or no vehicle answers on it",
    INTERRUPTED: "stopped by the user before it was done",
    PARTLY: "done for some of many dives, not for all",
}


class UsageError(SeatrialError):
    """The command line asks for something impossible."""


class NothingLeft(UsageError):
    """No upload is left to roll back. A program that reads the verb's reports knows it by its name."""


def of(error: SeatrialError) -> int:
    """The exit code of an error that ends a verb."""
    if isinstance(error, LinkSpecError | ParamUnwritten):
        return BAD_INPUT
    if isinstance(error, LinkError):
        return LINK
    if isinstance(error, ParamError | FitError):
        return NO
    return BAD_INPUT
