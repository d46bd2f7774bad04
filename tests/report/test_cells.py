"""Cells of a table: a quantity is written for the page, and as CSV a number a cell with the unit in the head."""

import csv
import io
import math

import pytest

from identify.report.cells import (
    Form,
    Number,
    Quantity,
    Style,
    count,
    duration,
    fixed,
    joined,
    percent,
    significant,
    speed,
    to_csv,
    with_interval,
)
from identify.report.page import Report, Section, Table, render_report


def read(head, *cells):
    rows = list(csv.reader(io.StringIO(to_csv(("axis", head), [("x", cell) for cell in cells]))))
    return [tuple(column) for column in zip(*rows, strict=True)][1:]


def change(before, after, per):
    return joined(Form.CHANGE, speed(before, per), speed(after, per))


@pytest.mark.parametrize(
    ("cells", "shown", "columns"),
    [
        ((fixed(3.7, 1), fixed(-0.5, 1), fixed(1.2, 1, style=Style.SIGNED)), ("3.7", "−0.5", "+1.2"),
         [("h", "3.7", "-0.5", "1.2")]),
        ((speed(0.012, "m/s"), speed(math.nan, "m/s")), ("12 mm/s", "—"), [("h, mm/s", "12", "")]),
        ((change(0.0049, 0.0023, "m/s"), change(0.0155, 0.0016, "rad/s")),
         ("4.9 → 2.3 mm/s", "0.89 → 0.092 deg/s"),
         [("h, before", "4.9", "0.89"), ("h, after", "2.3", "0.092"), ("h, unit", "mm/s", "deg/s")]),
        ((joined(Form.RANGE, percent(0.97), percent(1.0)), joined(Form.RANGE, percent(0.97), percent(math.nan))),
         ("97 to 100 %", "—"), [("h, from, %", "97", ""), ("h, to, %", "100", "")]),
        ((joined(Form.SPREAD, fixed(-0.42, 1), fixed(0.7, 1)),), ("−0.4 ± 0.7",), [("h", "-0.4"), ("h, ±", "0.7")]),
        ((joined(Form.INTERVAL, *with_interval(110.43, 107.4, 113.5)),), ("110.4 (107.4 to 113.5)",),
         [("h", "110.4"), ("h, from", "107.4"), ("h, to", "113.5")]),
        (with_interval(0.03, 0.01, 0.05, "per dive")[:1], ("0.030 per dive",), [("h, per dive", "0.030")]),
        ((significant(0.551, 2, "N m"), significant(0.67, 2, "N")), ("0.55 N m", "0.67 N"),
         [("h", "0.55", "0.67"), ("h, unit", "N m", "N")]),
        ((count(1140), count(5703)), ("1\N{NO-BREAK SPACE}140", "5\N{NO-BREAK SPACE}703"), [("h", "1140", "5703")]),
        ((duration(113.4), duration(0.34)), ("1 min 53 s", "0.34 s"), [("h, s", "113", "0.34")]),
        ((Quantity((Number(7.25, 1),), mark="?"), fixed(7.0, 1)), ("7.2?", "7.0"),
         [("h", "7.2", "7.0"), ("h, mark", "?", "")]),
        (("3.11.7", "2.13.0+cpu"), ("3.11.7", "2.13.0+cpu"), [("h", "3.11.7", "2.13.0+cpu")]),
        ((speed(0.012, "m/s"), "closely"), ("12 mm/s", "closely"), [("h", "12 mm/s", "closely")]),
        (("—", ""), ("—", ""), [("h", "", "")]),
    ],
)  # fmt: skip
def test_a_quantity_has_its_unit_in_its_cell_on_the_page_and_in_the_head_as_csv(cells, shown, columns):
    assert tuple(map(str, cells)) == shown
    assert read("h", *cells) == columns


def test_on_a_page_columns_of_quantities_stand_right_and_the_names_of_rows_do_not():
    rows = ((fixed(200.0, 0), fixed(1.2, 1), "flown"), (fixed(300.0, 0), "—", ""))
    table = Table(("speed", "error", "how"), rows)
    page = render_report(Report("dive", "", "", (Section("errors", tables=(table,)),)))
    heads = ("short", "speed"), ("number", "error"), ("short", "how")
    assert "".join(f'<th scope="col" class="{kind}">{name}</th>' for kind, name in heads) in page
