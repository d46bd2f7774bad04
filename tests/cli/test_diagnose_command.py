"""`seatrial diagnose`: check dives, simulators beside it, cut recordings, and the words of an answer."""

import gzip
import json
import math
from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from bridge import exit_codes, reports
from bridge.errors import ConfigError, FitError
from bridge.vehicle.coefficients import AcceptedEffect
from bridge.vehicle.config import load_vehicle
from gcs_plugin.params.files import read_parameters
from gcs_plugin.params.sidecar import read_sidecar
from identify.challenge.case import check_of, dive_of, draw_case
from identify.challenge.tlog import tlog_of
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.result import Accepted, Diagnosis, Finding, Gain, Gap, Share, Value
from identify.diagnose.shrink.shrunk import Shrink
from identify.diagnose.simulators import comparison as compared_by
from identify.dive import Dive
from identify.effects.hydrodynamics import DRAG_ASYMMETRY, QUADRATIC_DRAG
from identify.effects.library import library
from identify.effects.rigid_body import ADDED_PAYLOAD
from identify.ingest.same_dive import OVERLAPPING, PIECE, SAME, of_one_dive
from identify.run.diagnose import Before, effects_without
from identify.validation.forecast import Forecast
from tui import cli
from tui.accept_diagnosis import _sends, accept
from tui.commands.diagnose import is_for_upload, tell_diagnosis

DRAG = Finding(Cause(QUADRATIC_DRAG, QUADRATIC_DRAG.start()), (), {}, 0.95, {}, 50.0, Gain(0.0234, 0.0051))
D_U = {"D_u": Value(10.0, "N s/m", 9.0, 11.0)}


def diagnosis(*findings, **other):
    gap = Gap(2.0, (), (), {}, (Share("yaw", "turning", 1.0),), (), ())
    made = Diagnosis("d", "v", "c", "explained", gap, findings, (), None, None, None, None, (), 1.0)
    return replace(made, **other)


SHAPE = load_vehicle("ruvifist").vehicle.configurations["hovering"]


def printed(result):
    text = StringIO()
    tell_diagnosis(Console(file=text, width=1000), result)
    return text.getvalue()


@pytest.mark.parametrize(
    ("other", "offered"),
    [
        ({}, True),
        ({"first": ("The motion does not go the way the thrust pushes.",)}, False),
        ({"check": Shrink(3.0, 2.8, 0.11, 0.0, 0.2)}, False),
        ({"check": Shrink(3.0, 1.3, 0.9, 0.8, 1.0)}, True),
    ],
    ids=["sound", "mounted otherwise", "contradicted", "borne out"],
)
def test_an_upload_is_offered_only_where_the_diagnosis_does_not_advise_against_it(other, offered):
    found = Accepted(D_U, (AcceptedEffect("quadratic_drag", "quadratic drag", {"X_uu": 9.0}),), ())
    foretold = Shrink(3.0, 1.0, 0.98, 0.95, 1.0)
    assert is_for_upload(diagnosis(DRAG, accepted=found, heldout=foretold, **other)) is offered


def test_where_the_gap_lies_is_printed():
    assert "Where the missing force lies, most of it first: yaw, turning." in printed(diagnosis(DRAG))


def test_an_upload_is_promised_to_send_only_what_the_feed_forward_can_make_up_for():
    path = Path("x.param")
    upload = "seatrial params upload x.param sends"
    drag = Accepted({**D_U, "X_uu": Value(10.0, "N s2/m2", 9.0, 11.0)}, (), ())
    assert _sends(path, diagnosis(DRAG, accepted=drag), SHAPE) == f"{upload} it to the vehicle"
    munk = replace(DRAG, cause=Cause(DRAG_ASYMMETRY, DRAG_ASYMMETRY.start()))
    nominal_alone = (
        f"the feed-forward can make up for none of its causes; {upload} only the masses and dampings that were fitted "
        "beside them"
    )
    assert _sends(path, diagnosis(munk, accepted=Accepted(D_U, (), ())), SHAPE) == nominal_alone
    # Where the hull's own model has the drag, it makes up for no cause.
    assert _sends(path, diagnosis(munk, accepted=drag), replace(SHAPE, damping="both")) == nominal_alone
    nothing = _sends(path, diagnosis(munk, accepted=Accepted({}, (), ())), SHAPE)
    assert nothing == "nothing in it is for the vehicle; export and simulate --accepted take it"
    # A gain that was accepted before and is no longer is withdrawn.
    repaired = AcceptedEffect("weak_thruster", "weak thruster 1", {"gain": 1.0}, 1)
    assert (
        _sends(path, diagnosis(munk, accepted=Accepted(D_U, (repaired,), ())), SHAPE)
        == f"{upload} it to the vehicle"
    )
    payload = replace(DRAG, cause=Cause(ADDED_PAYLOAD, np.array([1.0])))
    sent = _sends(path, diagnosis(payload, accepted=Accepted(D_U, (), ())), SHAPE)
    assert sent == f"{upload} it to the vehicle"


def test_what_is_foretold_while_a_cause_is_accepted_shows_its_progress(tmp_path, monkeypatch, capsys):
    def flies(*given):
        given[-1](0.5)
        return Forecast((), (), ("foretold",))

    monkeypatch.setattr("identify.validation.forecast.forecast", flies)
    monkeypatch.setattr("tui.accept_diagnosis.contradictions", lambda *_: ())
    monkeypatch.setenv(reports.VARIABLE, reports.FORM)
    accepted = Accepted(D_U, (AcceptedEffect("quadratic_drag", "quadratic drag", {"X_uu": 9.0}),), ())
    file = load_vehicle("ruvifist")
    explained = diagnosis(DRAG, configuration="hovering", accepted=accepted)
    dive = Dive("dive", tmp_path, "1" * 64)
    assert "foretold" in accept(tmp_path / "x.param", explained, dive, file)
    (line,) = capsys.readouterr().err.splitlines()
    assert (json.loads(line)["of"], json.loads(line)["share"]) == ("foretelling the next dive", 0.5)
    assert read_sidecar(tmp_path / "x.param").unforetold == ("foretold",)


def test_a_gain_that_is_accepted_no_longer_is_written_as_none_and_is_no_effect_of_the_model(
    tmp_path, monkeypatch
):
    monkeypatch.setattr("identify.validation.forecast.forecast", lambda *_: Forecast((), (), ()))
    monkeypatch.setattr("tui.accept_diagnosis.contradictions", lambda *_: ())
    drag = AcceptedEffect("quadratic_drag", "quadratic drag", {"X_uu": 9.0})
    repaired = AcceptedEffect("weak_thruster", "weak_thruster of thruster 1", {"gain": 1.0}, 1)
    explained = diagnosis(DRAG, configuration="hovering", accepted=Accepted(D_U, (drag, repaired), ()))
    path = tmp_path / "x.param"
    accept(path, explained, Dive("dive", tmp_path, "1" * 64), load_vehicle("ruvifist"))
    assert read_sidecar(path).effects == (drag,)
    assert read_parameters(path)["FF1_T1_GAIN"] == 0.0
    assert "taken back: T1_gain" in path.read_text(encoding="utf-8")


CASE = draw_case(300051, names=[], seconds=30.0)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A vehicle with two dives of 30 s."""
    folder = tmp_path_factory.mktemp("two")
    (folder / "vehicle.yaml").write_text(CASE.vehicle.text, encoding="utf-8")
    (folder / "dive.tlog").write_bytes(tlog_of(dive_of(CASE)))
    (folder / "other.tlog").write_bytes(tlog_of(check_of(CASE)))
    return folder


def of(files, option, *words, recording="dive.tlog"):
    """Diagnose the dive, or another recording here, with one more option."""
    return ("diagnose", files / recording, "--vehicle", files / "vehicle.yaml", option, *words)


def made(path, data):
    path.write_bytes(data)
    return path


def test_a_check_dive_that_is_the_dive_is_refused_by_whatever_name(files, tmp_path, refused):
    data = (files / "dive.tlog").read_bytes()
    copy, packed = made(tmp_path / "copy.tlog", data), made(tmp_path / "c.tlog.gz", gzip.compress(data))
    for same in (files / "dive.tlog", copy, packed):
        said = refused(*of(files, "--check", same))
        assert f"the check dive {same}: {SAME} {files / 'dive.tlog'}" in said
        assert "give another dive" in said


def test_a_piece_of_the_dive_is_refused_wherever_it_was_cut(files, tmp_path, refused):
    data = (files / "dive.tlog").read_bytes()
    beginning = made(tmp_path / "beginning.tlog", data[: len(data) * 9 // 10 + 3])
    end = made(tmp_path / "end.tlog", data[len(data) // 3 :])
    for piece in (beginning, end):
        assert f"the check dive {piece}: {PIECE} " in refused(*of(files, "--check", piece))


def test_what_is_wrong_with_the_check_dive_is_told_of_the_check_dive(files, tmp_path, refused):
    empty = made(tmp_path / "empty.tlog", b"")
    assert f"the check dive {empty}: is empty" in refused(*of(files, "--check", empty))
    case = draw_case(300051, names=[], seconds=70.0)
    long = made(tmp_path / "long.tlog", tlog_of(dive_of(case)))
    start_s = check_of(case).span_s[0]
    short = made(tmp_path / "short.tlog", tlog_of(check_of(case).between(start_s, start_s + 5.0)))
    said = refused(*of(files, "--check", short, recording=long), code=exit_codes.NO)
    assert f"the check dive {short}: lasts 4 s, too short to tell one cause from another" in said


def test_two_pieces_that_share_a_stretch_are_of_one_dive(files, tmp_path):
    data = (files / "dive.tlog").read_bytes()
    assert len(data) > 262_144
    first = made(tmp_path / "one.tlog", data[: len(data) * 2 // 3])
    other = made(tmp_path / "other.tlog", data[len(data) // 3 :])
    assert of_one_dive([first], [other]) == of_one_dive([other], [first]) == OVERLAPPING


def test_two_dives_of_a_vehicle_and_two_tables_that_begin_alike_are_two(files, tmp_path):
    assert of_one_dive([files / "dive.tlog"], [files / "other.tlog"]) == ""
    head = b"time_s,u\n" * 65536
    tables = [made(tmp_path / f"{end}.csv", head + str(end).encode()) for end in (1, 2)]
    assert of_one_dive(tables[:1], tables[1:]) == ""
    assert of_one_dive([made(tmp_path / "empty.tlog", b"")], [files / "dive.tlog"]) == ""


@pytest.mark.parametrize("first", [True, False])
def test_a_run_that_compiles_first_says_so_and_no_other(first, files, capsys, monkeypatch):
    def no_dive(*_, **_more):
        raise FitError("nothing was pushed")

    monkeypatch.setattr("tui.commands.diagnose.compiles_first", lambda: first)
    monkeypatch.setattr("identify.diagnose.diagnose.diagnose", no_dive)
    words = ("diagnose", files / "dive.tlog", "--vehicle", files / "vehicle.yaml")
    assert cli.main([*map(str, words)]) == exit_codes.NO
    assert ("compiling first, once after installation" in capsys.readouterr().err) is first


def test_the_dive_is_diagnosed_against_what_accepted_names_or_what_was_in_force(files, monkeypatch):
    asked, against = [], []

    def model(accepted, dive, *_):
        asked.append((accepted, dive.name))
        return Before(notes=("in force",))

    def no_dive(*_, before, **_more):
        against.append(before.notes)
        raise FitError("nothing was pushed")

    monkeypatch.setattr("tui.commands.diagnose.before_of", model)
    monkeypatch.setattr("tui.commands.diagnose.diagnose", no_dive)
    words = [str(word) for word in ("diagnose", files / "dive.tlog", "--vehicle", files / "vehicle.yaml")]
    for more in ([], ["--accepted", "none"]):
        assert cli.main([*words, *more]) == exit_codes.NO
    assert asked == [(None, "dive"), ("none", "dive")]
    assert against == [("in force",)] * 2


NOTHING = Gap(math.nan, (), (), {}, (), (), ())


def held_against(folder, *words):
    real, sim, vehicle = folder / "dive.tlog", folder / "other.tlog", folder / "vehicle.yaml"
    return cli.main(["diagnose", *map(str, (real, "--against", sim, "--vehicle", vehicle)), *map(str, words)])


def test_screen_json_and_page_say_what_the_simulator_must_gain(
    files,
    tmp_path,
    capsys,
    monkeypatch,
):
    drag = next(
        e for e in library(CASE.file.vehicle.configurations[CASE.configuration], 0.1) if e.name == "dead_zone"
    )
    finding = Finding(Cause(drag, drag.start()), (), {}, 0.99, {}, 40.0)
    asked = []

    def diagnosed(dive, _file, configuration, *, simulator=None, progress, **_):
        asked.append((dive.name, configuration, simulator is not None))
        progress(1.0, "done")
        causes = (finding,) if dive.name == "dive" else ()
        return Diagnosis(
            dive.name, "rov", configuration, "explained", NOTHING, causes, (), None, None, None, None, (), 1.0, None,
            Accepted({}, (), ()),
        )  # fmt: skip

    monkeypatch.setattr(compared_by, "diagnose", diagnosed)
    page, data = tmp_path / "page.html", tmp_path / "answer.json"
    assert held_against(files, "--report", page, "--json", data) == exit_codes.DONE
    assert asked == [("other", CASE.configuration, False), ("dive", CASE.configuration, True)]
    assert "Your simulator must gain dead zone" in " ".join(capsys.readouterr().out.split())
    assert "Your simulator must gain dead zone" in page.read_text(encoding="utf-8")
    assert json.loads(data.read_text())["against"]["lacks"] == ["dead_zone"]


def in_runs(case, folder, each_s):
    """A case's dive in files of so many seconds each, some minutes apart; returns their folder."""
    folder.mkdir()
    dive = dive_of(case)
    starts_s = np.arange(dive.span_s[0], dive.span_s[1] - 1.0, each_s)
    for number, start_s in enumerate(starts_s.tolist()):
        run = dive.between(start_s, start_s + each_s)
        (folder / f"run-{number}.tlog").write_bytes(tlog_of(run, 1.77e9 + 300.0 * number))
    return folder


@pytest.mark.slow
def test_several_runs_are_held_against_several_of_a_simulator_each_as_one_dive(tmp_path, capsys):
    weak, sound = (
        draw_case(100_021, names=names, size=0.6, seconds=90.0) for names in (["weak_thruster"], [])
    )
    runs, sim = in_runs(weak, tmp_path / "runs", 30.0), in_runs(sound, tmp_path / "sim", 45.0)
    vehicle, answer = tmp_path / "vehicle.yaml", tmp_path / "answer.json"
    vehicle.write_text(weak.vehicle.text, encoding="utf-8")
    words = ["diagnose", *sorted(runs.iterdir()), "--vehicle", vehicle, "--against", sim, "--json", answer]
    assert cli.main([*map(str, words)]) == exit_codes.DONE
    data = json.loads(answer.read_text())
    assert data["against"]["lacks"] == ["weak_thruster"]
    assert [run["name"] for run in data["runs"]["used"]] == ["run-0", "run-1", "run-2"]
    assert data["against"]["simulator"] == "2 runs, run-0 to run-1"
    assert "3 runs are one dive of 90 s" in " ".join(capsys.readouterr().out.split())


def test_what_is_left_out_is_tried_in_neither_recording(files, monkeypatch):
    tried = []

    def diagnosed(*_, effects, **_more):
        tried.append({effect.name for effect in effects})
        raise FitError("enough")

    monkeypatch.setattr(compared_by, "diagnose", diagnosed)
    assert held_against(files, "--without", "waves") == exit_codes.NO
    assert "dead_zone" in tried[0]
    assert "waves" not in tried[0]


def test_runs_of_one_push_and_a_simulator_that_can_not_be_read_are_refused_by_name(
    files, monkeypatch, capsys, refused
):
    lost = files / "nosuch.tlog"
    assert f"{lost}: no such file" in refused(*of(files, "--against", lost))
    (files / "half.tlog").write_bytes(b"no frames")
    assert f"the simulator's {files / 'half.tlog'}: " in refused(*of(files, "--against", files / "half.tlog"))
    monkeypatch.setattr("tui.commands.diagnose.repeats", lambda dive, *_: dive.name == "dive")
    assert held_against(files) == exit_codes.NO
    said = " ".join(capsys.readouterr().err.split())
    assert f"{files / 'dive.tlog'}: its runs go from rest into one steady push" in said
    assert "give runs with several speeds" in said


@pytest.mark.parametrize("option", ["--check", "--predict", "--accept", "--accepted"])
def test_what_tells_of_the_vehicle_alone_is_refused_beside_a_simulator(files, tmp_path, capsys, option):
    assert held_against(files, option, tmp_path / "other.param") == exit_codes.BAD_INPUT
    assert f"{option} tells of the vehicle, --against of a simulator" in capsys.readouterr().err


def cut_off(data):
    packed = gzip.compress(data)
    return packed[: len(packed) // 3]


@pytest.mark.parametrize(
    ("name", "kept", "words"),
    [
        ("dive.tlog", bytes, "lasts 17 s, too short to tell one cause from another; record 20 s or more"),
        ("dive.tlog.gz", cut_off, "ends in the middle of a record, and what comes before lasts "),
    ],
)
def test_a_recording_is_said_to_be_short_or_to_be_cut(files, tmp_path, refused, name, kept, words):
    dive = dive_of(CASE)
    start_s = dive.span_s[0]
    (tmp_path / name).write_bytes(kept(tlog_of(dive.between(start_s, start_s + 18.0))))
    line = ("diagnose", tmp_path / name, "--vehicle", files / "vehicle.yaml")
    assert f"{tmp_path / name}: {words}" in refused(*line, code=exit_codes.NO)


def test_a_column_map_is_refused_where_no_recording_is_a_table(files, refused):
    needs_none = f"--columns nosuch: {files / 'dive.tlog'} needs no column map; leave it out"
    assert needs_none in refused(*of(files, "--columns", "nosuch"))


FILE = load_vehicle("ruvifist:survey")


def test_what_is_left_out_is_not_tried_and_all_else_is():
    whole = library(FILE.vehicle.configurations["survey"], FILE.vehicle.thrust_curve.lag_s)
    left = effects_without(["weak_thruster", "tether"], "survey", FILE)
    assert {effect.name for effect in whole} - {effect.name for effect in left} == {"weak_thruster", "tether"}


def test_an_effect_that_does_not_exist_is_refused_with_those_that_do():
    with pytest.raises(
        ConfigError, match=r"there is no effect 'kraken' to leave out; there are .*battery_sag"
    ):
        effects_without(["kraken"], "survey", FILE)
