"""An axis of dates, UTC: ticks at whole hours, days or months, few enough for a telephone."""

from collections.abc import Callable
from datetime import UTC, datetime

from identify.report.axes import Axis

HOUR_S, DAY_S = 3600, 86400
MOST_TICKS = 5
AIR = 0.05
SHORTEST_S = HOUR_S

_EVEN_STEPS_S = tuple(
    [hours * HOUR_S for hours in (1, 2, 3, 6, 12)] + [days * DAY_S for days in (1, 2, 4, 7, 14)]
)
_MONTH_STEPS = (1, 2, 3, 6, 12, 24, 60, 120, 600)


def date_axis(first_s: float, last_s: float) -> Axis:
    """An axis around the Unix times from `first_s` to `last_s`, with a little air; its title names both days."""
    title = f"{_when(first_s):%Y-%m-%d} to {_when(last_s):%Y-%m-%d}, UTC"
    air = max(AIR * (last_s - first_s), SHORTEST_S / 2 if last_s - first_s < SHORTEST_S else 0.0)
    low, high = first_s - air, last_s + air
    for step in _EVEN_STEPS_S:
        if int(high) // step - (-(-int(low) // step)) < MOST_TICKS:
            return Axis(title, low, high, _even(low, high, step))
    return Axis(title, low, high, _months(low, high))


def _even(low: float, high: float, step_s: int) -> tuple[tuple[float, str], ...]:
    first = -(-int(low) // step_s) * step_s
    label: Callable[[datetime], str] = _hour if step_s < DAY_S else _day
    return tuple((float(t), label(_when(t))) for t in range(first, int(high) + 1, step_s))


def _months(low: float, high: float) -> tuple[tuple[float, str], ...]:
    first, last = _when(low), _when(high)
    for step in _MONTH_STEPS:
        months = range(first.year * 12 // step * step, last.year * 12 + 12, step)
        starts = (datetime(month // 12, month % 12 + 1, 1, tzinfo=UTC) for month in months)
        inside = [start for start in starts if low <= start.timestamp() <= high]
        if len(inside) <= MOST_TICKS:
            break
    form = "%b" if first.year == last.year else "%b %y" if step < 12 else "%Y"
    return tuple((start.timestamp(), f"{start:{form}}") for start in inside)


def _hour(when: datetime) -> str:
    return f"{when:%H:%M}" if when.hour else _day(when)


def _day(when: datetime) -> str:
    return f"{when.day} {when:%b}"


def _when(unix_s: float) -> datetime:
    return datetime.fromtimestamp(unix_s, UTC)
