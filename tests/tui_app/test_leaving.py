"""Leaving while a verb is long at work is asked back once."""

from made_dives import DIVES, FakeVerbs, desk
from made_view import FixedViews
from screen_text import made, pressed, run


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


def test_the_list_of_dives_holds_nobody_up():
    assert left("dives", "ctrl+q") == (True, [])
