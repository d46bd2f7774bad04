"""The screen Validate: its looks, and the verb that it runs."""

import asyncio
import json

from made_diagnosis import CHECK, DIVE, OLDER
from made_dives import dive
from made_validation import validated_desk, validation
from made_view import FixedViews
from screen_text import made, pressed, run, text

from bridge.reports import UNKEPT, Report
from tui.app.jobs import Jobs
from tui.job import Done

NARROW, WIDE = (80, 24), (160, 50)


class Verb:
    """A verb that waits until it is let go, then writes a validation."""

    def __init__(self):
        self.words, self.go = (), asyncio.Event()

    async def __call__(self, words, hear):
        self.words = tuple(words)
        hear(Report("validating", 0.5, "reading"))
        await self.go.wait()
        with open(words[words.index("--json") + 1], "w", encoding="utf-8") as file:
            json.dump(validation(), file)
        return Done(0, validation(), ())


async def ended(app, pilot):
    while app.desk.jobs.runs("validate"):
        await pilot.pause()
    app._show()
    await pilot.pause()
    await pilot.pause()


def seen(app):
    return " ".join(text(app).split())


def test_keys_go_from_axis_to_axis_and_from_dive_to_dive(tmp_path):
    async def work(app, pilot):
        await pressed(pilot, "6", "s")
        axes = []
        for _ in range(4):
            axes.append(next(word for word in ("surge", "sway", "yaw") if f"{word} speed" in text(app)))
            await pressed(pilot, "a")
        assert axes == ["surge", "sway", "yaw", "surge"]
        labels = []
        for _ in range(4):
            labels.append(seen(app).split("CURVES of ")[1].split()[0])
            await pressed(pilot, "m")
        assert labels == ["shadow", "FF", "both", "shadow"]

    run(made(FixedViews(), desk=validated_desk(tmp_path)), NARROW, work)


def test_the_verdict_is_that_of_the_dive_that_is_looked_at(tmp_path):
    async def work(app, pilot):
        await pressed(pilot, "6")
        assert "raised from shadow to both" in seen(app)
        await pressed(pilot, "m")
        assert "raised from only to both" in seen(app)
        assert CHECK in seen(app)

    run(made(FixedViews(), desk=validated_desk(tmp_path)), WIDE, work)


def test_it_validates_the_chosen_dive_beside_so_many_others_as_a_key_says(tmp_path):
    async def work(app, pilot):
        await pressed(pilot, "6")
        aims = []
        for _ in range(4):
            aims.append(seen(app).split("validates ")[1].split(". ")[0])
            await pressed(pilot, "c")
        assert aims == [
            f"{DIVE}, by itself",
            f"{DIVE}, beside {CHECK}",
            f"{DIVE}, beside {CHECK}, {OLDER}",
            f"{DIVE}, by itself",
        ]
        await pressed(pilot, "v")
        assert f"validate {DIVE}" in seen(app)
        verb.go.set()
        await ended(app, pilot)
        assert "● GO" in text(app)

    verb = Verb()
    run(made(FixedViews(), desk=validated_desk(tmp_path, found=False, jobs=Jobs(verb))), WIDE, work)
    vehicle = verb.words[4]
    assert vehicle.endswith("ruvifist.yaml:hovering")
    assert verb.words == (
        "validate", str(tmp_path / DIVE), str(tmp_path / CHECK), "--vehicle", vehicle,
        "--json", str(tmp_path / DIVE / "validation.json"), "--report", str(tmp_path / DIVE / "validation.html"),
    )  # fmt: skip


def test_the_key_on_dives_validates_the_dive_under_the_mark_at_once(tmp_path):
    async def work(app, pilot):
        await pressed(pilot, "2")
        while app.desk.jobs.runs("dives"):
            await pilot.pause()
        app._show()
        await pressed(pilot, "v")
        assert app.desk.jobs.runs("validate")
        await pressed(pilot, "x")
        await ended(app, pilot)
        assert "validate was cancelled" in text(app)

    async def verbs(words, hear):
        if words[0] == "dives":
            return Done(0, [dive("validation", folder=str(tmp_path / DIVE))], ())
        return await verb(words, hear)

    verb = Verb()
    run(made(FixedViews(), desk=validated_desk(tmp_path, found=False, jobs=Jobs(verbs))), NARROW, work)
    assert verb.words[:2] == ("validate", str(tmp_path / DIVE))


def test_a_validation_that_finds_no_room_on_the_disk_is_shown_and_said_to_be_kept_nowhere(tmp_path):
    why = "full/validation.json: the JSON can't be written (No space left on device); give another file"

    async def verb(_words, hear):
        hear(Report(UNKEPT, 1.0, why, result=validation()))
        return Done(2, None, errors=(f"{why}",))

    desk = validated_desk(tmp_path, jobs=Jobs(verb))
    (tmp_path / DIVE / "validation.json").unlink()

    async def work(app, pilot):
        await pressed(pilot, "6")
        assert "nothing yet" in seen(app)
        await pressed(pilot, "v")
        await ended(app, pilot)
        assert "nothing yet" not in seen(app)
        assert f"{why}; its values are below, and kept nowhere" in seen(app)

    run(made(FixedViews(), desk=desk), WIDE, work)
