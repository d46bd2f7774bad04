"""The model that a vehicle flew with, as a diagnosis takes it for accepted: read from the sidecar of its upload."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from bridge import schema
from bridge.errors import ConfigError, LogError
from bridge.files import read_small
from bridge.plain import from_json
from bridge.vehicle.coefficients import BY_NAME, OF_HULL, AcceptedEffect
from bridge.vehicle.config import Configuration, Prior
from identify.diagnose.words.causes import effects_words
from identify.priors import values_sent
from identify.run.diagnose import Before
from identify.words import listed


def before_in_force(sidecar: Mapping[str, Any], since_utc: str, shape: Configuration) -> Before:
    """The model of a sidecar, with a note that it is taken as accepted and since when (UTC text) it is in force.

    The vehicle flies with its effects, doubted or not. A value that its identification doubts is left out: its
    error would be reported as a change of the vehicle. Raises ConfigError for a sidecar that is none.
    """
    try:
        effects = tuple(schema.build(AcceptedEffect, each, "effects") for each in sidecar.get("effects", ()))
        intervals = [
            (each["coefficient"], float(each["low95"]), float(each["high95"]))
            for each in sidecar["intervals"].values()
        ]
        doubted, dived = dict(sidecar.get("doubted", {})), str(sidecar.get("dived", ""))
        values = values_sent(intervals, float(sidecar.get("thrust_shift", 0.0)), with_effects=bool(effects))
        source = f"{sidecar['dive']} of {dived}, {sidecar['method']}"
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise ConfigError(f"no sidecar of a parameter file ({error!r})") from None
    hull = BY_NAME if shape.damping == "linear" else OF_HULL
    priors = {
        name: Prior(value, value * std, source, "thrust", str(sidecar.get("dive_sha256", "")))
        for name, (value, std) in values.items()
        if name in hull and name not in doubted
    }
    left_out = sorted(name for name in values if name in doubted)
    more = (
        (f"Of what is in force, {listed(left_out)} is doubted, and not held against this dive.",)
        if left_out
        else ()
    )
    return Before(priors or None, effects, (_note(effects, since_utc), *more))


def _note(effects: Iterable[AcceptedEffect], since_utc: str) -> str:
    since = since_utc[:16].replace("T", " ")
    return (
        f"In force since {since} UTC by the receipts, and taken as accepted: {effects_words(effects)}; --accepted none "
        "leaves it out."
    )


def read_in_force(sidecar: Path, since_utc: str, shape: Configuration, configuration: str) -> Before:
    """As `before_in_force`, from the sidecar's file; an empty one if it is of another configuration.

    Raises LogError for a file that can't be read, ConfigError for one that is no sidecar.
    """
    try:
        data = from_json(read_small(sidecar))
    except (OSError, ValueError) as error:
        raise LogError(f"can't be read ({error})", sidecar) from None
    if not isinstance(data, dict):
        raise ConfigError(f"{sidecar}: no sidecar of a parameter file")
    if data.get("configuration") != configuration or not data.get("effects"):
        return Before()
    return before_in_force(data, since_utc, shape)
