"""Drifts of effects over a campaign: exact on a line, silent where nothing drifts, and a thruster that weakens."""

import csv
import io
import json
import re
from dataclasses import replace

import pytest
from test_batch_drift import DAY_S, START_S, dives

from bridge import exit_codes
from identify.batch.dive_causes import DiveCauses, EffectSize, Size
from identify.batch.drift import drift_of, effect_drifts
from identify.batch.jobs import Result
from identify.batch.page import batch_report, cause_words
from identify.batch.rows import diagnosed, rows_of, to_csv, to_json
from identify.challenge.case import dive_of, draw_case
from identify.challenge.tlog import tlog_of
from identify.report.page import render_report
from identify.statistics import Z95
from tui import cli
from tui.commands.batch import causes_table, effect_table, effects_of

STD = 0.01
WEAK = "weak_thruster of thruster 3"


def size(value, std=STD, unit="1"):
    return Size(value, unit, value - Z95 * std, value + Z95 * std)


def dive(day, gain, named=True, label=WEAK, **more):
    """A dive that names a weak thruster, or only tells its size."""
    effect = EffectSize(
        label, "weak thruster 3", {"gain": size(gain)}, 0.97 if named else 0.0, named, ("fouling",)
    )
    effects = {"found": (effect,)} if named else {"absent": (effect,)}
    return DiveCauses(
        "only", "explained" if named else "no_gap", "", unix_s=START_S + day * DAY_S, **effects, **more
    )


def test_a_size_on_a_line_gives_its_slope_and_interval_exactly():
    from scipy.stats import t as stats_t

    (drift,) = effect_drifts([dive(day, 1.0 - 0.02 * day, named=day > 1) for day in range(5)])
    assert (drift.label, drift.parameter, drift.per, drift.named) == (WEAK, "gain", "day", 3)
    assert drift.slope == pytest.approx(-0.02, rel=1e-9)
    half = stats_t.ppf(0.975, 3) * STD / 10**0.5
    assert (drift.low95, drift.high95) == pytest.approx((-0.02 - half, -0.02 + half), rel=1e-6)
    assert drift.chance == pytest.approx(2 * stats_t.cdf(-0.02 * 10**0.5 / STD, 3), rel=1e-6)
    assert drift.is_real
    assert drift.sentence.startswith(
        "Weak thruster 3: its gain changes by −0.020 per day (95 %: −0.030 to −0.010)"
    )
    assert (
        "from 1.000 on 2026-02-02 02:40 to 0.920 on 2026-02-06 02:40. 3 of 5 dives name it." in drift.sentence
    )


def test_dives_of_one_day_drift_by_dive():
    (drift,) = effect_drifts([dive(0.1 * number, 1.0 - 0.02 * number) for number in range(5)])
    assert drift.per == "dive"
    assert drift.slope == pytest.approx(-0.02, rel=1e-9)


def test_a_size_that_stays_is_no_drift():
    (drift,) = effect_drifts([dive(day, 0.8 + 0.005 * (-1) ** day) for day in range(6)])
    assert not drift.is_real
    assert "no drift shows" in drift.sentence


def test_only_an_effect_that_a_dated_dive_names_is_looked_at():
    assert effect_drifts([dive(day, 1.0 - 0.02 * day, named=False) for day in range(5)]) == ()
    possible = [dive(day, 1.0 - 0.02 * day, named=False) for day in range(5)]
    assert effect_drifts([replace(item, found=item.absent, absent=()) for item in possible]) == ()
    undated = [replace(dive(day, 1.0 - 0.02 * day), unix_s=None) for day in range(5)]
    assert effect_drifts([*undated, dive(0, 0.9)]) == ()
    assert effect_drifts([dive(0, 0.9), dive(1, 0.8)]) == ()


def test_a_dive_that_tells_no_interval_of_a_size_is_left_out():
    rows = [dive(day, 1.0 - 0.02 * day) for day in range(4)]
    bare = EffectSize(WEAK, "weak thruster 3", {"gain": Size(5.0, "1", None, None)}, 0.9, True)
    (drift,) = effect_drifts([*rows, replace(dive(9, 1.0), found=(bare,))])
    assert drift.trend.count == 4


def test_the_more_effects_are_looked_at_the_less_sure_is_each():
    lone = [dive(day, 1.0 - 0.02 * day) for day in range(5)]
    (alone,) = effect_drifts(lone)
    drag = EffectSize("quadratic_drag", "quadratic drag", {"X_uu": size(20.0, unit="N s2/m2")}, 0.9, True)
    first, second = effect_drifts([replace(item, found=(*item.found, drag)) for item in lone])
    assert first.label == WEAK
    assert first.chance == pytest.approx(2 * alone.chance)
    assert not second.is_real


def rows():
    """Dives of a batch whose thruster weakens, one of them not diagnosed for its length."""
    made = [
        replace(row, causes=dive(7 * k, 1.0 - 0.03 * k, named=k > 0)) for k, row in enumerate(dives(count=5))
    ]
    return [*made, replace(dives(count=6)[-1], causes=DiveCauses(error="is too short"))]


def test_causes_survive_as_plain_data():
    causes = dive(1, 0.9)
    assert DiveCauses.from_json(json.loads(json.dumps(causes.to_json()))) == causes


def test_a_diagnosis_joins_the_row_of_its_recording_and_dates_it():
    identified = [
        Result("a", "one", "one.tlog", "11", None, "no value"),
        Result("b", "two", "two.tlog", "22", None),
    ]
    diagnoses = [
        Result("c", "one", "one.tlog", "11", dive(3, 0.9).to_json()),
        Result("d", "two", "", "22", None, "short"),
    ]
    first, second = rows_of(identified, diagnoses)
    assert (first.dive, first.unix_s, first.causes.found[0].label) == ("one", START_S + 3 * DAY_S, WEAK)
    assert second.causes == DiveCauses(error="short")
    assert diagnosed([first, second]) == {"only": [first]}
    assert rows_of(identified)[0].causes is None


def test_table_csv_and_json_tell_verdict_and_causes_by_dive():
    made = rows()
    lines = causes_table(made).rows
    assert lines[0][2:] == ("no gap", "-")
    assert lines[1][2:] == (
        "explained", "weak thruster 3 (or fouling), 97 % probable: gain 0.970 (0.950 to 0.990)",
    )  # fmt: skip
    assert lines[5][2:] == ("-", "is too short")
    kept = list(csv.DictReader(io.StringIO(to_csv(made))))
    assert (kept[1]["verdict"], kept[1]["causes"]) == (
        "explained",
        "weak thruster 3: gain 0.970 (0.950 to 0.990)",
    )
    assert to_json(made[1])["diagnosis"]["found"][0]["sizes"]["gain"]["value"] == pytest.approx(0.97)
    ((of_weak, *_),) = effect_table(effects_of(made)["only"], "only").rows
    assert of_weak == "weak thruster 3"


@pytest.mark.usefixtures("sketched")
def test_the_page_leads_with_the_drift_and_has_its_table():
    made = rows()
    effects = effects_of(made)
    page = batch_report("ruvifist", "likelihood", made, (), {"only": drift_of(made)}, effects)
    assert effects["only"][0].sentence in page.verdict
    html = render_report(page)
    assert "Causes in configuration only" in html
    assert "gain 0.880 (0.860 to 0.900)" in html
    assert "How the sizes of effects drift" in html


def test_the_page_says_of_a_cause_what_its_diagnosis_does_in_words_and_never_that_it_is_certain():
    item = replace(
        dive(7, 0.9).found[0], probability=0.9999, also=("weak_thruster of thruster 4", "steady_current")
    )
    assert cause_words(item).startswith(
        "weak thruster 3 (or weak thruster of thruster 4, steady current), over 99 % probable: gain 0.900 "
    )


@pytest.mark.usefixtures("sketched")
def test_the_page_names_a_dive_that_was_identified_and_not_diagnosed_and_why():
    made = [
        *rows(),
        replace(dives(count=7)[-1], unix_s=None, causes=DiveCauses(error="changed while it ran")),
    ]
    html = render_report(
        batch_report("ruvifist", "likelihood", made, (), {"only": drift_of(made)}, effects_of(made))
    )
    part = html[html.index(">Dives that were not diagnosed</h2>") :].partition("</section>")[0]
    assert re.findall(r"<td[^>]*>(.*?)</td>", part) == [
        "2026-03-09 02:40", "is too short", "—", "changed while it ran"
    ]  # fmt: skip
    assert "no_gap" not in html


SEED, SECONDS, WEEK_S = 100_021, 90.0, 7 * DAY_S
GAINS = {0.0: 0.95, 0.4: 0.874, 0.7: 0.736}


@pytest.mark.slow
@pytest.mark.soak
@pytest.mark.usefixtures("sketched")
def test_a_thruster_that_weakens_week_by_week_is_told_as_that(tmp_path):
    """A sound dive and three with less and less of thruster 2, a week apart."""
    drawn = [draw_case(SEED, names=[], seconds=SECONDS)]
    drawn += [draw_case(SEED, names=["weak_thruster"], size=size, seconds=SECONDS) for size in GAINS]
    for week, case in enumerate(drawn):
        folder = tmp_path / "dives" / f"dive-{week}"
        folder.mkdir(parents=True)
        (folder / "telemetry.tlog").write_bytes(tlog_of(dive_of(case), START_S + week * WEEK_S))
    (tmp_path / "vehicle.yaml").write_text(drawn[0].vehicle.text, encoding="utf-8")
    out = tmp_path / "all.json"
    words = ["batch", tmp_path / "dives", "--vehicle", tmp_path / "vehicle.yaml", "--out", tmp_path / "out"]
    assert (
        cli.main([*map(str, words), "--diagnose", "--processes", "1", "--json", str(out)]) == exit_codes.DONE
    )
    result = json.loads(out.read_text(encoding="utf-8"))
    assert [row["diagnosis"]["verdict"] for row in result["dives"]] == ["no_gap", *["explained"] * 3]
    causes = [[item["label"] for item in row["diagnosis"]["found"]] for row in result["dives"]]
    assert causes == [[], *[["weak_thruster of thruster 2"]] * 3]
    ((_, (drift,)),) = result["effects"].items()
    assert drift["significant"]
    assert drift["named"] == 3
    assert drift["low95"] < (GAINS[0.7] - 1.0) / 21 < drift["high95"] < 0
    page = (tmp_path / "out" / "trends.html").read_text(encoding="utf-8")
    # A page keeps a number with its unit.
    assert drift["sentence"] in page.replace("\N{NO-BREAK SPACE}", " ")
