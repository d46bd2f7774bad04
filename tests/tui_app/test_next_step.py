"""What to do next, and whether the feed-forward may be raised: a table of states; and the files that tell the state."""

import contextlib
import json
import os
from dataclasses import asdict, replace

import pytest
from fake_verbs import FakeVerbs, let_go
from fake_verbs import desk as made_desk
from made_diagnosis import diagnosis
from made_validation import raising, run
from made_view import FixedViews, picture, view
from screen_text import WIDE, Lacks, Sees, played, said

from bridge import exit_codes
from bridge.plain import plain
from bridge.reports import PAGE, UNKEPT, Report
from gcs_plugin.dives.folder import DiveFolder
from gcs_plugin.params import last_accepted
from gcs_plugin.params.files import write_parameters
from gcs_plugin.params.last_accepted import keep_accepted
from gcs_plugin.params.receipt import RECEIPT, Line, PastUpload, Receipt, path_of
from gcs_plugin.params.sidecar import Sidecar, write_with_sidecar
from gcs_plugin.params.transfer import Outcome
from gcs_plugin.watch.picture import Alarm, Armed, Kind, Said
from tui.app.jobs import JobState
from tui.app.next_step import Flight, Situation, lowered_to, next_of, raised_to
from tui.app.read_situation import read_situation
from tui.app.screens.overlays import AskScreen
from tui.app.view import Forcing, heard_of
from tui.dive_list import VERSION, Glance

HERE = Situation(heard=True, recording=True, linked=True)
DIVED = replace(HERE, dive="first", determined=6)
AWAY = replace(DIVED, heard=False, recording=False)
IDENTIFIED = replace(DIVED, identified=True, mode="off")
UPLOADED = replace(IDENTIFIED, uploaded=True)
SHADOW = replace(UPLOADED, mode="shadow")
GO = replace(SHADOW, after_upload=True, flown="shadow", go=True, gate=("first", True))
BOTH = replace(SHADOW, mode="both")
AGAIN = replace(BOTH, after_upload=True)
MENDED = replace(
    AGAIN, flown="both", go=False, uploaded=False, accepts=True, verdict="explained", disarmed=True
)


@pytest.mark.parametrize(
    ("situation", "words"),
    [
        (Situation(), "connect the vehicle"),
        (replace(DIVED, vehicle=False), "say which vehicle this is"),
        (Situation(linked=True), "record a dive"),
        (HERE, "once surge, sway and yaw are dived: begin the next dive"),
        (replace(HERE, heard=False), "switch the vehicle on, and dive surge, sway and yaw"),
        (replace(HERE, flies=True), "let it fly by itself what calibrates it"),
        (replace(DIVED, flies=True, determined=5, lacking=("D_v",)),
         "D_v not determined by first: let it fly"),
        (replace(HERE, flies=True, flight=Flight.BEING_PLANNED), "a flight is being planned"),
        (replace(HERE, flies=True, flight=Flight.PLANNED), "read the plan and its limits"),
        (replace(HERE, flight=Flight.UNDER_WAY), "the vehicle flies by itself"),
        (replace(HERE, flight=Flight.WORKED_ON), "the flight is over, and being worked on"),
        (replace(DIVED, determined=4, lacking=("M_v", "D_v")),
         "M_v, D_v not determined by first: dive sway there and back at two speeds"),
        (replace(DIVED, determined=None), "identify first"),
        (DIVED, "identify first"),
        (AWAY, "identify first"),
        (IDENTIFIED, "compare and upload what was identified"),
        (replace(IDENTIFIED, heard=False),
         "the vehicle is not heard: switch it on, or mend the link; then: compare and upload what was identified"),
        (replace(IDENTIFIED, heard=False, recording=False), "begin a recording; then: compare and upload"),
        (replace(IDENTIFIED, heard=False, recording=False, linked=False),
         "connect the vehicle; then: compare and upload what was identified"),
        (replace(IDENTIFIED, halfway=True), "the last upload was cut short"),
        (replace(SHADOW, halfway=True), "the last upload was cut short"),
        (replace(IDENTIFIED, taken_back=True, disarmed=True), "rolled back: dive anew and identify"),
        (replace(IDENTIFIED, taken_back=True, recording=False),
         "begin a recording; then: rolled back: dive anew and identify"),
        (replace(IDENTIFIED, taken_back=True, contested=True), "two vehicles share an address"),
        (replace(IDENTIFIED, taken_back=True), "rolled back: once surge, sway and yaw are dived anew"),
        (replace(IDENTIFIED, taken_back=True, after_roll_back=True, dive="anew"), "identify anew"),
        (replace(IDENTIFIED, taken_back=True, after_roll_back=True, mode="both"), "validate first"),
        (replace(IDENTIFIED, taken_back=True, after_roll_back=True, flown="both", go=True),
         "flown and compared"),
        (replace(SHADOW, taken_back=True), "once it has flown a minute in shadow"),
        (replace(IDENTIFIED, contested=True), "two vehicles share an address: part them"),
        (replace(GO, go=False, verdict="explained"), "first is diagnosed: read its last section, what to"),
        (replace(AGAIN, flown="both", go=False, recording=False, verdict="explained", contradicted=True),
         "the check dive shows no such effect: dive the same again, then ask once more, of both"),
        # What mode it is in, nobody knows until it speaks.
        (replace(UPLOADED, heard=False, mode=""), "uploaded: switch the vehicle on; the mode of"),
        (replace(GO, heard=False, mode=""), "GO in shadow: switch the vehicle on; this key then raises"),
        (replace(GO, heard=False, mode="", gate=("first", False), flown="off"),
         "uploaded: switch the vehicle on"),
        (replace(GO, heard=False, recording=False, mode=""),
         "begin a recording; then: uploaded: the mode of its feed-forward, once told"),
        (replace(UPLOADED, mode=""), "uploaded: the mode of its feed-forward, once told"),
        # As it was heard last, before its link or its recording ended.
        (replace(GO, heard=False, recording=False, mode="", last_mode="both"),
         "begin a recording; then: once it has flown with the feed-forward"),
        (replace(GO, heard=False, recording=False, mode="", last_mode="shadow"),
         "begin a recording; then: GO in shadow: raise"),
        (replace(SHADOW, heard=False, recording=False, mode="", last_mode="shadow"),
         "begin a recording; then: once it has flown a minute in shadow"),
        (replace(UPLOADED, heard=False, recording=False, mode="", last_mode="off"),
         "begin a recording; then: set the feed-forward to shadow"),
        (UPLOADED, "set the feed-forward to shadow"),
        (SHADOW, "once it has flown a minute in shadow"),
        (replace(SHADOW, flown="off"), "once it has flown a minute in shadow"),
        (replace(SHADOW, after_upload=True), "validate first"),
        (replace(AWAY, identified=True, uploaded=True, after_upload=True), "validate first"),
        (replace(SHADOW, after_upload=True, determined=None, reading=True), "first is being read"),
        (replace(SHADOW, after_upload=True, reading=True), "validate first"),
        (GO, "GO in shadow: raise the feed-forward to both"),
        (replace(GO, go=False), "first is a NO-GO: read why"),
        (replace(GO, flown="off", go=False, gate=None), "once it has flown a minute in shadow"),
        (BOTH, "once it has flown with the feed-forward"),
        (replace(BOTH, heard=False), "the vehicle is not heard: switch it on, or mend the link"),
        (replace(BOTH, heard=False, lost=True), "lost while armed: mend"),
        (replace(BOTH, heard=False, lost=True, working="identify"), "lost while armed"),
        (replace(BOTH, heard=False, lost=True, recording=False), "lost while armed, and its recording has ended"),
        (replace(GO, dive="second", flown=""), "validate second"),
        (replace(GO, dive="second", flown="off"), "GO in shadow: raise"),
        (replace(AGAIN, flown="shadow", go=True), "once it has flown with the feed-forward"),
        (AGAIN, "validate first"),
        (replace(AGAIN, flown="both", go=True), "flown and compared"),
        (replace(AGAIN, flown="both", go=False), "first is a NO-GO: lower the feed-forward"),
        (replace(SHADOW, after_upload=True, flown="both", go=False),
         "first is a NO-GO: ask what causes it"),
        (replace(AGAIN, heard=False, flown="both", go=False), "first is a NO-GO: ask what"),
        (replace(DIVED, writing=True), "the vehicle is being written to"),
        (replace(AGAIN, flown="both", go=True, verdict="no_gap"),
         "nothing is left to explain; once it has flown on: begin the next dive"),
        (replace(AGAIN, flown="both", go=True, verdict="no_gap", heard=False, recording=False),
         "nothing is left to explain; begin a recording; then: once it has flown on"),
        (replace(AGAIN, flown="both", go=True, verdict="partly"), "first is diagnosed"),
        (replace(IDENTIFIED, accepts=True), "compare and upload the cause"),
        (replace(IDENTIFIED, accepts=True, changed=True), "what was accepted has changed"),
        (replace(DIVED, working="identify"), "identify is at work"),
        (replace(DIVED, then="identify"), "the dives are being read; identify begins by itself then"),
        # A weak dive was judged, and flown again.
        (replace(AGAIN, heard=False, departed="weak"), "first was flown after a NO-GO: ask what"),
        (replace(AGAIN, mode="shadow", departed="weak"), "first was flown after a NO-GO: ask what"),
        (replace(AGAIN, departed="weak"), "validate first"),
        # A model that flies, and of which no upload is kept here.
        (replace(HERE, mode="both"), "it flies with a model that is not known here"),
        (replace(DIVED, mode="both", determined=4, lacking=("M_v",)), "validate first"),
        (replace(DIVED, mode="both", flown="off"), "it flies with a model that is not known here"),
        (replace(DIVED, mode="both", flown="both", go=True), "flown and compared"),
        # The feed-forward acts as it must not: whatever else is known or lacks, it is lowered first.
        (replace(DIVED, mode="both", flown="both", go=False, determined=4, lacking=("M_v",)),
         "first is a NO-GO: lower the feed-forward"),
        (replace(DIVED, mode="shadow", flown="both", go=False, lacking=("M_v",)),
         "first is a NO-GO: ask what causes it"),
        (replace(IDENTIFIED, mode="both", flown="both", go=False), "first is a NO-GO: lower"),
        (replace(IDENTIFIED, mode="both", flown="both", go=False, before_upload=True), "compare"),
        (replace(AGAIN, flown="both", go=False, verdict="explained", contradicted=True),
         "first is a NO-GO: lower the feed-forward to shadow, then dive the same again"),
        # Its cause can be sent at once to a vehicle that moves nothing.
        (MENDED, "compare and upload the cause that was diagnosed"),
        (replace(MENDED, disarmed=False), "first is a NO-GO: lower"),
        (replace(MENDED, verdict=""), "first is a NO-GO: lower"),
        (replace(MENDED, taken_back=True), "first is a NO-GO: lower"),
        (replace(HERE, mode="both", departs=True), "the vehicle departs from its model: lower"),
        (replace(BOTH, departs=True), "the vehicle departs from its model: lower"),
        (replace(SHADOW, departs=True), "the vehicle departs from its model: bring it home, begin"),
        (replace(BOTH, alarmed=True), "see to the ALARM above first"),
        (replace(BOTH, alarmed=True, departs=True), "the vehicle departs from its model: lower"),
        (replace(BOTH, departs=True, lost=True), "lost while armed"),
        # Uploaded from elsewhere, and a folder without a dive.
        (replace(HERE, uploaded=True, mode="off"), "set the feed-forward to shadow"),
        (replace(HERE, uploaded=True, mode="both"), "once it has flown with the feed-forward"),
        (replace(HERE, over=True), "the dive is over: begin the next"),
        (replace(DIVED, over=True, recording=False), "identify first"),
    ],
)  # fmt: skip
def test_each_state_has_its_next_step(situation, words):
    step = next_of(situation)
    assert step.words.startswith(words)
    assert step.actions or step.words.startswith(("switch the vehicle on", "the vehicle is being written"))


@pytest.mark.parametrize(
    "situation",
    [
        replace(DIVED, over=True, recording=False),
        replace(SHADOW, after_upload=True),
        replace(AGAIN, flown="both", go=True),
    ],
)
def test_where_the_screens_show_another_dive_the_keys_go_to_the_one_meant_first(situation):
    assert "dives.newest" not in next_of(situation).actions
    assert next_of(replace(situation, shown=False)).actions[:2] == ("screen.dives", "dives.newest")


@pytest.mark.parametrize(
    ("situation", "to", "why"),
    [
        (UPLOADED, "shadow", ""),
        (GO, "both", ""),
        (replace(UPLOADED, heard=False), None, "no vehicle is heard; connect it"),
        (replace(UPLOADED, mode=""), None, "tells no mode"),
        (replace(UPLOADED, recording=False), None, "none runs"),
        (replace(UPLOADED, contested=True), None, "two vehicles share its address"),
        (SHADOW, None, "no dive in shadow since the upload"),
        (replace(GO, gate=None), None, "no dive in shadow since the upload"),
        (replace(GO, dive="second", flown=""), "both", ""),
        (replace(GO, gate=("first", False)), None, "first is a NO-GO"),
        (replace(GO, mode="both"), None, "acts already, in both"),
    ],
)
def test_the_feed_forward_is_raised_by_one_step_and_to_both_only_after_a_go(situation, to, why):
    mode, reason = raised_to(situation)
    assert (mode.word if mode is not None else None) == to
    assert why in reason


@pytest.mark.parametrize(
    ("situation", "to", "why"),
    [
        (BOTH, "shadow", ""),
        (replace(BOTH, mode="ff"), "shadow", ""),
        (SHADOW, None, "does not act, in shadow"),
        (UPLOADED, None, "does not act, in off"),
        (replace(BOTH, mode=""), None, "tells no mode"),
        (replace(BOTH, recording=False), None, "none runs"),
    ],
)
def test_a_feed_forward_that_acts_is_lowered_to_shadow_whatever_was_validated(situation, to, why):
    mode, reason = lowered_to(situation)
    assert (mode.word if mode is not None else None) == to
    assert why in reason


@pytest.fixture
def place(tmp_path):
    """A folder of dives with one dive, and one of receipts."""
    return Place(tmp_path)


class Place:
    """The clock of its files goes on by a second with each that is written."""

    def __init__(self, root):
        self.dives, self.receipts, self._second = root / "dives", root / "receipts", 1_795_000_000
        self.verbs = FakeVerbs({"ff": {"mode": "shadow", "done": True}, "dives": []})
        self.desk = made_desk(self.verbs, out=self.dives, receipts=self.receipts, links=lambda: ("udpin",))

    def write(self, path, text=""):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
        self.stamp(path)

    def stamp(self, path):
        self._second += 1
        os.utime(path, (self._second, self._second))

    def dive(self, name, error="", **std):
        log = self.dives / name / "telemetry.tlog"
        self.write(log)
        state = log.stat()
        recorded = [["telemetry.tlog", state.st_size, state.st_mtime_ns]]
        key = {"version": VERSION, "recordings": recorded, "beside": [], "vehicle": "x"}
        known = Glance(error=error) if error else Glance(duration_s=112.0, relative_std=std)
        glance = asdict(known)
        self.write(self.dives / name / ".glance.json", json.dumps(plain({"key": key, "glance": glance})))

    def identify(self, name, value=12.5):
        path = self.dives / name / "identified.param"
        write_parameters(path, {"FF0_M_U": value}, ("identified",), 1, 1)
        self.stamp(path)

    def validate(self, name, mode, go):
        entry = {"dive": name, "raising": {"from": mode, "go": go}}
        self.write(self.dives / name / "validation.json", json.dumps([entry]))

    def situation(self, shown=None):
        return read_situation(self.desk, shown or view())


def test_the_state_is_read_from_the_folders_of_dives_and_receipts(place, monkeypatch):
    assert place.situation() == Situation(heard=True, recording=True, linked=True, mode="shadow")
    place.dive("2026-11-21T0800Z-first", M_u=0.01, D_u=0.9, M_q=0.9)
    dived = place.situation()
    assert (dived.dive, dived.lacking, dived.determined) == ("2026-11-21T0800Z-first", ("D_u",), 1)
    place.identify("2026-11-21T0800Z-first")
    assert (place.situation().identified, place.situation().uploaded) == (True, False)
    accepted = place.receipts / "2026-11-21T090000Z-accepted.param"
    place.write(accepted)
    monkeypatch.setattr("tui.app.read_situation.last_accepted", lambda *_: {"FF0_M_U": Accepted(12.5)})
    assert (place.situation().uploaded, place.situation().after_upload) == (True, False)
    place.dive("2026-11-21T0910Z-shadow", M_u=0.01)
    place.validate("2026-11-21T0910Z-shadow", "shadow", True)
    place.dive("2026-11-21T0920Z-afloat", M_u=float("inf"))
    flown = place.situation()
    in_shadow = (flown.dive, flown.after_upload, flown.flown, flown.go)
    assert in_shadow == ("2026-11-21T0910Z-shadow", True, "shadow", True)
    place.identify("2026-11-21T0910Z-shadow", value=13.0)
    assert place.situation().uploaded is False
    # What the vehicle accepted since is what the crew wanted, whichever file it came from.
    place.write(accepted)
    assert place.situation().uploaded is True


def test_a_recording_that_can_not_be_read_is_not_the_dive_that_is_to_be_identified(place):
    place.dive("2026-11-21T0800Z-first", M_u=0.01)
    place.dive("2026-11-21T0910Z-damaged", error="holds no MAVLink frame; give a .tlog recording")
    assert place.situation().dive == "2026-11-21T0800Z-first"


@pytest.mark.parametrize(("of", "is_uploaded"), [("ruvifist", True), ("", True), ("bluerov2", False)])
def test_what_another_vehicle_of_the_same_address_accepted_is_no_upload_to_this_one(place, of, is_uploaded):
    place.dive("2026-11-21T0800Z-first", M_u=0.01)
    values = place.dives / "2026-11-21T0800Z-first" / "identified.param"
    mine = Sidecar("", "", "hovering", "likelihood", "0.1", vehicle="ruvifist")
    write_with_sidecar(values, {"FF0_M_U": 12.5}, ("identified",), mine, 1, 1)
    path = place.receipts / "2026-11-21T090000Z-before.param"
    receipt = Receipt(
        Outcome.APPLIED,
        "",
        1,
        1,
        (Line("FF0_M_U", 1.0, 12.5, 12.5, Outcome.APPLIED, ""),),
        path,
        None,
        "2026",
        1.0,
    )
    place.receipts.mkdir()
    keep_accepted(receipt, replace(mine, vehicle=of), True)
    path_of(path, RECEIPT).write_text(json.dumps(receipt.to_json()), encoding="utf-8")
    assert place.situation().uploaded is is_uploaded


@pytest.fixture
def in_shadow(place, monkeypatch):
    """A place with an upload, and a dive in shadow after it that is a GO, which the screens show."""
    monkeypatch.setattr("tui.app.read_situation.last_accepted", lambda *_: {"FF0_M_U": Accepted(12.5)})
    place.dive("2026-11-21T0800Z-first", M_u=0.01)
    place.identify("2026-11-21T0800Z-first", 12.5004)
    place.write(place.receipts / "2026-11-21T090000Z-accepted.param")
    place.desk.dive = place.dives / SHADOWED
    place.dive(SHADOWED, M_u=0.01)
    place.write(
        place.desk.dive / "validation.json", json.dumps([run("shadow", SHADOWED, 1.0, 1.2, raising())])
    )
    return place


def contradicted_diagnosis():
    """One whose check dive shows no such effect."""
    data = diagnosis()
    data["shrink"]["check"]["after"] = 4.0  # it was 3.13 without the causes
    return data


SHADOWED, FLOWN = "2026-11-21T0910Z-shadow", "2026-11-21T0920Z-both"


def test_the_screen_that_says_go_names_the_key_and_the_key_goes_by_it_whatever_was_flown_since(in_shadow):
    in_shadow.dive(FLOWN, M_u=0.01)
    assert (in_shadow.situation().dive, in_shadow.situation().flown) == (FLOWN, "")
    asked = (lambda app: isinstance(app.screen, AskScreen), Sees("Type BOTH"))
    keys = ("6", Sees("GO"), Sees("Ctrl-U raises it to both."), "ctrl+u", *asked)
    played(in_shadow.desk, *keys, size=WIDE, views=FixedViews(shown(1, Armed.DISARMED)))
    in_shadow.validate(FLOWN, "both", False)
    why = f"{FLOWN} is a NO-GO; Validate says why"
    keys = ("6", Sees("GO"), Sees(f"Ctrl-U does not raise it now: {why}."), "ctrl+u")
    notices = played(in_shadow.desk, *keys, size=WIDE, views=FixedViews(shown(1)))
    assert notices == [f"not raised: {why}"]


def test_a_dive_flown_again_after_a_no_go_is_asked_about_with_it_and_judged_where_that_is_diagnosed(
    in_shadow,
):
    in_shadow.dive(FLOWN, M_u=0.01)
    in_shadow.validate(FLOWN, "both", False)
    again = "2026-11-21T0930Z-again"
    in_shadow.dive(again, M_u=0.01)
    assert (in_shadow.situation().dive, in_shadow.situation().departed) == (again, FLOWN)
    assert next_of(in_shadow.situation()).words == f"{again} was flown after a NO-GO: ask what causes it"
    for diagnosed in (again, FLOWN):
        kept = in_shadow.dives / diagnosed / "diagnosis.json"
        in_shadow.write(kept, json.dumps(diagnosis() | {"verdict": "no_gap"}))
        assert in_shadow.situation().departed == ""
        assert next_of(in_shadow.situation()).words == f"validate {again}"
        kept.unlink()
    # A diagnosis that its check dive contradicts does not stand: both are asked about together.
    in_shadow.write(in_shadow.dives / FLOWN / "diagnosis.json", json.dumps(contradicted_diagnosis()))
    assert next_of(in_shadow.situation()).words == f"{again} was flown after a NO-GO: ask what causes it"


@pytest.mark.parametrize("contradicted", [False, True])
def test_a_diagnosis_that_its_check_dive_contradicts_is_no_upload(in_shadow, contradicted):
    data = contradicted_diagnosis() if contradicted else diagnosis()
    in_shadow.write(in_shadow.desk.dive / "diagnosis.json", json.dumps(data))
    write_parameters(in_shadow.desk.dive / "diagnosed.param", {"FF0_M_U": 12.5, "FF0_X_UU": 9.0}, (), 1, 1)
    in_shadow.stamp(in_shadow.desk.dive / "diagnosed.param")
    step = next_of(in_shadow.situation(shown(1)))
    assert step.words.startswith(
        "GO in shadow" if contradicted else "compare and upload the cause that was diagnosed"
    )


@pytest.mark.parametrize("changed", [False, True])
def test_a_change_of_what_was_accepted_is_uploaded_or_rolled_back(in_shadow, changed):
    data = diagnosis()
    data["told"]["causes"][0]["changed"] = changed
    in_shadow.write(in_shadow.desk.dive / "diagnosis.json", json.dumps(data))
    write_parameters(in_shadow.desk.dive / "diagnosed.param", {"FF0_M_U": 12.5, "FF0_X_UU": 9.0}, (), 1, 1)
    in_shadow.stamp(in_shadow.desk.dive / "diagnosed.param")
    step = next_of(in_shadow.situation(shown(1)))
    assert step.words.startswith(
        "what was accepted has changed" if changed else "compare and upload the cause"
    )


def test_while_a_question_is_open_the_next_step_is_its_answer_and_names_no_key(place):
    place.dive("2026-11-21T0800Z-first", M_u=0.01)
    asked, next_step = Sees("NEXT answer what is asked; escape leaves it"), Sees("NEXT 2 i identify")
    views = FixedViews(shown(0))
    # Nor does the line of keys name one that would only be typed.
    typed = [Lacks(words) for words in ("i Identify", "t Theme", "? Help")]
    live = Sees("Ctrl-X FF off")
    left = ("escape", next_step, Sees("c Charts"))
    played(place.desk, next_step, "ctrl+u", asked, *typed, live, *left, views=views)


def test_a_go_from_before_the_upload_raises_nothing_and_the_screen_says_so(in_shadow):
    in_shadow.write(in_shadow.receipts / "2026-11-21T090000Z-accepted.param")
    assert in_shadow.situation().gate is None
    keys = ("6", Sees("GO"), Sees("Ctrl-U does not raise it now: no dive in shadow since the upload"))
    played(in_shadow.desk, *keys, size=WIDE, views=FixedViews(shown(1)))


def test_in_a_folder_without_values_the_upload_is_the_one_that_the_vehicle_accepted_last(in_shadow):
    (in_shadow.dives / "2026-11-21T0800Z-first" / "identified.param").unlink()
    situation = in_shadow.situation(shown(3))
    assert (situation.identified, situation.uploaded, situation.after_upload) == (False, True, True)
    assert next_of(in_shadow.situation(shown(1))).words.startswith("GO in shadow")
    # Not of a vehicle that says itself that it has none in force.
    lacks = replace(shown(0).picture, said=(Said(0.0, 4, "FF surge off: M_u is missing", of_set=True),))
    assert in_shadow.situation(replace(shown(0), picture=lacks)).uploaded is False
    in_shadow.dive(FLOWN, M_u=0.01, M_v=0.9)
    in_shadow.validate(FLOWN, "both", False)
    assert next_of(in_shadow.situation(shown(3))).words.startswith(f"{FLOWN} is a NO-GO: lower")
    assert next_of(in_shadow.situation(shown(1))).words == f"{FLOWN} is a NO-GO: ask what causes it"


def test_a_no_go_from_before_the_newest_upload_lowers_nothing(in_shadow):
    in_shadow.dive(FLOWN, M_u=0.01)
    in_shadow.validate(FLOWN, "both", False)
    assert in_shadow.situation(shown(3)).before_upload is False
    in_shadow.write(in_shadow.receipts / "2026-11-21T090000Z-accepted.param")
    assert in_shadow.situation(shown(3)).before_upload is True
    in_shadow.identify(FLOWN, 13.0)
    assert next_of(in_shadow.situation(shown(3))).words.startswith("compare and upload what was identified")


def test_the_mode_heard_last_is_kept_while_the_vehicle_is_not_heard(place):
    silent = replace(shown(None), last_heard=shown(3).picture)
    assert (place.situation(silent).mode, place.situation(silent).last_mode) == ("", "both")


@pytest.mark.parametrize(
    ("kind", "departs"), [(Kind.GAP, True), (Kind.THRUSTER, True), (Kind.BATTERY, False)]
)
def test_an_alarm_of_an_armed_vehicle_is_what_is_to_be_done_next(place, kind, departs):
    now = shown(3, Armed.ARMED)
    now = replace(now, picture=replace(now.picture, alarms=(Alarm(kind, "", "x"),)))
    assert (place.situation(now).departs, place.situation(now).alarmed) == (departs, not departs)
    late = place.situation(replace(now, behind_s=60.0))
    assert (late.departs, late.alarmed) == (False, False)
    on_deck = replace(now, picture=replace(now.picture, armed=Armed.DISARMED))
    assert place.situation(on_deck).alarmed is False


def test_the_next_step_follows_an_alarm_as_soon_as_it_comes_or_goes(place):
    calm = shown(3, Armed.ARMED)
    views = FixedViews(calm)
    deep = replace(calm, picture=replace(calm.picture, alarms=(Alarm(Kind.DEPTH, "", "x"),)))
    see_to = "see to the ALARM above first"
    steps = (Lacks(see_to), views.then(deep), Sees(see_to), views.then(calm), Lacks(see_to))
    # By this clock no time goes by, and nothing else is looked up anew.
    played(place.desk, *steps, views=views, clock=lambda: 0.0)


def test_a_dive_judged_beside_another_counts_as_well_and_one_that_is_written_does_not_yet(in_shadow):
    other = "2026-11-21T0915Z-again"
    in_shadow.dive(other, M_u=0.01)
    both = [
        {"dive": name, "raising": {"from": "shadow", "go": name == SHADOWED}} for name in (SHADOWED, other)
    ]
    in_shadow.write(in_shadow.desk.dive / "validation.json", json.dumps(both))
    assert in_shadow.situation().gate == (other, False)
    in_shadow.dive(FLOWN, M_u=0.01)
    with contextlib.closing(DiveFolder(in_shadow.dives / FLOWN).open_telemetry(2)):
        assert in_shadow.situation().dive == other
    assert in_shadow.situation().dive == FLOWN


@pytest.mark.parametrize(
    ("armed", "lost"), [(Armed.ARMED, True), (Armed.FAILSAFE, True), (Armed.DISARMED, False)]
)
def test_a_vehicle_that_fell_silent_while_armed_comes_before_all_else(place, armed, lost):
    silent = tuple(replace(link, age_s=9.0, lost=True) for link in picture().links)
    seen = replace(shown(3, armed), picture=replace(shown(3, armed).picture, links=silent))
    assert place.situation(seen).lost is lost
    assert place.situation(shown(3, armed)).lost is False


def test_a_verb_with_only_its_page_to_draw_is_not_waited_for(place):
    page = (Report(PAGE, 0.5, "draws"),)
    for verb, reports, working in (
        ("identify", (), "identify"),
        ("identify", page, ""),
        ("diagnose", page, "diagnose"),  # which leaves its model after its page
    ):
        place.desk.jobs._states[verb] = JobState((verb, "first"), 0.0, reports)
        assert place.situation().working == working


def test_a_diagnosed_model_is_what_is_to_be_uploaded_until_a_later_diagnosis_finds_nothing(
    place, monkeypatch
):
    monkeypatch.setattr("tui.app.read_situation.last_accepted", lambda *_: {"FF0_M_U": Accepted(12.5)})
    place.dive("2026-11-21T0800Z-first", M_u=0.01)
    place.identify("2026-11-21T0800Z-first")
    place.write(place.receipts / "2026-11-21T090000Z-accepted.param")
    place.validate("2026-11-21T0800Z-first", "both", True)
    dive = place.dives / "2026-11-21T0800Z-first"
    place.write(dive / "diagnosis.json", json.dumps(diagnosis() | {"verdict": "explained"}))
    write_parameters(dive / "diagnosed.param", {"FF0_M_U": 14.0}, ("diagnosed",), 1, 1)
    place.stamp(dive / "diagnosed.param")
    situation = place.situation()
    assert (situation.accepts, situation.uploaded, situation.verdict) == (True, False, "explained")
    place.write(dive / "diagnosis.json", json.dumps(diagnosis() | {"verdict": "no_gap"}))
    again = place.situation()
    assert (again.accepts, again.uploaded, again.verdict) == (False, True, "no_gap")


@pytest.mark.parametrize(("sent", "uploaded"), [(13.0, True), (12.5, False)])
def test_a_diagnosed_model_of_which_a_cause_was_left_out_is_uploaded_once_all_else_of_it_is_sent(
    place, monkeypatch, sent, uploaded
):
    dive = place.dives / "2026-11-21T0800Z-first"
    place.dive(dive.name, M_u=0.01)
    place.write(dive / "diagnosis.json", json.dumps(diagnosis() | {"verdict": "explained"}))
    write_parameters(dive / "diagnosed.param", {"FF0_M_U": 13.0, "FF0_T1_GAIN": 0.8}, ("diagnosed",), 1, 1)
    place.stamp(dive / "diagnosed.param")
    monkeypatch.setattr("tui.app.read_situation.last_accepted", lambda *_: {"FF0_M_U": Accepted(sent)})
    assert place.situation().uploaded is False
    place.write(place.receipts / "2026-11-21T090000Z-accepted.param")
    assert place.situation().uploaded is uploaded


def test_what_is_uploaded_to_a_vehicle_is_told_apart_by_its_system_and_so_is_what_was_taken_back(
    place, monkeypatch
):
    asked = []

    def receipts_hold(kept_in):
        monkeypatch.setattr(last_accepted, "kept_in", kept_in)
        place.write(place.receipts / "2026-11-21T090000Z-receipt.json")

    monkeypatch.setattr(
        "tui.app.read_situation.last_accepted", lambda _, system, *__: asked.append(system) or {}
    )
    place.dive("2026-11-21T0800Z-first", M_u=0.01)
    place.identify("2026-11-21T0800Z-first")
    preimage = place.receipts / "2026-11-21T090000Z-before.param"
    place.write(preimage)
    past = PastUpload(preimage, 2, Outcome.APPLIED, "2026-11-21T085000Z-before.param", {}, {}, None)
    receipts_hold(lambda _, system: [past] if system == 1 else [])
    assert (place.situation().taken_back, place.situation().halfway) == (True, False)
    assert place.situation().after_roll_back is False
    place.dive("2026-11-21T0930Z-anew", M_u=0.01)
    assert (place.situation().taken_back, place.situation().after_roll_back) == (True, True)
    begun = replace(past, outcome=Outcome.BEGUN, written={"FF0_M_U": 1.0})
    receipts_hold(lambda *_: [begun])
    assert (place.situation().taken_back, place.situation().halfway) == (False, True)
    receipts_hold(lambda *_: [past])
    place.identify("2026-11-21T0800Z-first", 13.0)
    assert place.situation().taken_back is False
    assert set(asked) == {1}


def test_a_vehicle_is_not_heard_because_another_is():
    lost, other = replace(picture().links[0], age_s=99.0, lost=True), replace(picture().links[0], system=2)
    assert heard_of(picture()) == 1
    assert heard_of(replace(picture(), links=(lost, other))) is None
    assert heard_of(replace(picture(), links=())) is None


class Accepted:
    time = "2026-11-21T090000Z"

    def __init__(self, value):
        self.value = value


def shown(mode, armed=Armed.DISARMED):
    return replace(view(), picture=replace(picture(), ff_mode=mode, armed=armed))


@pytest.mark.parametrize(
    ("armed", "word", "wrong"),
    [
        (Armed.DISARMED, "shadow", ("both", "")),
        (Armed.ARMED, "armed shadow", ("shadow",)),
        (Armed.UNKNOWN, "armed shadow", ("shadow",)),
    ],
)
def test_the_mode_is_typed_before_it_is_raised_and_with_armed_where_the_vehicle_is(place, armed, word, wrong):
    def modes():
        return [words for words in place.verbs.words if words[0] == "ff"]

    def answers(typed):
        keys = [key if key != " " else "space" for key in typed]
        asked = (
            lambda app: isinstance(app.screen, AskScreen),
            Sees("to set the feed-forward of vehicle 1 to shadow"),
        )
        return ("ctrl+u", *asked, *keys, "enter")

    def nothing_is_sent(app):
        assert "nothing was sent" in said(app)[-1]
        return modes() == []

    refused = [step for typed in wrong for step in (*answers(typed), nothing_is_sent)]
    played(place.desk, *refused, *answers(word), views=FixedViews(shown(0, armed)))
    while_disarmed = ("--disarmed",) if armed is Armed.DISARMED else ()
    assert modes() == [("ff", "shadow", "--yes", *while_disarmed, "--system", "1")]


def test_a_mode_is_not_raised_past_the_one_that_was_asked_about(in_shadow):
    """OFF was ordered, or the vehicle began anew, while the question stood: from off it goes to shadow alone."""
    views = FixedViews(shown(1))
    asked = ("ctrl+u", Sees("Type BOTH"), views.then(shown(0)))
    notices = played(in_shadow.desk, *asked, *"both", "enter", views=views)
    assert [words for words in in_shadow.verbs.words if words[0] == "ff"] == []
    assert notices[0].startswith("not raised: the vehicle is another, or in another mode")


def test_a_mode_that_another_vehicle_would_get_than_is_on_screen_now_is_not_sent(place):
    views = FixedViews(shown(0))
    (link,) = picture().links
    another = replace(view(), picture=replace(shown(0).picture, links=(replace(link, system=2),)))
    asked = ("ctrl+u", Sees("vehicle 1"), views.then(another))
    notices = played(place.desk, *asked, *"shadow", "enter", views=views)
    assert [words for words in place.verbs.words if words[0] == "ff"] == []
    assert notices[0].startswith("not raised: the vehicle is another")


def test_a_mode_that_is_asked_about_twice_is_sent_once(place):
    place.verbs.held = ("ff",)
    asked_twice = ("ctrl+u", Sees("Type SHADOW"), "ctrl+p", *"raise", "enter", Sees("Type SHADOW"))
    answers = (*"shadow", "enter", *"shadow", "enter")
    notices = played(place.desk, *asked_twice, *answers, views=FixedViews(shown(0)))
    assert [words for words in place.verbs.words if words[0] == "ff"] == [
        ("ff", "shadow", "--yes", "--disarmed", "--system", "1")
    ]
    assert "not raised: a mode is on its way to the vehicle already" in notices


def test_without_a_go_in_shadow_nothing_is_asked_and_the_reason_is_said(place):
    (notice,) = played(place.desk, "ctrl+u", views=FixedViews(shown(1)))
    assert notice.startswith("not raised: no dive in shadow since the upload was validated as a GO")


@pytest.mark.parametrize("armed", [Armed.DISARMED, Armed.ARMED, Armed.UNKNOWN])
def test_one_key_lowers_it_to_shadow_without_a_word_typed(place, armed):
    place.verbs.held = ("ff",)
    notices = played(place.desk, "ctrl+y", views=FixedViews(shown(3, armed)))
    assert [words for words in place.verbs.words if words[0] == "ff"] == [
        ("ff", "shadow", "--yes", "--system", "1")
    ]
    assert "vehicle 1 is being set to shadow" in notices


def test_the_mode_of_a_vehicle_that_is_only_looked_at_goes_by_its_own_link(place):
    place.desk.link = lambda: "tcp:sub:5777"
    played(place.desk, "ctrl+y", views=FixedViews(shown(3)))
    assert ("ff", "shadow", "--yes", "--system", "1", "--link", "tcp:sub:5777") in place.verbs.words


def looks_anew(app):
    """A step that does what the app does before it draws."""
    app._tell_ordered()
    app._take_back_warnings()


def says(*words):
    """A step that sees which notices there are."""
    return lambda app: said(app) == list(words)


def test_what_was_said_of_a_mode_goes_as_soon_as_the_vehicle_is_in_another(place):
    views = FixedViews(shown(3))
    in_shadow = says("feed-forward in shadow, as the vehicle says")
    # The screen is a little behind the vehicle's answer.
    answered = ("ctrl+y", looks_anew, in_shadow)
    played(place.desk, *answered, views.then(shown(1)), in_shadow, views.then(shown(3)), says(), views=views)


def test_an_order_that_off_overruled_says_so(place):
    place.verbs.code, place.verbs.results["ff"] = (
        exit_codes.NO,
        {"seen": "OFF was ordered meanwhile and wins"},
    )
    why = says("feed-forward not set: OFF was ordered meanwhile and wins")
    played(place.desk, "ctrl+y", looks_anew, why, views=FixedViews(shown(3)))


def test_a_mode_that_the_vehicle_took_is_said_so_though_the_answer_found_no_room_on_the_disk(place):
    why = "result.json: the JSON can't be written (No space left on device); give another file"
    place.verbs.code, place.verbs.errors = exit_codes.BAD_INPUT, (why,)
    place.verbs.tells = [Report(UNKEPT, 1.0, why, result={"mode": "shadow", "done": True})]
    place.verbs.results["ff"] = None
    in_shadow = says("feed-forward in shadow, as the vehicle says")
    played(place.desk, "ctrl+y", looks_anew, in_shadow, views=FixedViews(shown(3)))


def test_off_ends_an_order_for_another_mode_that_is_on_its_way(place):
    place.verbs.held, views = ("ff",), FixedViews(shown(3))
    ended = says("feed-forward not set: OFF was ordered meanwhile and wins")
    steps = ("ctrl+y", says("vehicle 1 is being set to shadow"), "ctrl+x", looks_anew, ended)
    played(place.desk, *steps, views=views)
    assert views.forced == 1
    assert place.desk.jobs.state("ff").cancelled


def stays(app):
    assert not app._exit


def test_while_a_mode_is_on_its_way_the_app_is_not_left_which_would_end_the_order(place):
    place.verbs.held = ("ff",)
    on_its_way = "vehicle 1 is being set to shadow"
    kept = says(on_its_way, "a mode is on its way to the vehicle; leave once that has ended")
    steps = ("ctrl+y", says(on_its_way), "ctrl+q", stays, kept, let_go, "ctrl+q", lambda app: app._exit)
    played(place.desk, *steps, views=FixedViews(shown(3)))


def test_while_off_is_not_confirmed_the_app_is_left_by_a_second_key_alone(place):
    asked = replace(shown(3), forcing=Forcing("vehicle 1: sent 4 times", 4, False))
    warned = says("OFF is not confirmed yet, and is sent no more once you leave; Ctrl-Q again leaves")
    steps = ("ctrl+x", "ctrl+q", stays, warned, "ctrl+x", "ctrl+q", stays, "ctrl+q", lambda app: app._exit)
    played(place.desk, *steps, views=FixedViews(asked))
    done = replace(asked, forcing=replace(asked.forcing, done=True))
    played(place.desk, "ctrl+x", "ctrl+q", lambda app: app._exit, views=FixedViews(done))


def test_what_does_not_act_is_not_lowered_and_the_reason_is_said(place):
    (notice,) = played(place.desk, "ctrl+y", views=FixedViews(shown(1)))
    assert notice == "not lowered: the feed-forward does not act, in shadow"


def test_each_screen_says_the_next_step_and_its_keys_as_they_are_bound(place):
    place.dive("2026-11-21T0800Z-first", M_u=0.01)
    views = FixedViews(shown(0))
    on_watch = Sees("NEXT 2 i identify 2026-11-21T0800Z-first")
    steps = (on_watch, "2", Sees("NEXT i identify 2026"), "3", Sees("NEXT 2 i"))
    played(place.desk, *steps, views=views)
    played(place.desk, Sees("NEXT 9 i identify"), views=views, keymap={"screen.dives": "9"})
    played(place.desk, Sees("identify 2026"), Lacks("NEXT 2 i"), views=views, view_only=True)
