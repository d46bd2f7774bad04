"""The screen Diagnose: its looks, and the verb that it runs."""

import asyncio
import json
import os

from made_diagnosis import CHECK, DIVE, OLDER, desk_with, diagnosis
from made_dives import dive
from made_view import FixedViews
from pymavlink.dialects.v20 import ardupilotmega as dialect
from screen_text import made, pressed, run, text

from bridge.framing import Encoder
from bridge.reports import UNKEPT, Report
from tui.app.jobs import Jobs
from tui.job import Done

SIZES = ((80, 24), (160, 50))


TRYING = Report("diagnosing", 0.4, "trying 41 candidates")


class Verb:
    """A verb that tells its progress, then waits until it is let go; `done` is how it ends, `leaves` what it writes."""

    def __init__(self, done=None, leaves=True, tells=TRYING):
        self.words, self.go = (), asyncio.Event()
        self.done, self.leaves = done or Done(0, diagnosis(), ()), leaves
        self.tells = tells

    async def __call__(self, words, hear):
        self.words = tuple(words)
        hear(self.tells)
        await self.go.wait()
        for option in ("--json", "--accept") if self.leaves else ():
            path = words[words.index(option) + 1]
            with open(path, "w", encoding="utf-8") as file:
                json.dump(diagnosis(), file)
        return self.done


async def ended(app, pilot):
    while app.desk.jobs.runs("diagnose"):
        await pilot.pause()
    app._show()
    await pilot.pause()
    await pilot.pause()


def test_where_not_all_fits_a_key_goes_from_section_to_section_and_round(tmp_path):
    async def work(app, pilot):
        await pressed(pilot, "4")
        heads = []
        for _ in range(5):
            heads.append(next(line.split("  ")[0] for line in text(app).splitlines() if " of 4  [s]" in line))
            await pressed(pilot, "s")
        assert [head.split()[0] for head in heads] == ["WHERE", "WHICH", "HOW", "WHAT", "WHERE"]

    run(made(FixedViews(), desk=desk_with(tmp_path)), SIZES[0], work)


def test_where_all_fits_all_is_shown_and_the_key_is_not_offered(tmp_path):
    async def work(app, pilot):
        await pressed(pilot, "4")
        seen = text(app)
        assert all(title in seen for title in ("WHERE the", "WHICH causes", "HOW FAR", "WHAT TO DIVE"))
        assert "Section" not in seen

    run(made(FixedViews(), desk=desk_with(tmp_path)), SIZES[1], work)


def test_it_runs_the_verb_on_the_dive_checked_on_the_newest_other_and_shows_what_that_left(tmp_path):
    async def work(app, pilot):
        await pressed(pilot, "4")
        assert f"[d] diagnoses {DIVE}, checked on {CHECK}." in " ".join(text(app).split())
        await pressed(pilot, "d")
        seen = text(app)
        assert f"diagnose {DIVE}" in seen
        assert " 40 %  trying 41 candidates" in seen
        assert "x Cancel" in seen
        verb.go.set()
        await ended(app, pilot)
        assert "AMBIGUOUS" in text(app)

    verb = Verb()
    desk = desk_with(tmp_path, found=False, jobs=Jobs(verb))
    run(made(FixedViews(), desk=desk), SIZES[0], work)
    folder = tmp_path / DIVE
    assert verb.words[:2] == ("diagnose", str(folder))
    assert verb.words[2] == "--vehicle"
    assert verb.words[3].endswith("ruvifist.yaml:hovering")
    assert verb.words[4:] == (
        "--check", str(tmp_path / CHECK), "--json", str(folder / "diagnosis.json"),
        "--report", str(folder / "diagnosis.html"), "--accept", str(folder / "diagnosed.param"),
    )  # fmt: skip


def test_a_dive_of_two_seconds_is_never_what_it_is_checked_on(tmp_path):
    async def work(app, pilot):
        await pressed(pilot, "4")
        assert f"[d] diagnoses {DIVE}, checked on {OLDER}." in " ".join(text(app).split())

    desk = desk_with(tmp_path, found=False)
    frame = Encoder(1, 1).encode(dialect.MAVLink_heartbeat_message(12, 0, 0, 0, 4, 3))
    stamps = (1_795_165_923_000_000, 1_795_165_925_000_000)
    records = b"".join(stamp.to_bytes(8, "big") + frame for stamp in stamps)
    (tmp_path / CHECK / "telemetry.tlog").write_bytes(records)
    run(made(FixedViews(), desk=desk), SIZES[0], work)


def test_the_check_dive_is_chosen_by_a_key_and_may_be_none(tmp_path):
    async def work(app, pilot):
        await pressed(pilot, "4")
        told = []
        for _ in range(4):
            told.append(" ".join(text(app).split()))
            await pressed(pilot, "c")
        ends = [
            f"checked on {CHECK}.",
            f"checked on {OLDER}.",
            "without a check dive.",
            f"checked on {CHECK}.",
        ]
        assert all(f"it again, {end}" in one for one, end in zip(told, ends, strict=True))

    run(made(FixedViews(), desk=desk_with(tmp_path)), SIZES[0], work)


def test_a_diagnosis_that_is_cancelled_is_ended_and_says_so(tmp_path):
    async def work(app, pilot):
        await pressed(pilot, "4", "d", "x")
        await ended(app, pilot)
        assert "diagnose was cancelled" in text(app)
        assert "d Diagnose" in text(app)

    run(made(FixedViews(), desk=desk_with(tmp_path, jobs=Jobs(Verb()))), SIZES[0], work)


def test_a_diagnosis_that_fails_says_why_beside_what_was_known(tmp_path):
    async def work(app, pilot):
        await pressed(pilot, "4", "d")
        verb.go.set()
        await ended(app, pilot)
        seen = " ".join(text(app).split())
        assert "AMBIGUOUS" in seen
        assert "dive is shorter than 60 s" in seen
        assert "seatrial:" not in seen

    verb = Verb(Done(2, None, errors=("dive is shorter than 60 s",)), leaves=False)
    run(made(FixedViews(), desk=desk_with(tmp_path, jobs=Jobs(verb))), SIZES[0], work)


def test_it_goes_on_while_another_screen_is_looked_at(tmp_path):
    async def work(app, pilot):
        await pressed(pilot, "4", "d", "1")
        verb.go.set()
        await ended(app, pilot)
        await pressed(pilot, "4")
        assert "AMBIGUOUS" in text(app)

    verb = Verb()
    run(made(FixedViews(), desk=desk_with(tmp_path, found=False, jobs=Jobs(verb))), SIZES[0], work)


def test_without_a_vehicle_file_it_says_what_lacks_and_starts_nothing(tmp_path):
    async def work(app, pilot):
        await pressed(pilot, "4", "d")
        assert "No vehicle file is known" in text(app)
        assert not app.desk.jobs.runs("diagnose")

    run(made(FixedViews(), desk=desk_with(tmp_path, found=False, vehicle="")), SIZES[0], work)


def test_without_any_dive_it_says_so(tmp_path):
    async def work(app, pilot):
        app.desk.dive = None
        app.desk.out = tmp_path / "none"
        await pressed(pilot, "4", "d")
        assert "holds no dive yet" in " ".join(text(app).split())

    run(made(FixedViews(), desk=desk_with(tmp_path)), SIZES[0], work)


def test_what_an_earlier_diagnosis_accepted_is_not_offered_for_upload(tmp_path):
    desk = desk_with(tmp_path)
    param, found = tmp_path / DIVE / "diagnosed.param", tmp_path / DIVE / "diagnosis.json"

    async def offered(app, pilot):
        await pressed(pilot, "4")
        return "p Parameters" in text(app)

    assert not run(made(FixedViews(), desk=desk), SIZES[1], offered)
    param.write_text("", encoding="utf-8")
    written_ns = found.stat().st_mtime_ns
    for offset_ns, expected in ((-1_000_000_000, False), (1_000_000, True)):
        os.utime(param, ns=(written_ns + offset_ns, written_ns + offset_ns))
        assert run(made(FixedViews(), desk=desk), SIZES[1], offered) is expected


def test_the_key_on_dives_diagnoses_the_dive_under_the_mark_at_once(tmp_path):
    async def work(app, pilot):
        await pressed(pilot, "2")
        while app.desk.jobs.runs("dives"):
            await pilot.pause()
        app._show()
        await pressed(pilot, "d")
        assert f"diagnose {CHECK}" in text(app)
        assert app.desk.dive == tmp_path / CHECK

    async def verbs(words, hear):
        return (
            Done(0, [dive("validation", folder=str(tmp_path / CHECK))], ())
            if words[0] == "dives"
            else await verb(words, hear)
        )

    verb = Verb()
    desk = desk_with(tmp_path, jobs=Jobs(verbs))
    desk.dive = tmp_path / CHECK
    run(made(FixedViews(), desk=desk), SIZES[0], work)
    assert verb.words[:2] == ("diagnose", str(tmp_path / CHECK))


def test_a_key_opens_parameters_with_what_was_accepted(tmp_path):
    async def work(app, pilot):
        await pressed(pilot, "4", "p")
        assert app.screen.title == "Parameters"
        assert app.desk.param == param

    async def nothing(words, _):
        return Done(3, None, errors=(f"{words[0]} finds no vehicle",))

    desk = desk_with(tmp_path, jobs=Jobs(nothing))
    param = tmp_path / DIVE / "diagnosed.param"
    param.write_text("", encoding="utf-8")
    run(made(FixedViews(), desk=desk), SIZES[1], work)


def test_a_diagnosis_that_finds_no_room_on_the_disk_is_shown_and_said_to_be_kept_nowhere(tmp_path):
    why = "full/diagnosis.json: the JSON can't be written (No space left on device); give another file"
    newer = diagnosis() | {"verdict": "unknown"}
    verb = Verb(Done(2, None, errors=(f"{why}",)), leaves=False, tells=Report(UNKEPT, 1.0, why, result=newer))

    async def work(app, pilot):
        await pressed(pilot, "4")
        assert "AMBIGUOUS" in text(app)
        await pressed(pilot, "d")
        verb.go.set()
        await ended(app, pilot)
        seen = " ".join(text(app).split())
        assert "UNKNOWN" in seen
        assert "AMBIGUOUS" not in seen
        assert f"{why}; its values are below, and kept nowhere" in seen
        assert "p Parameters" not in seen

    desk = desk_with(tmp_path, jobs=Jobs(verb))
    (tmp_path / DIVE / "diagnosed.param").write_text("", encoding="utf-8")
    run(made(FixedViews(), desk=desk), SIZES[1], work)
