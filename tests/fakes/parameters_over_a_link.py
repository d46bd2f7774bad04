"""Parameter machines driven against the fake vehicle over a bad link, in simulated time."""

import random
from dataclasses import fields

from fakes.lossy import Faults, Lossy
from fakes.vehicle import FakeVehicle

from bridge.wire.framing import Encoder, Framer
from gcs_plugin.params.listing import Listing
from gcs_plugin.params.meaning import is_staged
from gcs_plugin.params.session import message_of, news_of
from gcs_plugin.params.transfer import Outcome, Transfer
from gcs_plugin.peers import GROUND_STATION, Peers

SOURCE = (1, 191)
STEP_S = 0.05
LINK = {field.name for field in fields(Faults)}


class Reached(FakeVehicle):
    """A vehicle that holds `values`, and the ground's end of the link to it; faults are those of link or vehicle."""

    def __init__(self, values, seed=0, **faults):
        super().__init__(source=SOURCE, autopilot=8, holds=values)
        on_link = {"jitter_s": 0.02} | {name: fault for name, fault in faults.items() if name in LINK}
        vars(self).update({name: fault for name, fault in faults.items() if name not in LINK})
        self.link = Lossy(self, random.Random(seed), self.clock, **on_link)
        self.sends = 0
        self._ground, self._framer, self._peers = Encoder(*GROUND_STATION), Framer(), Peers()

    @property
    def now_s(self):
        return self.clock.now_s

    def cut(self, away=True):
        for faults in self.link.faults:
            faults.cut = away

    def run(self, machine, done, until_s=600.0):
        """Drive `machine` until `done()`; False where time ran out."""
        while not done():
            if self.now_s > until_s:
                return False
            for send in machine.tick(self.now_s):
                self.sends += 1
                self.link.write(self._ground.encode(message_of(send, SOURCE)))
            self._hear(machine)
        return True

    def settle(self, machine, for_s=5.0):
        """Let all that is still under way arrive, so that the truth is the last word."""
        end_s = self.now_s + for_s
        while self.now_s < end_s:
            self._hear(machine)

    def _hear(self, machine):
        for frame in self._framer.feed(self.link.read(STEP_S)):
            news = news_of(frame, self._peers.on_frame(frame, "link", self.now_s))
            if news is None:
                continue
            message, at = news.message, (news.source, self.now_s)
            if news.rebooted:
                machine.on_reboot(self.now_s)
            elif message.get_type() == "PARAM_VALUE":
                place = (message.param_index, message.param_count) if isinstance(machine, Listing) else ()
                machine.on_value(message.param_id, message.param_value, *place, *at)
            elif message.get_type() == "PARAM_ERROR" and not isinstance(machine, Listing):
                machine.on_error(
                    message.param_id, message.error, *at[: 1 if isinstance(machine, Transfer) else 2]
                )


def flown(values):
    """Those of the values that fly once they are committed."""
    return {name: value for name, value in values.items() if is_staged(name)}


def is_told_as_it_is(vehicle, ending, old, new):
    """No claim of an upload from `old` to `new` that is not so, and the set that flies is whole."""
    held = {name: vehicle.values[name] for name in old}
    assert vehicle.flying() in (flown(old), flown(new))
    if ending.outcome is Outcome.APPLIED:
        assert (held, vehicle.flying()) == (new, flown(new))
    elif ending.outcome is not Outcome.UNVERIFIED:
        assert (held, vehicle.flying()) == (old, flown(old))
    for values, outcome in ((new, Outcome.APPLIED), (old, Outcome.ROLLED_BACK)):
        claimed = {name for name, result in ending.results.items() if result.outcome is outcome}
        assert {name: held[name] for name in claimed} == {name: values[name] for name in claimed}
