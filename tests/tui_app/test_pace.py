"""Drawing keeps pace with the terminal."""

import json

import pytest

from tui.app import themes
from tui.app.drawing import ROLES
from tui.app.terminal import Pace


def test_a_terminal_that_keeps_up_is_drawn_as_often_as_asked():
    pace = Pace(4.0)
    for n in range(20):
        now_s = n * 0.25
        assert pace.may_draw(now_s)
        assert pace.may_ask()
        pace.on_asked(now_s)
        pace.on_answered(now_s + 0.05)
        assert pace.period_s(now_s) == 0.25


def test_a_terminal_that_lags_is_drawn_once_a_second_and_often_again_when_it_has_caught_up():
    pace = Pace(4.0)
    pace.on_asked(0.0)
    pace.on_answered(0.9)
    assert pace.period_s(1.0) == 1.0
    pace.on_asked(1.0)
    pace.on_answered(1.1)
    assert pace.period_s(5.0) == 1.0
    assert pace.period_s(6.0) == 0.25


def test_nothing_is_drawn_while_the_terminal_is_far_behind():
    pace = Pace(4.0)
    pace.on_asked(0.0)
    pace.on_answered(0.1)
    pace.on_asked(0.25)
    assert pace.may_draw(0.5)
    assert not pace.may_ask()
    assert not pace.may_draw(1.0)
    assert not pace.may_draw(4.0)
    assert pace.period_s(4.0) == 1.0
    pace.on_answered(4.5)
    assert pace.may_draw(4.6)


def test_an_answer_that_never_comes_stops_nothing_for_long():
    pace = Pace(4.0)
    pace.on_asked(0.0)
    pace.on_answered(0.1)
    pace.on_asked(0.25)
    assert pace.may_draw(5.5)
    assert pace.may_ask()


def test_a_terminal_that_never_answers_is_taken_to_keep_up():
    pace = Pace(4.0)
    pace.on_asked(0.0)
    assert all(pace.may_draw(float(n)) for n in range(100))
    assert pace.period_s(100.0) == 0.25


def test_fewer_refreshes_than_one_a_second_stay_so():
    pace = Pace(0.5)
    pace.on_asked(0.0)
    pace.on_answered(3.0)
    assert pace.period_s(3.1) == 2.0


@pytest.fixture
def state(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    return tmp_path / "seatrial" / "tui.json"


def test_the_theme_is_kept_for_next_time(state):
    assert themes.load_theme() == "dark"
    themes.keep_theme("sunlight")
    assert themes.load_theme() == "sunlight"
    assert json.loads(state.read_text(encoding="utf-8")) == {"theme": "sunlight"}


@pytest.mark.parametrize("kept", ["", "[]", '{"theme": "pink"}', '{"theme": ["dark"]}', '"dark"'])
def test_a_kept_theme_that_is_none_is_the_first(state, kept):
    state.parent.mkdir()
    state.write_text(kept, encoding="utf-8")
    assert themes.load_theme() == "dark"


def test_a_disk_that_takes_nothing_is_no_reason_to_stop(state):
    state.parent.write_text("a file where a folder should be", encoding="utf-8")
    themes.keep_theme("light")
    assert themes.load_theme() == "dark"


def test_every_role_has_a_look_in_every_theme():
    for name in themes.ORDER:
        assert set(themes.variables(name)) == {
            f"{role}-{part}" for role in ROLES for part in ("fg", "bg", "style")
        }


def test_sunlight_has_no_tint():
    for foreground, background, _ in themes.SUNLIGHT.values():
        for colour in filter(None, (foreground, background)):
            assert len({colour[n : n + 2] for n in (1, 3, 5)}) == 1


@pytest.mark.parametrize("name", themes.ORDER)
def test_states_that_must_be_told_apart_look_different(name):
    looks = themes.variables(name)
    told = [tuple(looks[f"{role}-{part}"] for part in ("fg", "bg", "style")) for role in
            ("plain", "strong", "stale", "warn", "bad", "failsafe")]  # fmt: skip
    assert len(set(told)) == len(told)


def _contrast(one, other):
    """WCAG 2.1's contrast ratio."""

    def luminance(colour):
        parts = [int(colour[n : n + 2], 16) / 255 for n in (1, 3, 5)]
        linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    light, dark = sorted((luminance(one), luminance(other)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


@pytest.mark.parametrize("name", themes.ORDER)
@pytest.mark.parametrize(
    "role", ["plain", "quiet", "strong", "accent", "warn", "bad", "lost", "armed", "failsafe", "tab", "key"]
)
def test_what_is_to_be_read_has_contrast(name, role):
    looks = themes.variables(name)
    assert _contrast(looks[f"{role}-fg"], looks[f"{role}-bg"]) >= 4.5
