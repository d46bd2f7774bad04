"""Words and numbers for readers: lists, capitals, dates, units, digits as the interval allows, text safe for HTML."""

import html
import math
import re
from collections.abc import Sequence
from datetime import UTC, datetime

from bridge.text import printable
from bridge.vehicle.coefficients import DOFS

MISSING = "—"
MINUS = "−"


def safe(text: str) -> str:
    """`text` for HTML, quotes escaped; control, direction and surrogate characters become a visible mark."""
    return html.escape(printable(text, "\N{REPLACEMENT CHARACTER}", "\n\t"), quote=True)


def decimals_for(spread: float) -> int:
    """Decimals that leave two significant digits of `spread`; negative for tens and hundreds."""
    return 1 - math.floor(math.log10(spread))


def fixed(value: float, decimals: int) -> str:
    """`value` rounded to `decimals`, which may be negative; a dash for NaN or infinity."""
    if not math.isfinite(value):
        return MISSING
    rounded = round(value, decimals)
    return f"{rounded + 0.0:.{max(decimals, 0)}f}".replace("-", MINUS)


def decimals_of(value: float, digits: int) -> int:
    """Decimals that leave `digits` significant digits of a finite `value`; negative for tens and hundreds."""
    rounded = float(f"{value:.{digits - 1}e}")
    return digits - 1 - math.floor(math.log10(abs(rounded))) if rounded else 0


def significant(value: float, digits: int = 3) -> str:
    """`value` with `digits` significant digits, written out, never as a power of ten."""
    return fixed(value, decimals_of(value, digits)) if math.isfinite(value) else MISSING


def nice_step(least: float) -> float:
    """The smallest of 1, 2, 5 times a power of ten that is at least `least`; 1 for 0."""
    if least <= 0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(least))
    return next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= least * (1 - 1e-9))


def with_interval(value: float, low: float, high: float) -> tuple[str, str]:
    """A value and its interval, both with the decimals that the interval's half width justifies."""
    half = (high - low) / 2
    if not math.isfinite(half) or half <= 0:
        return significant(value, 4), MISSING
    decimals = decimals_for(half)
    return fixed(value, decimals), f"{fixed(low, decimals)} to {fixed(high, decimals)}"


def speed(value: float, per: str) -> str:
    """A speed or an error of it, from m/s or rad/s (`per`): `6.1 mm/s`, `0.17 deg/s`."""
    scale, shown = speed_unit(per)
    return f"{significant(scale * value, 2)} {shown}" if math.isfinite(value) else MISSING


def speed_unit(per: str) -> tuple[float, str]:
    """Factor and unit in which a reader gets small speeds in m/s or rad/s (`per`)."""
    return (math.degrees(1.0), "deg/s") if per == "rad/s" else (1e3, "mm/s")


def unbroken(sentence: str) -> str:
    """The sentence for a page: units with raised powers, and no line breaks between a number and its unit, about an
    arrow, or within NO-GO."""
    whole = raised(sentence).replace(" -> ", "\N{NO-BREAK SPACE}→\N{NO-BREAK SPACE}")
    return with_units(whole.replace("NO-GO", "NO\N{NON-BREAKING HYPHEN}GO"), "\N{NO-BREAK SPACE}")


def with_units(sentence: str, glue: str) -> str:
    """The sentence with `glue` for the space between a number and its unit."""
    return re.sub(r"(?<=\d) (?=%|mm/s|m/s|deg/s|rad/s|°/s|(?:s|ms|m|mm|kg|N|V|Hz)\b)", glue, sentence)


def count(number: int) -> str:
    """A whole number in groups of three digits."""
    return f"{number:,}".replace(",", "\N{NO-BREAK SPACE}")


def unit(text: str) -> str:
    """A unit with its powers raised: `N s2/m2` becomes `N s²/m²`."""
    return re.sub(r"(?<=[a-z])[23]", lambda power: {"2": "²", "3": "³"}[power[0]], text)


def raised(sentence: str) -> str:
    """The sentence with the powers of a unit after a number raised, as in `14 kg m²`."""
    return re.sub(r"(?<=\d )(?:kg m2|kg/m3|m/s2|N s2/m2|N m s2)\b", lambda power: unit(power[0]), sentence)


def unit_after(text: str) -> str:
    """A unit after a number; empty for a bare number."""
    return "" if text in ("", "1") else f" {unit(text)}"


def seconds(duration_s: float) -> str:
    """A duration with its unit: `0.34 s`, `41.2 s`, `16 min 40 s`."""
    if duration_s < 100:
        return f"{significant(duration_s, 2 if duration_s < 10 else 3)} s"
    minutes, seconds_left = divmod(round(duration_s), 60)
    return f"{minutes} min {seconds_left} s" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"


def listed(names: Sequence[str]) -> str:
    """`surge, sway and yaw`; "" for nothing."""
    return " and ".join(filter(None, (", ".join(names[:-1]), *names[-1:])))


def axes_named(dofs: Sequence[int]) -> str:
    """Axes in words: surge, sway and yaw."""
    return listed([DOFS[dof] for dof in dofs])


def capital(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}"


def utc(unix_s: float | None) -> str:
    """`2026-11-20 09:12`; a dash for a dive without a date."""
    return "-" if unix_s is None else f"{datetime.fromtimestamp(unix_s, UTC):%Y-%m-%d %H:%M}"
