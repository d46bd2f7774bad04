"""Each screen looks as it was kept, once at each size; Watch in each theme and without colour."""

import pytest
from fake_verbs import FakeVerbs, desk
from made_diagnosis import desk_with
from made_identified import dive_in, identified_dive, passes
from made_parameters import desk as with_vehicle
from made_parameters import views
from made_validation import validated_desk
from made_view import FixedViews, StillReplay
from screen_text import NARROW, WIDE, check, made, play, run
from soak import rest_in_soak

from tui.app import app as seatrial_app
from tui.app.next_step import Situation
from tui.app.themes import ORDER

PHONE = (48, 30)
SIZES = pytest.mark.parametrize("size", rest_in_soak((NARROW, WIDE)))


@pytest.fixture(autouse=True)
def situation(monkeypatch):
    """The next step is that of one situation, whatever a screen's own dives are."""
    state = Situation(heard=True, linked=True, dive="2026-11-20T0912Z-hovering", determined=6)
    monkeypatch.setattr(seatrial_app, "read_situation", lambda *_: state)


def looks(name, app, size, *keys):
    """Press keys and hold the screen against the one kept under its name and size."""

    async def look(app, pilot):
        await play(app, pilot, *keys)
        check(f"{name}-{size[0]}x{size[1]}", app)

    run(app, size, look)


@SIZES
def test_watch_and_a_replay_on_it(size):
    looks("watch", made(FixedViews()), size)
    looks("replay", made(FixedViews(), desk=desk(replay=StillReplay())), size)


def test_watch_on_a_phone_has_the_values_on_its_first_page_and_thrusters_on_its_second():
    looks("watch", made(FixedViews()), PHONE)
    looks("watch-second", made(FixedViews()), PHONE, "c")


@pytest.mark.parametrize("theme", ORDER[1:])
def test_the_other_themes(theme):
    looks(f"watch-{theme}", made(FixedViews(), theme=theme), NARROW)


def test_without_colour(monkeypatch):
    monkeypatch.setenv("NO_COLOR", "1")
    looks("watch-no-colour", made(FixedViews()), NARROW)


def test_help():
    looks("help", made(FixedViews()), WIDE, "question_mark")


@SIZES
def test_dives(size):
    looks("dives", made(FixedViews(), desk=desk()), size, "2")


@SIZES
def test_an_identification_and_a_run(size, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    at = desk(FakeVerbs(tells=passes()), dive=identified_dive(dive_in(tmp_path)))
    looks("identify", made(FixedViews(), desk=at), size, "3")
    looks("identify-runs", made(FixedViews(), desk=at), size, "3", "i")


@pytest.mark.parametrize("size", rest_in_soak((WIDE, NARROW)))
def test_diagnose_and_validate(size, tmp_path):
    looks("diagnose", made(FixedViews(), desk=desk_with(tmp_path / "diagnosed")), size, "4")
    looks("validate", made(FixedViews(), desk=validated_desk(tmp_path / "validated")), size, "6")


@SIZES
def test_parameters(size):
    looks("parameters", made(views(), desk=with_vehicle()), size, "5", "down", "down")
