"""The page and the tables of a batch: every dive, every trend, dates that fit a telephone."""

import csv
import io
import re
from dataclasses import replace

import pytest
from test_batch_drift import dives

from identify.batch.drift import drift_of
from identify.batch.jobs import Result
from identify.batch.page import batch_report
from identify.batch.rows import NAMES, by_configuration, rows_of, to_csv, to_json
from identify.doubt import Doubt
from identify.report.page import render_report
from tui.commands.batch import dive_table, parameter_tables

WARNED = Doubt(("M_u",), "No rate of turn was recorded in roll", "M_u may be off; record a gyro.")

pytestmark = pytest.mark.usefixtures("sketched")


def page(rows, twins=()):
    drifts = {name: drift_of(group) for name, group in by_configuration(rows).items()}
    return render_report(batch_report("ruvifist", "likelihood", rows, twins, drifts))


@pytest.mark.usefixtures("rendered")
def test_the_page_tells_the_story_shows_each_parameter_and_names_each_dive():
    rows = dives(damping=0.2)
    html = page(rows)
    assert html.index("Damping is up and mass does not change significantly") < html.index("<main>")
    assert all(f">{name}, " in html for name in ("M_u", "M_v", "I_r", "D_u", "D_v", "D_r"))
    assert ">significant trend</text>" in html
    assert all(row.dive in html for row in rows)


def test_the_page_groups_by_configuration_and_tells_failures_and_twins():
    rows = [*dives(), *(replace(row, configuration="survey") for row in dives(damping=0.2, seed=3))]
    failed = rows_of([Result("k", "cut <b>", "cut.tlog", "0", None, "holds no MAVLink frame")])
    html = page([*rows, *failed], [("copy.tlog", "is the beginning of", "dive.tlog")])
    headings = re.findall(r"<h2>(.*?)</h2>", html)
    assert headings == [
        "Configuration only", "Configuration survey", "Dives of configuration only",
        "Dives of configuration survey", "Dives that gave nothing", "Counted once",
    ]  # fmt: skip
    assert "cut &lt;b&gt;" in html
    assert "holds no MAVLink frame" in html
    assert "copy.tlog" in html
    assert "is the beginning of" in html


def test_dives_without_a_date_are_listed_and_not_drawn():
    html = page([replace(row, unix_s=None) for row in dives(count=4)])
    assert "dive 3" in html
    assert "<figure>" not in html


def test_the_csv_has_a_line_a_dive_and_empty_cells_for_what_is_not_known():
    rows = [*dives(count=2), *rows_of([Result("k", "cut", "cut.tlog", "0", None, 'holds "nothing", sadly')])]
    rows[1] = replace(rows[1], doubts=(WARNED,))
    first, second, last = csv.DictReader(io.StringIO(to_csv(rows)))
    assert (first["doubted"], second["doubted"]) == ("", "M_u")
    assert to_json(rows[1])["doubted"] == {"M_u": "no rate of turn was recorded in roll"}
    assert float(first["M_u"]) == rows[0].values["M_u"].value
    assert (first["M_w"], first["date_utc"]) == ("", "2026-02-02T02:40:00Z")
    assert (last["error"], last["M_u"]) == ('holds "nothing", sadly', "")
    assert {f"{name}_low95" for name in NAMES} <= set(first)


def test_rows_stand_by_date_with_doubts_and_how_parameters_err_together_or_the_worst_where_that_is_not_told():
    interval = {"std": 5.0, "low95": 0.1, "high95": 9.0, "identifiable": True}
    interval |= {"given_thrust_std": 1.0, "given_thrust_low95": 1.0, "given_thrust_high95": 3.0}
    parameters = [{"name": name, "value": 2.0, **interval} for name in ("M_u", "M_v", "D_u")]
    data = {
        "parameters": parameters, "configuration": "only", "outcome": "converged", "dive": {"duration_s": 60.0},
        "covariance": {"of": ["M_u", "M_v"], "matrix": [[1.0, 1.2], [1.2, 4.0]]}, "doubts": [WARNED.to_json()],
    }  # fmt: skip
    answer = {"identification": data, "unix_s": 1.77e9, "dated_by": "its name", "voltage_v": None}
    answer["carried_kg"] = 0.0
    failed = [Result(name, name, f"{name}.tlog", "0", None, "cut") for name in ("undated", "2025-11-20")]
    results = [*failed, Result("k", "one", "one.tlog", "0", answer, "")]
    assert [row.dive for row in rows_of(results)] == ["2025-11-20", "one", "undated"]
    row = rows_of(results)[1]
    assert row.doubts == (WARNED,)
    assert vars(row.values["M_u"]) == {"value": 2.0, "std": 1.0, "low95": 1.0, "high95": 3.0}
    assert set(replace(row, values={**row.values, "X_udot": row.values["M_u"]}).doubted) == {"M_u", "X_udot"}
    assert row.correlation[frozenset(("M_u", "M_v"))] == pytest.approx(0.6)
    assert row.correlation[frozenset(("M_u", "D_u"))] == 1.0
    loaded = Result("k", "one", "one.tlog", "0", {**answer, "carried_kg": 0.5}, "")
    (row,) = rows_of([loaded])
    assert vars(row.values["M_u"]) == {"value": 1.5, "std": 1.0, "low95": 0.5, "high95": 2.5}
    assert row.values["D_u"].value == 2.0


def test_a_dive_that_is_in_no_trend_is_marked_on_the_page_and_in_the_terminal():
    *rows, last = dives(count=5)
    rows.append(replace(last, outcome="data and model disagree"))
    assert "data and model disagree: in no trend" in page(rows)
    table, *_ = parameter_tables(rows, rows, drift_of(rows), "only")
    assert [line[0] for line in table.rows] == ["1", "2", "3", "4", "5*"]
    assert table.title.endswith("; *: in no trend, undated or not converged")


def test_a_doubted_value_is_marked_beside_what_to_do_on_the_page_and_in_the_terminal():
    *rows, last = dives(count=4)
    rows.append(replace(last, doubts=(WARNED,)))
    html = page(rows)
    assert len(re.findall(r"<td[^>]*>([^<]*\?\*)</td>", html)) == 1
    assert "?: doubted; ?*: doubted, and in no trend" in html
    assert WARNED.sentence in html
    assert "?: doubted" not in page(dives(count=4))
    assert [line[-1] for line in dive_table(rows).rows][-2:] == [
        "dive 2: converged", "dive 3: converged, but doubts M_u",
    ]  # fmt: skip
    table, *_ = parameter_tables(rows, rows, drift_of(rows), "only")
    assert [line[2].endswith("?*") for line in table.rows] == [False, False, False, True]
    assert not any(line[3].endswith("?*") for line in table.rows)
    assert table.title.endswith("?: doubted; ?*: doubted, and in no trend")
