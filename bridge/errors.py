"""Every error that seatrial raises on purpose.

SeatrialError                 a sentence a user can act on: the problem, its object and the remedy
├── ConfigError               a vehicle file or a setting
├── LinkError                 a port or a network link
│   ├── LinkSpecError         an invalid name of a link
│   ├── LinkTimeout           nothing arrived within the time allowed
│   └── LinkLost              the port or the peer went away
├── FrameError                bytes that should form a frame and don't
├── ParamError                the vehicle's parameters
│   ├── ParamUnknown          a parameter that the vehicle does not have
│   ├── ParamRejected         a value that the vehicle refused, or that was never fit to send
│   │   └── ParamUnwritten    a file of parameters that can't be written
│   └── ParamUnverified       no independent read-back within the deadline
├── LogError                  a recording that can't be read or written
│   ├── NothingRecorded       a file that was created but holds no frame
│   ├── NotOfThisDive         a vehicle that has nothing of the dive that is asked for
│   └── TakenAway             a file that was deleted or moved while it was written
└── FitError                  an identification that can't be made
"""

from pathlib import Path


class SeatrialError(Exception):
    """Base of all errors raised on purpose; its text, the reason after the object `of`, is shown as it is."""

    def __init__(self, reason: str, of: object = "") -> None:
        self.reason, self.of = reason, of
        super().__init__(f"{of}: {reason}" if of else reason)


class ConfigError(SeatrialError):
    """A vehicle file or a setting is wrong."""


class LinkError(SeatrialError):
    """A port or a network link does not work."""


class LinkSpecError(LinkError):
    """The given name of a link is invalid."""


class LinkTimeout(LinkError):
    """Nothing arrived within the time allowed."""


class LinkLost(LinkError):
    """The port or the peer went away."""


class FrameError(SeatrialError):
    """Bytes that should form a frame don't."""


class ParamError(SeatrialError):
    """The vehicle's parameters could not be read or written."""


class ParamUnknown(ParamError):
    """The vehicle does not have this parameter."""


class ParamRejected(ParamError):
    """The vehicle refused the value, or the value was never fit to send."""


class ParamUnwritten(ParamRejected):
    """A file of parameters, or a file that an upload needs, can't be written."""


class ParamUnverified(ParamError):
    """No independent read-back confirmed the write within the deadline."""


class LogError(SeatrialError):
    """A recording can't be read or written."""


class NothingRecorded(LogError):
    """A file of a recording was created but holds no frame."""


class NotOfThisDive(LogError):
    """The vehicle on the link has nothing of the dive that is asked for: it may be another vehicle."""


class TakenAway(LogError):
    """A file was deleted while it was written, or moved to `place`, which is None for a deleted file."""

    def __init__(self, path: Path, place: str | None) -> None:
        self.path, self.place = path, place
        event = "was deleted" if place is None else f"was moved ({place})"
        super().__init__(f"{event} while it was written; a new file is begun in the folder, made anew", path)


class FitError(SeatrialError):
    """An identification can't be made from the recording `of`."""
