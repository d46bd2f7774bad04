"""A parameter download as QGroundControl does it, against the real bridge, with and without loss.

After QGroundControl's src/FactSystem/ParameterManager (v4, and the constants of its header on master): one
PARAM_REQUEST_LIST to every component, again after 5 s without an answer, 4 times; lists kept apart by component;
3 s after the last value the gaps are asked for by index, about 10 at a time, each 5 times, and what has not come then
is reported and given up, until the user presses Refresh.
"""

import dataclasses
import random
from dataclasses import dataclass, field

import pytest
from fakes.lossy import Lossy
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.links.link import memory_pair
from bridge.onboard.parameters import ParameterServer
from bridge.onboard.service import Bridge
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.parameters import vehicle_table
from bridge.wire.framing import Encoder, Framer, decode

STATION, EVERYBODY = (255, 190), 0
LIST_AGAIN_S, MOST_LISTS = 5.0, 5
GAPS_AFTER_S, MOST_AT_ONCE, MOST_TRIES = 3.0, 10, 5
STEP_S = 0.05
COMPANION = dialect.MAV_COMP_ID_ONBOARD_COMPUTER


@dataclass
class Qgc:
    """State of the ground station; `missing` counts how often each component and index was asked for,
    `failed` are those that it gave up.
    """

    values: dict = field(default_factory=dict)
    counts: dict = field(default_factory=dict)
    missing: dict = field(default_factory=dict)
    flying: set = field(default_factory=set)
    failed: list = field(default_factory=list)
    lists: int = 0
    by_index: int = 0
    asking: bool = False
    list_due_s: float | None = None
    gaps_due_s: float | None = None

    def refresh(self, now_s):
        """Connecting, or the button Refresh."""
        self.failed, self.asking, self.flying = [], False, set()
        for component, count in self.counts.items():
            self.missing |= dict.fromkeys(((component, index) for index in range(count)), 0)
        self.lists, self.list_due_s = 1, now_s + LIST_AGAIN_S
        self.gaps_due_s = now_s + GAPS_AFTER_S if self.counts else None
        return [dialect.MAVLink_param_request_list_message(1, EVERYBODY)]

    def on_value(self, message, now_s):
        component, index = message.get_srcComponent(), message.param_index
        if index == 65535 and self.list_due_s is not None:
            return []
        self.list_due_s = None
        if component not in self.counts:
            self.counts[component] = message.param_count
            self.missing |= dict.fromkeys(((component, index) for index in range(message.param_count)), 0)
        self.values.setdefault(component, {})[message.param_id] = message.param_value
        came = self.missing.pop((component, index), None) is not None
        self.flying.discard((component, index))
        sends = self.fill() if came else []
        self.gaps_due_s = now_s + GAPS_AFTER_S if self.missing else None
        return sends

    def tick(self, now_s):
        if self.list_due_s is not None and now_s >= self.list_due_s and self.lists < MOST_LISTS:
            self.lists, self.list_due_s = self.lists + 1, now_s + LIST_AGAIN_S
            return [dialect.MAVLink_param_request_list_message(1, EVERYBODY)]
        if self.gaps_due_s is not None and now_s >= self.gaps_due_s:
            self.asking, self.flying = True, set()
            sends = self.fill()
            self.gaps_due_s = now_s + GAPS_AFTER_S if sends else None
            return sends
        return []

    def fill(self):
        sends = []
        for at in sorted(self.missing) if self.asking else ():
            if at in self.flying or len(self.flying) >= MOST_AT_ONCE:
                continue
            if self.missing[at] == MOST_TRIES:
                self.failed.append(at)
                del self.missing[at]
                continue
            self.missing[at] += 1
            self.flying.add(at)
            self.by_index += 1
            sends.append(dialect.MAVLink_param_request_read_message(1, at[0], b"", at[1]))
        return sends

    @property
    def done(self):
        return bool(self.counts) and not self.missing


class Sea:
    """One system of two components, each a real bridge, and QGroundControl on a link to both."""

    def __init__(self, loss=0.0, seed=1):
        self.clock = SimulatedClock()
        ours, self.radio = memory_pair()
        self.link = Lossy(ours, random.Random(seed), self.clock, loss=loss)
        vehicle = load_vehicle("ruvifist").vehicle
        self.servers, self.bridges, self.routed = {}, [], []
        for component, configurations in ((1, 1), (COMPANION, 2)):
            kept = dict(list(vehicle.configurations.items())[:configurations])
            part = dataclasses.replace(vehicle, configurations=kept, component_id=component)
            aboard, its = memory_pair()
            server = ParameterServer(None, vehicle_table(part), component=component)
            self.servers[component] = server
            self.bridges.append(Bridge(part, self.clock, [its], server))
            self.routed.append(aboard)
        self.encoder, self.framer = Encoder(*STATION), Framer()
        self.qgc = Qgc()
        self.send(self.qgc.refresh(0.0))

    def send(self, messages):
        for message in messages:
            self.link.write(self.encoder.encode(message))

    def step(self):
        self.clock.advance_to(self.clock.boot_s() + STEP_S)
        while data := self.radio.read(0.0):
            for aboard in self.routed:
                aboard.write(data)
        for bridge, aboard in zip(self.bridges, self.routed, strict=True):
            bridge.step()
            while data := aboard.read(0.0):
                self.radio.write(data)
        while data := self.link.read(0.0):
            for frame in self.framer.feed(data):
                if frame.message_id == dialect.MAVLINK_MSG_ID_PARAM_VALUE:
                    self.send(self.qgc.on_value(decode(frame), self.clock.boot_s()))
        self.send(self.qgc.tick(self.clock.boot_s()))

    def download(self, most_s):
        """Until all has come or is given up; how long it took."""
        began_s = self.clock.boot_s()
        while not self.qgc.done:
            assert self.clock.boot_s() - began_s < most_s, self.qgc.missing
            self.step()
        return self.clock.boot_s() - began_s

    def held(self):
        return {
            component: {name: server.value(name) for name in server.names}
            for component, server in self.servers.items()
        }


def test_every_parameter_of_each_component_comes_by_the_list_alone():
    sea = Sea()
    for component, server in sea.servers.items():
        server.write("FF0_M_U", 100.0 + component, False)
    took_s = sea.download(5.0)
    assert sea.qgc.values == sea.held()
    assert sea.qgc.values[1]["FF0_M_U"] == 101.0
    assert sea.qgc.values[COMPANION]["FF0_M_U"] == 100.0 + COMPANION
    assert len(sea.qgc.values[1]) < len(sea.qgc.values[COMPANION])
    assert (sea.qgc.lists, sea.qgc.by_index, sea.qgc.failed) == (1, 0, [])
    assert took_s < 2.0


@pytest.mark.parametrize("seed", range(8))
def test_with_three_in_ten_frames_lost_each_way_gaps_are_filled_by_index(seed):
    sea = Sea(0.3, seed)
    sea.download(120.0)
    assert sea.qgc.by_index > 10
    refreshed = 0
    while sea.qgc.values != sea.held():
        # QGroundControl names the indices that it gave up, and its user presses Refresh.
        assert 0 < len(sea.qgc.failed) < 10
        refreshed += 1
        assert refreshed < 4
        sea.send(sea.qgc.refresh(sea.clock.boot_s()))
        sea.download(120.0)
