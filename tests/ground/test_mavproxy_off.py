"""`ff off` in MAVProxy is sent at once to whom the module has heard, also where nobody is heard any more."""

import pytest

from bridge.clock import SimulatedClock
from bridge.framing import Encoder, Framer
from bridge.messages.readings import Reading, encode
from gcs_plugin.fleet import Fleet
from gcs_plugin.mavproxy.switching import Switching


class Sea:
    name = "udpin:1"

    def __init__(self):
        self.clock, self.fleet, self.said = SimulatedClock(50.0), Fleet(), []
        self.switching = Switching(self.fleet, self.clock, self.said.append)

    def tells_its_mode(self, system):
        for frame in Framer().feed(Encoder(system, 1).frame(*encode(Reading("ff_mode", 0.0, (3.0,))))):
            self.fleet.on_frame(frame, self, self.clock.now_s)
            self.switching.on_frame(frame)

    def orders(self):
        return [
            (m.target_system, m.param_value) for m in self.switching.tick() if m.get_type() == "PARAM_SET"
        ]


@pytest.mark.parametrize(("chosen", "orders"), [(None, [(1, 0.0), (2, 0.0)]), (2, [(2, 0.0)])])
def test_off_goes_to_the_vehicle_chosen_else_to_all_that_were_heard_without_another_word_of_theirs(
    chosen, orders
):
    sea = Sea()
    sea.tells_its_mode(1)
    sea.tells_its_mode(2)
    sea.clock.advance_to(62.0)
    sea.fleet.chosen = chosen
    assert sea.switching.command(["off"])
    assert sea.orders() == orders
    sea.clock.advance_to(62.5)
    assert sea.orders() == orders
    assert sea.switching.status()[0].endswith("vehicle 2: sent 2 times, not heard for 12 s: not confirmed")


def test_off_where_nobody_was_ever_heard_says_that_nothing_is_sent():
    sea = Sea()
    assert sea.switching.command(["off"])
    assert sea.orders() == []
    assert sea.switching.status() == ["ff: no vehicle heard, nothing is sent yet"]
