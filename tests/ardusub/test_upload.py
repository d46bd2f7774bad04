"""An upload to a companion behind ArduSub, on links that lose a third of all frames: complete, or rolled back."""

import random

import pytest
from fakes.ardusub import Ardusub
from fakes.lossy import Lossy
from fakes.parameters_over_a_link import SOURCE, Reached, flown, is_told_as_it_is
from rig import Aboard, Pilot
from soak import rest_in_soak

from bench.ardusub.firmware import SteppedLink
from bridge.vehicle.mode import Mode
from bridge.vehicle.parameters import COMMIT
from bridge.wire.framing import Encoder, Framer
from gcs_plugin.params.client import ParameterClient
from gcs_plugin.params.plan import make_plan
from gcs_plugin.params.transfer import Outcome
from gcs_plugin.params.upload import Upload
from gcs_plugin.peers import GROUND_STATION, Peers

BAD_LINK = {"loss": 0.3, "duplicate": 0.2, "reorder": 0.1, "jitter_s": 0.2}
OLD = {f"FF0_{kind}_{dof}": 10.0 for kind in "MD" for dof in "UVW"}
TARGETS = {"FF0_M_U": 24.5, "FF0_M_V": 40.5, "FF0_D_U": 42.25, "FF0_D_V": 61.5}
SHORT, *LONG = range(3), *(range(first, first + 20) for first in range(0, 200, 20))


class Beside(Reached):
    """A companion behind the fake ArduSub that holds OLD, armed by a pilot who is in shadow; its link is bad."""

    def __init__(self, seed):
        self.fake = Ardusub()
        self.clock = self.fake.clock
        self.aboard = Aboard(self.fake, Mode.SHADOW)
        self.server = self.aboard.parameters
        for name, value in OLD.items():
            assert self.server.write(name, value, armed=False) is None
        assert self.server.write(COMMIT, self.server.staged_crc, armed=False) is None
        self.link = Lossy(SteppedLink(self.fake, self.aboard), random.Random(seed), self.clock, **BAD_LINK)
        self.sends = 0
        self._ground, self._framer, self._peers = Encoder(*GROUND_STATION), Framer(), Peers()
        pilot = Pilot(self.fake)
        self.fake.run(4.0, self.aboard, pilot)
        self.foreign = dict(self.fake.parameters)

    def flying(self):
        return {name: value for name, value in super().flying().items() if name in OLD}


def uploaded(seed, cut_s=None):
    """An upload on a bad link, that is cut altogether after a while, if asked."""
    vehicle = Beside(seed)
    upload, began_s = Upload(make_plan(TARGETS, vehicle.values), SOURCE, vehicle.now_s), vehicle.now_s

    def over():
        if cut_s is not None:
            vehicle.cut(0.0 <= vehicle.now_s - began_s - cut_s <= 8.0)
        return upload.ending is not None

    assert vehicle.run(upload, over, 2000.0)
    vehicle.settle(upload)
    is_told_as_it_is(vehicle, upload.ending, flown(OLD), flown(OLD | TARGETS))
    assert vehicle.fake.parameters == vehicle.foreign, "the autopilot took nothing for its own"
    return upload.ending.outcome


@pytest.mark.parametrize(
    "seeds", rest_in_soak((SHORT, *LONG)), ids=lambda seeds: f"{seeds[0]} to {seeds[-1]}"
)
def test_an_upload_on_a_link_that_loses_a_third_is_complete_or_rolled_back(seeds):
    outcomes = [uploaded(seed) for seed in seeds]
    assert set(outcomes) <= {Outcome.APPLIED, Outcome.ROLLED_BACK}
    assert outcomes.count(Outcome.APPLIED) >= 0.9 * len(seeds)


@pytest.mark.parametrize("seeds", rest_in_soak([(1, 5), range(8)]), ids=str)
def test_one_that_is_cut_off_for_a_while_leaves_the_old_set_or_the_new_in_force(seeds):
    outcomes = {uploaded(seed, cut_s=0.3 * seed) for seed in seeds}
    assert outcomes <= {Outcome.APPLIED, Outcome.ROLLED_BACK, Outcome.UNVERIFIED}


@pytest.mark.parametrize("seed", rest_in_soak(range(12), keep=3))
def test_on_such_a_link_the_companion_is_found_and_not_the_autopilot_in_front_of_it(seed):
    """Its heartbeats may be lost, where its other words come through."""
    vehicle = Beside(seed)
    assert ParameterClient(vehicle.link, vehicle.clock).find_vehicle() == SOURCE
