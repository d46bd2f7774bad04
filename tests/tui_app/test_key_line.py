"""The live keys at the bottom."""

import pytest
from made_view import FixedViews
from screen_text import made, run, text

from tui.app.screens.frame import KeyLine, LiveKey, fitting

KEYS = (
    LiveKey("i", "i", "Identify", "identify"),
    LiveKey("ctrl+x", "^x", "FF off", "app.force_off"),
    LiveKey("question_mark", "?", "Help", "app.help"),
    LiveKey("ctrl+q", "^q", "Quit", "app.quit"),
)


def written(keys):
    return "".join(text for key in keys for text, _ in key.spans)


def test_all_keys_are_told_where_they_fit_to_the_cell():
    line = " i Identify  ^x FF off  ? Help  ^q Quit "
    assert written(fitting(KEYS, len(line))) == line


def test_one_cell_less_leaves_out_the_last_and_counts_it_beside_the_help():
    line = " i Identify  ^x FF off  ? Help, 1 more "
    assert written(fitting(KEYS, 39)) == line
    assert len(line) == 39


@pytest.mark.parametrize("cells", [0, 1, 26])
def test_the_key_that_ends_the_feed_forward_and_the_help_stay_however_little_room_there_is(cells):
    assert written(fitting(KEYS, cells)) == " ^x FF off  ? Help, 2 more "


def test_a_click_on_a_key_is_the_key():
    views = FixedViews()

    async def work(app, pilot):
        x = text(app).splitlines()[-1].index("FF off")
        await pilot.click(KeyLine, offset=(x, 0))
        while not views.forced:
            await pilot.pause()
        await pilot.click(KeyLine, offset=(79, 0))
        assert app.screen.title == "Watch"

    run(made(views), (80, 24), work)
    assert views.forced == 1
