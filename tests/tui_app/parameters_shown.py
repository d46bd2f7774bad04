"""The screen Parameters beside a made vehicle: keys typed until they have had their effect, and the line of a name."""

from dataclasses import replace

from made_parameters import desk
from made_view import FixedViews, view
from screen_text import made, pressed, run, text
from textual.widgets import Input

from gcs_plugin.watch.picture import Armed

SIZES = ((80, 24), (160, 50))
NARROW = SIZES[0]


def views(armed=Armed.DISARMED, ff_mode=1):
    made_view = view()
    return FixedViews(replace(made_view, picture=replace(made_view.picture, armed=armed, ff_mode=ff_mode)))


async def done(app, pilot):
    """Until nothing runs, and it is shown."""
    while any(app.desk.jobs.runs(verb) for verb in ("params diff", "params upload")):
        await pilot.pause()
    app._show()
    await pilot.pause()
    while app.screen.has_class("-asking") and not isinstance(app.focused, Input):
        await pilot.pause()


async def typed(app, pilot, *keys):
    for key in keys:
        await pressed(pilot, key)
        await done(app, pilot)


def on_screen(vehicle, work, size=NARROW, shown=None, **what):
    async def begin(app, pilot):
        await typed(app, pilot, "5")
        await work(app, pilot)

    run(made(shown or views(), desk=desk(vehicle, **what)), size, begin)


def line_of(app, name):
    return next(line for line in text(app).splitlines() if name in line)
