"""Watch looks as it was kept, at two sizes, in three themes and without colour."""

from dataclasses import replace

import pytest
from made_view import UNIX_S, FixedViews, view
from screen_text import check, looks, made, pressed, run, strips, text
from soak import rest_in_soak

from gcs_plugin.watch.picture import Armed, Freshness, Said
from tui.app.screens.panes import SensorTable

SIZES = ((80, 24), (160, 50))


@pytest.mark.parametrize("size", rest_in_soak(SIZES))
def test_what_is_drawn_again_in_part_is_what_would_be_drawn_anew(size):
    before = view()
    lost = replace(before.picture.sensors[1], age_s=40.0, freshness=Freshness.GONE)
    after = replace(
        before,
        unix_s=before.unix_s + 1,
        trouble="refused",
        picture=replace(
            before.picture,
            now_s=before.picture.now_s + 3.0,
            sensors=(lost, *before.picture.sensors[1:]),
            said=before.picture.said[:2],
            armed=Armed.FAILSAFE,
        ),
    )

    async def anew(app, _):
        return looks(app)

    async def in_part(app, pilot):
        views.shown = after
        app._show()
        await pilot.pause()
        await pilot.pause()
        return looks(app)

    views = FixedViews(before)
    assert run(made(views), size, in_part) == run(made(FixedViews(after)), size, anew)


def test_help_looks_as_it_was_kept():
    async def look(app, pilot):
        await pressed(pilot, "question_mark")
        assert "Moving about" in text(app)
        check("help-160x50", app)

    run(made(FixedViews()), (160, 50), look)


def test_what_a_vehicle_says_can_neither_steer_the_terminal_nor_push_a_row_out_of_line():
    said = Said(UNIX_S, 4, "\x1b[2J wiped \U0001f480 \u6c34 \u0301 end")
    shown = replace(view(), picture=replace(view().picture, said=(said,)))

    async def work(app, _):
        assert "?[2J wiped ? ? ? end" in text(app)
        assert all(strip.cell_length == 80 for strip in strips(app))

    run(made(FixedViews(shown)), (80, 24), work)


def test_every_cell_that_changed_is_drawn_again_and_few_others():
    before = view()
    sensors = tuple(replace(row, age_s=row.age_s + 0.3) for row in before.picture.sensors)
    views = FixedViews(before)

    def cells(widget):
        return [[(c, role) for text, role in line for c in text] for line in widget._lines]

    async def work(app, pilot):
        widget = app.screen.query_one(SensorTable)
        old, drawn = cells(widget), set()

        def note(*regions, **_):
            drawn.update((x, y) for region in regions for y in region.line_range for x in region.column_range)

        widget.refresh = note
        views.shown = replace(before, picture=replace(before.picture, sensors=sensors))
        app._show()
        await pilot.pause()
        new = cells(widget)
        changed = {
            (x, y) for y, row in enumerate(new) for x, cell in enumerate(row) if old[y][x : x + 1] != [cell]
        }
        assert changed
        assert changed <= drawn
        assert len(drawn) < 3 * len(changed)

    run(made(views), (80, 24), work)
