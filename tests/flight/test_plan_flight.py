"""A plan cut into pieces, flown until enough is known, and the verbs fly and calibrate."""

import json
import math
import os
import pty
import re
import signal
import threading
import time
from dataclasses import replace
from pathlib import Path

import pytest
import yaml
from fakes.telling import telling
from fakes.vehicle import FakeVehicle
from ideal import LIMITS
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge import reports
from bridge.clock import SimulatedClock, utc_text
from bridge.errors import ConfigError, LinkError, LinkLost, LogError
from bridge.flight.flight import End, State
from bridge.flight.orders import ORDER, Order
from bridge.links.link import Link, Wrapper, memory_pair
from bridge.onboard.parameters import parameters_of
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.legs import Leg
from bridge.wire.framing import Encoder, Framer, decode
from bridge.wire.readings import Reading, encode
from bridge.wire.status_codes import status_texts
from bridge.wire.tlog import read_tlog
from gcs_plugin import simulated
from gcs_plugin.dives.folder import DiveFolder, new_folder
from gcs_plugin.dives.recordings import length_s
from gcs_plugin.feedforward.off_orders import OffMarks
from gcs_plugin.flying import run
from gcs_plugin.flying.crew import Crew
from gcs_plugin.flying.plan import cut, flight_plan, load_plan
from gcs_plugin.flying.run import Outcome, PlanFlight, Wanted, known_so_far
from gcs_plugin.peers import GROUND_STATION, ground_heartbeat
from gcs_plugin.recording import orders
from gcs_plugin.recording.recorder import Recorder
from gcs_plugin.recording.state import write_holding
from identify.identification import estimate
from identify.planning.knowledge import widths
from tui import cli
from tui.commands import calibrate, fly
from tui.flight_recording import RecordedHere, RecordedThere, recorded_crew

FILE = load_vehicle("ruvifist")
QUICK = (Leg(1.0, push_surge_n=40.0), Leg(2.0, push_surge_n=-40.0, alternate=15), Leg(1.0, push_surge_n=40.0))
YAW = (Leg(1.0, yaw_rad_s=0.2), Leg(2.0, yaw_rad_s=-0.2), Leg(1.0, yaw_rad_s=0.2))
PLAN = """name: plan
start_depth_m: 1.5
legs:
  - {duration_s: 5.0, name: rest, phase: rest}
  - {duration_s: 1.0, name: surge square wave, push_surge_n: 53.7}
  - {duration_s: 2.0, name: surge square wave, push_surge_n: -53.7, alternate: 15}
  - {duration_s: 1.0, name: surge square wave, push_surge_n: 53.7}
  - {duration_s: 5.0, name: rest, phase: rest}
  - {duration_s: 5.0, name: surge laps, surge_m_s: 0.3, transient_s: 5.0}
  - {duration_s: 3.0, name: surge laps, phase: rest, transient_s: 3.0}
  - {duration_s: 5.0, name: rest, phase: rest}
"""
LIMIT_FILE = (
    "shallowest_m: 0.1\ndeepest_m: 4\naltitude_m: 1\ndistance_m: 4\nspeed_m_s: 0.8\ntilt_deg: 25\nbattery_v: 13\n"
    "time_s: 900\nhold_s: 5\n"
)


def test_a_wave_is_cut_into_waves_of_the_same_kind_and_length_in_all_two_short_ones_first():
    pieces = cut(QUICK)
    assert [piece[1].alternate for piece in pieces] == [3, 3, 7]
    assert all(piece[0] == QUICK[0] == piece[2] for piece in pieces)
    assert sum(leg.duration_s * leg.alternate for piece in pieces for leg in piece) == 32.0


def test_each_further_piece_of_a_wave_takes_as_long_as_all_before_it_up_to_a_minute():
    pieces = cut((QUICK[0], replace(QUICK[1], alternate=2 * 56 - 1), QUICK[2]))
    assert [sum(leg.duration_s * leg.alternate for leg in piece) for piece in pieces] == [
        8,
        8,
        16,
        32,
        64,
        64,
        32,
    ]


def test_laps_are_cut_between_one_and_the_next():
    lap = (
        Leg(3.0, "laps", yaw_rad_s=0.3, transient_s=3.0),
        Leg(14.0, "laps", yaw_rad_s=0.3),
        Leg(3.0, "laps", "rest"),
    )
    assert cut(lap) == [lap]
    assert cut(lap * 7) == [lap, lap, lap * 2, lap * 3]
    assert cut(lap[:2] * 7) == [lap[:2] * 7], "it turns on from one to the next"


def test_a_wave_of_any_length_keeps_all_its_cycles():
    for cycles in range(1, 40):
        pieces = cut((QUICK[0], replace(QUICK[1], alternate=2 * cycles - 1), QUICK[2]))
        assert sum((piece[1].alternate + 1) // 2 for piece in pieces) == cycles
        assert all(piece[1].alternate % 2 == 1 for piece in pieces), cycles


@pytest.mark.parametrize(
    "legs", [QUICK[:2], (*QUICK, QUICK[0]), (QUICK[0], replace(QUICK[1], duration_s=3.0), QUICK[2])]
)
def test_any_other_manoeuvre_stays_whole(legs):
    assert cut(legs) == [tuple(legs)]


def test_a_plan_is_parted_at_its_rests_and_its_manoeuvres_take_turns(tmp_path):
    path = tmp_path / "plan.yaml"
    path.write_text(PLAN)
    plan = load_plan(path)
    assert [piece.name for piece in plan.pieces] == [
        "1. surge, 8 s", "2. surge, 8 s", "1. surge, 8 s", "1. surge, 16 s",
    ]  # fmt: skip
    assert plan.depth_m == 1.5
    assert plan.coefficients == ("M_u", "D_u")
    assert flight_plan("a", 1.5, [QUICK, YAW]).coefficients == ("M_u", "I_r", "D_u", "D_r")


def test_a_plan_without_a_manoeuvre_or_with_one_that_cannot_be_flown_is_refused(tmp_path):
    path = tmp_path / "plan.yaml"
    path.write_text("legs: [{duration_s: 5, name: rest, phase: rest}]\n")
    with pytest.raises(ConfigError, match=r"plan\.yaml: has no manoeuvre to fly"):
        load_plan(path)
    path.write_text("legs: [{duration_s: 5, name: all, surge_m_s: 1, sway_m_s: 1, yaw_rad_s: 1}]\n")
    with pytest.raises(ConfigError, match=r"plan\.yaml: leg 'all': drives 3 axes"):
        load_plan(path)
    with pytest.raises(ConfigError, match="manoeuvre 1 has 101 legs, and 100 can be flown"):
        flight_plan("a", 1.5, [[Leg(1.0, push_surge_n=1.0)] * 101])


class Scripted:
    """Identifications with the answers that a test gives; the last of them stays."""

    def __init__(self, *answers):
        self.answers, self.asked, self.busy = list(answers), 0, False

    def ask(self):
        self.asked, self.busy = self.asked + 1, True

    def answer(self):
        if not self.busy:
            return None
        self.busy = False
        return self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]


class Water:
    """A plan flown by the simulated vehicle, with scripted identifications."""

    def __init__(self, folder, *answers, plan=None, share=0.05, armed=False):
        self.link, self.clock = simulated.afloat(FILE, "hovering", 1, parameters_of(FILE, None))
        self.link.vehicle.bridge.armed = armed
        self.words, self.identifying = [], Scripted(*answers)
        self.crew, self.recorder, self.folder = recorded_crew(
            self.link, FILE, "hovering", folder, self.clock, self.words.append
        )
        self.crew.find(5)
        plan = plan or flight_plan("test", 0.4, [QUICK[:1] * 2, YAW])
        limits = replace(LIMITS, shallowest_m=0.0, hold_s=5.0)
        self.flight = PlanFlight(
            self.crew, plan, limits, Wanted(plan.coefficients, share), self.identifying, self.words.append
        )
        self.flight.begin(3.0)

    @property
    def state(self):
        return self.link.vehicle._flights.flight.state

    def fly(self, until=lambda _: False, within_s=200.0):
        end_s = self.clock.boot_s() + within_s
        while not self.flight.over and not until(self):
            assert self.clock.boot_s() < end_s, self.words
            self.flight.step()
        return self

    @property
    def flown(self):
        return [word for word in self.words if word.startswith("flies")]


@pytest.mark.parametrize("armed", [False, True])
def test_it_stops_as_soon_as_all_is_known_and_is_disarmed_where_it_began(tmp_path, armed):
    known = dict.fromkeys(("M_u", "I_r", "D_u", "D_r"), 0.01)
    plan = flight_plan("test", 0.4, [QUICK[:1] * 2, YAW, YAW])
    water = Water(tmp_path, {}, known, plan=plan, armed=armed).fly()
    outcome = water.flight.outcome
    assert (outcome.end, outcome.all_known, outcome.pieces) == (End.FINISHED, True, 2)
    assert water.state is State.IDLE
    assert not water.link.vehicle.bridge.armed
    assert water.words[-1].startswith("holds its place")
    assert water.folder.telemetry()


def test_what_was_flown_is_identified_while_the_vehicle_goes_back_to_its_station(tmp_path):
    water = Water(tmp_path, {}).fly(lambda water: water.identifying.asked)
    assert (water.state, water.flight.outcome.pieces) == (State.GOING, 1)


def test_the_piece_that_tells_the_widest_is_flown_next(tmp_path):
    wide = {"M_u": 0.1, "D_u": 0.01, "I_r": 0.2, "D_r": 0.01}
    plan = flight_plan("test", 0.4, [QUICK[:1] * 2, YAW, QUICK[:1] * 2, YAW])
    water = Water(tmp_path, wide, wide, wide | {"I_r": 0.05}, plan=plan).fly()
    assert [word.split(". ")[1].split(",")[0] for word in water.flown] == ["surge", "yaw", "yaw", "surge"]


def test_only_pieces_that_tell_what_is_not_known_yet_are_flown(tmp_path):
    half = {"M_u": 0.01, "D_u": 0.01, "I_r": 0.2, "D_r": math.inf}
    plan = flight_plan("test", 0.4, [QUICK[:1] * 2, YAW, QUICK[:1] * 2, YAW])
    water = Water(tmp_path, half, plan=plan).fly()
    assert [word.split(". ")[1].split(",")[0] for word in water.flown][-1] == "yaw"
    assert len(water.flown) in (3, 4)
    assert "known so far: M_u ± 1 %, I_r ± 20 % (not yet), D_u ± 1 %, D_r unknown" in water.words
    assert not water.flight.outcome.all_known
    assert water.flight.outcome.words == "finished"


def test_the_vehicle_goes_back_without_waiting_for_a_slow_identification_which_decides_afterwards(tmp_path):
    known = dict.fromkeys(("M_u", "I_r", "D_u", "D_r"), 0.01)
    water = Water(tmp_path, known, plan=flight_plan("test", 0.4, [QUICK[:1] * 2, YAW]))
    water.identifying.answer, answer = lambda: None, water.identifying.answer
    water.fly(lambda water: water.state is State.IDLE and water.flight.outcome.end is End.FINISHED)
    flown_s = water.flight.outcome.seconds
    water.fly(lambda water: water.clock.boot_s() > flown_s + 30.0)
    assert not water.flight.over
    water.identifying.answer = answer
    water.fly()
    assert water.flight.outcome.all_known
    assert water.flight.outcome.seconds == flown_s
    assert water.identifying.asked == 1


def test_the_end_key_holds_and_a_second_press_disarms(tmp_path):
    water = Water(tmp_path, {}).fly(lambda water: water.state is State.FLYING)
    water.flight.key()
    water.fly(lambda water: water.state is State.HOLDING, within_s=1.0)
    assert not water.flight.over
    water.flight.key()
    water.fly(within_s=2.0)
    assert (water.state, water.link.vehicle.bridge.armed) == (State.IDLE, False)
    assert water.flight.outcome.end is End.KEY


def test_each_further_press_asks_anew_to_disarm_where_the_one_before_was_given_up(tmp_path):
    water = Water(tmp_path, {}).fly(lambda water: water.state is State.FLYING)
    water.flight.key()
    water.flight.key()
    water.crew.session.fail("the vehicle does not answer")
    assert water.crew.session.idle
    water.flight.key()
    assert not water.crew.session.idle


def test_flights_begun_at_one_time_number_their_orders_apart():
    assert len({fly.first_number() for _ in range(5)}) == 5


def test_a_ground_that_hears_nothing_any_more_gives_up_and_says_where_the_vehicle_is(tmp_path, monkeypatch):
    water = Water(tmp_path, {}).fly(lambda water: water.state is State.FLYING)
    water.link.vehicle.bridge._sides.write_all = lambda _: None
    monkeypatch.setattr(run, "UNHEARD_S", 10.0)
    water.fly()
    assert (
        water.flight.outcome.words
        == "the vehicle is not heard any more; if it still runs, it goes back by itself"
    )


class Beside:
    """A companion that flies, and its autopilot, as they are heard; the companion dies when told to."""

    def __init__(self):
        self.clock, self.alive, self.sent = SimulatedClock(), True, []
        self._companion, self._autopilot = Encoder(1, 191), Encoder(1, 1)

    def hear(self):
        self.clock.advance_to(self.clock.boot_s() + 0.5)
        beat = dialect.MAVLink_heartbeat_message(12, dialect.MAV_AUTOPILOT_ARDUPILOTMEGA, 128, 19, 4, 3)
        said = [self._autopilot.encode(beat)]
        if self.alive:
            flying = Reading("flight", self.clock.boot_s(), (4.0, 0.0, 1.0, 5.0, 0.0, 0.0))
            said.append(self._companion.frame(*encode(flying)))
        return Framer().feed(b"".join(said))

    def send(self, raw):
        self.sent.append(raw)


def test_a_companion_that_died_beside_its_autopilot_is_told_and_not_that_it_goes_back():
    ear = Beside()
    crew = Crew(ear, memory_pair()[0], ear.clock, print)
    crew.find(1)
    plan = flight_plan("test", 0.4, [YAW])
    flight = PlanFlight(crew, plan, LIMITS, Wanted(plan.coefficients, 0.03), Scripted({}))
    for _ in range(100):
        flight.step()
    assert not flight.over
    ear.alive, died_s = False, ear.clock.boot_s()
    while not flight.over and ear.clock.boot_s() < died_s + 60.0:
        flight.step()
    assert flight.outcome.words.startswith("the companion is not heard any more, and the autopilot is")
    assert ear.clock.boot_s() - died_s == pytest.approx(15.0, abs=1.0)


class Refuses:
    """A vehicle that lies still and refuses to begin; its words, in two pieces, come after the refusal."""

    def __init__(self):
        self.clock, self._vehicle, self._next = SimulatedClock(), Encoder(1, 191), []

    def hear(self):
        self.clock.advance_to(self.clock.boot_s() + 0.05)
        still = Reading("flight", self.clock.boot_s(), (0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
        now, self._next = self._next[:1], self._next[1:]
        return Framer().feed(b"".join((*now, self._vehicle.frame(*encode(still)))))

    def send(self, raw):
        (order,) = map(decode, Framer().feed(raw))
        if order.get_type() != "COMMAND_LONG":
            return
        begins = order.command == ORDER and order.param1 == Order.BEGIN
        result = dialect.MAV_RESULT_DENIED if begins else dialect.MAV_RESULT_ACCEPTED
        # An order is answered by what it orders, a limit by its place.
        place = int(order.param1)
        ack = dialect.MAVLink_command_ack_message(order.command, result, 0, place, *GROUND_STATION)
        texts = status_texts(REASON, dialect.MAV_SEVERITY_NOTICE, 1) if begins else ()
        self._next += [self._vehicle.encode(message) for message in (ack, *texts)]


REASON = "no flight: no battery measured: mend its sensor, or give battery_v 0"


def test_a_flight_that_is_refused_ends_with_the_vehicles_words_why():
    vehicle, words = Refuses(), []
    crew = Crew(vehicle, memory_pair()[0], vehicle.clock, words.append)
    crew.find(1)
    plan = flight_plan("test", 0.4, [YAW])
    flight = PlanFlight(crew, plan, LIMITS, Wanted(plan.coefficients, 0.03), Scripted({}))
    flight.begin(3.0)
    began_s = vehicle.clock.boot_s()
    while not flight.over:
        flight.step()
    assert words == [f"vehicle: {REASON}"]
    assert flight.outcome.words == "the vehicle refuses; its words say why"
    assert vehicle.clock.boot_s() - began_s < 5.0


def test_a_flight_that_is_recorded_here_is_put_on_the_disk_while_it_lasts(tmp_path):
    """As any recording: a loss of power takes no more than its last half second."""
    water, synced = Water(tmp_path, {}), threading.Event()
    water.recorder.sync = synced.set
    recording = RecordedHere(water.crew, water.recorder, water.folder, water.words.append)
    assert synced.wait(30.0)
    recording.end("flight: not begun")
    assert "recorder-sync" not in {thread.name for thread in threading.enumerate()}


class Passing(Wrapper):
    """A link on which two vehicles that fly nothing, in configuration 7, share the address of `system`."""

    def __init__(self, link, system):
        super().__init__(link)
        self.twins = Encoder(system, 1), Encoder(system, 1)
        for _ in range(64):
            self.speak(self.twins[1])

    @staticmethod
    def speak(encoder):
        beat = dialect.MAVLink_heartbeat_message(dialect.MAV_TYPE_SUBMARINE, 3, 0, 0, 4, 3)
        return encoder.encode(beat) + encoder.frame(*encode(Reading("veh_cfg", 0.0, (7.0,))))

    def read(self, timeout_s):
        data = self._link.read(timeout_s)
        return data + b"".join(map(self.speak, self.twins)) if timeout_s else data


def test_what_other_vehicles_say_or_share_is_no_matter_of_a_flight(tmp_path):
    link, clock = simulated.afloat(FILE, "hovering", 1, parameters_of(FILE, None))
    crew, _, _ = recorded_crew(Passing(link, 5), FILE, "hovering", tmp_path, clock, print)
    assert crew.find(5).vehicle == (1, 1)
    assert "system 5" in crew._peers.fault(5)
    assert (crew.fault, crew.veh_cfg) == ("", 1.0)
    crew, _, _ = recorded_crew(Passing(link, 1), FILE, "hovering", tmp_path, clock, print)
    with pytest.raises(LinkError, match="two vehicles beat as system 1, component 1"):
        crew.find(5)


def test_how_a_flight_went_stands_among_the_stamps_of_its_dive_though_the_clock_was_set(
    tmp_path, monkeypatch
):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    vehicle = FakeVehicle()
    clock, day_s = vehicle.clock, 86_400.0
    began_s = clock.unix_s()
    write_holding(telling(folder=str(tmp_path), written_unix_s=began_s + day_s, set_by_s=day_s))
    monkeypatch.setattr(orders, "next_dive", lambda *_, **_soon: (tmp_path, tmp_path))
    there = RecordedThere(vehicle, FILE, "hovering", clock, print)
    there.begin()
    crew, recorder, folder = recorded_crew(vehicle, FILE, "hovering", tmp_path, clock, print)
    here = RecordedHere(crew, recorder, folder, print)
    here.begin()
    recorder.step(0.0)
    monkeypatch.setattr(clock, "unix_s", lambda: began_s + day_s)
    for recorded, dive in ((there, DiveFolder(tmp_path)), (here, folder)):
        recorded.end("flight: finished")
        (event,) = dive.about().events
        assert event.utc[:10] == utc_text(began_s)[:10]


class BesideAStation(Wrapper):
    """A link on which another ground station beats."""

    station = Encoder(255, 230)

    def read(self, timeout_s):
        return self._link.read(timeout_s) + self.station.encode(ground_heartbeat())


def test_without_a_vehicle_or_with_one_that_flies_nothing_no_flight_begins(tmp_path):
    vehicle = FakeVehicle()
    crew, _, _ = recorded_crew(vehicle, FILE, "hovering", tmp_path, vehicle.clock, print)
    with pytest.raises(
        LinkError, match="flies no manoeuvres by itself: beside ArduSub start seatrial bridge"
    ):
        crew.find(5)
    vehicle.mute = True
    for link in (vehicle, BesideAStation(vehicle)):
        crew, _, _ = recorded_crew(link, FILE, "hovering", tmp_path, vehicle.clock, print)
        with pytest.raises(LinkError, match="no vehicle within 5 s"):
            crew.find(5)


def test_beside_an_autopilot_that_is_not_supported_fly_says_so_and_what_works(tmp_path):
    vehicle = FakeVehicle(autopilot=dialect.MAV_AUTOPILOT_PX4)
    crew, _, _ = recorded_crew(vehicle, FILE, "hovering", tmp_path, vehicle.clock, print)
    with pytest.raises(LinkError, match=r"PX4 is not supported.*what works: record, watch, import"):
        crew.find(5)


def test_widths_are_half_the_interval_over_the_value_and_unknown_where_not_identifiable():
    known = estimate("M_u", 100.0, 1.0, 98.0, 102.0)
    unknown = estimate("D_u", 50.0, 30.0, 1.0, 120.0, "the dive says too little")

    class Identified:
        parameters = (known, unknown, replace(known, name="X_udot"))

    assert widths(Identified) == {"M_u": pytest.approx(0.02), "D_u": math.inf}
    assert known_so_far({"M_u": 0.02}, Wanted(("M_u", "D_u"), 0.03)) == "known so far: M_u ± 2 %, D_u unknown"


@pytest.mark.parametrize(
    ("width", "asked", "shown"),
    [
        (0.012, 0.03, "1.2 %"), (0.0304, 0.03, "3.04 %"), (0.030001, 0.03, "3.01 %"), (0.03, 0.03, "3 %"),
        (0.02951, 0.0296, "2.95 %"), (0.08, 0.03, "8 %"), (1.234, 0.03, "123 %"), (12.0, 0.03, "1200 %"),
    ],
)  # fmt: skip
def test_a_width_that_is_not_yet_as_asked_never_reads_as_the_one_asked_for(width, asked, shown):
    assert run.per_cent(width, asked) == shown
    mark = "" if width <= asked else " (not yet)"
    assert known_so_far({"M_u": width}, Wanted(("M_u",), asked)) == f"known so far: M_u ± {shown}{mark}"


@pytest.fixture
def files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    (tmp_path / "plan.yaml").write_text(PLAN)
    (tmp_path / "limits.yaml").write_text(LIMIT_FILE)
    return tmp_path


def command(*more, link=("--link", "memory:sea")):
    return ["fly", "plan.yaml", "--limits", "limits.yaml", "--vehicle", "ruvifist:hovering", *link, *more]


@pytest.mark.usefixtures("files")
def test_without_armed_nothing_is_sent_and_the_plan_is_shown(capsys, monkeypatch):
    monkeypatch.setattr(fly, "flown", lambda *_: pytest.fail("it flew"))
    assert cli.main(command()) == 0
    shown = capsys.readouterr().out
    assert "1. surge   8 + 8 + 16" in shown
    assert "nothing was sent: --armed arms the vehicle" in shown
    assert "deepest_m" in shown


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("--know", "D_w"), "--know D_w: the plan tells M_u, D_u alone"),
        (("--countdown", "2"), "--countdown 2: give 3 to 60 seconds"),
        (("--limits", "none.yaml"), "none.yaml: no such file"),
    ],
)
@pytest.mark.usefixtures("files")
def test_a_wrong_word_is_refused_before_anything_is_opened(capsys, more, words):
    assert cli.main(command("--armed", *more)) == 2
    assert words in capsys.readouterr().err


@pytest.mark.parametrize(
    "verb", [("fly", "plan.yaml"), ("calibrate", "--plan", "plan.yaml")], ids=["fly", "calibrate"]
)
@pytest.mark.parametrize("other", ["ruvifist:survey", "kraken:hovering"])
def test_a_plan_for_another_vehicle_or_configuration_is_neither_shown_nor_flown(files, capsys, verb, other):
    (files / "plan.yaml").write_text(f"vehicle: {other}\n{PLAN}")
    words = [*verb, "--limits", "limits.yaml", "--vehicle", "ruvifist:hovering"]
    for armed in ([], ["--armed"]):
        assert cli.main([*words, *armed]) == 2
        said = capsys.readouterr().err
        assert (
            f"plan.yaml: was planned for {other}, and --vehicle names ruvifist:hovering; plan again" in said
        )
    (files / "plan.yaml").write_text(f"vehicle: ruvifist:hovering\n{PLAN}")
    assert cli.main(words) == 0


def test_a_plan_outside_of_the_limits_depth_is_not_flown(files, capsys):
    (files / "limits.yaml").write_text(LIMIT_FILE.replace("shallowest_m: 0.1", "shallowest_m: 2"))
    assert cli.main(command("--armed")) == 2
    assert "the plan begins at 1.5 m of depth, and the limits are 2 to 4 m" in capsys.readouterr().err


def test_limits_whose_time_is_over_within_the_first_manoeuvre_are_refused_before_anything_is_sent(
    files, capsys
):
    (files / "limits.yaml").write_text(LIMIT_FILE.replace("time_s: 900", "time_s: 1"))
    assert cli.main(command("--armed")) == 2
    said = capsys.readouterr().err
    assert re.search(r"the first manoeuvre takes \d+ s, and the limits give time_s 1; give more", said)


def test_of_a_hull_without_linear_damping_the_flight_asks_for_the_masses_alone(files, capsys):
    """It asked for what no dive tells: the whole plan was flown, and nothing was ever uploaded."""
    vehicle = yaml.safe_load(FILE.path.read_text())
    hull = vehicle["configurations"]["hovering"] | {"damping": "quadratic", "model": {"X_uu": 30.0}}
    (files / "hull.yaml").write_text(yaml.safe_dump(vehicle | {"configurations": {"hovering": hull}}))
    asked = [word.replace("ruvifist:hovering", "hull.yaml") for word in command("--json", "out.json")]
    assert cli.main(asked) == 0
    assert json.loads((files / "out.json").read_text())["know"] == ["M_u"]
    assert cli.main([*asked, "--know", "M_u", "D_u"]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "--know D_u: hull.yaml has damping: quadratic, and no linear damping to tell; leave it out" in said


def on_a_simulated_vehicle(monkeypatch, *answers):
    """The verb's link, clock and identifications are those of a simulated vehicle."""
    link, clock = simulated.afloat(FILE, "hovering", 1, parameters_of(FILE, None))
    identifying = Scripted(*answers)
    identifying.close = lambda: None
    monkeypatch.setattr(fly.clocks, "SystemClock", lambda: clock)
    monkeypatch.setattr(fly.secured.Opener, "open", lambda *_: link)
    monkeypatch.setattr(fly, "Alongside", lambda *_: identifying)
    return link


def test_fly_flies_the_plan_and_writes_how_it_went(files, capsys, monkeypatch):
    vehicle = on_a_simulated_vehicle(monkeypatch, {"M_u": 0.01, "D_u": 0.02}).vehicle
    assert cli.main(command("--armed", "--countdown", "3", "--json", "out.json")) == 0
    out = json.loads((files / "out.json").read_text())
    assert (out["end"], out["widths_percent"]) == ("finished", {"M_u": 1.0, "D_u": 2.0})
    assert not vehicle.bridge.armed
    (dive,) = (files / "dives").iterdir()
    assert "flight: finished" in (dive / "dive.yaml").read_text()
    assert (dive / "telemetry.tlog").stat().st_size > 100_000
    assert "all that was asked for was known" in capsys.readouterr().out


def test_the_end_of_the_program_that_reads_the_progress_is_a_key_pressed_once(monkeypatch):
    monkeypatch.setattr(fly.os, "getppid", lambda: 7)
    for asks in (False, True):
        if asks:
            monkeypatch.setenv(reports.VARIABLE, reports.FORM)
        with fly.end_key() as pressed:
            seen = [pressed()]
            monkeypatch.setattr(fly.os, "getppid", lambda: 1)
            seen += [pressed(), pressed()]
            monkeypatch.setattr(fly.os, "getppid", lambda: 7)
            os.kill(os.getpid(), signal.SIGINT)
            seen.append(pressed())
        assert seen == [False, asks, False, True]


class OfRecording(Link):
    """The hub of a recording, which is stepped as it is read; `go_on` is the order for its next dive."""

    def __init__(self, link, clock, root):
        self.name, self.came, self.asked, self.root, self.clock = "memory:sea", b"", [], root, clock
        self.folders = [new_folder(root, clock.unix_s(), "before")]
        self.recorder = Recorder(
            [link], self.folders[0].open_telemetry, clock, lambda: 1 << 40, lambda _: None, outlet=self
        )

    def broadcast(self, raw):
        self.came += raw

    def taken(self):
        asked, self.asked = self.asked, []
        return asked

    def read(self, timeout_s):
        self.recorder.step(timeout_s)
        came, self.came = self.came, b""
        return came

    def write(self, data):
        self.asked.append(data)

    def close(self):
        self.asked = []

    def go_on(self, clock, **_soon):
        self.folders.append(new_folder(self.root, clock.unix_s(), "dive"))
        self.recorder.go_on(self.folders[-1].open_telemetry, lambda _: None)
        self.read(0.0)
        return tuple(folder.path for folder in self.folders[-2:])


def by_way_of_a_recording(files, monkeypatch, *answers):
    """A simulated vehicle on the link of a recording that runs."""
    link = on_a_simulated_vehicle(monkeypatch, *answers)
    hub = OfRecording(link, fly.clocks.SystemClock(), files / "dives")
    monkeypatch.setattr(fly.links, "link_for", lambda _: hub)
    monkeypatch.setattr(orders, "next_dive", hub.go_on)
    return link, hub


OF_RECORDING = command("--armed", "--countdown", "3", link=())


@pytest.mark.parametrize("there", [False, True], ids=["recorded here", "by way of a recording"])
def test_a_flight_tells_how_it_went_also_where_that_can_not_be_noted_on_the_disk(
    there, files, capsys, monkeypatch
):
    def full(*_):
        raise LogError("dive.yaml: can't be written (No space left on device); check the disk")

    known = {"M_u": 0.01, "D_u": 0.02}
    _, hub = by_way_of_a_recording(files, monkeypatch, known) if there else (None, None)
    if not there:
        on_a_simulated_vehicle(monkeypatch, known)
    monkeypatch.setattr(DiveFolder, "add_event", full)
    words = OF_RECORDING if there else command("--armed", "--countdown", "3")
    assert cli.main([*words, "--json", "out.json"]) == 0
    assert json.loads((files / "out.json").read_text())["end"] == "finished"
    assert "dive.yaml: can't be written (No space left on device)" in capsys.readouterr().err
    assert hub is None or len(hub.folders) == 3


def test_by_way_of_a_recording_a_flight_has_a_folder_of_its_own_and_beats_itself(files, monkeypatch):
    _, hub = by_way_of_a_recording(files, monkeypatch, {"M_u": 0.01, "D_u": 0.02})
    assert cli.main([*OF_RECORDING, "--json", "out.json"]) == 0
    _, flown, after = hub.folders
    out = json.loads((files / "out.json").read_text())
    assert (out["end"], out["folder"]) == ("finished", str(flown.path))
    assert "flight: finished" in (flown.path / "dive.yaml").read_text()
    assert flown.about().configuration == "hovering"
    sent = [
        frame for _, frame in read_tlog(flown.path / "telemetry.tlog") if frame.system == GROUND_STATION[0]
    ]
    beats = [frame for frame in sent if frame.message_id == 0]
    flown_s = length_s(flown.path)
    assert len(beats) == pytest.approx(flown_s, abs=3)
    assert len(sent) > len(beats)
    assert after.telemetry()


def test_a_recording_that_ends_in_mid_flight_ends_the_verb_and_the_vehicle_goes_back(
    files, capsys, monkeypatch
):
    link, hub = by_way_of_a_recording(files, monkeypatch, {})
    flight, read = link.vehicle._flights.flight, hub.read

    def ends(timeout_s):
        if flight.state is State.FLYING:
            raise LinkLost("the recording of memory:sea has ended; begin another, and ask again")
        return read(timeout_s)

    hub.read = ends
    assert cli.main(OF_RECORDING) == 3
    assert (
        "has ended; begin another, and ask again; a vehicle under way goes back by itself"
        in capsys.readouterr().err
    )
    assert "flight: its end was not heard" in (hub.folders[1].path / "dive.yaml").read_text()
    end_s = hub.clock.boot_s() + 100.0
    while flight.state is not State.IDLE and hub.clock.boot_s() < end_s:
        link.read(0.05)
    assert (flight.end, link.vehicle.bridge.armed) == (End.LINK, False)


def test_a_vehicle_in_another_configuration_is_not_flown_and_no_dive_is_left(files, capsys, monkeypatch):
    vehicle = on_a_simulated_vehicle(monkeypatch, {}).vehicle
    words = [word.replace("ruvifist:hovering", "ruvifist:survey") for word in command("--armed")]
    assert cli.main(words) == 1
    assert "the vehicle is in configuration 1, and --vehicle names 'survey'" in capsys.readouterr().err
    assert not vehicle.bridge.armed
    assert list((files / "dives").iterdir()) == []


@pytest.mark.parametrize(
    ("typed", "times"),
    [(b"x", 1), (b"xx", 2), (b"\x1b[A", 1), (b"\x1bOP\x1b[15~x", 3), ("é".encode(), 1), (b"\x1b", 1)],
)
def test_every_press_of_a_key_counts_though_several_came_since_the_last_look(monkeypatch, typed, times):
    keyboard, terminal = pty.openpty()
    with os.fdopen(keyboard, "wb", buffering=0) as keys, os.fdopen(terminal) as stdin:
        monkeypatch.setattr("sys.stdin", stdin)
        with fly.end_key() as pressed:
            keys.write(typed)
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)
            assert (pressed(), pressed()) == (times + 2, 0)


CALIBRATE = ["calibrate", *command("--armed", "--countdown", "3")[2:]]


def test_a_flight_that_ended_because_the_ground_was_not_heard_names_the_ways_out():
    said = fly.sentence(Outcome(End.LINK, "ground not heard", 4, 40.0))
    assert said.startswith("flight ended: ground not heard; 4 pieces, 40 s of manoeuvres")
    assert "mend the link, or close what keeps this computer busy, and fly again" in said
    assert "mend the link" not in fly.sentence(Outcome(End.KEY, "end key", 4, 40.0))


def flown(monkeypatch, known_s):
    """The flight of `calibrate` ends so at once: `fly` has its own tests."""
    outcome = Outcome(End.FINISHED, "finished", 1, 8.0, known_s)
    monkeypatch.setattr(fly, "flown", lambda *_: (outcome, DiveFolder(Path("dives/flown"))))


def forecast(folder, **widths):
    """What `plan` leaves for `calibrate`: the plan, and how well each coefficient would be known by it."""
    foretold = [{"name": n, "after": {"relative_std": widths.get(n, 0.01) / 1.96}} for n in ("M_u", "D_u")]
    (folder / "calibrate-plan.yaml").write_text(PLAN)
    told = {"mission": "calibrate-plan.yaml", "duration_s": 300.0, "parameters": foretold}
    (folder / "calibrate-plan.json").write_text(json.dumps(told))
    return 0


@pytest.mark.parametrize(
    ("width", "told", "ways"),
    [
        (0.066, "6.6", "--to 7, or about --minutes 25 with a time_s of more than 1500 in the limits"),
        (0.03011, "3.01", "--to 4, or about --minutes 6"),
    ],
)
def test_calibrate_does_not_fly_a_plan_that_would_not_tell_what_is_asked(
    files, capsys, monkeypatch, width, told, ways
):
    monkeypatch.setattr(fly, "flown", lambda *_: pytest.fail("it flew"))
    monkeypatch.setattr(calibrate, "step", lambda *_, **__: forecast(files / "dives", D_u=width))
    assert cli.main(CALIBRATE) == 1
    said = " ".join(capsys.readouterr().out.split())
    assert (
        f"nothing was sent: all of this plan tells D_u to {told} % alone, and --to asks for 3 %: give {ways}, or "
        "wider limits, or --know M_u"
    ) in said


@pytest.mark.parametrize(
    ("ends_at", "way_out"),
    [
        ("identify", "nothing was uploaded, and the dive is kept in dives/"),
        ("params", "mend what it says, then seatrial params upload dives/"),
        ("ff", "mend what it says, then seatrial ff shadow"),
    ],
)
def test_calibrate_takes_each_step_in_turn_and_ends_with_the_first_that_says_no(
    files, monkeypatch, capsys, ends_at, way_out
):
    flown(monkeypatch, 30.0)
    names = ["identify", "params", "ff"]
    taken = names[: names.index(ends_at) + 1]
    steps, codes = [], {name: int(name == ends_at) for name in taken}

    def step(name, *words, **_):
        steps.append((name, *words))
        return forecast(files / "dives") if name == "plan" else codes[name]

    monkeypatch.setattr(calibrate, "step", step)
    assert cli.main([*CALIBRATE, "--json", "out.json"]) == 1
    assert [name for name, *_ in steps] == ["plan", *taken]
    within = "--minutes 5 --to 3 --space 3 --depth-space 1.05 --speed 0.5 --out dives/calibrate-plan.yaml "
    within += "--json dives/calibrate-plan.json"
    assert steps[0][3:] == tuple(within.split())
    assert [words[0] for name, *words in steps if name == "params"] == ["upload"][: len(taken) - 1]
    assert json.loads((files / "out.json").read_text())["steps"] == codes
    shown = "".join(capsys.readouterr().out.split())
    last = shown[shown.rindex(f"calibrateendsat{ends_at}:") :]
    assert way_out.replace(" ", "") in last


@pytest.mark.parametrize(
    ("ordered", "code"), [(False, 0), (True, 1)], ids=["", "an OFF of another program meanwhile"]
)
def test_calibrate_ends_in_shadow_unless_off_was_ordered_while_it_ran(files, monkeypatch, ordered, code):
    flown(monkeypatch, 30.0)
    forecast(files)
    vehicle = FakeVehicle()
    vehicle.chatters = True
    vehicle.give_a_model()
    monkeypatch.setattr("bridge.links.open.open_link", lambda _: vehicle)
    monkeypatch.setattr("bridge.clock.SystemClock", lambda: vehicle.clock)
    off = dialect.MAVLink_param_set_message(1, 1, b"FF_MODE", 0.0, dialect.MAV_PARAM_TYPE_REAL32)
    switches = calibrate.step

    def step(name, *words, **options):
        if name == "params" and ordered:
            OffMarks().mark([off])
        return switches(name, *words, **options) if name == "ff" else 0

    monkeypatch.setattr(calibrate, "step", step)
    assert cli.main([*CALIBRATE, "--plan", "calibrate-plan.yaml"], time.time()) == code
    assert vehicle.server.mode == (0 if ordered else 1)


def test_calibrate_flies_the_plan_that_was_read_and_makes_no_other(files, monkeypatch):
    on_a_simulated_vehicle(monkeypatch, {"M_u": 0.01, "D_u": 0.02})
    forecast(files)
    steps = []
    monkeypatch.setattr(calibrate, "step", lambda name, *_, **__: steps.append(name) or 0)
    assert cli.main([*CALIBRATE, "--plan", "calibrate-plan.yaml"]) == 0
    assert steps == ["identify", "params", "ff"]


def test_calibrate_takes_no_other_json_that_lies_beside_a_plan_for_what_foretells_it(files, monkeypatch):
    flown(monkeypatch, 30.0)
    (files / "hovering.yaml").write_text(PLAN)
    identified = {"configuration": "hovering", "outcome": "converged", "parameters": [{"name": "M_u"}]}
    (files / "hovering.json").write_text(json.dumps(identified))
    monkeypatch.setattr(calibrate, "step", lambda *_, **__: 0)
    assert cli.main([*CALIBRATE, "--plan", "hovering.yaml"]) == 0


def test_calibrate_uploads_nothing_where_the_flight_did_not_tell_enough(files, monkeypatch):
    flown(monkeypatch, math.nan)
    steps = []

    def step(name, *words, **_):
        steps.append((name, *words))
        return forecast(files / "dives")

    monkeypatch.setattr(calibrate, "step", step)
    assert cli.main(CALIBRATE) == 1
    assert [name for name, *_ in steps] == ["plan"]
