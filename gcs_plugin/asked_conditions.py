"""A dive's conditions as entered in a form: a text for each field, empty if not known; and those of the last dive."""

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path

from bridge.errors import ConfigError
from gcs_plugin.conditions import LIMITS, NOTHING_SAID, Conditions, why_not
from gcs_plugin.dive_order import order, recordings
from gcs_plugin.folder import described_folders

TITLES: Mapping[str, str] = {
    "water_temperature_c": "water temperature, °C",
    "salinity": "salinity (0 fresh, 35 ocean)",
    "tether_out_m": "tether out, m",
    "ballast_kg": "ballast, kg beyond the file's",
    "payload_kg": "payload, kg beyond the file's",
    "payload": "payload, what it is",
    "weather": "weather and sea",
}
"""Labels of the form, by field."""


def texts_of(conditions: Conditions) -> dict[str, str]:
    """Texts of the conditions for a form, by field."""
    values = {field.name: getattr(conditions, field.name) for field in fields(Conditions)}
    return {name: "" if value is None else f"{value}".removesuffix(".0") for name, value in values.items()}


def mistakes(texts: Mapping[str, str]) -> dict[str, str]:
    """Error sentence for each field with an invalid text; empty if all texts are valid."""
    sentences = {name: _mistake(name, _bare(texts, name)) for name in LIMITS}
    return {name: sentence for name, sentence in sentences.items() if sentence}


def of_texts(texts: Mapping[str, str]) -> Conditions:
    """Conditions from the texts; a field whose text is missing or empty is not known.

    Raises ConfigError for invalid texts.
    """
    if wrong := mistakes(texts):
        raise ConfigError(". ".join(f"{name}: {sentence}" for name, sentence in wrong.items()))
    values: dict[str, float | str | None] = {}
    for field in fields(Conditions):
        text = _bare(texts, field.name)
        values[field.name] = text if field.name not in LIMITS else _number(text) if text else None
    return Conditions(**values)  # type: ignore[arg-type]


def last_conditions(root: Path, before: Path | None = None) -> Conditions:
    """Conditions of the newest dive under `root` that has any; with `before`, of the dives earlier than that folder."""
    # A dive without a recording so far is later than all others.
    last = order(before) if before is not None and recordings(before) else None
    for folder in reversed(described_folders(root)):
        if before is not None and folder.path.resolve() == before.resolve():
            continue
        if last is not None and order(folder.path) >= last:
            continue
        try:
            conditions = folder.about().conditions
        except ConfigError:
            continue
        if conditions != NOTHING_SAID:
            return conditions
    return NOTHING_SAID


def _bare(texts: Mapping[str, str], name: str) -> str:
    return " ".join(texts.get(name, "").split())


def _number(text: str) -> float:
    """Number in a text, with a decimal point or comma. Raises ValueError."""
    return float(text.replace(",", "."))


def _mistake(name: str, text: str) -> str:
    """Error sentence for the text of a number, "" if it is valid or empty."""
    if not text:
        return ""
    try:
        why = why_not(name, _number(text))
    except ValueError:
        return f"'{text}' is no number; give one such as 12.5, or leave it empty"
    return why and f"{why}; mend it, or leave it empty"
