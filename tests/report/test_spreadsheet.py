"""Tables of a page as CSV: a number a cell, and nothing that is none torn apart."""

import csv
import io

import pytest

from identify.report.spreadsheet import to_csv


def read(head, *cells):
    rows = list(csv.reader(io.StringIO(to_csv(("axis", head), [("x", cell) for cell in cells]))))
    return [tuple(column) for column in zip(*rows, strict=True)][1:]


@pytest.mark.parametrize(
    ("cells", "columns"),
    [
        (("3.7", "−0.5", "+1.2"), [("h", "3.7", "-0.5", "1.2")]),
        (("12 mm/s", "—"), [("h, mm/s", "12", "")]),
        (
            ("4.9 mm/s → 2.3 mm/s", "0.89 deg/s → 0.092 deg/s"),
            [("h, before", "4.9", "0.89"), ("h, after", "2.3", "0.092"), ("h, unit", "mm/s", "deg/s")],
        ),
        (("0.07 → 0.03", "0.99 -> 0.99"), [("h, before", "0.07", "0.99"), ("h, after", "0.03", "0.99")]),
        (("97 % to 100 %", "—"), [("h, from, %", "97", ""), ("h, to, %", "100", "")]),
        (("-0.4 ± 0.7",), [("h", "-0.4"), ("h, ±", "0.7")]),
        (
            ("110.4 (107.4 to 113.5)",),
            [("h", "110.4"), ("h, from", "107.4"), ("h, to", "113.5")],
        ),
        (("0.55 N m", "0.67 N"), [("h", "0.55", "0.67"), ("h, unit", "N m", "N")]),
        (("1 140", "5 703"), [("h", "1140", "5703")]),
        (("1.2e-05 rad/s",), [("h, rad/s", "1.2e-05")]),
        (("3.11.7", "2.13.0+cpu"), [("h", "3.11.7", "2.13.0+cpu")]),
        (("0.39 N, under 1 %",), [("h", "0.39 N, under 1 %")]),
        (("1 min 53 s",), [("h", "1 min 53 s")]),
        (("12 mm/s", "closely"), [("h", "12 mm/s", "closely")]),
        (("1 m to 2 s",), [("h", "1 m to 2 s")]),
        (("—", "—"), [("h", "", "")]),
    ],
)
def test_quantities_become_numbers_with_their_unit_in_the_head_and_all_else_stays(cells, columns):
    assert read("h", *cells) == columns
