"""`seatrial conditions`: show or note the conditions of a dive."""

import argparse
from dataclasses import asdict, replace
from pathlib import Path

from bridge import exit_codes
from bridge.errors import ConfigError
from gcs_plugin.dives.conditions import NOTHING_SAID, mistakes, of_texts, texts_of
from gcs_plugin.dives.folder import About, DiveFolder, find_folder, last_conditions, list_folders
from tui import links, show
from tui.verbs import CONDITIONS


def run(arguments: argparse.Namespace) -> int:
    folder = _folder(arguments.dive)
    given = {name: getattr(arguments, name) for name in CONDITIONS if getattr(arguments, name) is not None}
    if wrong := mistakes(given):
        raise ConfigError(". ".join(f"{CONDITIONS[name][0]}: {sentence}" for name, sentence in wrong.items()))
    before = last_conditions(folder.path.resolve().parent, folder.path)
    if arguments.same and before == NOTHING_SAID:
        raise ConfigError(
            f"--same: no dive before {folder.path} has any; leave it out, and give them one by one"
        )
    if given or arguments.same:

        def added(about: About) -> About:
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


def _folder(given: str | None) -> DiveFolder:
    """Return the dive in question. Raises LogError or UsageError if there is none, LinkError if its recorder hangs."""
    if given is not None:
        return find_folder(Path(given))
    holding = links.usable_now()
    if holding is not None:
        return DiveFolder(Path(holding.folder))
    dives = list_folders(Path("dives"))
    if not dives:
        raise exit_codes.UsageError("no recording runs, and dives holds none; give the folder of a dive")
    return dives[-1]
