"""An app that dies of an exception is gone at once: one sentence, the trace in a file, the terminal as it was."""

import asyncio
import os
import signal
import sys
import threading
import time

import pytest
from replayed_vehicle import free_port
from tmux import NEEDS_TMUX, Tmux, alone

from bridge.errors import LinkError
from gcs_plugin.recording.state import held
from tui.app.jobs import aside
from tui.app.terminal import keep_trace, trace_file

APP = """
import asyncio, sys, time
from tui.app.screens.watch import WatchScreen
from tui.cli import command

def breaks(screen):
    raise RuntimeError("a made fault")

async def waits(screen):
    screen.run_worker(asyncio.to_thread(time.sleep, 3600))
    screen.set_timer(0.1, lambda: breaks(screen))

WatchScreen.action_words = {method}
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
@pytest.mark.parametrize("method", ["breaks", "waits"])
def test_in_tmux_the_prompt_is_back_and_the_recording_goes_on(method, tmp_path):
    port = free_port()
    (tmp_path / "app.py").write_text(APP.format(method=method))
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
