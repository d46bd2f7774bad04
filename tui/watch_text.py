"""The picture of a vehicle as text: tables, a line a second, plain data."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from typing import Any

from rich.console import Group, RenderableType
from rich.text import Text

from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.mode import word_of
from gcs_plugin.monitor.gap import Gap, in_units, worst
from gcs_plugin.recording.state import Holding
from gcs_plugin.watch.alarms import user_file
from gcs_plugin.watch.picture import (
    Armed,
    Condition,
    Freshness,
    LinkRow,
    Picture,
    SensorRow,
    ThrusterRow,
    Trace,
)
from tui import show
from tui.app.drawing import SHOWN_IN, cut, left

LINE = 110
"""Characters of a line in a pipe, behind its time."""
ROWS_BESIDE = 3
"""Of a table, beside its own: the columns' names, a rule, and an empty one below."""

LOSSY = 0.01
GONE = "--"
NO_READING = "none"
DECIMALS = {"m/s": 2, "deg/s": 1, "m": 2, "V": 1, "A": 1}
VELOCITIES = ("u", "v", "w", "r")
POOR = (Condition.BAD, Condition.MISSING)


def screen(
    picture: Picture, holding: Holding | None, width: int, height: int, fault: str = ""
) -> RenderableType:
    """Return the tables for a terminal, with stale rows dimmed; `fault` says why nothing arrives.

    Where the terminal has fewer rows, it cuts the last tables off: what is wrong stands above them then.
    """
    shown = tables(picture)
    sentences = header(picture, holding, fault)
    if len(sentences) + sum(len(table.rows) + ROWS_BESIDE for table in shown) > height:
        sentences = list(dict.fromkeys((*sentences, *trouble(picture))))
    text = Text(no_wrap=True, overflow="ellipsis")
    for number, sentence in enumerate(sentences):
        loud = 0 < number <= len(picture.alarms)
        text.append(f"{sentence}\n", style="bold reverse" if loud else "bold" if number == 0 else "")
    parts: list[RenderableType] = [text]
    for table in shown:
        parts += [table.drawn(width), ""]
    return Group(*parts)


def valued(value: float, unit: str, age_s: float, freshness: Freshness) -> str:
    """Format a number, without its unit."""
    if freshness is Freshness.GONE:
        return GONE
    unit, factor = SHOWN_IN.get(unit, (unit, 1.0))
    value *= factor
    if not math.isfinite(value):
        text = NO_READING
    elif unit == "deg":
        text = str(round(value) % 360)
    else:
        text = f"{value:z.{DECIMALS[unit]}f}"
    return text if freshness is Freshness.FRESH else f"{text} ({age_s:.1f} s old)"


def now_of(trace: Trace) -> str:
    value = float(trace.value[-1]) if len(trace.value) else math.nan
    return valued(value, trace.unit, trace.age_s, trace.freshness)


def asked_of(trace: Trace) -> str:
    """The reference now; empty if there is none, or if it is as old as a value that is not fresh."""
    fresh = trace.freshness is Freshness.FRESH
    if trace.reference is None or not fresh or not math.isfinite(trace.reference[-1]):
        return ""
    return valued(float(trace.reference[-1]), trace.unit, 0.0, Freshness.FRESH)


def against_reference(trace: Trace) -> str:
    """Value and reference as `0.29/0.30`, or the value alone."""
    reference = asked_of(trace)
    return f"{now_of(trace)}/{reference}" if reference else now_of(trace)


def armed_words(picture: Picture) -> str:
    """The armed state; if no heartbeat came for a while, with its age."""
    lost = picture.links and picture.links[0].lost
    if picture.armed is Armed.UNKNOWN or not lost:
        return picture.armed.value
    return f"{picture.armed.value} {picture.armed_age_s:.0f} s ago"


def gap_now(picture: Picture) -> Gap | None:
    """The gap of a vehicle that is heard: that of one that is not has no age."""
    return None if picture.links and picture.links[0].lost else picture.gap


def link_words(row: LinkRow) -> str:
    """`LINK 0.4 s loss 2 % 284 Hz sys 1/1`."""
    if row.age_s == math.inf:
        return f"LINK without HEARTBEAT  {row.rate_hz:.0f} Hz  sys {row.system}/{row.component}"
    if row.lost:
        return f"LINK LOST {row.age_s:.0f} s  sys {row.system}/{row.component}"
    return f"LINK {row.age_s:.1f} s{loss_of(row)}  {row.rate_hz:.0f} Hz  sys {row.system}/{row.component}"


def mode_words(picture: Picture) -> str:
    """Mode of the feed-forward; empty if the vehicle never reported it."""
    mode = picture.ff_mode
    if mode is None:
        return ""
    return f"FF {word_of(mode)}" + (
        f" {picture.ff_mode_age_s:.0f} s ago" if picture.ff_mode_age_s > 3.0 else ""
    )


def recording_words(holding: Holding | None) -> str:
    """Whether a recording runs, and how long the disk will last."""
    if holding is None:
        return "NOT RECORDING"
    lasts = f"  {left(holding.disk_left_s)}" if math.isfinite(holding.disk_left_s) else ""
    lost = f"  {holding.lost} LOST" if holding.lost else ""
    refused = f"  {holding.refused}" if holding.refused else ""
    if holding.unwritten:
        return f"NOT WRITTEN: {holding.unwritten}  {holding.waiting} frames wait{lost}{refused}"
    return f"REC {holding.frames} frames  {holding.bytes / 1e6:.1f} MB{lost}{refused}{lasts}"


def trouble(picture: Picture) -> list[str]:
    """All problems, the worst first; none are known before the vehicle's first heartbeat."""
    if picture.armed is Armed.UNKNOWN:
        return []
    rows = sorted(
        (row for row in picture.sensors if row.condition not in (Condition.OK, Condition.AWAITED)),
        key=lambda row: POOR.index(row.condition) if row.condition in POOR else len(POOR),
    )
    return [*filter(None, (picture.twins, picture.wrong_file)), *(f"{row.name}: {row.words}" for row in rows)]


def line(picture: Picture, holding: Holding | None, fault: str = "") -> str:
    """The vehicle in LINE characters: its state, alarms, troubles, and as many values as fit;
    `fault` says why nothing comes."""
    traces = picture.traces
    gap = gap_now(picture)
    axis = None if gap is None else worst(gap)
    words = [
        armed_words(picture),
        link_briefly(picture.links[0]) if picture.links else "NO LINK",
        "NOT RECORDING" if holding is None else "NOT WRITTEN" if holding.unwritten else "REC",
        *alarm_words(picture),
        fault,
        mode_words(picture),
        *trouble(picture),
    ]
    values = [
        f"depth {against_reference(traces['depth'])} m",
        " ".join(f"{key} {against_reference(traces[key])}" for key in VELOCITIES) + " deg/s",
        "" if axis is None else "{} {}/{} {} off".format(DOFS[axis.dof], *in_units(axis)),
        f"{now_of(traces['voltage'])} V",
    ]
    said = cut(" | ".join(filter(None, words)), LINE)
    for value in values:
        is_known = any(map(str.isdigit, value))
        said = f"{said} | {value}" if is_known and len(said) + 3 + len(value) <= LINE else said
    return said


def loss_of(row: LinkRow) -> str:
    return "" if math.isnan(row.loss) else f"  loss {row.loss:.0%}"


def link_briefly(row: LinkRow) -> str:
    """`LINK LOST 5 s` or `loss 12 %`; empty for a link that loses next to nothing."""
    if row.lost:
        return "LINK without HEARTBEAT" if row.age_s == math.inf else f"LINK LOST {row.age_s:.0f} s"
    return f"loss {row.loss:.0%}" if row.loss >= LOSSY else ""


def alarm_words(picture: Picture) -> list[str]:
    """A line for each alarm, the gravest first."""
    return [f"ALARM {alarm.words}" for alarm in picture.alarms]


def unset_words(picture: Picture) -> str:
    """Which alarms are switched off, and what sets them; "" for none."""
    unset = ", ".join(kind.value for kind in picture.unset)
    return f"no alarm is set for {unset}: give limits in {user_file()}" if unset else ""


def header(picture: Picture, holding: Holding | None, fault: str = "") -> list[str]:
    """Armed state, alarms, links and recording, a line each; `fault` says why nothing comes."""
    first = [armed_words(picture), mode_words(picture), picture.configuration]
    links = [f"{link_words(row)}  {row.name}" for row in picture.links] or ["NO LINK"]
    holds = [said for said in picture.said if not said.past]
    lacks = f"not compared with its model: {picture.lacks}" if picture.gap is None and picture.lacks else ""
    texts = [f"{said.severity_word}: {said.text}" for said in holds[-3:]]
    return [
        "  ".join(filter(None, first)),
        *alarm_words(picture),
        *links,
        recording_words(holding),
        *filter(
            None,
            (
                fault,
                picture.twins,
                picture.wrong_file,
                lacks,
                "" if holding else picture.hidden,
                unset_words(picture),
            ),
        ),
        *texts,
    ]


def sensor_table(picture: Picture) -> show.Table:
    """Each sensor, its rate and age, and its problem, if any."""
    rows = [
        (
            row.name,
            row.condition.value,
            show.number(row.rate_hz or None, 3),
            show.number(row.expected_hz, 3),
            f"{row.age_s:.1f}" if math.isfinite(row.age_s) else GONE,
            row.words,
        )
        for row in picture.sensors
    ]
    columns = ("sensor", "state", "Hz", "expected", "age s", "")
    return show.Table("", columns, rows, numbers=columns[2:5], stale=_stale(picture.sensors))


def quantity_table(picture: Picture) -> show.Table:
    rows = [
        (key, trace.name, now_of(trace), asked_of(trace), SHOWN_IN.get(trace.unit, (trace.unit,))[0])
        for key, trace in picture.traces.items()
    ]
    columns = ("", "quantity", "now", "reference", "unit")
    return show.Table("", columns, rows, numbers=columns[2:4], stale=_stale(picture.traces.values()))


def thruster_table(picture: Picture) -> show.Table:
    """Each thruster's command and speed."""
    rows = [
        (str(row.number), row.name, *(_of_thruster(v, row.freshness) for v in (row.pwm_us, row.rpm)))
        for row in picture.thrusters
    ]
    columns = ("thruster", "where", "us", "rpm")
    return show.Table("", columns, rows, numbers=columns[2:], stale=_stale(picture.thrusters))


def gap_table(picture: Picture) -> show.Table:
    """Each axis of the model in force: its drift over 5 s, and how much of that is noise and sea."""
    gap = gap_now(picture) or Gap()
    rows = [(DOFS[axis.dof], *in_units(axis), "ALARM" if axis.high else "") for axis in gap.axes]
    columns = ("model", "off in 5 s", "floor", "unit", "")
    return show.Table("", columns, rows, numbers=columns[1:3])


def _stale(rows: Iterable[Trace | SensorRow | ThrusterRow]) -> list[bool]:
    return [row.freshness is not Freshness.FRESH for row in rows]


def tables(picture: Picture) -> Sequence[show.Table]:
    candidates = (quantity_table(picture), gap_table(picture), sensor_table(picture), thruster_table(picture))
    return [table for table in candidates if table.rows]


def plain(picture: Picture) -> dict[str, Any]:
    """The picture as plain data, with only the newest value of each trace."""
    return {
        "armed": picture.armed.value,
        "armed_age_s": picture.armed_age_s,
        "links": [vars(row) for row in picture.links],
        "sensors": [
            vars(row) | {"freshness": row.freshness.value, "condition": row.condition.value}
            for row in picture.sensors
        ],
        "quantities": {
            key: {
                "name": trace.name,
                "unit": trace.unit,
                "value": float(trace.value[-1]) if len(trace.value) else math.nan,
                "reference": math.nan if trace.reference is None else float(trace.reference[-1]),
                "age_s": trace.age_s,
                "freshness": trace.freshness.value,
            }
            for key, trace in picture.traces.items()
        },
        "thrusters": [vars(row) | {"freshness": row.freshness.value} for row in picture.thrusters],
        "ff_mode": picture.ff_mode,
        "ff_mode_age_s": picture.ff_mode_age_s,
        "configuration": picture.configuration,
        "said": [vars(said) for said in picture.said],
        "twins": picture.twins,
        "gap": None if picture.gap is None else asdict(picture.gap),
        "alarms": [asdict(alarm) | {"kind": alarm.kind.value} for alarm in picture.alarms],
    }


def _of_thruster(value: float, freshness: Freshness) -> str:
    return GONE if freshness is Freshness.GONE or not math.isfinite(value) else f"{value:.0f}"
