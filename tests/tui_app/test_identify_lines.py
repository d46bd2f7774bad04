"""An identification as lines: bars, curves that converge, and the result beside what was accepted."""

import os

import numpy as np
import pytest
from made_identified import DOUBT, PAGE, REASON, answer, identified, leave, passes

from bridge import exit_codes
from bridge.vehicle.coefficients import BY_NAME
from gcs_plugin.params.last_accepted import AcceptedValue
from tui.app.drawing import width
from tui.app.jobs import Done, JobState
from tui.app.screens import identify_lines
from tui.app.screens.identify_lines import (
    Passes,
    converging,
    curves,
    ended,
    load_identified,
    passes_of,
    places,
    progress,
    result,
    words_for,
)

WORDS = ("identify", "dives/2026-11-21T0352Z-hovering", "--vehicle", "ruvifist")
RUNNING = JobState(WORDS, 10.0, passes())


def said(lines):
    return ["".join(text for text, _ in line) for line in lines]


def roles(lines):
    return {role for line in lines for text, role in line if text.strip()}


@pytest.fixture
def dive(tmp_path):
    """A dive's folder with its identification beside it."""

    def made(**what):
        leave(words_for(str(tmp_path), "ruvifist", places(tmp_path)), identified(**what))
        return tmp_path

    return made


def test_a_bar_for_each_method_tells_how_far_it_is_and_what_it_does():
    lines = said(progress(RUNNING, 24.0, 80))
    assert lines[0].startswith("IDENTIFYING 2026-11-21T0352Z-hovering ─")
    assert lines[0].endswith("00:00:14")
    assert lines[1] == "likelihood  █████████░░░░░░░░░░░░░░░  39 %  fitting all axes together"
    assert lines[2] == "pinn        ███████░░░░░░░░░░░░░░░░░  27 %  pass 3"


def test_a_job_that_has_told_nothing_reads_the_dive_and_one_that_is_stopped_says_so():
    assert said(progress(JobState(WORDS, 0.0), 1.0, 80))[1] == "reading the dive"
    assert said(progress(JobState(WORDS, 0.0, cancelled=True), 1.0, 80))[0].startswith("STOPPING")


@pytest.mark.parametrize(
    ("what", "title"),
    [
        ({"done": Done(exit_codes.DONE, {}, ())}, "IDENTIFIED"),
        ({"done": Done(exit_codes.NO, {}, ())}, "IDENTIFIED"),
        ({"done": Done(exit_codes.BAD_INPUT, None, ())}, "FAILED"),
        ({"done": Done(exit_codes.INTERRUPTED, None, ()), "cancelled": True}, "STOPPED"),
    ],
)
def test_once_it_is_over_the_title_says_how_it_ended(what, title):
    over = JobState(WORDS, 10.0, (*passes(), answer(), answer("pinn")), ended_s=43.0, **what)
    assert said(progress(over, 99.0, 80))[0].startswith(f"{title} 2026-11-21T0352Z-hovering ─")
    assert said(progress(over, 99.0, 80))[0].endswith("00:00:33")


def test_the_answer_of_one_method_stands_beside_the_curves_of_the_other_as_soon_as_it_is_there():
    told = (*passes(), answer(), *passes(4)[-1:])
    assert said(curves(told, 80, 18))[0].startswith("M_u      111.8 ± 2.8 kg        vs 111.7 ")
    assert said(progress(JobState(WORDS, 0.0, told), 1.0, 80))[1].endswith("100 %  answered")
    assert len(passes_of(told)[0].value) == 4


def test_an_answer_alone_is_told_line_by_line_with_its_intervals():
    assert said(curves((answer(),), 80, 18))[0] == "M_u      111.7 ± 3.4 kg  by likelihood"


def test_once_all_have_answered_there_is_one_bar_for_the_page_that_is_written():
    told = (*passes(), answer(), answer("pinn"), PAGE)
    assert said(progress(JobState(WORDS, 0.0, told), 1.0, 80)) == [
        "page        ██████░░░░░░░░░░░░░░░░░░  25 %  writing the page"
    ]


def test_values_are_gathered_pass_by_pass():
    first, *others = passes_of(passes())
    assert (first.name, len(others)) == ("M_u", 11)
    assert first.value.tolist() == pytest.approx([117.285, 113.09625, 112.0490625])
    assert first.half.tolist() == pytest.approx([11.17, 5.585, 3.7233333])
    assert passes_of(passes(0)) == ()


def test_a_curve_has_the_value_now_and_the_ends_of_its_widest_interval():
    lines = said(converging(passes_of(passes())[0], "kg", 40, 5))
    assert lines[0] == "M_u      112.0 ± 3.7 kg           pass 3"
    assert lines[1].startswith(" 128.5┤")
    assert lines[4].startswith(" 106.1┤")
    assert len(lines) == 5


def test_a_value_that_stands_still_is_a_level_line_in_the_middle_and_what_is_to_come_is_blank():
    still = Passes("D_u", np.full(2, 50.0), np.zeros(2))
    lines = said(converging(still, "", 7 + 8, 4))
    # Two of at least four passes fill half of the eight cells.
    assert lines[2][7:].rstrip() in ("⠒⠒⠒⠒", "⠤⠤⠤⠤")
    assert not lines[1][7:].strip()
    assert not lines[3][7:].strip()


@pytest.mark.parametrize(("cells", "rows"), [(80, 18), (156, 40), (80, 6), (30, 12)])
def test_all_curves_fit_into_their_room(cells, rows):
    lines = curves(passes(), cells, rows)
    assert len(lines) <= rows
    assert all(width(line) <= cells for line in lines)
    assert all(name in "\n".join(said(lines)) for name in BY_NAME)


def test_what_lies_beside_a_dive_is_read(dive):
    folder = dive()
    read = load_identified(folder, folder)
    assert (read.outcome, read.count, read.param) == ("converged", 11, folder / "identified.param")
    assert (read.comparison.method, read.comparison.outcome) == ("pinn", "converged")
    assert load_identified(folder / "other", folder) is None


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"dive": 1}'])
def test_a_file_that_is_no_identification_is_none(text, tmp_path):
    (tmp_path / "identified.json").write_text(text, encoding="utf-8")
    assert load_identified(tmp_path, tmp_path) is None


def test_parameters_of_an_earlier_identification_are_not_offered(dive):
    folder = dive()
    os.utime(folder / "identified.param", (1.0, 1.0))
    assert load_identified(folder, folder).param is None


def test_the_result_begins_with_its_outcome_and_has_each_value_with_interval_and_unit(dive):
    folder = dive()
    lines = said(result(load_identified(folder, folder), 80))
    assert lines[1] == "Converged: 11 of 12 coefficients identified by likelihood; pinn beside it:"
    assert "Likelihood and pinn agree in all 11 parameters that both identify." in lines
    row = next(line for line in lines if line.startswith("M_u"))
    assert row.split() == ["M_u", "111.7", "108.3", "…", "115.1", "kg"]
    assert next(line for line in lines if line.startswith("I_q")).split() == ["I_q", "--", "no,", "see", "1"]
    assert f"1: {REASON}"[:60] in "\n".join(lines)
    assert "The DVL had no bottom lock in 1 % of its samples." in lines


def test_what_was_last_accepted_stands_beside_it_and_news_is_warned_of(dive, monkeypatch):
    accepted = {
        BY_NAME[name].parameter_id(0): AcceptedValue(value, None, "")
        for name, value in {"M_u": 110.0, "D_u": 80.0}.items()
    }
    monkeypatch.setattr(identify_lines, "last_accepted", lambda _: accepted)
    folder = dive()
    lines = result(load_identified(folder, folder), 80)
    rows = {line[0][0].strip(): line for line in lines if line}
    assert rows["M_u"][-2:] == (("     110.0", "plain"), ("    +1.5 %", "plain"))
    assert rows["D_u"][-2:] == (("     80.00", "plain"), ("   -29.5 %", "warn"))


def test_doubts_are_told_in_full_before_the_values(dive):
    doubted = {"sentence": DOUBT, "about": ["D_u"], "outcome": "converged", "culprit": "recording"}
    folder = dive(doubts=[doubted])
    lines = said(result(load_identified(folder, folder), 80))
    at = next(n for n, line in enumerate(lines) if line.startswith("▲"))
    assert " ".join(line.strip() for line in lines[at : at + 2]) == f"▲ {DOUBT}"
    assert at < next(n for n, line in enumerate(lines) if line.startswith("M_u"))
    assert "warn" in roles(result(load_identified(folder, folder), 80)[1:2])


def test_one_that_told_nothing_has_no_table(dive):
    from made_identified import parameters

    nothing = parameters(tuple(BY_NAME))
    folder = dive(parameters=nothing, outcome="not identifiable", comparison=None)
    lines = said(result(load_identified(folder, folder), 80))
    assert lines[1] == "Not identifiable: 0 of 12 coefficients identified by likelihood."
    assert not any(line.startswith("M_u") for line in lines)
    assert any(line.startswith("1: M_qdot") for line in lines)


def test_a_run_that_failed_says_why_and_one_that_was_stopped_that_it_was():
    failed = JobState(WORDS, 0.0, done=Done(exit_codes.BAD_INPUT, None, errors=("x.tlog: no such dive",)))
    assert said(ended(failed, 80)) == ["x.tlog: no such dive"]
    silent = JobState(WORDS, 0.0, done=Done(-9, None, ()))
    assert said(ended(silent, 80)) == ["identify ended with exit code -9 and said nothing"]
    stopped = JobState(WORDS, 0.0, done=Done(exit_codes.INTERRUPTED, None, ()), ended_s=4.0, cancelled=True)
    assert said(ended(stopped, 80))[0].startswith("2026-11-21T0352Z-hovering: stopped by you after 00:00:04")
    drawing = JobState(WORDS, 0.0, (PAGE,), done=stopped.done, ended_s=4.0, cancelled=True)
    assert said(ended(drawing, 80)) == [
        "2026-11-21T0352Z-hovering: its page was stopped by you; its values are below"
    ]
    assert ended(JobState(WORDS, 0.0, done=Done(exit_codes.NO, {}, ())), 80) == ()
    assert ended(RUNNING, 80) == ()


def test_the_command_line_leaves_its_results_beside_the_dive(tmp_path):
    words = words_for(str(tmp_path), "ruvifist:hovering", places(tmp_path))
    assert words[:4] == ("identify", str(tmp_path), "--vehicle", "ruvifist:hovering")
    assert words[4:] == (
        *("--json", str(tmp_path / "identified.json")),
        *("--param", str(tmp_path / "identified.param")),
        *("--report", str(tmp_path / "identified.html")),
    )
