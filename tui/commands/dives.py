"""`seatrial dives`: list the dive folders and the coefficients that each dive could identify, before any fit."""

import argparse
import math
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from bridge import exit_codes
from bridge.vehicle.config import load_vehicle
from identify.ingest.mavlink.messages import clock
from identify.words import utc
from tui import show
from tui.dive_list import FAIR, DiveRow, letters
from tui.dive_reading import rows_of

LEGEND = (
    "mass, damping: what each dive could identify by itself of u v w p q r: a capital letter to 10 %, a small one to "
    "30 % (one standard error), a dot not at all; roll and pitch are promised only where thrusters pushed them"
)


def run(arguments: argparse.Namespace) -> int:
    file = load_vehicle(arguments.vehicle) if arguments.vehicle else None
    if arguments.otherwise:
        load_vehicle(arguments.otherwise)
    with show.progress("dives") as progress:
        rows = rows_of(Path(arguments.folder), file, arguments.otherwise, progress)
    console = show.results(arguments.json)
    if rows:
        show.put(console, table_of(rows))
        times = Counter(row.name for row in rows)
        for row in rows:
            label = row.name if times[row.name] == 1 else row.folder.name
            show.say(console, *(f"{label}: {sentence}" for sentence in said_of(row)))
        if any(row.glance.relative_std for row in rows):
            show.say(console, LEGEND)
    else:
        show.say(console, f"{arguments.folder}: holds no dive")
    show.write_json([to_json(row) for row in rows], arguments.json)
    unread = [row for row in rows if row.glance.error]
    if not unread:
        return exit_codes.DONE
    return exit_codes.PARTLY if len(unread) < len(rows) else exit_codes.BAD_INPUT


def table_of(rows: list[DiveRow]) -> Any:
    columns = ("when", "length", "MB", "loss %", "unheard", "mass", "damping", "dive")
    return show.Table(
        "",
        columns,
        [
            (
                utc(row.glance.began_unix_s),
                clock(round(row.glance.duration_s)) if math.isfinite(row.glance.duration_s) else "-",
                f"{row.size_bytes / 1e6:.1f}",
                f"{100 * row.glance.loss:.1f}" if math.isfinite(row.glance.loss) else "-",
                f"{row.glance.unheard_s:.0f} s" if row.glance.unheard_s else "-",
                letters(row.glance.relative_std, "mass"),
                letters(row.glance.relative_std, "damping"),
                row.name,
            )
            for row in rows
        ],
        numbers=columns[1:5],
    )


def said_of(row: DiveRow) -> Iterator[str]:
    glance = row.glance
    if row.underway:
        yield row.underway
    if glance.error:
        yield f"can't be read: {glance.error}"
    if row.damaged:
        yield row.damaged
    yield from filter(None, (glance.untold, *glance.oddities, *row.learnt))
    if row.conditions:
        yield f"conditions: {row.conditions}"
    yield from row.noted


def to_json(row: DiveRow) -> dict[str, Any]:
    data = vars(row) | vars(row.glance)
    for nested in ("glance", "relative_std", "spans"):
        del data[nested]
    std = row.glance.relative_std
    excitation = (
        None
        if std is None
        else [{"name": name, "relative_std": std[name], "identifiable": std[name] <= FAIR} for name in std]
    )
    return data | {"excitation": excitation, "axes": [vars(span) for span in row.glance.spans]}
