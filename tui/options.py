"""Options of the verbs: those that several verbs share, and the two shapes of the others, a value and a switch."""

import argparse
import math
from typing import Any, ClassVar

from bridge.command_line import above_zero, seconds, seed, size, system
from bridge.links import secured

NO_HUB = "none"
FASTEST = "max"
NONE_ACCEPTED = "none"
RECEIPTS = "receipts"
PARAMETER_SUFFIXES = (".param", ".parm", ".params")
LONGEST_PLAN_MIN = 240
"""A plan of more minutes is simulated for longer than a crew waits, and no battery lasts for it."""


class Target(str):
    """A file that a verb writes. `suffixes`: the endings that it may have, empty for any."""

    suffixes: ClassVar[tuple[str, ...]] = ()


class Output(Target):
    """A file that a verb writes; `-` is standard output."""


class NewFile(str):
    """A file that a verb makes, and that must not be there; empty for one that the verb names."""


class MissionTarget(Target):
    """A file of a mission that a verb writes."""

    suffixes = (".yaml", ".yml")


class ParameterTarget(Target):
    """A parameter file that a verb writes, with its sidecar."""

    suffixes = PARAMETER_SUFFIXES


class PageTarget(Target):
    """A page that a verb writes; a browser shows one of another ending as text."""

    suffixes = (".html", ".htm")


class FolderTarget(str):
    """A folder that a verb writes into, and makes."""


class NewFolder(str):
    """A folder that a verb makes, and that must not be there."""


def speed(text: str) -> float:
    """Parse a speed of simulated time: a positive number, or `max`."""
    if text == FASTEST:
        return math.inf
    try:
        return above_zero(text)
    except argparse.ArgumentTypeError as error:
        raise argparse.ArgumentTypeError(f"{error}, and not {FASTEST}") from None


def planned_minutes(text: str) -> float:
    """Parse the minutes of a plan: a positive number up to LONGEST_PLAN_MIN."""
    minutes = above_zero(text)
    if minutes > LONGEST_PLAN_MIN:
        raise argparse.ArgumentTypeError(
            f"a plan takes {LONGEST_PLAN_MIN} minutes at most, not {text}; plan a longer dive in parts"
        )
    return minutes


def hub_port(text: str) -> int | None:
    """Parse the hub's port: 0 for a free port, None for `none`."""
    if text == NO_HUB:
        return None
    if not text.isdecimal() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"'{text}' is no port from 0 to 65535, and not {NO_HUB}")
    return int(text)


class Options:
    """Adds options to a parser of argparse, or to a group of one."""

    def __init__(self, parser: Any) -> None:
        self.parser = parser

    def value(self, name: str, metavar: str | tuple[str, ...] | None, meaning: str, **more: Any) -> None:
        """Add an option or an argument with a value, which `--help` calls `metavar`; `more` as for argparse.

        A default that is a word or a number other than 0 is named in the help.
        """
        default = more.get("default")
        if default and isinstance(default, str | int | float):
            meaning += f" (default: {default if isinstance(default, str) else format(default, 'g')})"
        self.parser.add_argument(name, metavar=metavar, help=meaning, **more)

    def switch(self, name: str, meaning: str) -> None:
        """Add an option without a value."""
        self.parser.add_argument(name, action="store_true", help=meaning)

    def json(self, content: str = "the result") -> None:
        self.value("--json", "FILE", f"write {content} as JSON; - for standard output", type=Output)

    def columns(self) -> None:
        self.value("--columns", "MAP", "YAML map from the columns of a table, bag or log to signals")

    def figures(self) -> None:
        meaning = "write each figure of the report as SVG and PNG, as wide as a paper's column"
        self.value("--figures", "FOLDER", meaning, type=FolderTarget)

    def seed(self) -> None:
        self.value("--seed", None, "of noise and disturbance", type=seed, default=1)

    def network(self, large: str) -> None:
        """The size of the source paper's network; `large` describes the largest."""
        self.value(
            "--network",
            ("HIDDEN", "DEPTH", "EPOCHS"),
            f"size and training of the paper's network: 1024 5 100 is {large} (default: small)",
            type=size,
            nargs=3,
        )

    def vehicle(self, meaning: str, *, required: bool = False) -> None:
        self.value("--vehicle", "FILE[:CONFIGURATION]", meaning, required=required)

    def vehicle_file(self, meaning: str, *, required: bool = False) -> None:
        """A vehicle file without the choice of a configuration."""
        self.value("--vehicle", "FILE", meaning, required=required)

    def vehicle_of_dive(self) -> None:
        self.vehicle(
            "the vehicle file, or the name of one in configs/vehicles; the recording's VEH_CFG chooses the"
            " configuration unless one is named",
            required=True,
        )

    def despite_doubts(self, meaning: str = "accept an identification that did not converge") -> None:
        self.switch("--despite-doubts", meaning)

    def accepted(self, when: str = "", otherwise: str = "") -> None:
        """The model that a diagnosis starts from, and how much of it."""
        self.value(
            "--accepted",
            "FILE",
            f"{when}the JSON of identify, or a .param with its sidecar, that was accepted earlier; or a vehicle file's "
            f"published model, as our.yaml:open; changes against it are reported too{otherwise}",
        )
        self.despite_doubts("of --accepted, also take doubted values")

    def link(self, meaning: str = "the link to the vehicle (default: that of the running recording)") -> None:
        self.value("--link", "SPEC", meaning)
        self.sign_key()

    def links(self, meaning: str) -> None:
        """Any number of links, and the key that signs them."""
        self.value("--link", "SPEC", meaning, action="append", default=[])
        self.sign_key()

    def sign_key(self) -> None:
        secured.add_argument(self.parser)

    def system(self, meaning: str = "its MAVLink system, if several vehicles are heard") -> None:
        self.value("--system", "N", meaning, type=system)

    def takes_dive(self) -> None:
        self.value("--out", "FOLDER", "folder for the dive folder", default="dives")

    def receipts(self, meaning: str) -> None:
        """The folder of the uploaded values."""
        self.value("--receipts", "FOLDER", meaning, default=RECEIPTS)

    def report(self, meaning: str) -> None:
        """A page, and its figures as files."""
        self.value("--report", "HTML", meaning, type=PageTarget)
        self.figures()

    def out(self, meaning: str, default: str) -> None:
        """The folder that it writes into."""
        self.value("--out", "FOLDER", meaning, type=FolderTarget, default=default)

    def positive(self, name: str, metavar: str, meaning: str, default: float | None = None) -> None:
        self.value(name, metavar, meaning, type=above_zero, default=default)

    def plan_minutes(self, meaning: str) -> None:
        """How long the plan may take."""
        self.value("--minutes", "N", meaning, type=planned_minutes, default=5.0)

    def seconds(self, meaning: str, default: float | None = None) -> None:
        self.value("--seconds", "N", meaning, type=seconds, default=default)

    def yes(self) -> None:
        self.switch("--yes", "do not ask")
