"""A diagnosis as lines: nothing is wider than it may be, numbers stand where colours do, old files are read."""

import json
from pathlib import Path

import pytest
from made_diagnosis import diagnosis

from tui.app.drawing import width
from tui.app.screens import diagnose_lines as made
from tui.app.screens.diagnose_lines import PHASES, answer

KEPT = sorted((Path(__file__).parents[1] / "data" / "sealed_answers").glob("*.json"))
PARTS = (made.verdict, made.where, made.which, made.how_far, made.what_next)


def text(lines):
    return ["".join(span for span, _ in line).rstrip() for line in lines]


def found(**change):
    return answer(diagnosis() | change)


@pytest.mark.parametrize("cells", [78, 80, 110, 160])
@pytest.mark.parametrize("part", PARTS)
def test_no_line_is_wider_than_there_is_room(part, cells):
    answers = [found(), *(answer(json.loads(path.read_text(encoding="utf-8"))) for path in KEPT)]
    assert len(answers) > 5
    assert all(width(line) <= cells for one in answers for line in part(one, cells))


def test_the_map_has_a_row_a_degree_of_freedom_and_its_cells_their_share_in_numbers():
    head, *rows, foot = text(made.where(found(), 80))
    assert head.split("  ")[-1].strip() == "all"
    assert [row.split()[0] for row in rows] == ["surge", "sway", "heave", "roll", "pitch", "yaw"]
    assert " ".join(rows[1].split()) == "sway <1 % · · ▓▓▓▓ 19 % ▒▒▒▒ 8 % <1 % 28 %"
    assert " ".join(rows[5].split()) == "yaw · · · ▒▒▒▒ 3 % ████ 56 % · 59 %"
    assert " ".join(foot.split()) == "all <1 % 1 % · 26 % 66 % 6 %"


def test_the_columns_of_the_map_stand_under_their_words():
    head, *rows, _ = text(made.where(found(), 80))
    ends = [head.index(words) + len(words) for words in PHASES.values()]
    turning = ends[list(PHASES).index("turning")]
    assert rows[5][:turning].endswith("56 %")


def test_where_there_is_no_gap_the_map_says_that_it_is_of_noise():
    assert text(made.where(found(verdict="no_gap"), 80))[-1] == "there is no gap: these are shares of noise"
    assert text(made.where(found(), 80))[-1].startswith("all")


def test_the_missing_force_stands_beside_the_map_where_there_is_room():
    head, *rows, _ = text(made.where(found(), 110))
    assert head.endswith("missing force")
    assert rows[1].endswith("2.43 N")
    assert rows[4].endswith("-- N m")


def test_causes_are_ranked_with_evidence_probability_and_what_they_are_mistaken_for():
    lines = text(made.which(found(), 80))
    assert lines[1].startswith("1 quadratic drag")
    assert lines[1].endswith("483 nats      98 %")
    assert lines[2] == "  N_rr 9.84 N m s²/rad² (95 %: 9.05 to 10.62)"
    assert any("can't tell it from command delay" in line for line in lines)
    assert lines[-3] == "tried as well, and not accepted"
    assert lines[-2].startswith("  waves: too little here")
    assert lines[-1].startswith("  weak thruster 5")  # a DVL bias that gains 0.03 nats is left out


def test_a_cause_less_probable_than_not_is_possible_and_not_accepted():
    one, other = diagnosis()["effects"]
    lines = text(made.which(found(effects=[one, other | {"probability": 0.42}]), 80))
    heads = [n for n, line in enumerate(lines) if line.startswith(("cause ", "possible", "tried as well"))]
    accepted, possible = lines[heads[0] : heads[1]], lines[heads[1] : heads[2]]
    assert possible[0].startswith("possible, not accepted ")
    assert possible[1].startswith("2 thruster lag or command del")
    assert possible[1].endswith("37 nats      42 %")
    assert not any("thruster lag" in line for line in accepted)


def test_where_no_cause_is_likely_none_is_accepted_and_the_possible_ones_are_named():
    lines = text(
        made.which(found(effects=[one | {"probability": 0.49} for one in diagnosis()["effects"]]), 80)
    )
    assert lines[0] == "No candidate of the library is accepted as a cause."
    assert lines[2].startswith("possible, not accepted ")
    assert lines[3].startswith("1 quadratic drag")


def test_evidence_bars_grow_with_evidence_and_the_strongest_fills_its_place():
    bars = [line.count("█") for line in text(made.which(found(), 80)) if "nats" in line]
    assert bars[0] == made.BAR_CELLS - 8
    assert bars == sorted(bars, reverse=True)
    assert bars[-1] > 0


def test_the_drift_falls_from_before_to_the_floor_in_numbers_and_bars():
    lines = text(made.how_far(found(), 80))
    assert lines[1] == "this dive"
    assert [line.split()[:2] for line in lines[2:5]] == [
        ["before", "3.57"],
        ["after", "1.02"],
        ["floor", "1.00"],
    ]
    assert lines[5].split("  ")[-1].strip() == "98 % (93 to 100 %) of what can be closed"
    assert lines[9].startswith("check dive 2026-11-20T1015Z-validation")
    assert lines[2].count("█") == pytest.approx(3.57 * lines[4].count("█"), rel=0.1)


def test_what_to_dive_next_comes_before_the_notes():
    lines = text(made.what_next(found(), 80))
    assert lines[0].startswith("Dive next: square waves")
    assert lines[-1].startswith("The DVL had no bottom lock")


def test_an_answer_without_words_is_told_all_the_same():
    bare = answer({key: value for key, value in diagnosis().items() if key != "told"})
    assert bare.sentence == "A cause is one of several that this dive can't tell apart."
    assert [one.name for one in bare.causes] == ["quadratic drag", "thruster lag"]
    assert bare.causes[0].values == ("N_rr 9.84 N m s2/rad2 (95 %: 9.05 to 10.6)",)
    assert bare.causes[1].alike == "This dive can't tell it from command delay."
    assert bare.next == ("square waves of surge force",)
    assert text(made.verdict(bare, 80))[0].split() == ["◐", "AMBIGUOUS"]


@pytest.mark.parametrize(
    "data", [None, [], {}, {"verdict": "explained"}, {"gap": {}, "effects": [], "next": None}]
)
def test_what_is_no_diagnosis_is_none(data):
    assert answer(data) is None


def test_no_cause_and_nothing_next_is_said():
    none = found(effects=[], verdict="no_gap", told=None, next=None)
    assert text(made.which(none, 80)) == ["No candidate of the library is accepted as a cause."]
    assert text(made.what_next(none, 80)) == ["Nothing is left to split: dive on."]


def test_what_is_explained_in_part_and_what_the_disturbance_takes_is_said():
    partly = found(verdict="partly", told=diagnosis()["told"] | {"disturbance": ["In surge it takes 3.1 N."]})
    assert text(made.verdict(partly, 80))[0].split()[:2] == ["◑", "PARTLY"]
    assert text(made.where(partly, 80))[-1] == "In surge it takes 3.1 N."
    bare = answer({key: value for key, value in diagnosis().items() if key != "told"} | {"verdict": "partly"})
    assert bare.sentence.startswith("Part of the gap is explained, and something is left")


def test_the_check_dive_is_told_by_degree_of_freedom_first_in_absolute_terms():
    surge = {
        "before": 0.034, "after": 0.016, "floor": 0.009, "nrmse_before": 0.61, "nrmse_after": 0.28,
        "nrmse_baseline": 0.33,
    }  # fmt: skip
    yaw = surge | {"before": 0.02, "nrmse_baseline": None}
    shrink = diagnosis()["shrink"]
    one = found(shrink=shrink | {"check": shrink["check"] | {"by_axis": {"surge": surge, "yaw": yaw}}})
    lines = text(made.how_far(one, 80))
    assert lines[0] == "check dive 2026-11-20T1015Z-validation: drift over 5 s by degree of freedom"
    assert lines[2].split() == ["surge", "34", "16", "9.0", "mm/s", "0.61", "to", "0.28", "0.33"]
    assert lines[3].split()[:2] == ["yaw", "1.1"]
    assert lines[3].endswith("--")
    assert lines[5].startswith("drift of the model over 5 s, in floors")
    assert all(width(line) <= 78 for line in made.how_far(one, 78))
