"""`seatrial conditions`: show or note the conditions of a dive."""

import argparse
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

from bridge import exit_codes

if TYPE_CHECKING:
    from gcs_plugin.dives.folder import About, DiveFolder

EXAMPLE = (
    "seatrial conditions dives/2026-11-20T0912Z-hovering --water-temperature 11.5 --salinity 35 --ballast 2"
)
OPTIONS = {
    "water_temperature_c": ("--water-temperature", "C", "of the water"),
    "salinity": ("--salinity", "S", "practical: 0 for fresh water, 35 for the ocean"),
    "tether_out_m": ("--tether-out", "M", "length of tether in the water"),
    "ballast_kg": (
        "--ballast",
        "KG",
        "mass in air beyond the vehicle file's dry mass; below 0 for what is off",
    ),
    "payload_kg": ("--payload-mass", "KG", "likewise, of what it carries"),
    "payload": ("--payload", "TEXT", "what it carries"),
    "weather": ("--weather", "TEXT", "wind and sea"),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "dive",
        nargs="?",
        metavar="DIVE",
        help="a dive folder (default: the dive that is being recorded, else the newest in dives)",
    )
    for name, (option, metavar, sentence) in OPTIONS.items():
        parser.add_argument(option, dest=name, metavar=metavar, help=f'{sentence}; "" for not known')
    parser.add_argument("--same", action="store_true", help="as in the dive before, but for what is given")
    parser.add_argument("--json", metavar="FILE", help="write them as JSON; - for standard output")


def run(arguments: argparse.Namespace) -> int:
    from bridge.errors import ConfigError
    from gcs_plugin.dives.conditions import NOTHING_SAID, mistakes, of_texts, texts_of
    from gcs_plugin.dives.folder import last_conditions
    from tui import show
    from tui.files import check_file

    check_file("--json", arguments.json)
    folder = _folder(arguments.dive)
    given = {name: getattr(arguments, name) for name in OPTIONS if getattr(arguments, name) is not None}
    if wrong := mistakes(given):
        raise ConfigError(". ".join(f"{OPTIONS[name][0]}: {sentence}" for name, sentence in wrong.items()))
    before = last_conditions(folder.path.resolve().parent, folder.path)
    if given or arguments.same:

        def added(about: "About") -> "About":
            known = before if arguments.same else about.conditions
            return replace(about, conditions=of_texts(texts_of(known) | given))

        folder.change(added)
    conditions = folder.about().conditions
    show.write_json(asdict(conditions) | {"density_kg_m3": conditions.density_kg_m3}, arguments.json)
    console = show.results(arguments.json)
    show.say(console, f"{folder.path}: {conditions.words or 'no conditions are noted'}")
    if conditions.density_kg_m3 is not None:
        show.say(console, f"water of {conditions.density_kg_m3:.1f} kg/m3")
    if conditions == NOTHING_SAID and before != NOTHING_SAID:
        show.say(console, f"in the dive before: {before.words}; --same takes that")
    return exit_codes.DONE


def _folder(given: str | None) -> "DiveFolder":
    """Return the dive in question. Raises LogError or UsageError if there is none, LinkError if its recorder hangs."""
    from gcs_plugin.dives.folder import DiveFolder, find_folder, list_folders
    from tui.links import usable_now

    if given is not None:
        return find_folder(Path(given))
    holding = usable_now()
    if holding is not None:
        return DiveFolder(Path(holding.folder))
    dives = list_folders(Path("dives"))
    if not dives:
        raise exit_codes.UsageError("no recording runs, and dives holds none; give the folder of a dive")
    return dives[-1]
