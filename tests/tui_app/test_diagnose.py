"""The screen Diagnose: the verb that it runs, and a diagnosis as lines."""

import json
import os
import shutil
from dataclasses import asdict
from pathlib import Path
from types import SimpleNamespace

import pytest
from fake_verbs import FakeVerbs, let_go
from made_diagnosis import CHECK, DIVE, OLDER, desk_with, diagnosis
from made_dives import dive, record
from made_view import FixedViews
from screen_text import NARROW, WIDE, Lacks, Sees, made, plain, play, played, resized, run, shows

from bridge.reports import UNKEPT, Report
from bridge.vehicle.forecast import ForecastRow
from gcs_plugin.params.sidecar import sidecar_path
from tui.app.diagnosis import answer
from tui.app.drawing import width
from tui.app.jobs import Jobs
from tui.app.screens import diagnose, diagnose_lines
from tui.app.screens.parameters import ParametersScreen

TRYING = Report("diagnosing", 0.4, "trying 41 candidates")


def leave(words):
    """Write what the verb writes, where its words want it."""
    if words[0] == "diagnose":
        for option in ("--json", "--accept"):
            Path(words[words.index(option) + 1]).write_text(json.dumps(diagnosis()), encoding="utf-8")


def verb(tmp_path, **how):
    """A diagnosis that waits until it is let go, beside a list of the check dive."""
    rows = [dive("validation", folder=str(tmp_path / CHECK))]
    results = {"dives": rows, "diagnose": diagnosis(), "params": None}
    return FakeVerbs(results, **{"tells": [TRYING], "held": ("diagnose",), "leave": leave} | how)


def test_where_not_all_fits_a_key_goes_from_section_to_section_and_round(tmp_path):
    titles = ("WHERE force is", "WHICH causes", "HOW FAR it", "WHAT TO DIVE", "WHERE force is")
    steps = [
        step for n, title in enumerate(titles) for step in (Sees(title), Sees(f"{n % 4 + 1} of 4 [s]"), "s")
    ]
    played(desk_with(tmp_path), "4", *steps)


def test_another_dive_is_shown_from_its_first_section_on(tmp_path):
    def choose_another(app):
        app.desk.dive = tmp_path / CHECK

    kept = ("4", "s", Sees("2 of 4 [s]"), "1", "4", Sees("2 of 4 [s]"))
    played(desk_with(tmp_path), *kept, choose_another, "1", "4", Sees("1 of 4 [s]"))


def test_it_runs_the_verb_on_the_dive_checked_on_the_newest_other_and_shows_what_that_left(tmp_path):
    verbs, folder = verb(tmp_path), tmp_path / DIVE
    runs = (Sees(f"diagnose {DIVE}"), Sees("40 % trying 41 candidates"), Sees("x Cancel"))
    offered = Sees(f"[d] diagnoses {DIVE}, checked on {CHECK}; [c] changes that.")
    desk = desk_with(tmp_path, diagnosed=False, jobs=Jobs(verbs))
    # It goes on while another screen is looked at.
    played(desk, "4", offered, "d", *runs, "1", let_go, "4", Sees("AMBIGUOUS"))
    (words,) = verbs.words
    assert words[:3] == ("diagnose", str(folder), "--vehicle")
    assert words[3].endswith("ruvifist.yaml:hovering")
    assert words[4:] == (
        "--check", str(tmp_path / CHECK), "--accepted", "none", "--json", str(folder / "diagnosis.json"),
        "--report", str(folder / "diagnosis.html"), "--accept", str(folder / "diagnosed.param"),
    )  # fmt: skip


def test_it_takes_for_accepted_what_the_receipts_say_was_in_force(tmp_path):
    verbs = verb(tmp_path)
    desk = desk_with(tmp_path, diagnosed=False, jobs=Jobs(verbs))
    desk.receipts = tmp_path / "receipts"
    desk.receipts.mkdir()
    played(desk, "4", "d", Sees(f"diagnose {DIVE}"))
    (words,) = verbs.words
    assert words[words.index("--accepted") + 1] == str(desk.receipts)


def test_a_dive_of_two_seconds_is_never_what_it_is_checked_on(tmp_path):
    desk = desk_with(tmp_path, diagnosed=False)
    record(tmp_path / CHECK / "telemetry.tlog", 1_795_165_923, 1_795_165_925)
    played(desk, "4", Sees(f"[d] diagnoses {DIVE}, checked on {OLDER}; [c] changes that."))


def test_the_check_dive_is_chosen_by_a_key_and_may_be_none(tmp_path):
    ends = (f"checked on {CHECK};", f"checked on {OLDER};", "without a check dive;", f"checked on {CHECK};")
    played(desk_with(tmp_path), "4", *(step for end in ends for step in (Sees(f"it again, {end}"), "c")))


def test_it_is_checked_first_on_a_dive_with_the_same_values_later_before_earlier_and_near_in_time(
    tmp_path, monkeypatch
):
    desk = desk_with(tmp_path)
    same, late, before = (
        "2026-11-20T0900Z-hovering",
        "2026-11-20T1400Z-hovering",
        "2026-11-20T0830Z-hovering",
    )
    for name in (same, late, before):
        shutil.copytree(tmp_path / CHECK, tmp_path / name)
    upload = tmp_path / "receipts" / "2026-11-20T084500Z-receipt.json"
    upload.parent.mkdir()
    upload.write_text("{}", encoding="utf-8")
    ended = {OLDER: 0, before: 10, same: 30, DIVE: 40, CHECK: 50, late: 60}
    for name, second in ended.items():
        os.utime(tmp_path / name / "telemetry.tlog", (second, second))
    os.utime(upload, (20, 20))
    past = SimpleNamespace(preimage=upload.with_name("2026-11-20T084500Z-before.param"))
    monkeypatch.setattr("tui.app.desk.kept_of", lambda *_: [past])
    ends = [f"checked on {name};" for name in (CHECK, late, same, before, OLDER)]
    played(desk, "4", *(step for end in ends for step in (Sees(end), "c")))


def test_a_diagnosis_that_is_cancelled_is_ended_and_says_so(tmp_path):
    stopped = ("x", lambda _: None, Sees("diagnose was stopped by you"), Sees("d Diagnose"))
    played(desk_with(tmp_path, jobs=Jobs(verb(tmp_path))), "4", "d", *stopped)


def test_a_diagnosis_that_fails_says_why_beside_what_was_known(tmp_path):
    verbs = FakeVerbs({"diagnose": None}, 2, ["dive is shorter than 60 s"])
    seen = (Sees("AMBIGUOUS"), Sees("dive is shorter than 60 s"), Lacks("seatrial:"))
    played(desk_with(tmp_path, jobs=Jobs(verbs)), "4", "d", *seen)


def test_without_a_vehicle_file_it_says_what_lacks_and_starts_nothing(tmp_path):
    desk = desk_with(tmp_path, diagnosed=False, vehicle="")
    played(desk, "4", "d", Sees("No vehicle file is known"), lambda _: not desk.jobs.runs("diagnose"))


def test_what_an_earlier_diagnosis_accepted_is_not_offered_for_upload(tmp_path):
    desk = desk_with(tmp_path)
    param, result = tmp_path / DIVE / "diagnosed.param", tmp_path / DIVE / "diagnosis.json"
    played(desk, "4", Lacks("p Parameters"), size=WIDE)
    param.write_text("", encoding="utf-8")
    written_ns = result.stat().st_mtime_ns
    for offset_ns, step in ((-1_000_000_000, Lacks), (1_000_000, Sees)):
        os.utime(param, ns=(written_ns + offset_ns, written_ns + offset_ns))
        played(desk, "4", step("p Parameters"), size=WIDE)


def test_what_the_accepted_model_foretells_stands_before_the_drifts(tmp_path):
    desk, param = desk_with(tmp_path), tmp_path / DIVE / "diagnosed.param"
    row = ForecastRow("yaw", "rad/s", "both", "both", 0.0106, 0.0014, 0.1)
    sidecar_path(param).write_text(json.dumps({"foretold": [asdict(row)]}), encoding="utf-8")
    foretold = "foretold for the next dive in both, rms over the whole mission: yaw 0.61 -> 0.080 deg/s"
    played(desk, "4", "s", "s", Sees("HOW FAR"), Lacks(foretold))  # of a model that is no longer there
    param.write_text("", encoding="utf-8")
    played(desk, "4", "s", "s", Sees(foretold), Lacks("is not foretold"))
    why = "How the next dive tracks is not foretold: the vehicle makes up for a thruster by itself."
    sidecar_path(param).write_text(json.dumps({"foretold": [], "unforetold": [why]}), encoding="utf-8")
    played(desk, "4", "s", "s", Sees(why), Lacks("foretold for the next dive"))


def test_the_key_on_dives_diagnoses_the_dive_under_the_mark_at_once(tmp_path):
    verbs = verb(tmp_path)
    desk = desk_with(tmp_path, jobs=Jobs(verbs))
    played(desk, "2", "d", Sees(f"diagnose {CHECK}"), lambda _: desk.dive == tmp_path / CHECK)
    assert verbs.words[-1][:2] == ("diagnose", str(tmp_path / CHECK))


def test_a_key_opens_parameters_with_what_was_accepted(tmp_path):
    verbs = FakeVerbs({"params": None}, 3, ["no vehicle is found"])
    desk, param = desk_with(tmp_path, jobs=Jobs(verbs)), tmp_path / DIVE / "diagnosed.param"
    param.write_text("", encoding="utf-8")
    played(desk, "4", "p", shows(ParametersScreen), lambda _: desk.param == param, size=WIDE)


def test_the_dives_to_check_on_are_not_looked_for_at_each_step_of_a_diagnosis_at_work(tmp_path, monkeypatch):
    """Of hundreds that takes longer than a step, and no key would be answered."""
    looked, comparable = [], diagnose.DiagnoseScreen.comparable

    def look(screen, dive):
        looked.append(dive)
        return comparable(screen, dive)

    def steps_on(app):
        before = len(looked)
        app.desk.jobs._change("diagnose", reports=(TRYING,))
        app._show()
        assert len(looked) == before

    monkeypatch.setattr(diagnose.DiagnoseScreen, "comparable", look)
    desk = desk_with(tmp_path, diagnosed=False, jobs=Jobs(verb(tmp_path, tells=[])))
    played(desk, "4", "d", steps_on, Sees("trying 41 candidates"), let_go, lambda _: None, Sees("AMBIGUOUS"))


def diffs(verbs):
    """The files that were compared with the vehicle."""
    return [Path(words[2]).name for words in verbs.words if words[:2] == ("params", "diff")]


def test_a_model_of_an_earlier_diagnosis_is_compared_no_more_once_a_newer_one_found_nothing(tmp_path):
    folder = tmp_path / DIVE

    def finds_nothing(words):
        if words[0] == "diagnose":
            (folder / "diagnosis.json").write_text(json.dumps(diagnosis()), encoding="utf-8")

    verbs = verb(tmp_path, held=(), leave=finds_nothing)
    desk = desk_with(tmp_path, jobs=Jobs(verbs))
    (folder / "diagnosed.param").write_text("FF1_M_U,1\n", encoding="utf-8")
    played(desk, "4", "p", shows(ParametersScreen), "4", "d", "5", shows(ParametersScreen))
    assert diffs(verbs) == ["diagnosed.param"]


def test_what_a_diagnosis_accepts_is_compared_though_the_identification_was_looked_at_before(tmp_path):
    folder = tmp_path / DIVE
    verbs = verb(tmp_path, held=())
    desk = desk_with(tmp_path, diagnosed=False, jobs=Jobs(verbs))
    desk.param = folder / "identified.param"
    desk.param.write_text("FF1_M_U,1\n", encoding="utf-8")
    played(desk, "5", "4", "d", "5", shows(ParametersScreen))
    assert diffs(verbs) == ["identified.param", "diagnosed.param"]


def test_a_diagnosis_that_finds_no_room_on_the_disk_is_shown_and_said_to_be_kept_nowhere(tmp_path):
    why = "full/diagnosis.json: the JSON can't be written (No space left on device); give another file"
    newer = diagnosis() | {"verdict": "unknown"}
    verbs = FakeVerbs({"diagnose": None}, 2, [why], tells=[Report(UNKEPT, 1.0, why, result=newer)])
    desk = desk_with(tmp_path, jobs=Jobs(verbs))
    (tmp_path / DIVE / "diagnosed.param").write_text("", encoding="utf-8")
    seen = (Sees("UNKNOWN"), Lacks("AMBIGUOUS"), Lacks("p Parameters"))
    kept_nowhere = Sees(f"{why}; its values are below, and kept nowhere")
    played(desk, "4", Sees("AMBIGUOUS"), "d", *seen, kept_nowhere, size=WIDE)


KEPT = sorted((Path(__file__).parents[1] / "data" / "sealed_answers").glob("*.json"))
PARTS = (
    diagnose_lines.verdict_lines,
    diagnose_lines.where_lines,
    diagnose_lines.which_lines,
    diagnose_lines.how_far_lines,
    diagnose_lines.next_dive_lines,
)


def diagnosed(**change):
    return answer(diagnosis() | change)


@pytest.mark.parametrize("cells", [78, 110])
@pytest.mark.parametrize("part", PARTS)
def test_no_line_is_wider_than_there_is_room(part, cells):
    kept = (answer(json.loads(path.read_text(encoding="utf-8"))) for path in KEPT)
    answers = [diagnosed(), *filter(None, kept)]
    assert len(answers) > 5
    assert all(width(line) <= cells for shown in answers for line in part(shown, cells))


def test_a_cause_less_probable_than_not_is_possible_and_not_accepted():
    first, second = diagnosis()["effects"]
    lines = plain(diagnose_lines.which_lines(diagnosed(effects=[first, second | {"probability": 0.42}]), 80))
    heads = [n for n, line in enumerate(lines) if line.startswith(("cause ", "possible", "tried as well"))]
    accepted, possible = lines[heads[0] : heads[1]], lines[heads[1] : heads[2]]
    assert possible[0].startswith("possible, not accepted ")
    assert possible[1].startswith("2 thruster lag or command del")
    assert possible[1].endswith("42 %  █████████▍          37 nats")
    assert not any("thruster lag" in line for line in accepted)


@pytest.mark.parametrize("part", [part for part in PARTS if part is not diagnose_lines.where_lines])
def test_on_a_phone_no_word_is_cut(part):
    wide, phone = (plain(part(diagnosed(), cells)) for cells in (200, 48))
    assert max(map(len, phone)) <= 48
    assert {word for line in wide for word in line.split() if word.isalpha()} <= set(" ".join(phone).split())


@pytest.mark.parametrize(
    "data", [None, [], {}, {"verdict": "explained"}, {"gap": {}, "effects": [], "next": None}]
)
def test_what_is_no_diagnosis_is_none(data):
    assert answer(data) is None


def test_a_phase_that_no_diagnosis_knows_makes_it_none():
    gap = diagnosis()["gap"]
    strange = [gap["where"][0] | {"phase": "loitering"}, *gap["where"][1:]]
    assert diagnosed(gap=gap | {"where": strange}) is None


@pytest.mark.parametrize("unknown", ["before", "after", "floor"])
def test_a_drift_that_is_not_known_is_shown_as_that(unknown):
    shrink = diagnosis()["shrink"]
    surge = shrink["check"]["by_axis"]["surge"] | {unknown: None}
    by_axis = shrink["check"]["by_axis"] | {"surge": surge}
    shown = diagnosed(shrink=shrink | {"check": shrink["check"] | {"by_axis": by_axis}})
    lines = plain(diagnose_lines.how_far_lines(shown, 110))
    assert "—" in next(line for line in lines if line.startswith("  surge"))


def test_no_cause_and_nothing_next_is_said():
    none = diagnosed(
        effects=[],
        gap=diagnosis()["gap"] | {"before": 1.1},
        verdict="no_gap",
        told=diagnosis()["told"] | {"causes": [], "next": [], "notes": []},
    )
    assert plain(diagnose_lines.where_lines(none, 80)) == ["There is no gap, so it lies nowhere."]
    assert (
        plain(diagnose_lines.which_lines(none, 80))[0]
        == "No candidate of the library is accepted as a cause."
    )
    assert not set("░▒▓█▏") & set(
        "".join(plain((*diagnose_lines.which_lines(none, 80), *diagnose_lines.how_far_lines(none, 80))))
    )
    assert plain(diagnose_lines.next_dive_lines(none, 80)) == ["Nothing is left to split: dive on."]


def test_a_drift_that_nothing_explains_is_not_called_no_gap_where_it_lies():
    gap = {"verdict": "no_gap", "effects": [], "told": diagnosis()["told"] | {"causes": []}}
    for before, words in ((1.3, "The model drifts further than noise"), (1.1, "There is no gap")):
        shown = diagnosed(**gap, gap=diagnosis()["gap"] | {"before": before})
        assert plain(diagnose_lines.where_lines(shown, 120))[0].startswith(words)


@pytest.mark.parametrize(("after", "then"), [(1.1, "upload what was found, and dive on"), (1.6, "dive on")])
def test_an_upload_is_advised_only_where_no_check_dive_is_followed_worse_with_the_causes(after, then):
    told = diagnosis()["told"] | {"next": [], "notes": []}
    check = {"check": diagnosis()["shrink"]["check"] | {"before": 1.5, "after": after}}
    explained = diagnosed(verdict="explained", told=told, shrink=diagnosis()["shrink"] | check)
    assert plain(diagnose_lines.next_dive_lines(explained, 80)) == [f"Nothing is left to split: {then}."]


def test_the_check_dive_stands_first_of_how_far_the_gap_shrinks_and_the_fitted_dive_last():
    lines = plain(diagnose_lines.how_far_lines(diagnosed(), 80))
    heads = [line.split("  ")[0] for line in lines if line[:1] not in ("", " ")]
    assert heads[1:] == [f"check dive {CHECK}", "pieces held out", "this dive, which was fitted"]


@pytest.mark.parametrize("cells", [68, 80, 104])
def test_no_head_of_the_map_touches_another(cells):
    head, *rows = plain(diagnose_lines.where_lines(diagnosed(), cells))
    assert " ".join(head.split("missing")[0].split()) == "at rest speeds up slows steady turns reverses"
    assert all(len(line) <= cells for line in (head, *rows))


def test_where_the_map_has_no_room_its_parts_are_listed():
    lines = plain(diagnose_lines.where_lines(diagnosed(), 48))
    assert [line.split()[:2] for line in lines[:2]] == [["yaw", "turns"], ["sway", "steady"]]


def test_what_is_explained_in_part_and_what_the_disturbance_takes_is_said():
    partly = diagnosed(
        verdict="partly", told=diagnosis()["told"] | {"disturbance": ["In surge it takes 3.1 N."]}
    )
    assert plain(diagnose_lines.verdict_lines(partly, 80))[0].split()[:2] == ["◑", "PARTLY"]
    assert plain(diagnose_lines.where_lines(partly, 80))[-1] == "In surge it takes 3.1 N."


def test_the_verdict_is_shown_to_its_end_on_every_screen(tmp_path):
    async def work(app, pilot):
        await play(app, pilot, "4")
        for size in ((48, 30), NARROW, WIDE):
            await resized(app, pilot, size)
            await play(app, pilot, Sees("Most of it lies in yaw, turning. [d] diagnoses it again"))

    run(made(FixedViews(), desk=desk_with(tmp_path)), NARROW, work)
