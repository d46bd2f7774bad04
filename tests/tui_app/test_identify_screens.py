"""The screen Identify: from a dive to its result by one key, cancelled by another."""

from functools import partial
from pathlib import Path

import made_identified
import pytest
from fake_verbs import FakeVerbs, desk, let_go
from made_dives import DECK, HOVERING
from made_identified import PAGE, answer, identified_dive, leave, passes
from screen_text import WIDE, Lacks, Sees, played, shows, text

from bridge import exit_codes
from bridge.reports import UNKEPT, Report
from bridge.vehicle.config import load_vehicle
from tui.app.screens.dives import DivesScreen
from tui.app.screens.identify import IdentifyScreen, words_for
from tui.app.screens.parameters import ParametersScreen
from tui.app.screens.watch import WatchScreen
from tui.dive_list import results_beside

WAITING = partial(FakeVerbs, tells=passes())


@pytest.fixture
def dive(tmp_path, monkeypatch):
    """A dive's folder, under a name that is the same each time."""
    monkeypatch.chdir(tmp_path)
    return made_identified.dive_in(tmp_path)


@pytest.fixture
def identified(dive):
    """One with a result of yesterday beside it."""
    return identified_dive(dive)


def key_line(app):
    return text(app).splitlines()[-1]


def test_two_keys_identify_the_dive_that_one_comes_from(dive):
    verbs = FakeVerbs({"dives": [HOVERING | {"folder": str(dive)}], "identify": {}}, leave=leave)
    seen = (shows(IdentifyScreen), Sees("11 of 12 coefficients"), lambda app: app.desk.dive == dive)
    played(desk(verbs), "2", "i", *seen)
    assert verbs.words[-1] == words_for(str(dive), "ruvifist:hovering", results_beside(dive))


def test_it_goes_on_while_another_screen_is_looked_at_and_is_cancelled_by_a_key(dive):
    runs = (Sees("IDENTIFYING"), Sees("pass 3"), lambda app: "i Identify" not in key_line(app))
    stopped = ("x", lambda app: not app.desk.jobs.runs("identify"), Sees("stopped by you"))
    again = (lambda app: "i Identify" in key_line(app),)
    played(desk(WAITING(), dive=dive), "3", "i", "1", "3", *runs, *stopped, *again)


def test_the_curves_can_be_looked_at_afterwards_and_escape_goes_back(dive):
    verbs = FakeVerbs({"identify": {}}, tells=passes(), leave=leave)
    looked = ("c", Sees("┤"), "escape", Lacks("┤"))
    played(desk(verbs, dive=dive), "3", "i", Lacks("┤"), *looked)


def test_the_result_is_there_and_goes_to_parameters_while_its_page_is_still_written(dive):
    verbs = FakeVerbs({}, tells=(*passes(), answer(), answer("pinn"), PAGE))

    def runs(app):
        return app.desk.jobs.runs("identify")

    def leave_values(_):
        leave(words_for(str(dive), "", results_beside(dive)))

    seen = (runs, Sees("11 of 12 coefficients"), Sees("25 % writing the page"))
    played(desk(verbs, dive=dive), "3", leave_values, "i", *seen, "p", shows(ParametersScreen), runs)
    assert verbs.words[-1][:3] == ("params", "diff", str(results_beside(dive)["--param"]))


@pytest.mark.parametrize(
    ("code", "keys", "screen"),
    [
        (exit_codes.DONE, ("p", Sees("then parameters")), ParametersScreen),
        (exit_codes.NO + 1, ("p", Sees("then parameters")), IdentifyScreen),
        (exit_codes.DONE, ("p", "1"), WatchScreen),
    ],
    ids=["with its values", "not with older ones", "not where the screen was left"],
)
def test_parameters_asked_for_while_it_runs_come_once_it_has_ended(code, keys, screen, identified):
    at = desk(FakeVerbs({"identify": {}, "params": None}, code, held=("identify",)), dive=identified)
    played(at, "3", "i", *keys, let_go, lambda _: None, shows(screen))


def test_a_run_that_fails_says_why_and_an_older_result_stays(identified):
    why = "the recording is too short; dive longer"
    verbs = FakeVerbs({"identify": None}, exit_codes.NO + 1, [why])
    played(desk(verbs, dive=identified), "3", "i", Sees(why), Sees("11 of 12 coefficients"))


def test_without_a_dive_or_a_vehicle_file_it_says_what_to_do(dive):
    played(desk(WAITING(), out=dive / "none"), "3", "i", Sees("yet; a recording makes one"))
    unnamed = desk(WAITING(), dive=dive.relative_to(Path.cwd()), vehicle="")
    named = []
    unnamed.name_vehicle = lambda vehicle: named.append(load_vehicle(vehicle))
    which = (
        Sees("NEXT Ctrl-K say which vehicle this is"),
        "ctrl+k",
        Sees("ardusub_vectored, bluerov2, bluerov2_heavy, bolt, ruvifist"),
    )
    notices = played(
        unnamed,
        "3",
        "i",
        Sees("No vehicle file is known"),
        Sees("Ctrl-K says which."),
        *(*which, *"rov", "enter", lambda _: not (named or unnamed.vehicle)),
        *("ctrl+k", *"bolt", "enter", Lacks("No vehicle file is known"), lambda _: unnamed.vehicle == "bolt"),
    )
    assert any(notice.startswith("rov: no such file") for notice in notices)
    assert [file.vehicle.name for file in named] == ["bolt"]


def test_a_dive_that_was_not_identified_says_which_key_does(dive):
    offered = Sees("not identified yet; i identifies it")
    played(desk(FakeVerbs(), dive=dive), "2", "3", offered, "2", shows(DivesScreen))


def on_watch(dives, *steps):
    """The dive that was identified last, and what was said."""
    verbs = FakeVerbs({"dives": dives, "identify": {}}, leave=leave)
    notices = played(desk(verbs), *steps, shows(IdentifyScreen))
    return verbs.words[-1][1], notices


def test_one_key_on_watch_identifies_the_dive_just_made_wherever_the_mark_stood(dive):
    older = HOVERING | {"folder": str(dive.with_name("older")), "name": "older", "began_unix_s": 0.0}
    chosen = ("2", "end", "enter", "1", lambda app: app.desk.dive == Path(older["folder"]))
    assert on_watch([older, HOVERING | {"folder": str(dive)}], *chosen, "i") == (str(dive), [])


def test_a_newer_recording_that_can_tell_nothing_is_said_to_be_passed_over(dive):
    passed_over = ["hovering; deck, recorded since, can tell nothing yet"]
    assert on_watch([HOVERING | {"folder": str(dive)}, DECK], "i") == (str(dive), passed_over)


def test_a_second_one_is_not_begun_while_one_runs(dive):
    verbs = FakeVerbs({"dives": [HOVERING | {"folder": str(dive)}]}, tells=passes())
    played(desk(verbs), *("1", "i") * 2, shows(IdentifyScreen))
    assert [words[0] for words in verbs.words].count("identify") == 1


WHY = "full/identified.json: the JSON can't be written (No space left on device); give another file"


def unkept(count=11):
    """A verb that identified so many coefficients and finds no room for any of its files."""
    missing = [value["name"] for value in made_identified.parameters()[count:]]
    result = made_identified.identified(parameters=made_identified.parameters(missing))
    page = (WHY, "full/identified.html: the report can't be written (No space left on device)")
    tells = (*passes(), Report(UNKEPT, 1.0, WHY, result=result), PAGE)
    return FakeVerbs({"identify": None}, exit_codes.BAD_INPUT, page, tells)


def test_values_that_find_no_room_on_the_disk_are_shown_and_said_to_be_kept_nowhere(dive):
    values = (Sees("11 of 12 coefficients identified"), Sees("its values are below, and kept nowhere"))
    why = (Sees(WHY), Sees("identified.html: the report can't be written"))
    played(desk(unkept(), dive=dive), "3", "i", *values, *why, Lacks("not identified yet"), size=WIDE)


def test_values_of_before_are_neither_shown_nor_uploaded_for_newer_ones_without_room(identified):
    at = desk(unkept(5), dive=identified)
    kept = (Sees("5 of 12 coefficients identified"), "p", shows(IdentifyScreen))
    played(at, "3", "i", "p", *kept, lambda _: at.param is None, size=WIDE)
