"""Writes priors into the text of a vehicle file and leaves everything else in it, comments included, unchanged."""

import json
from collections.abc import Mapping

from bridge.errors import ConfigError
from bridge.vehicle.config import Prior


def with_priors_written(text: str, configuration: str, priors: Mapping[str, Prior], where: str) -> str:
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
