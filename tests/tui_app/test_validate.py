"""The screen Validate: the verb that it runs, and a validation as lines."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fake_verbs import FakeVerbs, let_go
from made_diagnosis import CHECK, DIVE, OLDER
from made_validation import FORETOLD, raising, validated_desk, validation
from made_validation import run as run_of
from screen_text import WIDE, Lacks, Sees, plain, played

from bridge.reports import PAGE, Report
from identify.validation.axis_criteria import Criterion
from tui.app.curves import Curve, plot, seconds_row
from tui.app.drawing import width
from tui.app.jobs import Jobs
from tui.app.screens import validate
from tui.app.screens.validate import Verdict, runs


def test_keys_go_from_axis_to_axis_and_from_dive_to_dive(tmp_path):
    axes = [step for axis in ("surge", "sway", "yaw", "surge") for step in (Sees(f"{axis} speed"), "a")]
    dives = [
        step for name in ("shadow", "ff", "both", "shadow") for step in (Sees(f"CURVES of {name} "), "m")
    ]
    played(validated_desk(tmp_path), "6", "s", *axes, *dives)


def test_it_validates_the_chosen_dive_beside_so_many_others_as_a_key_says(tmp_path):
    def leave(words):
        Path(words[words.index("--json") + 1]).write_text(json.dumps(validation()), encoding="utf-8")

    alone, more = "by itself; [c] beside one more", "; [c] beside one more"
    aims = (alone, f"beside {CHECK}{more}", f"beside {CHECK}, {OLDER}; [c] by itself", alone)
    chosen = [step for aim in aims for step in (Sees(f"validates {DIVE}, {aim}. "), "c")]
    verbs = FakeVerbs({"validate": validation()}, held=("validate",), leave=leave)
    desk = validated_desk(tmp_path, validated=False, jobs=Jobs(verbs))
    played(desk, "6", *chosen, "v", Sees(f"validate {DIVE}"), let_go, lambda _: None, Sees("● GO"), size=WIDE)
    (words,) = verbs.words
    vehicle = words[4]
    assert vehicle.endswith("ruvifist.yaml:hovering")
    assert words == (
        "validate", str(tmp_path / DIVE), str(tmp_path / CHECK), "--vehicle", vehicle,
        "--receipts", "receipts",
        "--json", str(tmp_path / DIVE / "validation.json"), "--report", str(tmp_path / DIVE / "validation.html"),
    )  # fmt: skip


def test_where_the_dive_looked_at_is_compared_no_more_the_chosen_one_is_shown_again(tmp_path):
    def compare_others(_):
        others = [run_of("off", CHECK, 1.0, 0.0, None), run_of("shadow", DIVE, 1.0, 1.2, raising(False))]
        (tmp_path / DIVE / "validation.json").write_text(json.dumps(others), encoding="utf-8")

    played(validated_desk(tmp_path), "6", "m", "m", compare_others, "1", "6", Sees("▲ NO-GO"))


def test_a_dive_that_lay_afloat_for_an_upload_is_not_compared(tmp_path, monkeypatch):
    monkeypatch.setattr(validate, "can_check", lambda dive: dive.name != CHECK)
    desk = validated_desk(tmp_path)
    played(
        desk, "6", "c", Sees(f"beside {OLDER}; [c] by itself. "), "c", Sees("again, by itself; "), size=WIDE
    )


def test_the_verdict_stands_as_soon_as_it_is_there_while_the_page_is_drawn(tmp_path):
    verbs = FakeVerbs({}, tells=(Report(PAGE, 0.3, "draws"),))
    desk = validated_desk(tmp_path, jobs=Jobs(verbs))
    played(desk, "6", "v", Sees("● GO"), Sees("30 % draws"), size=WIDE)


def roles(line):
    return [role for span, role in line if span.strip()]


@pytest.mark.parametrize("cells", [60, 77])
def test_no_line_is_wider_than_there_is_room(cells):
    shown = runs(validation())
    parts = [
        validate.verdict_lines(shown[0], cells),
        validate.criteria_lines(shown[0], cells),
        validate.error_lines(shown, DIVE, cells),
        *(validate.curve_lines(shown[0], axis, cells, 15) for axis in validate.axes_of(shown)),
    ]
    assert all(width(line) <= cells for lines in parts for line in lines)


@pytest.mark.parametrize(
    "change",
    [
        {"unit": "furlongs"},
        {"wrench_unit": "N m"},
        {"step_s": 0.0},
        {"step_s": 1e-320},
        {"start_s": 1e300},
        {"start_s": 10**299},
        {"measured": [1.0]},
        {"tau_ff": [1e308, -1e308]},
        {"reference": ["1e400"]},
    ],
    ids=str,
)
def test_curves_that_are_of_no_dive_are_no_validation(change):
    data = validation()
    data[0]["curves"][0] |= change
    assert runs(data) is None


def test_errors_in_a_unit_of_no_axis_are_no_validation():
    data = validation()
    data[0]["axes"][0]["unit"] = "furlongs"
    assert runs(data) is None


def test_a_criterion_is_passed_or_failed_or_not_known():
    data = validation()
    data[0]["raising"]["criteria"][0]["passed"] = [[]]
    assert runs(data) is None


@pytest.mark.parametrize(("go", "mark"), [(True, "● GO"), (False, "▲ NO-GO")])
def test_the_verdict_is_a_mark_a_word_and_a_sentence(go, mark):
    lines = plain(validate.verdict_lines(runs(validation(go))[0], 80))
    assert lines[0].split("  ")[0].strip() == mark
    assert " ".join(lines[1:]).startswith(mark.split()[1])


def test_a_dive_that_tells_no_mode_has_no_verdict():
    shown = runs(validation())[2]
    assert plain(validate.verdict_lines(shown, 80))[0].startswith("No verdict")
    assert validate.criteria_lines(shown, 80) == ()


def test_the_pid_alone_is_the_baseline_and_a_recording_in_which_nothing_moved_is_none():
    flown = run_of("off", OLDER, 1.0, 1.2, None)
    (baseline,), (idle,) = runs([flown]), runs([flown | {"axes": []}])
    assert "the baseline" in " ".join(plain(validate.verdict_lines(baseline, 77)))
    assert " ".join(plain(validate.verdict_lines(idle, 77))) == validate.NO_VERDICT


def test_each_criterion_is_a_line_with_a_mark_its_name_and_its_figure():
    lines = plain(validate.criteria_lines(runs(validation(go=False))[0], 80))
    assert lines[0] == "▲ no  surge mass:     223 kg fed, PID 110 ± 6.3: ×2.03 (0.71 to 1.41)"
    assert lines[1] == "● ok  surge likeness: 0.99 between feed-forward and PID, at least 0.8"
    assert lines[3].startswith("◐ ?   yaw mass")


@pytest.mark.parametrize("cells", [36, 40, 48, 60, 70])
def test_a_long_name_takes_no_room_from_the_words_and_neither_is_clipped(cells):
    data = validation()
    long = {
        "what": "yaw not asked to move",
        "passed": False,
        "words": "0.73 deg/s rms while others move, at most 0.3",
    }
    data[0]["raising"]["criteria"].append(long)
    lines = plain(validate.criteria_lines(runs(data)[0], cells))
    assert max(map(len, lines)) <= cells
    assert lines[0].startswith("▲ no  yaw not asked to move")
    assert next(n for n, line in enumerate(lines) if line.startswith("● ok")) <= 3
    assert long["words"] in " ".join(" ".join(lines).replace(long["what"], "").split())


def test_a_yaw_rate_is_told_in_degrees():
    lines = plain(validate.error_lines(runs(validation()), DIVE, 80))
    head = next(n for n, line in enumerate(lines) if line.startswith("yaw"))
    assert lines[head].split()[:2] == ["yaw,", "deg/s"]
    assert lines[head + 1].split()[1] == "5.32"
    assert lines[head + 6].split()[:3] == ["steady", "|PID|,", "N"]


@pytest.mark.parametrize(("count", "cells"), [(1, 48), (2, 48), (3, 58), (3, 80)])
def test_each_dive_s_name_stands_above_its_own_numbers_on_a_phone_too(count, cells):
    head, *rows = validate.error_lines(runs(validation())[:count], DIVE, cells)[:5]
    assert {width(row) for row in rows} == {width(head)}


@pytest.mark.parametrize("change", [{"axis": "x"}, {"axis": []}, {"rms": "much"}], ids=str)
def test_a_whole_mission_of_no_axis_is_no_validation(change):
    data = validation()
    data[0]["whole"][0] |= change
    assert runs(data) is None


def test_what_was_foretold_stands_in_the_verdict_before_its_sentence():
    shown = runs(validation())
    lines = plain(validate.verdict_lines(shown[1], 90))
    assert lines[1] == FORETOLD
    assert lines[2].startswith("GO: ")
    assert plain(validate.verdict_lines(shown[0], 90))[1].startswith("GO: ")


def test_a_validation_from_before_has_no_word_of_the_whole_mission():
    data = validation()
    for run in data:
        del run["whole"], run["as_foretold"]
    (shown, *_) = runs(data)
    assert (shown.whole, shown.foretold) == ({}, "")
    assert plain(validate.error_lines(runs(data), DIVE, 80))[0].startswith("surge, mm/s")


def test_two_dives_of_one_mode_are_told_apart_by_their_hours():
    data = [run_of(f"{name} shadow", name, 1.0, 1.0, None) for name in (DIVE, CHECK)]
    assert [run.label for run in runs(data)] == ["0912Z shadow", "1015Z shadow"]


def test_curves_show_the_part_in_which_the_axis_moves():
    lines = plain(validate.curve_lines(runs(validation())[0], "sway", 80, 15))
    titles = [line.split("  ")[0] for line in lines if "━" in line]
    assert titles == ["sway speed, m/s", "sway error, mm/s", "sway force, N"]
    assert len(lines) == 15
    # Sway runs from 40 to 60 s.
    times = lines[-1].replace(" s", "").split()
    assert 37 <= float(times[0]) <= 45
    assert 57 <= float(times[-1]) <= 64


def test_an_error_of_a_few_mm_s_fills_its_chart():
    surge = runs(validation())[0].curves[0]
    late = replace(surge, measured=surge.reference + 0.012 * np.sin(surge.time_s))
    shown = replace(runs(validation())[0], curves=(late,))
    lines = plain(validate.curve_lines(shown, "surge", 80, 30))
    title = next(n for n, line in enumerate(lines) if line.startswith("surge error, mm/s"))
    labels = [line.split("┤")[0].strip() for line in lines[title + 1 :] if "┤" in line]
    assert labels[0] == "20"


def test_an_axis_that_a_dive_lacks_is_said():
    surge_only = validation()[:1]
    surge_only[0]["curves"] = surge_only[0]["curves"][:1]
    (shown,) = runs(surge_only)
    assert "its reference does not move there" in " ".join(plain(validate.curve_lines(shown, "yaw", 80, 15)))


def test_a_plot_runs_from_the_lowest_to_the_highest_value_and_leaves_gaps_empty():
    time_s = np.linspace(0.0, 100.0, 201)
    value = np.sin(time_s / 10)
    value[(time_s > 40) & (time_s < 60)] = np.nan
    lines = plain(plot("u, m/s", time_s, Curve("u", value), None, 0.1, 67, 9))
    assert lines[0].startswith("u, m/s")
    assert lines[1].startswith("   1.0┤")
    assert lines[-1].startswith("  -1.0┤")
    gap = [line[7:].ljust(60)[25:35].strip("┈ ") for line in lines[1:]]
    assert gap == [""] * 8
    (times,) = plain(seconds_row(time_s, 67))
    assert times.index("50 s") == 7 + 30 - 2
    assert seconds_row(time_s[:1], 67) == seconds_row(time_s, 7) == ()


@pytest.mark.parametrize("data", [None, {}, [], [{"run": "PID"}], "x"])
def test_what_is_no_validation_is_none(data):
    assert runs(data) is None


def test_a_heading_is_never_cut_on_a_phone(tmp_path):
    titles = ("GO OR NO-GO for the feed-forward", "CURVES of ", "ERRORS: rms, then mean by phase")
    steps = (step for title in titles for step in (Sees(title), "s"))
    played(validated_desk(tmp_path), "6", *steps, size=(44, 40))


def test_a_criterion_s_name_ends_before_its_words_begin():
    made = Criterion("thruster 1 made up for", True, "asked as if it gave 79 % of its curve")
    (line,) = plain(
        validate.criteria_lines(replace(runs(validation())[0], verdict=Verdict(True, "", (made,))), 80)
    )
    assert line == "● ok  thruster 1 made up for: asked as if it gave 79 % of its curve"


def test_a_table_that_is_cut_off_is_scrolled_at_once_and_so_is_that_of_the_next_section(tmp_path):
    def at(down):
        return lambda app: app.screen.query_one("#validate-errors VerticalScroll").scroll_y == down

    scrolled = (Sees("3 of 3 [s]"), at(0), "down", "down", at(2))
    played(validated_desk(tmp_path), "6", "s", "s", *scrolled)


def test_what_was_there_before_is_not_shown_below_a_validation_that_runs(tmp_path):
    desk = validated_desk(tmp_path, jobs=Jobs(FakeVerbs({"validate": validation()}, held=("validate",))))
    before = ("6", Sees("surge likeness"), Sees("a Axis"))
    runs = ("v", Lacks("surge likeness"), Sees("at work: the answer comes here"), Lacks("a Axis"))
    played(desk, *before, *runs, let_go, lambda _: None, Sees("surge likeness"))
