"""An identification as lines: bars, curves that converge, and the result beside what was accepted."""

import os
from dataclasses import replace

import numpy as np
import pytest
from made_identified import DOUBT, PAGE, REASON, answer, identified, leave, parameters, passes
from screen_text import plain

from bridge import exit_codes
from bridge.vehicle.coefficients import BY_NAME
from gcs_plugin.params.last_accepted import AcceptedValue
from tui.app import identification
from tui.app.drawing import width
from tui.app.identification import load_identified
from tui.app.jobs import Done, JobState, ended
from tui.app.screens.identify import words_for
from tui.app.screens.identify_lines import result
from tui.app.screens.identify_progress import Passes, converging, curves, passes_of, progress
from tui.dive_list import results_beside

WORDS = ("identify", "dives/2026-11-21T0352Z-hovering", "--vehicle", "ruvifist")
STOPPED = Done(exit_codes.INTERRUPTED, None, ())


def at_work(*reports, began_s=0.0, **changed):
    return JobState(WORDS, began_s, reports, **changed)


@pytest.fixture
def beside_dive(tmp_path):
    """What is read of an identification beside a dive's folder."""

    def made(**changed):
        leave(words_for(str(tmp_path), "ruvifist", results_beside(tmp_path)), identified(**changed))
        return load_identified(tmp_path, tmp_path)

    return made


@pytest.mark.parametrize(
    ("ending", "title"),
    [({}, "IDENTIFYING"), ({"cancelled": True}, "STOPPING"), ({"done": STOPPED}, "CURVES OF")],
)
def test_the_title_says_how_it_goes_and_for_how_long(ending, title):
    (first, *_) = plain(progress(at_work(*passes(), began_s=10.0, **ending), 43.0, 80))
    assert first.startswith(f"{title} 2026-11-21T0352Z-hovering ─")
    assert first.endswith("00:00:33")


def test_a_job_that_has_told_nothing_reads_the_dive():
    assert plain(progress(at_work(), 1.0, 80))[1] == "reading the dive"


def test_the_answer_of_one_method_stands_beside_the_curves_of_the_other_as_soon_as_it_is_there():
    reports = (*passes(), answer(), *passes(4)[-1:])
    assert plain(curves(reports, 80, 18))[0].startswith("M_u      111.8 ± 2.8 kg      vs 111.7   M_v")
    assert plain(progress(at_work(*reports), 1.0, 80))[1].endswith(
        "100 %  answered: its values stand behind vs"
    )
    assert len(passes_of(reports)[0].value) == 4
    assert plain(curves((answer(),), 80, 18))[0] == "M_u      111.7 ± 3.4 kg  by likelihood"


def test_what_a_method_refuses_has_no_interval_once_it_has_answered():
    first = answer()
    refuses = replace(first, values={name: value for name, value in first.values.items() if name != "I_p"})
    own = replace(refuses, of="pinn")
    lines = "\n".join(plain(curves((*passes(), own), 160, 18)))
    assert "I_p         -- not identified" in lines
    assert "M_u      112.0 ± 3.7 kg" in lines
    beside = "\n".join(plain(curves((*passes(), refuses), 160, 18)))
    assert "I_p      4.782 ± 0.16 kg m2     vs --" in beside


def test_the_heads_of_charts_side_by_side_do_not_touch():
    (head, *_) = plain(curves((*passes(), answer()), 160, 18))
    assert "vs 111.7   M_v" in head


def test_once_all_have_answered_there_is_one_bar_for_the_page_that_is_written():
    reports = (*passes(), answer(), answer("pinn"), PAGE)
    bar = "page        ██████░░░░░░░░░░░░░░░░░░  25 %  writing the page"
    assert plain(progress(at_work(*reports), 1.0, 80)) == [bar]


def test_a_value_that_stands_still_is_a_level_line_in_the_middle_and_what_is_to_come_is_blank():
    still = Passes("D_u", np.full(2, 50.0), np.zeros(2))
    lines = plain(converging(still, "", 7 + 8, 4))
    # Two of at least four passes fill half of the eight cells.
    assert lines[2][7:].rstrip("⠀ ") in ("⠒⠒⠒⠒", "⠤⠤⠤⠤")
    assert not lines[1][7:].strip("⠀ ")
    assert not lines[3][7:].strip("⠀ ")


def test_a_unit_is_not_cut_where_its_head_has_room_once_it_stands_close():
    passes = Passes("D_r", np.full(2, 25.82), np.full(2, 0.24))
    for cells, head in (
        (40, "D_r      25.82 ± 0.24 N m/(rad/s) pass 2"),
        (32, "D_r 25.82 ± 0.24 N m/(rad/s)"),
    ):
        assert plain(converging(passes, "N m/(rad/s)", cells, 4))[0].rstrip() == head


@pytest.mark.parametrize(("cells", "rows"), [(80, 18), (156, 40), (30, 12)])
def test_all_curves_fit_into_their_room(cells, rows):
    lines = curves(passes(), cells, rows)
    assert len(lines) <= rows
    assert all(width(line) <= cells for line in lines)
    assert all(name in "\n".join(plain(lines)) for name in BY_NAME)


def test_parameters_of_an_earlier_identification_are_not_offered(beside_dive, tmp_path):
    assert beside_dive().param == tmp_path / "identified.param"
    os.utime(tmp_path / "identified.param", (1.0, 1.0))
    assert load_identified(tmp_path, tmp_path).param is None


@pytest.mark.parametrize("text", [None, "", "[]", "{}", '{"dive": 1}'])
def test_a_file_that_is_no_identification_is_none(text, tmp_path):
    if text is not None:
        (tmp_path / "identified.json").write_text(text, encoding="utf-8")
    assert load_identified(tmp_path, tmp_path) is None


def test_reasons_and_notes_stand_beside_the_values_where_there_is_room_and_go_on_below(beside_dive):
    lines = plain(result(beside_dive(), 139))
    m_u = next(n for n, line in enumerate(lines) if line.startswith("M_u"))
    assert f"1: {REASON}"[:40] in lines[m_u - 1]
    assert max(map(len, lines)) <= 139
    # On a phone nothing is cut: the whole name first, then when it was written.
    name, written = plain(result(beside_dive(), 40))[:2]
    assert name == "2026-11-21T0352Z-hovering hovering"
    assert " UTC ─" in written


def test_what_was_last_accepted_stands_beside_it_and_news_is_warned_of(beside_dive, monkeypatch):
    accepted = {
        BY_NAME[name].parameter_id(0): AcceptedValue(value, None, "")
        for name, value in {"M_u": 110.0, "D_u": 80.0}.items()
    }
    monkeypatch.setattr(identification, "accepted_of", lambda *_: accepted)
    rows = {line[0][0].strip(): line for line in result(beside_dive(), 80) if line}
    assert " ".join(plain((rows["M_u"],))[0].split()) == "M_u 110.0 → 111.7 +1.5 % kg 91.6 … 135"
    assert rows["M_u"][4] == ("   +1.5 %", "plain")
    assert rows["D_u"][4] == ("  -29.5 %", "warn")


def test_news_is_what_lies_outside_the_interval_given_the_thrust(beside_dive, monkeypatch):
    # 120 lies within the wide interval and outside the narrow one: the thrust is the same in both dives.
    accepted = {BY_NAME["M_u"].parameter_id(0): AcceptedValue(120.0, None, "")}
    monkeypatch.setattr(identification, "accepted_of", lambda *_: accepted)
    value = next(each for each in beside_dive().values if each.name == "M_u")
    assert value.low95 < 120.0 < value.high95
    assert value.is_news


def test_doubts_are_told_in_full_before_the_values(beside_dive):
    doubted = {"sentence": DOUBT, "about": ["D_u"], "outcome": "converged", "culprit": "recording"}
    lines = result(beside_dive(doubts=[doubted]), 80)
    words = plain(lines)
    at = next(n for n, line in enumerate(words) if line.startswith("▲"))
    assert " ".join(line.strip() for line in words[at : at + 2]) == f"▲ {DOUBT}"
    assert at < next(n for n, line in enumerate(words) if line.startswith("M_u"))
    assert lines[1][0][1] == "warn"


def test_one_that_told_nothing_has_no_table(beside_dive):
    nothing = beside_dive(parameters=parameters(tuple(BY_NAME)), outcome="not identifiable", comparison=None)
    lines = plain(result(nothing, 80))
    assert lines[1] == "Not identifiable: 0 of 12 coefficients identified by likelihood."
    assert not any(line.startswith("M_u") for line in lines)
    assert any(line.startswith("1: M_qdot") for line in lines)


@pytest.mark.parametrize(
    ("state", "words"),
    [
        (at_work(done=Done(2, None, errors=("x.tlog: no such dive",))), ["x.tlog: no such dive"]),
        (at_work(done=Done(-9, None, ())), ["identify ended with exit code -9 and said nothing"]),
        (
            at_work(done=STOPPED, cancelled=True),
            ["identify was stopped by you; what lay there before stays"],
        ),
        (
            at_work(PAGE, done=STOPPED, cancelled=True),
            ["the page of identify was stopped by you; what it found is below"],
        ),
        (at_work(done=Done(exit_codes.NO, {}, ())), []),
        (at_work(*passes()), []),
    ],
    ids=["failed", "silent", "stopped", "its page stopped", "over", "at work"],
)
def test_a_run_without_a_result_says_how_it_ended(state, words):
    assert plain(ended("identify", state, 80)) == words


def test_the_command_line_leaves_its_results_beside_the_dive(tmp_path):
    words = words_for(str(tmp_path), "ruvifist:hovering", results_beside(tmp_path))
    assert words[:4] == ("identify", str(tmp_path), "--vehicle", "ruvifist:hovering")
    assert words[4:] == (
        *("--json", str(tmp_path / "identified.json")),
        *("--param", str(tmp_path / "identified.param")),
        *("--report", str(tmp_path / "identified.html")),
    )
