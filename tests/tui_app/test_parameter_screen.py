"""The screen Parameters: how its lines read, when the vehicle is read again, which lines are chosen and stay so."""

import asyncio
from dataclasses import replace

import pytest
from fake_verbs import FakeVerbs
from fake_verbs import desk as desk_of
from made_parameters import PARAM, FakeVehicle, desk, has, line_of, on_screen, plan, receipt, row, views
from screen_text import NARROW, WIDE, Lacks, Sees, made, plain, played, pressed, settled, text
from soak import rest_in_soak
from textual.widgets._toast import Toast

from bridge.reports import Written
from bridge.vehicle.config import CONFIGS
from gcs_plugin.params.files import write_parameters
from gcs_plugin.params.last_accepted import AcceptedValue
from gcs_plugin.params.proposal import TAKEN_BACK
from tui.app.screens.frame import Drawn
from tui.app.screens.parameters_lines import details
from tui.app.screens.parameters_table import LEFT, table
from tui.app.screens.parameters_transfer import comparison

FIRST = plan()["parameters"][0]
WHY = "its standard deviation, 153, is as large as the value: the dive did not tell it"


def starts(name, mark):
    """Whether the line of that name begins with the mark."""
    return lambda app: line_of(app, name).startswith(mark)


def test_where_every_change_rounds_to_nothing_no_line_is_chosen_beforehand():
    tiny = [{**FIRST, "name": f"FF1_{n}", "present": 100.0, "target": 100.01} for n in range(3)]
    on_screen(
        FakeVehicle(plan(parameters=tiny)), Sees("+0.0 %"), Sees("0 of 3 chosen"), "a", Sees("3 of 3 chosen")
    )
    mixed = [*tiny, {**FIRST, "name": "FF1_9"}]
    on_screen(FakeVehicle(plan(parameters=mixed)), Sees("4 of 4 chosen"))


def test_upload_says_so_where_nothing_was_identified(tmp_path):
    (tmp_path / "2026-11-21T0352Z-hovering").mkdir()
    (tmp_path / "2026-11-21T0352Z-hovering" / "telemetry.tlog").touch()
    (notice,) = played(desk_of(FakeVehicle(), out=tmp_path), "5", "u", views=views())
    assert notice.startswith("2026-11-21T0352Z-hovering: nothing was identified from it yet")


def test_values_that_come_while_nothing_is_shown_are_compared_by_themselves(tmp_path):
    dive = tmp_path / "2026-11-21T0352Z-hovering"
    dive.mkdir()
    (dive / "telemetry.tlog").touch()
    vehicle = FakeVehicle()
    none_yet = ("5", Sees("nothing was identified from it yet"))
    identified = (lambda _: (dive / PARAM.name).touch(), Sees("7 of 7 chosen"))
    played(desk_of(vehicle, out=tmp_path), *none_yet, *identified, views=views())
    assert [words[:3] for words in vehicle.words if words[0] == "params"] == [
        ("params", "diff", str(dive / PARAM.name))
    ]


def test_without_a_vehicle_the_file_stands_there_beside_what_was_last_accepted(tmp_path, monkeypatch):
    accepted = {"FF1_M_U": AcceptedValue(110.36, None, ""), "FF1_D_U": AcceptedValue(56.2, None, "")}
    monkeypatch.setattr("tui.app.screens.parameters_in_file.accepted_of", lambda *_: accepted)
    dive = tmp_path / "2026-11-21T0352Z-hovering"
    dive.mkdir()
    (dive / "telemetry.tlog").touch()
    held = {"FF1_M_U": 110.7651, "FF1_D_U": 56.2, "FF1_T1_GAIN": 0.79, "FF1_T2_GAIN": 0.0}
    write_parameters(dive / PARAM.name, held, (), 1, 1)
    none = FakeVerbs(lambda _: None, 4, ["no vehicle answers"])
    for cells, values in (
        (60, "FF1_M_U 110.77 110.36 kg FF1_T1_GAIN 0.79 -- 2 lines"),
        (40, "FF1_T1_GAIN 0.79 -- 2 lines"),
    ):
        of_file = (Sees("identified.param OF 2026-11-21T0352Z-hovering"), Sees(values), Lacks("FF1_T2_GAIN"))
        others = Sees("2 lines more, as last accepted or with no")
        keys = ("5", Sees("no vehicle answers"), *of_file, others)
        played(desk_of(none, out=tmp_path), *keys, size=(cells, 24), views=views())


@pytest.mark.parametrize(
    ("target", "words"),
    [
        (110.5, "the change lies within the interval."),
        (119.0, "the change goes 3.0 times as far as the interval."),
    ],
)
def test_a_change_is_told_against_its_interval(target, words):
    shown = comparison(plan(parameters=[row("M_u", 110.0, target, 3.0, None, "")]))
    assert " ".join(plain(details(shown.parameters[0], None, None, 300))).endswith(words)


def test_the_key_that_uploads_stays_on_a_narrow_screen():
    for cells in (48, 40):
        on_screen(FakeVehicle(), Sees("u Upload Ctrl-X FF off ? Help"), size=(cells, 24))


def test_notices_cover_nothing():
    async def work():
        app = made(views(), desk=desk(FakeVehicle()))
        async with app.run_test(size=NARROW, notifications=True) as pilot:
            await settled(app, pilot)
            await pressed(pilot, "5", "u")
            app.notify(
                "said just now, and at more length than a single row of this screen holds: twice", timeout=600
            )
            app.notify("and then something else", severity="warning", timeout=600)
            for _ in range(500):
                await pilot.pause()
                if len(app.screen.query(Toast)) == 2 and app.screen.query_one("#notices").region.height == 3:
                    break
            question = app.screen.query_one("#parameters-ask").region
            drawn = [widget.region for widget in app.screen.query(Drawn) if widget.is_on_screen]
            toasts = [toast.region for toast in app.screen.query(Toast)]
            assert question.height
            assert {toast.height for toast in toasts} == {1, 2}
            assert not [(a, b) for a in toasts for b in (question, *drawn) if a.overlaps(b)]

    asyncio.run(work())


def test_a_notice_that_just_fills_its_row_is_shown_to_its_end():
    async def work():
        app = made(views(), desk=desk(FakeVehicle()))
        async with app.run_test(size=NARROW, notifications=True) as pilot:
            await settled(app, pilot)
            for length in range(74, 79):
                app.notify(f"{'said at length '.ljust(length - 4, 'x')} end", timeout=600)
                for _ in range(500):
                    await pilot.pause()
                    if app.screen.query(Toast) and app.screen.query_one("#notices").region.height:
                        break
                assert "end" in text(app).split(), length
                app.clear_notifications()
                while app.screen.query(Toast):
                    await pilot.pause()

    asyncio.run(work())


def test_lines_that_have_no_room_are_counted_on_their_side_and_a_question_hides_none():
    many = [{**FIRST, "name": f"FF1_{n}"} for n in range(30)]
    below = (Sees("lines below"), Lacks("above"))
    on_screen(FakeVehicle(plan(parameters=many)), *below, "end", Sees("lines above"), Lacks("below"))
    names = (Sees(row["name"]) for row in plan()["parameters"])
    on_screen(FakeVehicle(), Lacks("lines above"), "u", *names)


def test_a_verdict_stands_in_a_whole_word_on_a_narrow_line_and_in_full_on_a_wide_one():
    words = {"not on the vehicle": "absent", "implausible": "unlikely", "refused": "refused"}
    lines = {f"FF1_{n}": verdict for n, verdict in enumerate(words)}
    rows = [
        {**FIRST, "name": name, "verdict": verdict, "reason": "why so"} for name, verdict in lines.items()
    ]
    vehicle = FakeVehicle(plan(parameters=rows))
    steps = [
        step
        for name, verdict in lines.items()
        for step in (has(name, words[verdict]), Sees(f"{verdict}: why so."), "down")
    ]
    on_screen(vehicle, *steps, size=(60, 24))
    in_full = [lambda app, n=n, v=v: f" {v} " in line_of(app, n) for n, v in lines.items()]
    on_screen(vehicle, *in_full, size=WIDE)


AWKWARD = [
    row("M_u", -12345.678, 123456.78, 1234.5, -12345.678, "") | {"name": "FF1_T_VSHARES"},
    row("D_r", 0.0, 0.0012345, 0.0001, None, "why", "not on the vehicle", "it has none"),
    row("D_v", 1.0, 2.0, 0.5, 1.0, "", "changed", TAKEN_BACK),
]


@pytest.mark.parametrize("cells", [48, 60, 80, 90, 100, 120, 130, 140, 160])
@pytest.mark.parametrize("rows", [plan()["parameters"], AWKWARD], ids=["usual", "awkward"])
@pytest.mark.parametrize("written", [False, True])
def test_no_column_is_cut_and_those_in_intervals_are_left_out_first(rows, cells, written):
    shown = comparison(plan(parameters=rows))
    names = [line["name"] for line in rows]
    became = {name: Written(name, "rolled_back", "why") for name in names if written}
    head, *lines = plain(table(shown, (), 0, became, cells, 20))
    assert max(map(len, (head, *lines))) <= cells
    assert "…" not in "".join(lines)
    heads = head.split()
    assert heads[: heads.index("change") + 1] == [
        *("name", "was" if written else "vehicle", "→"),
        *("identified" if cells >= 60 else "new", "change"),
    ]
    order = [known for known in ("change", "unit", "±", "Δ/±", "accepted", "meaning") if known in heads]
    assert order == [head for head in heads if head in order]
    for line, entry in zip(lines, shown.parameters, strict=True):
        assert entry.name in line
        assert "meaning" not in heads or line.endswith(entry.sentence)
    if cells >= 100:
        assert "accepted" in heads


def test_a_number_without_a_unit_is_shown_without_one():
    (head, line, *_) = plain(table(comparison(plan(parameters=[GAIN])), (), 0, {}, 100, 20))
    assert "unit" in head
    assert "% 1" not in " ".join(line.split())


GAIN = FIRST | {"name": "FF1_T1_GAIN", "unit": "1", "present": 0.0, "target": 0.791, "change": None}


def test_a_gain_that_is_not_set_is_a_gain_of_1_before_an_upload_and_after_a_roll_back():
    on_screen(
        FakeVehicle(plan(parameters=[GAIN])),
        lambda app: "1 →      0.791  -21 %" in line_of(app, "FF1_T1_GAIN"),
        Sees("on the vehicle 1 (not set) → in the file 0.791 (-21 %)"),
    )
    back = GAIN | {"present": 0.791, "target": 0.0, "low95": None, "high95": None}
    undone = (
        lambda app: "0.791 →      1  +26 %" in line_of(app, "FF1_T1_GAIN"),
        Sees("in the file 1 (not set)"),
    )
    on_screen(FakeVehicle(back=plan(parameters=[back])), "r", "escape", *undone)


@pytest.mark.parametrize("size", rest_in_soak([NARROW, WIDE, (48, 24)]))
def test_a_mass_that_is_not_set_reads_so_and_is_no_mass_of_0_kg(size):
    first = FIRST | {"present": 0.0, "accepted": 0.0, "change": None}
    on_screen(
        FakeVehicle(plan(parameters=[first])),
        lambda app: f"not set → {first['target']:.5g}" in " ".join(line_of(app, first["name"]).split()),
        Sees(f"on the vehicle not set → in the file {first['target']:.5g} kg"),
        size=size,
    )
    back = first | {"present": first["target"], "target": 0.0, "low95": None, "high95": None}
    undone = (lambda app: "→ not set" in " ".join(line_of(app, first["name"]).split()), Lacks("not set kg"))
    on_screen(FakeVehicle(back=plan(parameters=[back])), "r", "escape", *undone, size=size)


def test_a_vehicle_that_cannot_be_read_says_why_and_what_to_do():
    vehicle = FakeVehicle({}, errors=["no vehicle's HEARTBEAT within 5 s"])

    def change_key(app):
        app.set_keymap({"parameters.read": "f7"})

    again = "Nothing was written by this reading; {} reads the vehicle again."
    failure = (Sees("no vehicle's HEARTBEAT"), Sees(again.format("Ctrl-R")))
    on_screen(vehicle, *failure, change_key, lambda _: None, Sees(again.format("f7")), "u", Lacks("type"))


def test_what_was_read_long_ago_is_read_again_before_it_is_asked():
    vehicle, now_s = FakeVehicle(), [0.0]

    def later(_):
        now_s[0] = 121.0

    on_screen(vehicle, later, "u", Sees("type 7 and Enter"), now_s=lambda: now_s[0])
    assert len(vehicle.words) == 2


def test_a_file_that_was_written_again_since_is_shown_again_and_not_sent(tmp_path):
    file = tmp_path / "identified.param"
    file.write_text("FF1_M_U,1\n", "utf-8")
    vehicle, read = FakeVehicle(plan(file=str(file))), []

    def choose(app):
        app.desk.dive, app.desk.param = tmp_path, file

    def write_again(_):
        read.append(len(vehicle.words))
        file.write_text("FF1_M_U,2\n", "utf-8")

    changed = Sees("has changed since it was shown")
    on_screen(vehicle, choose, "1", "5", "u", "7", write_again, "enter", changed)
    assert len(vehicle.words) == read[0] + 1
    assert vehicle.writes == []


def test_a_vehicle_that_is_only_looked_at_is_read_and_written_by_its_own_link():
    """Without it, a verb goes to the vehicle of whatever recording runs."""
    vehicle = FakeVehicle()
    on_screen(vehicle, "u", "7", "enter", link=lambda: "tcp:sub:5777")
    diff, upload = (words for words in vehicle.words if words[0] == "params")
    for words in (diff, upload):
        assert words[words.index("--link") + 1] == "tcp:sub:5777"


def test_what_was_read_by_one_link_is_not_written_by_another_that_was_connected_since():
    vehicle, links = FakeVehicle(), [("udpin:127.0.0.1:14550",)]

    def connect_another(_):
        links[0] = ("tcp:sub:5777",)

    refused = Sees("another link has been connected since the vehicle was read: nothing was sent")
    on_screen(vehicle, "u", "7", connect_another, "enter", refused, links=lambda: links[0])
    assert vehicle.writes == []


class Flying:
    """Views of a vehicle that says which set it flies, by a clock of the test."""

    def __init__(self):
        self.now_s, self.views = 0.0, views()

    def at(self, now_s, number, age_s):
        """A step at which the vehicle has said so long ago that it flies this set."""

        def step(_):
            self.now_s = now_s
            picture = replace(self.views.shown.picture, active_set=number, active_set_age_s=age_s)
            self.views.shown = replace(self.views.shown, picture=picture)

        return step

    def on_screen(self, vehicle, *steps):
        on_screen(vehicle, *steps, shown=self.views, now_s=lambda: self.now_s)


def read_again(vehicle, times):
    return lambda _: len([words for words in vehicle.words if "--yes" not in words]) - 1 == times


def test_once_another_set_flies_the_vehicle_is_read_again_and_choices_stay():
    flying, vehicle = Flying(), FakeVehicle()

    def fly_none(app):
        vehicle.compared = plan(active_crc=0.0)
        flying.at(12.0, 0, 2.0)(app)

    flying.on_screen(
        vehicle,
        *("space", "down"),
        *(flying.at(12.0, 4711, 2.0), read_again(vehicle, 0)),
        *(fly_none, lambda _: None, read_again(vehicle, 1)),
        *(Sees("6 of 7 chosen"), starts("FF1_M_U", " □")),
        # As it was told before it was read.
        *(flying.at(30.0, 4711, 25.0), read_again(vehicle, 1)),
    )


def test_the_own_upload_is_shown_until_another_set_flies():
    flying, vehicle = Flying(), FakeVehicle(written=receipt() | {"active_crc": 13247})
    flying.on_screen(
        vehicle,
        *("u", "7", "enter", flying.at(5.0, 13247, 1.0), Sees("✓ applied")),
        *(flying.at(20.0, 0, 1.0), lambda _: None, Lacks("✓"), read_again(vehicle, 1)),
    )


def test_on_a_wide_screen_each_line_says_what_it_means():
    means = "total mass in surge: rigid body plus added"
    vehicle = FakeVehicle()
    on_screen(vehicle, lambda app: means not in line_of(app, "FF1_M_U"))
    on_screen(vehicle, lambda app: means in line_of(app, "FF1_M_U"), size=WIDE)


def test_what_the_vehicle_held_is_dimmed_and_dated_once_it_may_no_longer_be_so():
    flying, fresh = Flying(), views().shown.picture

    def dimmed(app):
        line = next(line for line in app.screen._table(80, 20) if ("FF1_M_U", "tab") in line)
        return next(role for text, role in line if text.strip() == "96.5 →") == "stale"

    def grows_old(link, now_s):
        def step(_):
            flying.now_s = now_s
            picture = replace(fresh, links=(replace(fresh.links[0], **link),))
            flying.views.shown = replace(flying.views.shown, picture=picture)

        return step

    undated = (Lacks("was read"), lambda app: not dimmed(app))
    steps = [*undated]
    for link, now_s, age in (
        ({"lost": True, "age_s": 31.0}, 31.0, "31 s ago"),
        ({"system": 7}, 31.0, "31 s ago"),
        ({}, 121.0, "2 min ago"),
    ):
        dated = (
            Sees(f"what the vehicle holds was read {age}"),
            Sees(f"on the vehicle {age} 96.5 → in the file 111.52 kg (+16 %)"),
            dimmed,
        )
        steps += [grows_old(link, now_s), *dated, grows_old({}, 1.0), *undated]
    flying.on_screen(FakeVehicle(), *steps)


def test_the_upload_writes_the_chosen_lines_once_their_number_is_typed():
    vehicle = FakeVehicle()
    asked = ("space", "down", "space", "u", Sees("type 5 and Enter"))
    on_screen(
        vehicle, *asked, "5", "enter", Sees("applied: 7 parameters written"), has("FF1_D_V", "✓", "equal")
    )
    (words,) = vehicle.writes
    assert words[:4] == ("params", "upload", str(PARAM), "--yes")
    assert words[words.index("--vehicle") + 1] == str(CONFIGS / "vehicles" / "ruvifist.yaml")
    only = words[words.index("--only") + 1 :]
    assert only == ("FF1_M_W", "FF1_I_R", "FF1_D_V", "FF1_D_W", "FF1_D_R")
    assert "--armed" not in words


def test_what_was_left_out_or_taken_by_name_stays_so_when_the_same_file_is_read_again():
    left_out = (starts("FF1_M_U", " □"), starts("FF1_M_W", " ■"))
    five = Sees("5 of 7 chosen")
    read_again = ("space", "down", "space", "ctrl+r", five, *left_out)
    on_screen(FakeVehicle(), *read_again, "r", "escape", "escape", five, "u", "5", "enter", "ctrl+r", five)


def test_no_line_chosen_asks_nothing():
    on_screen(FakeVehicle(), "a", "u", Sees("no line is chosen"), "a", Sees("7 of 7 chosen"))


def test_a_click_goes_to_a_line_and_a_second_one_chooses_it():
    def click(app):
        app.screen._press(4)

    on_screen(FakeVehicle(), click, starts("FF1_I_R", "▶■"), click, starts("FF1_I_R", "▶□"))


def with_an_implausible_mass():
    first, *others = plan()["parameters"]
    return plan(parameters=[first | {"verdict": "implausible", "reason": WHY}, *others])


def test_an_implausible_line_says_why_and_is_left_out_of_an_upload():
    vehicle, name = FakeVehicle(with_an_implausible_mass()), FIRST["name"]
    on_screen(vehicle, lambda app: LEFT in line_of(app, name), Sees(WHY), "u", "6", "enter")
    (words,) = vehicle.writes
    assert name not in words
    assert words.count("--only") == 1
    assert "--accept-implausible" not in words


def test_an_implausible_line_that_is_chosen_is_written_for_a_harder_word():
    vehicle = FakeVehicle(with_an_implausible_mass())
    on_screen(vehicle, "space", "u", Sees("type DOUBTED 7 and Enter"), *"DOUBTED7", "enter")
    (words,) = vehicle.writes
    assert words[-2:] == ("--accept-implausible", FIRST["name"])
    assert "--only" not in words


def test_an_effect_that_is_accepted_a_second_time_is_written_by_name_alone():
    why = (
        "thruster 1 is made up for already: with this it would be asked as if it gave 64 %, and it gives 80 %"
    )
    gain = GAIN | {"present": 0.8, "target": 0.8, "verdict": "implausible", "reason": why}
    again = plan(parameters=[*plan()["parameters"][1:3], gain])
    vehicle = FakeVehicle(again)
    on_screen(vehicle, lambda app: LEFT in line_of(app, gain["name"]), "end", Sees(why), "u", "2", "enter")
    (words,) = vehicle.writes
    assert gain["name"] not in words
    vehicle = FakeVehicle(again)
    on_screen(vehicle, "end", "space", "u", Sees("type DOUBTED 3 and Enter"), *"DOUBTED3", "enter")
    (words,) = vehicle.writes
    assert words[-2:] == ("--accept-implausible", gain["name"])


def test_half_of_a_model_asks_nothing_until_both_halves_are_chosen_or_neither():
    rows = [
        parameter | {"present": 0.0} if parameter["coefficient"] in ("I_r", "D_r") else parameter
        for parameter in plan()["parameters"]
    ]
    vehicle = FakeVehicle(plan(parameters=rows))
    why = Sees("FF1_D_R: without FF1_I_R the feed-forward of yaw stays off: choose FF1_I_R too, or neither")
    left_out = (*["down"] * 3, "space", starts("FF1_I_R", "▶□"))
    unasked = ("u", why, lambda app: not app.screen.has_class("-asking"))
    on_screen(vehicle, *left_out, *unasked, "space", "u", "7", "enter")
    (words,) = vehicle.writes
    assert "--only" not in words
