"""The screen that docs/howto/add_a_screen.md shows does what the page says."""

import re
from dataclasses import replace
from pathlib import Path

from made_view import FixedViews, view
from screen_text import made, pressed, run, settled, text

PAGE = Path(__file__).resolve().parents[2] / "docs" / "howto" / "add_a_screen.md"


def shown():
    (block,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.S)
    names = {"__name__": "shown"}
    exec(block, names)
    return names


def test_the_screen_that_is_shown_counts_lost_frames_from_a_key_on():
    page = shown()
    assert page["loss_lines"](7, 4) == ((("▲ ", "bad"), ("3 frames lost", "plain")),)
    lost = replace(view(), recording=replace(view().recording, lost=7))

    async def work(app, pilot):
        app.push_screen(page["LossScreen"]("Loss", ()))
        await settled(app, pilot)
        assert "▲ 7 frames lost" in text(app)
        await pressed(pilot, "z")
        assert "● 0 frames lost" in text(app)

    run(made(FixedViews(lost)), (80, 24), work)
