"""Watch looks as it was kept, at two sizes, in three themes and without colour."""

import pytest
from made_view import FixedViews
from screen_text import check, made, pressed, run, text

from tui.app.themes import ORDER

SIZES = ((80, 24), (160, 50))


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("theme", ORDER)
def test_watch_looks_as_it_was_kept(theme, size):
    async def look(app, _):
        check(f"watch-{size[0]}x{size[1]}-{theme}", app)

    run(made(FixedViews(), theme=theme), size, look)


@pytest.mark.parametrize("size", SIZES)
def test_watch_without_colour_looks_as_it_was_kept(size, monkeypatch):
    monkeypatch.setenv("NO_COLOR", "1")

    async def look(app, _):
        check(f"watch-{size[0]}x{size[1]}-no-colour", app)

    run(made(FixedViews()), size, look)


def test_the_second_page_of_charts_and_all_words_look_as_they_were_kept():
    async def look(app, pilot):
        await pressed(app, pilot, "c")
        check("watch-80x24-second-page", app)
        await pressed(app, pilot, "w")
        check("watch-80x24-words", app)

    run(made(FixedViews()), (80, 24), look)


def test_help_looks_as_it_was_kept():
    async def look(app, pilot):
        await pressed(app, pilot, "question_mark")
        assert "Moving about" in text(app)
        check("help-160x50", app)

    run(made(FixedViews()), (160, 50), look)
