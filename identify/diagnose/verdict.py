"""The verdict on a dive, and what to dive next."""

from collections.abc import Sequence

from bridge.effects.effect import Effect
from identify.diagnose.diagnosis import Found, Next, Verdict
from identify.diagnose.generic import Left, Shape, beyond_chance

SENSORS = (
    "voltage",
    "shaft speed",
    "accelerometer",
    "satellite",
    "temperature",
    "recorded",
    "log of",
    "current beside",
)
"""Words by which what tells causes apart is a reading, and no manoeuvre."""


FORM_SHARE = 0.02
"""Of what causes save, what the form of one may leave: one that is right to a seventh of its force leaves so much."""


def unexplained(left: Left) -> tuple[Shape, ...]:
    """The generic forces that foretell more of what is left than chance would let them, strongest first."""
    least = FORM_SHARE * left.explained
    return tuple(
        shape
        for shape, gain in zip(left.shapes, left.gains, strict=True)
        if beyond_chance(shape, gain) and gain > least
    )


def is_unknown(left: Left) -> bool:
    """Whether anything is left that chance would not leave."""
    return bool(unexplained(left))


def verdict_of(found: Sequence[Found], left: Left) -> Verdict:
    if is_unknown(left):
        return "unknown"
    if not found:
        return "no_gap"
    return "ambiguous" if any(one.also for one in found) else "explained"


def next_of(found: Sequence[Found], library: Sequence[Effect]) -> Next | None:
    """What would tell the causes apart that this dive can't; None where it can."""
    doubtful = [one for one in found if one.also]
    if not doubtful:
        return None
    by_name = {effect.name: effect for effect in reversed(library)}
    names = [name for one in doubtful for name in (one.name, *one.also)]
    parts = [part for name in names if name in by_name for part in by_name[name].told_apart.split("; ")]
    parts = list(dict.fromkeys(parts))
    sensors = [part for part in parts if any(word in part for word in SENSORS)]
    manoeuvres = [part for part in parts if part not in sensors]
    return Next("; ".join(manoeuvres), "; ".join(sensors), tuple(dict.fromkeys(names)))
