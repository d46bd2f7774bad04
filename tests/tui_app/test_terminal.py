"""The terminal: how fast it is drawn on, the looks of the themes, how the app leaves and how it dies."""

import asyncio
import json
import os
import signal
import sys
import threading
import time

import pytest
from fake_verbs import desk
from replayed_vehicle import free_port
from screen_text import played, said
from tmux import NEEDS_TMUX, Tmux, alone

from bridge.errors import LinkError
from gcs_plugin.recording.state import held
from tui.app import themes
from tui.app.crash_trace import keep_trace, trace_file
from tui.app.drawing import ROLES
from tui.app.jobs import aside
from tui.app.terminal import RefreshRate


def paced(*asked_and_answered):
    """The pace after queries and their answers, at these times in turn."""
    pace = RefreshRate(4.0)
    for n, now_s in enumerate(asked_and_answered):
        (pace.on_answered if n % 2 else pace.on_asked)(now_s)
    return pace


@pytest.mark.parametrize(
    ("times", "now_s", "may_draw", "may_ask", "period_s"),
    [
        ((0.0, 0.05, 0.25, 0.3), 0.5, True, True, 0.25),
        ((0.0, 0.9), 1.0, True, True, 1.0),
        ((0.0, 0.9, 1.0, 1.1), 5.0, True, True, 1.0),
        ((0.0, 0.9, 1.0, 1.1), 6.0, True, True, 0.25),
        ((0.0, 0.1, 0.25), 0.5, True, False, 0.25),
        ((0.0, 0.1, 0.25), 4.0, False, False, 1.0),
        ((0.0, 0.1, 0.25, 4.5), 4.6, True, True, 1.0),
        ((0.0, 0.1, 0.25), 5.5, True, True, 1.0),
        ((0.0,), 99.0, True, False, 0.25),
    ],
    ids=["keeps up", "lags", "has just caught up", "has caught up", "is a little behind", "is far behind", "came back",
         "is given up on", "never answers"],
)  # fmt: skip
def test_a_terminal_is_drawn_on_as_fast_as_it_keeps_up(times, now_s, may_draw, may_ask, period_s):
    pace = paced(*times)
    assert (pace.may_draw(now_s), pace.may_ask(), pace.period_s(now_s)) == (may_draw, may_ask, period_s)


def tried(pace, from_s, to_s):
    """How often a terminal is drawn on that answers no query any more."""
    drawn = 0
    for now_s in range(from_s, to_s):
        if pace.may_draw(float(now_s)):
            drawn += 1
            if pace.may_ask():
                pace.on_asked(float(now_s))
    return drawn


def test_a_terminal_that_stalls_for_an_hour_is_given_less_than_fills_the_queue_to_it():
    """Textual's queue holds 30 writes, two a drawing with its query; a full one would stop alarms and orders too."""
    pace = paced(0.0, 0.1)
    assert tried(pace, 1, 3600) <= 15
    pace.on_answered(3600.0)
    assert tried(pace, 3601, 3611) >= 2


@pytest.fixture(autouse=True)
def state(tmp_path, monkeypatch):
    """The file of the theme, in a folder of its own."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    return tmp_path / "seatrial" / "tui.json"


def test_the_theme_is_kept_for_next_time(state):
    assert themes.load_theme() == "dark"
    themes.keep_theme("sunlight")
    assert themes.load_theme() == "sunlight"
    assert json.loads(state.read_text(encoding="utf-8")) == {"theme": "sunlight"}


@pytest.mark.parametrize("kept", ["", "[]", '{"theme": "pink"}', '{"theme": ["dark"]}'])
def test_a_kept_theme_that_is_none_is_the_first(state, kept):
    state.parent.mkdir()
    state.write_text(kept, encoding="utf-8")
    assert themes.load_theme() == "dark"


def test_a_disk_that_takes_nothing_is_no_reason_to_stop(state):
    state.parent.write_text("a file where a folder should be", encoding="utf-8")
    themes.keep_theme("light")
    assert themes.load_theme() == "dark"
    assert "no more is known" in keep_trace(ValueError("x"))


def test_sunlight_has_no_tint():
    for foreground, background, _ in themes.looks_of("sunlight").values():
        for colour in filter(None, (foreground, background)):
            assert len({colour[n : n + 2] for n in (1, 3, 5)}) == 1


def _contrast(colour, ground):
    """WCAG 2.1's contrast ratio."""

    def luminance(colour):
        parts = [int(colour[n : n + 2], 16) / 255 for n in (1, 3, 5)]
        linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    light, dark = sorted((luminance(colour), luminance(ground)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


@pytest.mark.parametrize("name", themes.ORDER)
def test_what_is_to_be_read_has_contrast_and_states_that_must_be_told_apart_look_different(name):
    looks = themes.variables(name)
    unread = ("reference", "rule", "stale", "faded")
    for role in (role for role in ROLES if role not in unread):
        assert _contrast(looks[f"{role}-fg"], looks[f"{role}-bg"]) >= 4.5, role
    states = ("plain", "strong", "stale", "warn", "bad", "failsafe")
    assert len({tuple(looks[f"{role}-{part}"] for part in ("fg", "bg", "style")) for role in states}) == len(
        states
    )


APP = """
import sys
from tui.app.screens.watch import WatchScreen
from tui.cli import command

def breaks(screen):
    raise RuntimeError("a made fault")

WatchScreen.action_words = breaks
sys.exit(command())
"""


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


def test_work_aside_answers_and_raises():
    def fail():
        raise LinkError("no link")

    async def both():
        assert await aside(lambda: 7) == 7
        await aside(fail)

    with pytest.raises(LinkError, match="no link"):
        asyncio.run(both())


def test_nobody_waits_for_work_aside_at_the_end():
    never = threading.Event()

    async def leave():
        waiting = asyncio.create_task(aside(never.wait))
        await asyncio.sleep(0)
        waiting.cancel()
        await asyncio.gather(waiting, return_exceptions=True)

    asyncio.run(leave())
    (thread,) = [thread for thread in threading.enumerate() if thread.name == "aside"]
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


def test_long_work_is_told_of_before_the_app_is_left_and_again_where_it_was_begun_anew():
    now_s = [0.0]
    at = desk(now_s=lambda: now_s[0])

    def begin(_):
        now_s[0] += 1.0
        at.jobs.start("diagnose", ("diagnose", "dives/a"))

    def cancel(_):
        at.jobs.cancel("diagnose")

    def stays(app):
        return not app._exit

    anew = (cancel, begin, "ctrl+q", stays, "ctrl+q", lambda app: app._exit)
    warning = "diagnose at work, and lost if you leave now; Ctrl-Q again leaves"

    def warned(app):
        return said(app) == [warning]

    # The first warning goes with the work that it was about.
    assert played(at, begin, "ctrl+q", stays, warned, *anew) == [warning]
