"""Recordings from the app: begun, gone on with in a new dive, ended."""

import math
import threading
from dataclasses import replace
from pathlib import Path

import pytest
from fake_verbs import FakeVerbs, desk
from made_dives import DECK, DIVES, HOVERING, OUT, dive
from made_view import FixedViews, picture, recording, view
from screen_text import WIDE, Lacks, Sees, played, said, shows, text, worked
from soak import rows_rest_in_soak

from bridge.errors import LinkError
from gcs_plugin.watch.picture import Alarm, Armed, Kind
from tui.app.connecting import Choice, Way
from tui.app.screens.connect import ConnectScreen
from tui.app.screens.dives import DivesScreen
from tui.app.screens.overlays import AskScreen
from tui.app.screens.parameters import ParametersScreen
from tui.app.screens.watch import WatchScreen
from tui.app.view import Forcing

SILENT = replace(view(), recording=None)
LOST = replace(SILENT, trouble="no recording runs that could be listened to")
OVER = "the dive deck is over after 00:12:31"
HANGS = replace(view(), recording=replace(view().recording, written_unix_s=0.0))
NO_RECORDING = "no recording runs that the app could speak to"


class Boat:
    """A recording into the dive `deck`, as the app meets it; each order that it gets is in `orders`."""

    def __init__(self, fails=""):
        self.recorded, self.orders, self.fails = Path(DECK["folder"]), [], fails
        self.links = ("udpin:127.0.0.1:14550",)
        self.verbs = FakeVerbs()
        self.desk = desk(
            self.verbs,
            record=lambda: self._order("begin"),
            recorded=lambda: self.recorded,
            next_dive=self._next,
            end_recording=self._end,
            links=lambda: self.links,
            connect=self._connect,
            was_killed=lambda _: True,
        )

    def _order(self, word):
        self.orders.append(word)
        if self.fails:
            raise LinkError(self.fails)

    def _connect(self, choice):
        self.orders.append(choice)

    def _next(self):
        self._order("next")
        finished, self.recorded = self.recorded, Path(SECOND["folder"])
        self.verbs.results["dives"] = [*DIVES, SECOND]
        return finished

    def _end(self):
        self._order("end")
        finished, self.recorded = self.recorded, None
        return finished


SECOND = dive("second", duration_s=3.0)


def after(keys, boat, shown=None, **how):
    """What the app says once the keys were pressed, and the orders were carried out."""
    return played(boat.desk, *keys, worked, views=FixedViews(shown), **how)


@pytest.mark.parametrize("key", ["ctrl+g", "ctrl+x"])
def test_a_recording_is_begun_where_none_runs_also_for_off_which_goes_by_its_links(key):
    boat = Boat()
    (notice,) = after([key], boat, SILENT)
    assert notice == (
        "a recording of udpin:127.0.0.1:14550 has begun, and goes on when the app is left; Ctrl-D ends it again, and "
        "only looks"
    )
    assert boat.orders == ["begin"]


def test_one_key_declines_the_recording_that_the_app_has_just_begun_and_looks_at_its_link():
    boat = Boat()
    notices = after(["ctrl+g", "ctrl+d"], boat, SILENT)
    assert boat.orders == ["begin", "end", Choice("udpin:127.0.0.1:14550", records=False)]
    assert notices[-1] == "the app looks at, and does not record, udpin:127.0.0.1:14550"


def test_that_a_recording_has_begun_is_said_no_longer_once_it_was_ended():
    boat = Boat()

    def announced(app):
        return any("has begun, and goes on" in notice for notice in said(app))

    notices = after(
        ["ctrl+g", worked, announced, "ctrl+d", worked, lambda app: not announced(app)], boat, SILENT
    )
    assert any("NOTHING is recorded any more" in notice for notice in notices)


def test_a_recording_that_the_app_did_not_begin_is_not_declined():
    boat = Boat()
    assert after(["ctrl+d"], boat) == ["the app has begun no recording just now; nothing was ended"]
    assert boat.orders == []


def test_a_recording_that_another_program_began_after_the_apps_is_not_declined():
    boat = Boat()

    def another_program_records(_):
        boat.recorded = Path(SECOND["folder"])

    notices = after(["ctrl+g", another_program_records, "ctrl+d"], boat, SILENT)
    assert notices[-1] == "the app has begun no recording just now; nothing was ended"
    assert boat.orders == ["begin"]


def test_where_a_link_is_named_the_recording_begins_with_the_app_and_is_announced():
    boat = Boat()
    (notice,) = after([], boat, SILENT, begins=True)
    assert "has begun, and goes on when the app is left" in notice
    assert boat.orders == ["begin"]


def test_without_a_link_the_dives_come_first_and_the_key_that_records_asks_for_the_way():
    boat = Boat()
    boat.links = ()
    boat.desk.ways = lambda: (
        Way("udpin:127.0.0.1:14550", "a vehicle"),
        Way("serial:/dev/ttyUSB0:115200", "DVL"),
    )
    first = (shows(DivesScreen), Sees("no vehicle is connected; Ctrl-L connects one"))
    asked = ("ctrl+g", shows(ConnectScreen), Sees("serial:/dev/ttyUSB0:115200"))
    boat.recorded = None
    after([*first, *asked, "down", "enter"], boat, SILENT)
    assert boat.orders == [Choice("serial:/dev/ttyUSB0:115200", records=True)]


@pytest.mark.parametrize(("keys", "at"), [((), WatchScreen), (("5",), ParametersScreen)])
def test_a_link_that_takes_long_to_connect_takes_nobody_away_from_another_screen(keys, at):
    boat, connected = Boat(), threading.Event()
    boat.recorded, boat.links = None, ()
    boat.desk.connect = lambda _: connected.wait(60.0)
    chosen = ("3", "ctrl+l", shows(ConnectScreen), "enter")
    after([*chosen, *keys, lambda _: connected.set(), worked, shows(at)], boat, SILENT)


def test_where_a_recording_runs_it_is_watched_from_the_first_screen_on_though_not_seen_yet():
    boat = Boat()
    boat.links = ()
    after([shows(WatchScreen)], boat, SILENT)


def test_an_app_that_goes_by_the_first_of_two_recordings_says_so_and_how_the_other_is_seen():
    boat = Boat()
    boat.desk.ways = lambda: (
        Way("udpin:127.0.0.1:14550", "", recorded=True),
        Way("udpin:127.0.0.1:14551", "", recorded=True, others=True),
        Way("udpin:127.0.0.1:14552", ""),
    )
    assert after([], boat) == [
        "the app shows what udpin:127.0.0.1:14550 brings; another recording runs, and its vehicle is seen by "
        "`seatrial watch --link udpin:127.0.0.1:14551`"
    ]


def test_a_link_may_be_typed_recorded_or_only_looked_at():
    boat, link = Boat(), "tcp:sub:5777"
    boat.desk.ways = tuple
    asked = ("ctrl+l", shows(ConnectScreen))
    after([*asked, "escape", *asked, *link, "ctrl+r", worked, *asked, *link, "enter"], boat, SILENT)
    assert boat.orders == [Choice(link, records=False), Choice(link, records=True)]


def test_a_port_that_is_recorded_is_not_looked_at_beside_its_recording_in_another_spelling_either():
    boat, typed = Boat(), "serial:/dev/ttyUSB0:115200"
    boat.desk.ways = lambda: (Way("serial:/dev/ttyUSB0:57600", "", recorded=True),)
    after(["ctrl+l", shows(ConnectScreen), *typed, "ctrl+r"], boat, SILENT)
    assert boat.orders == [Choice(typed, records=True)]


@pytest.mark.parametrize(
    ("link", "why"), [("udpin", "'udpin' is not a link"), ("tcp:a:1", "goes by another recording")]
)
def test_what_is_no_link_or_is_recorded_by_another_stays_in_the_box_with_the_reason(link, why):
    boat = Boat()
    boat.desk.ways = lambda: (Way(link, "", recorded=True, others=True),)
    after(["ctrl+l", shows(ConnectScreen), "enter", Sees(why)], boat, SILENT)
    assert boat.orders == []


@pytest.mark.parametrize(
    ("now", "killed", "notice"),
    [
        (None, False, f"{OVER}; Ctrl-G records the next"),
        (replace(view().recording, folder="dives/second"), False, f"{OVER}; the next dive is recorded"),
        (None, True, "the recording of deck has ended without being told to; Ctrl-G begins one"),
    ],
)
def test_a_recording_that_ends_says_so_and_offers_the_next(now, killed, notice):
    boat, views = Boat(), FixedViews(view())
    boat.desk.was_killed = lambda _: killed

    over = replace(view(), recording=now, trouble="no recording runs that could be listened to")

    def shows_no_alarm(app):
        top = text(app).splitlines()[0]
        assert ("DIVE OVER" in top) is (now is None and not killed)
        assert ("NOT RECORDING" in top) is killed
        assert ("no recording runs" in text(app)) is (killed or now is not None)

    steps = (views.then(view()), views.then(over), shows_no_alarm)
    assert played(boat.desk, *steps, views=views) == [notice]
    # What the dive holds is read at once: the next step hangs on it on every screen.
    assert [words[0] for words in boat.verbs.words] == ["dives"]


def test_an_armed_vehicle_that_beats_on_after_its_recording_ended_is_shown_with_its_alarms_and_not_as_over():
    boat, views = Boat(), FixedViews(view())
    boat.desk.was_killed = lambda _: False
    ended = replace(view(), recording=None)
    deep = Alarm(Kind.DEPTH, "", "depth 12.00 m, deeper than 10 m")
    later = replace(picture(), now_s=picture().now_s + 5.0, alarms=(deep,))
    is_over = (views.then(view()), views.then(ended), Sees("DIVE OVER"))
    beats_on = (
        views.then(replace(ended, picture=later)),
        Lacks("DIVE OVER"),
        Sees("■ ARMED"),
        Sees(deep.words),
    )
    # One that is silent since then has ended its dive.
    silent = replace(later, armed_age_s=5.4, alarms=())
    played(
        boat.desk,
        *is_over,
        views.then(replace(ended, picture=silent)),
        Sees("DIVE OVER"),
        *beats_on,
        views=views,
    )


def test_a_recording_in_which_nothing_arrived_was_no_dive_and_the_way_to_a_vehicle_is_said_again():
    boat, nobody = Boat(), replace(SILENT, picture=replace(picture(), links=(), armed=Armed.UNKNOWN))
    boat.links, boat.recorded = (), None
    boat.desk.was_killed = lambda _: False
    views = FixedViews(nobody)
    other = replace(recording(lasted_s=5.0, disk_left_s=math.inf), frames=0, links=("udpin:127.0.0.1:14570",))
    says_how = Sees("no vehicle is connected; Ctrl-L")
    is_recorded = (views.then(replace(nobody, recording=other)), Lacks("no vehicle is connected"))
    is_over = (views.then(nobody), Lacks("DIVE OVER"))
    notices = played(boat.desk, says_how, *is_recorded, *is_over, says_how, views=views)
    assert notices == [
        "the app follows the recording of udpin:127.0.0.1:14570 into dives/deck",
        "the recording of udpin:127.0.0.1:14570 is over; nothing arrived in it; Ctrl-L connects one",
    ]


def test_while_the_app_begins_a_recording_it_does_not_say_that_none_runs():
    boat, begun = Boat(), threading.Event()
    boat.desk.record = begun.wait
    boat.recorded = None
    views = FixedViews(LOST)
    begins = (views.then(LOST), Sees("a recording begins"), Lacks("no recording runs"))
    goes_on = (Sees("no recording runs"), "ctrl+g", *begins, lambda _: begun.set())
    played(boat.desk, *goes_on, views=views)


@pytest.mark.parametrize("again", [("ctrl+g",), ("ctrl+l", shows(ConnectScreen), "enter")])
def test_while_a_recording_begins_no_second_one_is_begun_beside_it(again):
    """Of a slow port, whose key is pressed again, or another way gone: both would open it."""
    boat, begun = Boat(), threading.Event()
    begin = boat.desk.record

    def slowly():
        begin()
        begun.wait(60.0)

    boat.desk.record = slowly
    refused, announced = after(["ctrl+g", *again, lambda _: begun.set()], boat, SILENT)
    assert boat.orders == ["begin"]
    assert "a recording begins already; wait until it runs, or says why not" in refused
    assert announced.startswith("a recording of udpin:127.0.0.1:14550 has begun")


def test_a_vehicle_silent_since_the_end_of_its_dive_is_not_lost_because_the_next_is_recorded():
    boat, views = Boat(), FixedViews(view())
    gone = tuple(replace(link, age_s=30.0, lost=True) for link in picture().links)
    over = replace(view(), picture=replace(picture(), armed=Armed.DISARMED, links=gone))

    def reads_anew(app):
        app._step = None
        app._refresh_view()

    is_over = (views.then(over), reads_anew, Sees("DIVE OVER"), Sees("the dive is over: begin the next"))
    second = views.then(replace(over, recording=replace(view().recording, folder="dives/second")))
    gone_by = map(Lacks, ("DIVE OVER", "LINK LOST", "the dive is over: begin"))
    follows = (second, reads_anew, Sees("no vehicle heard yet"), *gone_by)
    played(boat.desk, *is_over, *follows, views.then(view()), Lacks("DIVE OVER"), views=views)


@pytest.mark.parametrize(("key", "shown"), [("ctrl+g", SILENT), ("ctrl+g", HANGS), ("ctrl+x", HANGS)])
def test_why_none_could_be_begun_is_said(key, shown):
    why = "the recorder hangs and keeps the link: end it with `kill -9 4711`"
    assert after([key], Boat(why), shown) == [f"nothing is recorded: {why}"]


def test_an_app_that_records_nothing_says_how_it_would():
    boat = Boat()
    boat.desk.record = None
    (notice,) = after(["ctrl+g"], boat, SILENT)
    assert "--unrecorded; leave it and start it without" in notice


def said_after(*recordings, killed=False):
    """What the app says while these recordings are seen one after the other; `killed`: none ended in order."""
    views = FixedViews(view())
    steps = (views.then(replace(view(), recording=recording)) for recording in recordings)
    return played(desk(was_killed=lambda _: killed), *steps, views=views)


def test_a_warning_goes_once_it_holds_no_longer():
    well = view().recording
    assert said_after(well, None, replace(well, folder="dives/second"), killed=True) == []


def test_once_there_is_space_again_it_is_said_that_the_recording_goes_on():
    well = view().recording
    full = replace(well, unwritten="telemetry.tlog: can't be written (No space left on device)", waiting=9)
    all_written = ["the recording goes on: every frame that waited is written"]
    assert said_after(well, full, full) == []
    assert said_after(full, None, full, well, well) == [OVER, *all_written]
    assert said_after(full, replace(well, lost=12)) == ["the recording goes on: 12 frames are lost"]
    assert said_after(full, recording(lasted_s=60.0)) == []


ASKED = Forcing("vehicle 1: sent 4 times, no answer for 2.0 s", 4, False)
DONE = Forcing("vehicle 1: off, as read back", 5, True)
RUNS, DEAD = replace(view(), forcing=ASKED), replace(SILENT, forcing=ASKED)


@pytest.mark.parametrize(
    ("seen", "keys", "times"),
    [
        ((view(), RUNS, DEAD), (), 1),
        ((view(), DEAD, RUNS, DEAD), (), 1),
        ((view(), replace(view(), forcing=DONE), replace(SILENT, forcing=DONE)), (), 0),
        ((RUNS, DEAD), ("ctrl+e", *"END", "enter"), 0),
    ],
    ids=["dies unnoticed", "dies twice", "dies once off was acknowledged", "the crew itself ended it"],
)
def test_the_off_key_begins_one_recording_where_that_dies_before_off_is_acknowledged(seen, keys, times):
    boat, views = Boat(), FixedViews(seen[0])
    steps = (step for shown in (*seen[1:], seen[-1]) for step in (views.then(shown), worked))
    played(boat.desk, "ctrl+x", *keys, *steps, views=views)
    assert boat.orders.count("begin") == times


def test_off_begins_no_recording_where_somebody_ended_that_in_order_and_may_need_the_link():
    boat, views = Boat(), FixedViews(view())
    boat.desk.was_killed = lambda _: False
    played(boat.desk, "ctrl+x", *map(views.then, (RUNS, DEAD, DEAD)), worked, views=views)
    assert boat.orders == []


@pytest.mark.parametrize(
    ("shown", "how", "sentence"),
    [
        (SILENT, {}, "no recording runs; Ctrl-G begins one"),
        (SILENT, {"keymap": {"recording.begin": "f7"}}, "no recording runs; f7 begins one"),
        (LOST, {}, "no recording runs that could be listened to; Ctrl-G begins one"),
        (LOST, {"view_only": True}, "no recording runs that could be listened to"),
    ],
)
def test_while_nothing_is_recorded_the_top_names_the_key_that_records_by_its_live_binding(
    shown, how, sentence
):
    def is_on_top(app):
        return text(app).splitlines()[2].strip() == sentence

    played(Boat().desk, is_on_top, views=FixedViews(shown), **how)


def test_one_key_begins_the_next_dive_and_the_newest_finished_one_is_chosen(tmp_path):
    boat = Boat()
    boat.recorded = tmp_path
    boat.desk.dive = OUT / HOVERING["name"]
    assert after(["ctrl+n"], boat) == [f"{tmp_path.name} is finished; the next dive is recorded"]
    assert boat.orders == ["next"]
    assert boat.desk.dive is None


def test_a_dive_that_ends_by_a_key_is_told_once_though_the_next_is_seen_before_the_answer():
    boat, views, seen = Boat(), FixedViews(view()), threading.Event()
    boat.recorded = Path(view().recording.folder)
    at_once = boat.desk.next_dive
    boat.desk.next_dive = lambda: at_once() if seen.wait(60.0) else None
    second = replace(view(), recording=replace(view().recording, folder="dives/second"))
    steps = (views.then(view()), "ctrl+n", views.then(second), lambda _: seen.set(), worked)
    (notice,) = played(boat.desk, *steps, views=views)
    assert notice.endswith("; the next dive is recorded")


def test_a_dive_in_which_nothing_arrived_is_said_not_to_be_kept():
    (notice,) = after(["ctrl+n"], Boat())
    assert notice.endswith("deck is not kept, since nothing arrived in it; the next dive is recorded")


def test_where_nothing_is_recorded_the_keys_say_so():
    boat = Boat()
    assert after(["ctrl+n", "ctrl+e"], boat, SILENT) == [f"{NO_RECORDING}; Ctrl-G begins one"] * 2
    boat.desk.record = None
    assert after(["ctrl+n", "ctrl+e"], boat, SILENT) == [NO_RECORDING] * 2
    assert boat.orders == []


def test_why_there_is_no_next_dive_is_said():
    why = "dives: this dive has only just begun; ask again in 5 s"
    assert after(["ctrl+n"], Boat(why)) == [why]


def test_the_question_names_the_dive_and_the_recording_is_ended_only_where_that_is_typed():
    boat = Boat()
    named = Sees("Type END to end the recording of 2026-11-21T0452Z-deck")
    ends = Sees("enter ends it, and the link with it, escape leaves it")
    left = ("ctrl+e", shows(AskScreen), named, ends, *"END", "escape")
    after([*left, "ctrl+e", "enter", "ctrl+e", *"yes", "enter"], boat)
    assert boat.orders == []
    after(["ctrl+e", *"end", "enter"], boat)
    assert boat.orders == ["end"]


def test_a_recording_that_is_being_ended_is_not_ended_a_second_time():
    boat, answered = Boat(), threading.Event()
    at_once = boat.desk.next_dive
    boat.desk.next_dive = lambda: at_once() if answered.wait(60.0) else None
    told, finished = after(["ctrl+n", "ctrl+e", Lacks("Type END"), lambda _: answered.set()], boat)
    assert told == "the recording has not answered the last order yet; wait for that"
    assert "the next dive is recorded" in finished
    assert boat.orders == ["next"]


def test_a_recording_begun_since_the_question_was_asked_is_not_ended_by_its_answer():
    boat = Boat()

    def begin_another(_):
        boat.recorded = Path(SECOND["folder"])

    assert after(["ctrl+e", begin_another, *"END", "enter"], boat) == [
        "the recording of 2026-11-21T0452Z-deck is over already; nothing was ended"
    ]
    assert boat.orders == []


def test_dives_marks_the_dive_that_is_over_and_the_new_one_is_recorded():
    def at(marked, recorded):
        places = Path(marked["folder"]), {Path(recorded["folder"])}
        return lambda app: (app.screen._at, app.screen._recorded) == places

    rests = (worked, lambda _: None)
    played(Boat().desk, "2", at(HOVERING, DECK), "ctrl+n", *rests, at(DECK, SECOND))


@pytest.fixture
def dives(tmp_path):
    """A dive that has ended, the one that is being recorded, and the one after it, which is not there yet."""
    folders = [tmp_path / f"2026-11-21T0{hour}52Z-hovering" for hour in (3, 4, 5)]
    for folder in folders[:2]:
        lie(folder)
    return folders


def lie(folder):
    folder.mkdir(exist_ok=True)
    (folder / "telemetry.tlog").write_bytes(b"")


@pytest.mark.parametrize(
    ("screen", "key", "verb"),
    rows_rest_in_soak([("3", "i", "identify"), ("4", "d", "diagnose"), ("6", "v", "validate")]),
)
@pytest.mark.parametrize("by_key", [True, False])
def test_a_dive_that_is_worked_on_keeps_its_screens_whatever_ends_meanwhile(screen, key, verb, by_key, dives):
    first, second, third = dives
    recorded = [second]

    def go_on(_=None):
        lie(third)
        recorded[0] = third
        return second

    at = desk(FakeVerbs(), out=first.parent, recorded=lambda: recorded[0], next_dive=go_on)
    words = f"{second.name} is finished; the next dive is recorded; the screens stay on {first.name}"
    works = (screen, key, lambda _: at.jobs.runs(verb), "ctrl+n" if by_key else go_on, worked)
    stays = (lambda _: at.jobs.cancel(verb), lambda _: at.chosen() == first, Sees(first.name))
    told = (lambda app: said(app) == [words] * by_key, "ctrl+n", worked, lambda _: at.chosen() == second)
    played(at, *works, *stays, *told, size=WIDE)
