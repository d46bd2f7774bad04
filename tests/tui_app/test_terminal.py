"""The terminal: how fast it is drawn on, the looks of the themes, how the app leaves and how it dies."""

import asyncio
import json
import os
import signal
import sys
import threading
import time

import pytest
from made_dives import DIVES, FakeVerbs, desk
from made_view import FixedViews
from replayed_vehicle import free_port
from screen_text import made, pressed, run
from tmux import NEEDS_TMUX, Tmux, alone

from bridge.errors import LinkError
from gcs_plugin.recording.state import held
from tui.app import themes
from tui.app.drawing import ROLES
from tui.app.jobs import aside
from tui.app.terminal import Pace, keep_trace, trace_file


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


APP = """
import sys
from tui.app.screens.watch import WatchScreen
from tui.cli import command

def breaks(screen):
    raise RuntimeError("a made fault")

WatchScreen.action_words = breaks
sys.exit(command())
"""


@pytest.fixture(autouse=True)
def _own_state(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))


def test_the_trace_is_kept_and_a_sentence_says_where():
    try:
        raise ValueError("two\nlines")
    except ValueError as error:
        sentence = keep_trace(error)
    assert sentence == (
        "seatrial: the app has died (ValueError: two lines); a recording goes on without it. "
        f"Start it again; what it died of is in {trace_file()}"
    )
    assert "in test_the_trace_is_kept_and_a_sentence_says_where" in trace_file().read_text()


def test_a_trace_that_can_not_be_written_is_told_too(tmp_path):
    (tmp_path / "seatrial").write_text("a file where a folder should be")
    assert "no more is known" in keep_trace(ValueError("x"))


def test_work_aside_answers_and_raises():
    async def both():
        assert await aside(lambda: 7) == 7
        await aside(lambda: _raise(LinkError("no link")))

    with pytest.raises(LinkError, match="no link"):
        asyncio.run(both())


def _raise(error):
    raise error


def test_nobody_waits_for_work_aside_at_the_end():
    never = threading.Event()

    async def leave():
        waiting = asyncio.create_task(aside(never.wait))
        await asyncio.sleep(0)
        waiting.cancel()
        await asyncio.gather(waiting, return_exceptions=True)

    asyncio.run(leave())
    (thread,) = [one for one in threading.enumerate() if one.name == "aside"]
    assert thread.daemon
    never.set()
    thread.join()


@pytest.mark.slow
@NEEDS_TMUX
def test_in_tmux_the_prompt_is_back_and_the_recording_goes_on(tmp_path):
    port = free_port()
    (tmp_path / "app.py").write_text(APP)
    terminal = Tmux(f"seatrial-dies-{os.getpid()}-{port}", 80, 24, "sh", alone(tmp_path))
    try:
        line = f"{sys.executable} app.py tui --link udpin:127.0.0.1:{port}"
        # The word is split, so that the command line itself does not hold it.
        terminal.keys(f"cd {tmp_path}; {line}; echo ended w''ith $?; stty -a | grep -o ' icanon'", "Enter")
        terminal.until("1 Watch", "REC 00:00:")
        terminal.keys("w")
        screen = terminal.until("the app has died (RuntimeError: a made fault)", "ended with 1", " icanon")
        assert "1 Watch" not in screen
        assert "Traceback" not in screen
        assert "in breaks" in trace_file().read_text()
        assert held(time.time()) is not None
    finally:
        terminal.close()
        if holding := held(time.time()):
            os.kill(holding.pid, signal.SIGTERM)


def left(verb, *keys, restart=False):
    """Whether the app was left by the keys, and what it said, while `verb` runs; it may run anew after the first."""

    async def work(app, pilot):
        app.desk.jobs.start(verb, (verb, "dives/a"))
        await pressed(pilot, keys[0])
        if restart:
            app.desk.jobs.cancel(verb)
            await pilot.pause()
            app.desk.jobs._clock = lambda: 1.0
            app.desk.jobs.start(verb, (verb, "dives/a"))
        await pressed(pilot, *keys[1:])
        said = [notice.message for notice in app._notifications]
        return app._exit, said

    verbs = FakeVerbs({"dives": DIVES})
    return run(made(FixedViews(), desk=desk(verbs)), (80, 24), work)


def test_an_identification_at_work_is_told_of_first():
    assert left("identify", "ctrl+q") == (
        False,
        ["identify at work, and lost if you leave now; ^q again leaves"],
    )


def test_the_key_pressed_again_leaves():
    gone, said = left("identify", "ctrl+q", "ctrl+q")
    assert gone
    assert len(said) == 1


def test_one_that_was_begun_since_is_told_of_too():
    gone, said = left("diagnose", "ctrl+q", "ctrl+q", restart=True)
    assert not gone
    assert len(said) == 2
