"""What every test of the app begins with."""

import asyncio
import functools

import pytest
from textual._compositor import Compositor
from textual.app import active_app
from textual.css.model import RuleSet
from textual.css.stylesheet import Stylesheet


@pytest.fixture(autouse=True)
def _with_colour(monkeypatch):
    """Whatever the terminal of these tests asks for."""
    monkeypatch.delenv("NO_COLOR", raising=False)


@pytest.fixture(autouse=True, scope="session")
def _style_sheets_are_parsed_once():
    """Each app parses the same sheets several times as it starts, a third of the time that it takes to start."""
    parse, known = Stylesheet._parse_rules, {}

    @functools.wraps(parse)
    def once(self, css, *where, **which):
        key = (frozenset(self._variables.items()), css, where, frozenset(which.items()))
        if key not in known:
            known[key] = parse(self, css, *where, **which)
        return known[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Stylesheet, "_parse_rules", once)
        # The same hash, by identity, without a call of Python: rules are looked up some 50 000 times a test.
        patch.setattr(RuleSet, "__hash__", object.__hash__)
        yield


@pytest.fixture(autouse=True, scope="session")
def _screens_are_drawn_when_they_are_read():
    """Without a terminal every update is drawn and thrown away, a third of a test's time; `screen_text` draws anew."""
    draw = Compositor.render_update

    @functools.wraps(draw)
    def drawn(self, *how, **which):
        if not active_app.get().is_headless:
            return draw(self, *how, **which)
        self._dirty_regions.clear()
        return None

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Compositor, "render_update", drawn)
        yield


GLANCE_S = 0.002


async def _nothing_is_left_to_do(*_):
    """Until the loop has nothing ready, nor what a thread or a file may have made so meanwhile."""
    loop = asyncio.get_running_loop()
    for glance_s in (0.0, GLANCE_S):
        await asyncio.sleep(glance_s)
        while loop._ready:
            await asyncio.sleep(0.0)


@pytest.fixture(autouse=True, scope="session")
def _keys_wait_for_the_loop_and_not_for_the_clock():
    """Textual takes an app for idle once its process hardly worked for 20 ms, several times for each key."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("textual.app.wait_for_idle", _nothing_is_left_to_do)
        patch.setattr("textual.pilot.wait_for_idle", _nothing_is_left_to_do)
        yield
