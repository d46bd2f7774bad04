"""Parameters read and written from frame to frame, against the vehicle's own server behind a bad link."""

import random

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.errors import ParamRejected, ParamUnknown
from bridge.framing import Encoder, Framer, decode
from bridge.link.lossy import Lossy
from bridge.link.memory import memory_pair
from bridge.parameters import ParameterServer, set_crc, vehicle_table
from bridge.vehicle.config import load_vehicle
from gcs_plugin.params.client import GONE_S
from gcs_plugin.params.errand import AGREE_WITHIN_S, READ_WITHIN_S, Errand, Step, Told
from gcs_plugin.params.sidecar import Wanted
from gcs_plugin.params.transfer import Outcome

SOURCE = (1, 1)
STEP_S = 0.05
WANTED = Wanted({"FF0_M_U": 96.5, "FF1_D_U": 42.25})


class Sea:
    """An errand and a vehicle on two ends of a link, in simulated time. Faults are attributes."""

    def __init__(self, wanted=WANTED, loss=0.0, seed=1):
        self.clock = SimulatedClock()
        ours, its = memory_pair()
        self.link = Lossy(ours, random.Random(seed), self.clock, loss=loss)
        self.its, self.encoder = its, Encoder(*SOURCE)
        self.server = ParameterServer(None, vehicle_table(load_vehicle("ruvifist").vehicle))
        self.station, self.framers = Encoder(255, 230), (Framer(), Framer())
        self.errand = Errand(SOURCE, wanted, 0.0)
        self.armed, self.fault, self.mute, self.off, self.sets = False, "", False, False, 0
        self.heard_s = 0.0

    def step(self):
        now_s = self.clock.boot_s() + STEP_S
        self.clock.advance_to(now_s)
        for message in self.errand.tick(now_s, Told(self.armed, now_s - self.heard_s, self.fault, self.off)):
            self.sets += message.get_type() == "PARAM_SET"
            self.link.write(self.station.encode(message))
        answers = []
        for frame in self.framers[0].feed(self.its.read(0.0)):
            answers += self.server.handle(decode(frame), self.armed)
        for message in (*answers, *self.server.step(5)):
            if not self.mute:
                self.its.write(self.encoder.encode(message))
        while data := self.link.read(0.0):
            for frame in self.framers[1].feed(data):
                self.heard_s = now_s
                self.errand.on_message(decode(frame), (frame.system, frame.component), now_s, False)

    def until(self, step, most_s=120.0):
        while self.errand.step is not step:
            assert self.clock.boot_s() < most_s, self.errand.progress
            self.step()
        return self.errand


@pytest.mark.parametrize("loss", [0.0, 0.3])
def test_what_is_wanted_is_read_agreed_written_and_read_back(loss):
    sea = Sea(loss=loss)
    errand = sea.until(Step.AGREE)
    assert errand.plan.changes == WANTED.values
    assert sea.sets == 0
    errand.agreed(sea.clock.boot_s())
    sea.until(Step.ENDED)
    assert errand.ending.outcome is Outcome.APPLIED
    assert sea.server.value("FF0_M_U") == 96.5
    assert errand.active_crc == sea.server.active_crc != 0


def test_the_code_stands_for_what_is_written():
    codes = set()
    for values in (
        {"FF0_M_U": 96.5},
        {"FF0_M_U": 96.625},
        {"FF0_M_V": 96.5},
        {"FF0_M_U": 96.5, "FF1_D_U": 1.0},
    ):
        errand = Sea(Wanted(values)).until(Step.AGREE)
        assert errand.code(False) == f"{len(values)}-{set_crc(values):06x}"
        codes.add(errand.code(False))
    assert len(codes) == 4


def test_lines_may_be_chosen_and_one_that_is_not_there_is_refused():
    errand = Sea().until(Step.AGREE)
    with pytest.raises(ParamUnknown, match="no line FF0_X"):
        errand.choose(("FF0_X",))
    errand.choose(("FF0_M_U",))
    assert list(errand.plan.changes) == ["FF0_M_U"]


def test_a_value_that_can_not_be_sends_nothing():
    sea = Sea(Wanted({"FF0_M_U": 96.5, "FF0_D_U": -1.0}))
    errand = sea.until(Step.AGREE)
    with pytest.raises(ParamRejected, match="nothing was sent"):
        errand.agreed(sea.clock.boot_s())
    assert sea.sets == 0


def test_effects_accepted_before_are_taken_back_by_a_whole_model():
    sea = Sea(Wanted({"FF0_M_U": 96.5}, whole=True))
    sea.server.write("FF0_X_UU", 30.0, False)
    errand = sea.until(Step.AGREE)
    assert errand.back == ("FF0_X_UU",)
    assert errand.plan.changes == {"FF0_M_U": 96.5, "FF0_X_UU": 0.0}


def test_a_vehicle_that_says_nothing_ends_the_reading():
    sea = Sea()
    sea.mute = True
    errand = sea.until(Step.ENDED)
    assert sea.clock.boot_s() == pytest.approx(READ_WITHIN_S, abs=1.0)
    assert "sent no parameter" in errand.failure


def test_arming_in_the_midst_of_staging_rolls_back():
    sea = Sea()
    errand = sea.until(Step.AGREE)
    errand.agreed(sea.clock.boot_s())
    while not sea.sets:
        sea.step()
    sea.armed = True
    sea.until(Step.ENDED)
    assert errand.ending.outcome is Outcome.ROLLED_BACK
    assert "armed" in errand.ending.sentence
    assert sea.server.value("FF0_M_U") == 0.0


def test_off_that_was_ordered_in_the_midst_keeps_the_mode_down_and_takes_the_rest_back():
    sea = Sea(Wanted({"FF0_M_U": 96.5, "FF_MODE": 1.0}))
    before = sea.server.value("FF0_M_U")
    errand = sea.until(Step.AGREE)
    errand.agreed(sea.clock.boot_s())
    sea.off = True
    sea.until(Step.ENDED)
    assert errand.ending.outcome is Outcome.ROLLED_BACK
    assert errand.ending.sentence.startswith("OFF was ordered meanwhile and wins: FF_MODE is not raised")
    assert (sea.server.mode, sea.server.value("FF0_M_U")) == (0, before)


def test_what_was_agreed_for_an_armed_vehicle_goes_on_when_it_is_armed_and_its_code_is_another():
    sea = Sea()
    errand = sea.until(Step.AGREE)
    assert errand.code(True) == f"armed-{errand.code(False)}"
    errand.agreed(sea.clock.boot_s(), even_armed=True)
    sea.armed = True
    sea.until(Step.ENDED)
    assert errand.ending.outcome is Outcome.APPLIED


def test_going_back_never_raises_the_mode_of_the_feed_forward():
    sea = Sea(Wanted({"FF_MODE": 3.0, "FF0_M_U": 96.5}))
    sea.errand = Errand(SOURCE, Wanted({"FF_MODE": 3.0, "FF0_M_U": 96.5}), 0.0, going_back=True)
    assert sea.until(Step.AGREE).plan.changes == {"FF0_M_U": 96.5}


@pytest.mark.parametrize("trouble", ["twins", "silence"])
def test_trouble_on_the_link_ends_it_without_another_write(trouble):
    sea = Sea()
    errand = sea.until(Step.AGREE)
    errand.agreed(sea.clock.boot_s())
    sea.step()
    if trouble == "twins":
        sea.fault = "two vehicles beat as system 1"
    else:
        sea.mute = True
        while sea.clock.boot_s() - sea.heard_s < GONE_S - 2 * STEP_S:
            sea.step()
    sets = sea.sets
    sea.until(Step.ENDED)
    assert errand.ending.outcome is Outcome.UNVERIFIED
    assert sea.sets == sets


def test_a_stop_while_reading_ends_at_once_and_while_staging_rolls_back():
    sea = Sea()
    sea.step()
    assert sea.errand.stop("stopped by the user", sea.clock.boot_s())
    assert (sea.errand.step, sea.errand.failure) == (Step.ENDED, "stopped by the user")
    sea = Sea()
    errand = sea.until(Step.AGREE)
    errand.agreed(sea.clock.boot_s())
    while not sea.sets:
        sea.step()
    assert errand.stop("stopped by the user", sea.clock.boot_s())
    sea.until(Step.ENDED)
    assert errand.ending.outcome is Outcome.ROLLED_BACK


def test_a_plan_grows_old():
    sea = Sea()
    errand = sea.until(Step.AGREE)
    assert not errand.is_old(sea.clock.boot_s() + AGREE_WITHIN_S - 1)
    assert errand.is_old(sea.clock.boot_s() + AGREE_WITHIN_S + 1)


def test_a_list_is_asked_anew_of_a_vehicle_that_started_anew():
    sea = Sea()
    for _ in range(8):
        sea.step()
    assert sea.errand.progress[1] > 0
    time = dialect.MAVLink_system_time_message(0, 10)
    sea.errand.on_message(time, SOURCE, sea.clock.boot_s(), True)
    assert sea.errand.progress[1] == 0
    sea.until(Step.AGREE)
