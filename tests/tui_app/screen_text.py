"""A screen as text to keep and compare: under each row the role of every cell, at the end how the roles look.

`pytest-textual-snapshot` keeps SVG, and its newest release (1.1.0) wants pytest below 9; a difference in text is read
at once. Keep anew, after looking: SEATRIAL_KEEP_SCREENS=1.
"""

import asyncio
import os
from functools import partial
from inspect import isawaitable
from pathlib import Path

from made_view import FixedViews
from rich.segment import Segment
from textual._context import visible_screen_stack
from textual.color import Color
from textual.widgets import Input

from tui.app.app import SeatrialApp
from tui.app.drawing import ROLES
from tui.app.screens.frame import Drawn
from tui.app.screens.overlays import OverScreen

NARROW, WIDE = (80, 24), (160, 50)
KEPT = Path(__file__).parent / "screens"
LETTERS = dict(zip(ROLES, ".qSar-sfWBLAFTK", strict=True))
OTHERS = "123456789"


def run(app, size, work=None):
    """Run `work(app, pilot)` in the app once it shows something; what it answers."""

    async def begin():
        async with app.run_test(size=size) as pilot:
            pilot.press = partial(_pressed, app, pilot, pilot.press)
            await settled(app, pilot)
            return await work(app, pilot) if work else None

    return asyncio.run(begin())


async def _pressed(app, pilot, press, *keys):
    """Press keys, and wait until each has had its effect."""
    await press(*keys)
    while app.is_typing:
        await pilot.pause()


async def settled(app, pilot):
    """Until the screen has its first view, and is drawn."""
    while getattr(app.screen, "view", None) is None:
        await pilot.pause()
    await pilot.pause()


async def resized(app, pilot, size):
    """Give the terminal this size, until what it shows stands still."""
    await pilot.resize_terminal(*size)
    while app.screen.size != size:
        await pilot.pause()
    await still(app, pilot)


async def still(app, pilot):
    """Until what the screen shows stands still."""
    shown, alike = "", 0
    while alike < 3:
        await pilot.pause()
        alike = alike + 1 if text(app) == shown else 0
        shown = text(app)


async def pressed(pilot, *keys):
    for key in keys:
        await pilot.press(key)
        await pilot.pause()
    await pilot.pause()


class Sees(str):
    """Words that stand on the screen, wherever its lines break."""


class Lacks(str):
    """Words that do not."""


async def at_rest(app, pilot):
    """Until every verb has ended that does not wait to be let go, and what it left is shown.

    What is shown may begin to read the dives: that is waited for, and shown too.
    """
    jobs = app.desk.jobs
    for _ in range(2):
        while sum(state.runs for state in jobs._states.values()) > getattr(jobs._work, "waiting", 0):
            await pilot.pause()
        shown = dict(jobs._states)
        app._show()
        await pilot.pause()
        if all(state is shown.get(verb) for verb, state in jobs._states.items()):
            break
    # A key that comes before the line has the focus is lost.
    while _asks(app.screen) and not isinstance(app.focused, Input):
        await pilot.pause()


def _asks(screen):
    return screen.has_class("-asking") or (isinstance(screen, OverScreen) and bool(screen.query(Input)))


async def play(app, pilot, *steps):
    """Press the keys, hold the screen against `Sees` and `Lacks`, call functions, each until the app rests."""
    for step in steps:
        if isinstance(step, Sees | Lacks):
            if (step in flat(app)) is not isinstance(step, Sees):
                await still(app, pilot)
            assert (step in flat(app)) is isinstance(step, Sees), text(app)
            continue
        if callable(step):
            answer = step(app)
            assert (await answer if isawaitable(answer) else answer) is not False, text(app)
        else:
            await pressed(pilot, step)
        await at_rest(app, pilot)


def played(desk, *steps, size=NARROW, views=None, **options):
    """Play the steps in an app with this desk: what it said."""

    async def work(app, pilot):
        await play(app, pilot, *steps)
        return said(app)

    return run(made(views or FixedViews(), desk=desk, **options), size, work)


def said(app):
    """The notices that the app shows, or showed."""
    return [notice.message for notice in app._notifications]


async def worked(app):
    """A step that waits until the app has done what it was told."""
    await app.workers.wait_for_complete()


def shows(screen):
    """A step that sees which screen is on top."""
    return lambda app: isinstance(app.screen, screen)


def strips(app):
    visible_screen_stack.set(app._background_screens)
    return app.screen._compositor.render_strips()


def plain(lines):
    """The text of lines, without their roles."""
    return ["".join(text for text, _ in line).rstrip() for line in lines]


def text(app):
    """What is on the screen, without any style."""
    return "\n".join(strip.text.rstrip() for strip in strips(app))


def flat(app):
    """What is on the screen, in one line."""
    return " ".join(text(app).replace("│", " ").split())


def looks(app):
    """The text with a role under each cell, and the legend."""
    letters, legend = _known(app)
    foreground, plain = next(iter(letters)).split(" on ")
    lines = []
    for strip in strips(app):
        roles = ""
        for segment in strip:
            key = _look(segment.style)
            if not segment.text.strip() and key.endswith(plain):
                key = f"{foreground} on {plain}"
            if key not in letters:
                letters[key] = OTHERS[len([letter for letter in letters.values() if letter in OTHERS])]
                legend[letters[key]] = key
            roles += letters[key] * len(segment.text)
        lines += [strip.text.rstrip(), roles.rstrip(".").rstrip()]
    used = set("".join(lines[1::2])) | {"."}
    lines += [f"{letter} {look}" for letter, look in legend.items() if letter in used]
    return "\n".join(lines) + "\n"


def _known(app):
    """The letter of each look that a role has in this theme, under the app's own filters."""
    widget = next(iter(app.screen.query(Drawn)))
    letters, legend = {}, {}
    for role in ROLES:
        segments = [Segment("x", widget.screen.get_component_rich_style(f"line--{role}"))]
        for line_filter in app.get_line_filters():
            segments = line_filter.apply(segments, Color.parse("black"))
        look = _look(segments[0].style)
        if look not in letters:
            letters[look], legend[LETTERS[role]] = LETTERS[role], f"{role}: {look}"
    return letters, legend


def _look(style):
    """A style in words, without what does not show."""
    if style is None:
        return "none"
    words = [name for name in ("bold", "dim", "italic", "underline", "reverse") if getattr(style, name)]
    colours = [colour.name if colour else "default" for colour in (style.color, style.bgcolor)]
    return " ".join([*words, " on ".join(colours)])


def check(name, app):
    """Hold the screen against the one kept under `name`."""
    file = KEPT / f"{name}.txt"
    seen = looks(app)
    if os.environ.get("SEATRIAL_KEEP_SCREENS"):
        KEPT.mkdir(exist_ok=True)
        file.write_text(seen, encoding="utf-8")
    assert seen.splitlines() == file.read_text(encoding="utf-8").splitlines()


def made(views, **options):
    """The app without a user's own files."""
    return SeatrialApp(views, keep_theme=options.pop("keep_theme", lambda _: None), **options)
