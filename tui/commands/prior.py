"""`seatrial prior`: turn accepted identification results into the vehicle file's priors for the next dive."""

import argparse
import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import yaml

from bridge import exit_codes, schema
from bridge.errors import ConfigError
from bridge.text import typed
from bridge.vehicle.coefficients import OF_HULL
from bridge.vehicle.config import CONFIGS, Prior, Vehicle, VehicleFile, load_vehicle
from gcs_plugin.params.files import replace_text
from gcs_plugin.params.identified import doubt_lines
from tui import show
from tui.accepted_priors import accepted_in
from tui.parameter_files import Leave


def run(arguments: argparse.Namespace) -> int:
    file = load_vehicle(arguments.vehicle)
    widen = None if arguments.widen is None else arguments.widen / 100
    leave = Leave(doubts=arguments.despite_doubts)
    read = accepted_in(Path(arguments.file), widen, leave)
    if read.vehicle not in ("", file.vehicle.name):
        raise exit_codes.UsageError(
            f"{arguments.file}: is of vehicle '{read.vehicle}', and {arguments.vehicle} of '{file.vehicle.name}': "
            "nothing was written; give the file of that vehicle"
        )
    configuration, accepted = read.configuration, read.priors
    file.vehicle.configuration_named(configuration)
    present = file.vehicle.configurations[configuration].priors
    weighed = {name for name, prior in present.items() if prior.rests_on == "weight"}
    doubted = {name: why for name, why in read.doubted.items() if name in accepted.keys() - weighed}
    if not arguments.despite_doubts:
        accepted = {name: prior for name, prior in accepted.items() if name not in doubted}
    if not accepted:
        raise exit_codes.UsageError(
            f"{arguments.file}: all that it holds is doubted ({doubt_lines(doubted, tuple(doubted))[0]}): nothing was "
            "written; dive again, or give --despite-doubts"
        )
    priors = merged(present, accepted)
    write(file, configuration, priors)
    console = show.results(arguments.json)
    rows = [
        (
            name,
            show.number(prior.value),
            show.number(prior.std, 2),
            OF_HULL[name].unit,
            prior.rests_on,
            _change(name, present.get(name), prior),
        )
        for name, prior in priors.items()
    ]
    title = f"priors of {file.path}, configuration {configuration}"
    columns = ("name", "value", "std", "unit", "rests on", "is")
    show.put(console, show.Table(title, columns, rows, ("value", "std")))
    refused = "" if arguments.despite_doubts else "; not taken: dive again, or give --despite-doubts"
    show.say(console, *(f"warning: {line}{refused}" for line in doubt_lines(doubted, tuple(doubted))))
    if lost := left_behind(present, priors):
        show.say(console, f"warning: {_lost(lost, present, file.path)}")
    show.write_json({name: vars(prior) for name, prior in priors.items()}, arguments.json)
    return exit_codes.DONE


def _change(name: str, before: Prior | None, prior: Prior) -> str:
    """Describe the change of a coefficient's prior, at the precision of the vehicle file."""
    if before is None:
        return "new"
    if entry(name, before) == entry(name, prior):
        return "as before"
    source = f" ({before.source})" if before.source else ""
    return f"replaces {show.number(before.value)} ± {show.number(before.std, 2)}{source}"


def _lost(names: list[str], present: dict[str, Prior], path: Path) -> str:
    """Warn that earlier dives' information on these coefficients is lost, and say how to keep both."""
    sources = dict.fromkeys(present[name].source or "an earlier dive" for name in names)
    return (
        f"the new values of {', '.join(names)} did not rest on the priors that they replace, so what "
        f"{' and '.join(sources)} told of them is no longer in {path}; to have both, run seatrial prior of the earlier "
        f"identification again, then seatrial identify of this dive with {typed('--vehicle', path)}, then seatrial "
        "prior of that"
    )


def write(file: VehicleFile, configuration: str, priors: dict[str, Prior]) -> None:
    """Write the priors into the vehicle file, after checking that the rest of the new text means the same as before.

    Raises UsageError for a file that is part of seatrial, ConfigError for a file whose layout can't be edited.
    """
    if file.path.resolve().is_relative_to(CONFIGS):
        raise exit_codes.UsageError(f"{file.path}: is part of seatrial; copy it, and give your copy")
    text = with_priors_written(file.path.read_text(encoding="utf-8"), configuration, priors, str(file.path))
    shapes = dict(file.vehicle.configurations)
    rounded = {name: _as_written(entry(name, prior), name) for name, prior in priors.items()}
    shapes[configuration] = replace(shapes[configuration], priors=rounded)
    after = schema.build(Vehicle, yaml.safe_load(text), str(file.path))
    if after != replace(file.vehicle, configurations=shapes):
        raise ConfigError(
            f"{file.path}: is laid out so that priors can't be put in; write them there yourself"
        )
    replace_text(file.path, text)


def _as_written(line: str, name: str) -> Prior:
    """A prior rounded to the digits that the vehicle file holds."""
    return schema.build(Prior, yaml.safe_load(line)[name], name)


def with_priors_written(text: str, configuration: str, priors: dict[str, Prior], where: str) -> str:
    """Return the vehicle file `text` with these `priors`, and no others, in a configuration.

    Raises ConfigError if the file does not put each key on a line of its own; `where` names the file.
    """
    lines = text.splitlines()
    head = _heading(lines, configuration)
    if head is None:
        raise ConfigError(
            f"{where}: configuration '{configuration}' is not written a key a line; put the priors there yourself"
        )
    end = _end_of_block(lines, head)
    children = [_indent(lines[i]) for i in range(head + 1, end) if _says(lines[i])]
    inner = children[0] if children else _indent(lines[head]) + 2
    kept, place = [], head + 1
    skip = False
    for i in range(head + 1, end):
        if _says(lines[i]) and _indent(lines[i]) <= inner:
            skip = lines[i].strip().startswith("priors:")
        if not skip:
            kept.append(lines[i])
    block = [" " * inner + "priors:", *(" " * (inner + 2) + entry(n, p) for n, p in priors.items())]
    return "\n".join([*lines[:place], *block, *kept, *lines[end:]]) + "\n"


def entry(name: str, prior: Prior) -> str:
    """Format a prior as a line of the vehicle file."""
    of_dive = f", dive_sha256: {json.dumps(prior.dive_sha256)}" if prior.dive_sha256 else ""
    opening = f", dive_opening: {json.dumps(prior.dive_opening)}" if prior.dive_opening else ""
    earlier = f", earlier_dives: {json.dumps(prior.earlier_dives)}" if prior.earlier_dives else ""
    return (
        f"{name}: {{value: {prior.value:.6g}, std: {prior.std:.3g}, rests_on: {prior.rests_on}, "
        f"source: {json.dumps(prior.source)}{of_dive}{opening}{earlier}}}"
    )


def _heading(lines: list[str], configuration: str) -> int | None:
    """Index of the line that opens a configuration; None if the configuration has no such line."""
    top = next((i for i, line in enumerate(lines) if line.rstrip() == "configurations:"), None)
    if top is None:
        return None
    for i in range(top + 1, _end_of_block(lines, top)):
        if lines[i].split("#")[0].strip() == f"{configuration}:":
            return i
    return None


def _end_of_block(lines: list[str], head: int) -> int:
    """Index of the first line after `head` that belongs to another block."""
    for i in range(head + 1, len(lines)):
        if _says(lines[i]) and _indent(lines[i]) <= _indent(lines[head]):
            return i
    return len(lines)


def _indent(line: str) -> int:
    return len(line) - len(line.lstrip())


def _says(line: str) -> bool:
    """Whether a line is neither blank nor a comment."""
    return bool(line.strip()) and not line.lstrip().startswith("#")


def merged(present: Mapping[str, Prior], accepted: Mapping[str, Prior]) -> dict[str, Prior]:
    """Replace earlier values by accepted ones, but keep weighed values: a dive is no better force standard."""
    weighed = {name: prior for name, prior in present.items() if prior.rests_on == "weight"}
    both = {**present, **accepted, **weighed}
    return {name: both[name] for name in OF_HULL if name in both}


def left_behind(present: Mapping[str, Prior], after: Mapping[str, Prior]) -> list[str]:
    """Names whose earlier dive is not among the dives of the new prior; a prior that names no dive is not judged."""
    dives_of = {name: set(before.dives) - set(before.earlier_dives) for name, before in present.items()}
    return [
        name
        for name, dives in dives_of.items()
        if name in after and dives and not dives.intersection(after[name].dives)
    ]
