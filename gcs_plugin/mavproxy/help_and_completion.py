# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands of the MAVProxy module with their help, and the completions of their words."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Final

from bridge.vehicle.config import shipped_vehicles
from gcs_plugin.dives.recordings import MADE_ELSEWHERE
from gcs_plugin.params.files import SUFFIXES

HELP: Final = {
    "status": ("status", "vehicles, links, alarms, how far it is off its model, recording, and what runs"),
    "record": (
        "record start [FOLDER] | record next | record stop | record note TEXT",
        "every frame of every link, both ways, into a dive folder in FOLDER (dives); next goes on in a new one and "
        "loses no frame; where MAVProxy is connected through `seatrial record`, next and note act on that recording",
    ),
    "identify": (
        "identify [DIVE] [OPTION ...]",
        "identify a dive, the last that is over if none is given; leaves identified.json and identified.param in the "
        "dive folder; options: --vehicle, --method, --columns, --json, --param, --report",
    ),
    "diagnose": (
        "diagnose [DIVE] [--check DIVE] [OPTION ...]",
        "diagnose a dive likewise; leaves diagnosis.json and diagnosis.html in the dive folder; options: --vehicle, "
        "--without, --accepted none or FOLDER of receipts, which tell what was in force, --columns, --json, --report",
    ),
    "cancel": ("cancel", "end what runs: identify, diagnose, params, or ff"),
    "params": (
        "params diff FILE | params upload FILE [NAME ...] [despite-doubts] [--accept-implausible NAME ...] | "
        "params yes CODE | params rollback [FILE] [armed]",
        "compare a .param with the vehicle; upload shows the plan and the CODE that writes it, all lines or some; "
        "rollback brings back at once the values before an upload, without FILE the last one that stands",
    ),
    "ff": (
        "ff off | ff shadow|ff|both | ff yes MODE [armed]",
        "the feed-forward: off at once, and again until the vehicle says so; another mode by `ff yes` and its name",
    ),
    "vehicle": ("vehicle [N|any]", "which system is meant where several beat; any: the only one"),
    "file": ("file [NAME[:CONFIGURATION]]", "the vehicle file, for recordings, identify and diagnose"),
    "help": ("help [COMMAND]", "this"),
}
USAGE: Final = f"usage: seatrial {' | '.join(HELP)}"

COMPLETIONS: Final = [
    "status",
    "record start (SEATRIAL_FOLDER)",
    "record next",
    "record stop",
    "record note",
    "identify (SEATRIAL_DIVE)",
    "diagnose (SEATRIAL_DIVE) --check (SEATRIAL_DIVE)",
    "diagnose --check (SEATRIAL_DIVE)",
    "cancel",
    "params <diff|upload> (SEATRIAL_PARAM) <despite-doubts>",
    "params rollback (SEATRIAL_PARAM) <armed>",
    "params yes",
    "ff <off|shadow|ff|both>",
    "ff yes <shadow|ff|both> <armed>",
    "vehicle (SEATRIAL_VEHICLE)",
    "file (SEATRIAL_FILE)",
    f"help <{'|'.join(HELP)}>",
]


def help_lines(command: str | None) -> list[str]:
    if command is not None and command not in HELP:
        return [f"there is no command '{command}'; {USAGE}"]
    rows = [HELP[command]] if command is not None else HELP.values()
    return [line for usage, sentence in rows for line in (f"seatrial {usage}", f"    {sentence}")]


def _files(suffixes: Sequence[str], text: str) -> list[str]:
    """Completions of `text` by files with one of the suffixes, dive folders, and folders on the way to them."""
    stem = text.rpartition("/")[0]
    folder = Path(stem or ("/" if text.startswith("/") else "."))
    # Text that is already complete must be in the list: only then does MAVProxy complete the next word.
    completions = [text.rstrip("/"), text] if text and Path(text).exists() else []
    if not folder.is_dir():
        return completions
    for path in sorted(folder.iterdir()):
        name = f"{text[: len(text) - len(text.rpartition('/')[2])]}{path.name}"
        if not name.startswith(text) or name in completions:
            continue
        if path.is_dir():
            completions.append(name if (path / "telemetry.tlog").exists() else f"{name}/")
        elif path.suffix.lower() in suffixes:
            completions.append(name)
    return completions


def _vehicle_files(text: str) -> list[str]:
    """Completions of a vehicle file: those that come with seatrial, and YAML files."""
    return [*shipped_vehicles(), *_files((".yaml",), text)]


COMPLETERS: Final[Mapping[str, Callable[[str], list[str]]]] = {
    "(SEATRIAL_DIVE)": partial(_files, (".tlog", ".gz", *MADE_ELSEWHERE)),
    "(SEATRIAL_PARAM)": partial(_files, SUFFIXES),
    "(SEATRIAL_FOLDER)": partial(_files, ()),
    "(SEATRIAL_FILE)": _vehicle_files,
}
"""Completions of a word, by its place in COMPLETIONS."""
