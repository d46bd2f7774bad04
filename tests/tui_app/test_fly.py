"""Fly: nothing is armed without a limit file and a typed word; what is flown and known is shown; one key ends it."""

import hashlib
from dataclasses import replace
from pathlib import Path

import pytest
from fake_verbs import FakeVerbs, desk, let_go
from made_view import FixedViews, picture, view
from screen_text import WIDE, Lacks, Sees, played, said

from bridge.flight.limits import load_limits
from bridge.reports import FLIGHT, SAID, Report
from gcs_plugin.watch.picture import Freshness
from tui.app.screens.fly import FLY, mistakes, now_lines

LIMITS = (
    "shallowest_m: 0.3\ndeepest_m: 4\naltitude_m: 0\ndistance_m: 4\nspeed_m_s: 0.8\ntilt_deg: 25\nbattery_v: 13\n"
    "time_s: 900\n"
)
PLAN = "name: plan\n"
PROPOSED = {
    "plan": "plan",
    "file": "dives/calibrate-plan.yaml",
    "sha256": hashlib.sha256(PLAN.encode()).hexdigest(),
    "manoeuvres": {"1. surge": [8.0, 16.0], "2. yaw": [12.0]},
    "limits": {"shallowest_m": 0.3, "deepest_m": 4.0, "altitude_m": 0.0, "distance_m": 4.0, "speed_m_s": 0.8,
               "tilt_deg": 25.0, "battery_v": 13.0, "time_s": 900.0, "link_s": 3.0, "hold_s": 60.0, "travel_m_s": 0.2},
    "know": ["M_u", "D_u"],
    "asked_percent": 3.0,
    "refused": "",
}  # fmt: skip
ASKED = (
    "calibrate", "--limits", "limits.yaml", "--vehicle", "ruvifist:hovering", "--to", "3", "--minutes", "5", "--out",
    "dives", "--receipts", "receipts",
)  # fmt: skip
TELLS = (
    Report(SAID, 0.0, "flies 1. surge, 16 s"),
    Report(FLIGHT, 0.5, "flies 1. surge, 16 s: 7 s left", values={"M_u": (0.012, 0.03), "D_u": (0.08, 0.03)}),
)
DONE = {"flight": {"end": "finished"}, "folder": "dives/a", "steps": {}}


@pytest.fixture(autouse=True)
def limits(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "limits.yaml").write_text(LIMITS)
    (tmp_path / "dives").mkdir()
    (tmp_path / "dives" / "calibrate-plan.yaml").write_text(PLAN)
    return tmp_path / "limits.yaml"


def verbs(**options):
    return FakeVerbs(
        lambda words: [] if words[0] == "dives" else DONE if "--armed" in words else PROPOSED, **options
    )


def on(made, *steps, flies=True, **options):
    shown = replace(view(), picture=replace(picture(), flies=flies))
    at = desk(made, out=Path("dives"), link=options.pop("link", str))
    return played(at, "7", *steps, views=FixedViews(shown), **options)


def says(words):
    """A step that sees a notice, which goes again as soon as it holds no longer."""
    return lambda app: any(notice.startswith(words) for notice in said(app))


def flights(made):
    return [words for words in made.words if "--armed" in words]


def test_what_would_be_flown_stands_with_its_limits_and_nothing_is_sent():
    made = verbs()
    seen = (Sees("M_u, D_u known to 3 %"), Sees("depth 0.3 to 4 m, altitude not measured, 4 m from the start"),
            Sees("1. surge 8 + 16 s"), Sees("2. yaw 12 s"), Sees("PLAN, 36 s at most"))  # fmt: skip
    on(made, "p", *seen, size=WIDE)
    assert made.words[-1] == ASKED
    assert flights(made) == []


@pytest.mark.parametrize("typed", ["fly", "FLY"])
def test_the_vehicle_is_armed_by_the_typed_word_alone(typed):
    made = verbs()

    def nothing_flies(app):
        assert "nothing was sent" in said(app)[-1]
        return flights(made) == []

    wrong = [step for word in ("yes", "") for step in ("f", *word, "enter", nothing_flies)]
    on(made, "p", *wrong, "f", Sees("Type FLY to arm vehicle 1"), *typed, "enter")
    agreed = ("--plan", "dives/calibrate-plan.yaml", "--system", "1", "--armed")
    assert flights(made) == [(*ASKED, *agreed)]


def test_a_vehicle_that_is_only_looked_at_flies_by_its_own_link():
    made = verbs()
    on(made, "p", "f", *"fly", "enter", link=lambda: "tcp:sub:5777")
    (words,) = flights(made)
    assert words[-3:] == ("--link", "tcp:sub:5777", "--armed")


def test_limits_that_changed_since_they_were_read_are_not_flown(limits):
    made = verbs()

    def change(_):
        limits.write_text(LIMITS.replace("deepest_m: 4", "deepest_m: 40"))

    (notice,) = on(made, "p", change, "f", *"FLY", "enter")
    assert notice == "nothing was sent: plan or limits are others by now; plan again"
    assert flights(made) == []


def test_a_limit_file_whose_name_no_folder_can_hold_is_a_mistake_of_the_form():
    wrong = mistakes({"limits": "a" * 300, "to": "3", "minutes": "5", "know": ""})
    assert list(wrong) == ["limits"]
    assert wrong["limits"].endswith("; name another")


def test_a_plan_that_another_program_wrote_over_the_one_shown_is_not_flown():
    made = verbs()

    def plan_another(_):
        Path("dives/calibrate-plan.yaml").write_text("name: another\n")

    (notice,) = on(made, "p", "f", Sees("Type FLY"), plan_another, *"FLY", "enter")
    assert notice == "nothing was sent: plan or limits are others by now; plan again"
    assert flights(made) == []


def test_without_a_limit_file_none_is_planned_and_it_is_asked_for_with_the_reason(limits):
    limits.unlink()
    made = verbs()
    on(made, "p", Sees("limit file"), Sees("limits.yaml: no such file"), "enter", "escape", "f")
    assert made.words == []


@pytest.mark.parametrize(
    ("shown", "why"),
    [
        ({"flies": False}, "this vehicle says nothing of flying by itself"),
        ({"refused": "all of this plan tells D_u to 7 % alone"}, "all of this plan tells D_u to 7 % alone"),
    ],
)
def test_what_speaks_against_a_flight_is_said_and_its_key_does_nothing(shown, why, monkeypatch):
    made = verbs()
    monkeypatch.setitem(PROPOSED, "refused", shown.get("refused", ""))
    on(made, "p", Sees(why), "f", Lacks("Type FLY"), flies=shown.get("flies", True))
    assert flights(made) == []


def test_a_plan_that_is_being_made_is_shown_though_another_vehicle_is_meant_by_now_and_is_not_flown():
    """Else the screen would show neither its progress nor a key, until it has ended."""
    made = verbs(held=("calibrate",))

    def names_another(app):
        app.desk.vehicle = "ruvifist:survey"

    on(
        made,
        "p",
        names_another,
        Sees("0 % begins"),
        let_go,
        Lacks("begins"),
        Lacks("Stop planning"),
        "f",
        Lacks("Type FLY"),
        Sees("[p] plans"),
    )
    assert flights(made) == []


def test_the_key_that_stops_planning_is_named_on_the_screen_while_a_plan_is_being_made():
    made = verbs(held=("calibrate",))
    on(made, "p", Sees("0 % begins"), Sees("Ctrl-R Stop planning"), "ctrl+r", Lacks("Stop planning"))


def test_the_end_key_without_a_flight_of_the_app_says_where_that_of_another_flight_is():
    made = verbs()
    on(
        made,
        "ctrl+f",
        says("no flight runs that was begun here; one of `seatrial fly` ends by any key in its terminal"),
    )


def test_during_the_flight_the_intervals_are_live_and_its_end_key_is_pressed_from_any_screen():
    made = verbs(tells=TELLS)

    def presses(count):
        return lambda _: made.pressed() == count

    def flies(app):
        made.held = ("calibrate",)
        app.desk.jobs.start(FLY, (*ASKED, "--armed"))

    words = ("m, 0.3 to 4", "flies 1. surge, 16 s: 7 s left", "● M_u ± 1.2 %", "○ D_u ± 8 %", "[x] ends it")
    seen = map(Sees, words)
    steps = ("x", says("the flight is ended: it holds its place"), "x", presses(2), "1", "ctrl+f", presses(1))
    on(made, "p", flies, *seen, *steps, "ctrl+q", says("the vehicle flies; leave"), Sees("7 s left"), let_go)


def test_a_value_just_beyond_its_limit_does_not_read_as_the_limit():
    shown, limits = picture(), replace(load_limits(Path("limits.yaml")), altitude_m=1.0, battery_v=13.0)
    near = {"altitude": 0.98, "voltage": 12.97}
    traces = {
        key: replace(trace, value=trace.value * 0 + near.get(key, 0.0), freshness=Freshness.FRESH)
        for key, trace in shown.traces.items()
    }
    rows = now_lines(replace(shown, traces=traces), limits, 160)
    words = " ".join("".join(text for text, _ in row) for row in rows)
    assert "altitude 0.98 m, 1 at least" in words
    assert "battery 12.97 V, 13 at least" in words


def test_after_the_flight_its_last_words_stand_and_a_failure_too():
    said = (*TELLS, Report(SAID, 0.0, "calibrated: the model is in the vehicle, in shadow"))
    on(verbs(tells=said), "p", "f", *"fly", "enter", Sees("calibrated: the model is in the vehicle"))
    failed = FakeVerbs(
        lambda words: None if "--armed" in words else PROPOSED, code=2, errors=("no vehicle within 5 s",)
    )
    on(failed, lambda app: app.desk.jobs.start(FLY, (*ASKED, "--armed")), Sees("no vehicle within 5 s"))
