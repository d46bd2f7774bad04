"""Conditions as a person gives them: a text for each, empty for what is not known; and those of last time."""

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path

from bridge.errors import ConfigError
from gcs_plugin.conditions import NOTHING_SAID, Conditions
from gcs_plugin.folder import list_folders

TITLES: Mapping[str, str] = {
    "water_temperature_c": "water temperature, °C",
    "salinity": "salinity (0 fresh, 35 ocean)",
    "tether_out_m": "tether out, m",
    "ballast_kg": "ballast, kg beyond the file's",
    "payload_kg": "payload, kg beyond the file's",
    "payload": "payload, what it is",
    "weather": "weather and sea",
}
"""What a form asks, by field."""


def texts_of(conditions: Conditions) -> dict[str, str]:
    """What a form shows of them, by field."""
    found = {one.name: getattr(conditions, one.name) for one in fields(Conditions)}
    return {name: "" if value is None else f"{value}".removesuffix(".0") for name, value in found.items()}


def of_texts(texts: Mapping[str, str]) -> Conditions:
    """Conditions from a text for each field; one that is missing or empty is not known. Raises ConfigError."""
    values: dict[str, float | str | None] = {}
    for one in fields(Conditions):
        text = " ".join(texts.get(one.name, "").split())
        values[one.name] = text if isinstance(one.default, str) else _number(text, one.name)
    try:
        return Conditions(**values)  # type: ignore[arg-type]
    except ValueError as error:
        raise ConfigError(f"{error}; mend it, or leave it empty where nobody knows") from None


def last_conditions(root: Path, before: Path | None = None) -> Conditions:
    """Those of the newest dive under `root`, earlier than the folder `before`, of which any are known."""
    for folder in reversed(list_folders(root)):
        if before is not None and folder.path.name >= before.resolve().name:
            continue
        try:
            conditions = folder.about().conditions
        except ConfigError:
            continue
        if conditions != NOTHING_SAID:
            return conditions
    return NOTHING_SAID


def _number(text: str, name: str) -> float | None:
    if not text:
        return None
    try:
        return float(text.replace(",", "."))
    except ValueError:
        raise ConfigError(
            f"{name}: '{text}' is no number; give one such as 12.5, or leave it empty"
        ) from None
