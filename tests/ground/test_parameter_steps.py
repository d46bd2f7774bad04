"""Whole uploads over bad links, cut at each message, and drawn by seeds."""

import copy
from statistics import mean

import pytest
from fakes.parameters_over_a_link import SOURCE, Reached, flown, is_told_as_it_is
from figures import keep
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.vehicle.coefficients import COEFFICIENTS
from gcs_plugin.params.listing import Listing
from gcs_plugin.params.plan import make_plan
from gcs_plugin.params.transfer import Outcome
from gcs_plugin.params.upload import Upload

OLD = {f"FF0_{kind}_{dof}": 10.0 for kind in "MD" for dof in "UV"} | {"FF_MODE": 1.0}
TARGETS = {"FF0_M_U": 24.5, "FF0_D_U": 42.25, "FF_MODE": 2.0}
NEW = OLD | TARGETS
PARAMETERS = {
    dialect.MAVLINK_MSG_ID_PARAM_VALUE, dialect.MAVLINK_MSG_ID_PARAM_SET,
    dialect.MAVLINK_MSG_ID_PARAM_REQUEST_READ, dialect.MAVLINK_MSG_ID_PARAM_REQUEST_LIST,
}  # fmt: skip
LISTED_S, LONG_S, SETTLE_S = 60.0, 2000.0, 5.0


class Numbered(Reached):
    """A vehicle to which `happens` at message number `at`, be it one of the ground or its own, and nothing before."""

    def __init__(self, at, happens):
        super().__init__(OLD)
        self.at, self.happens, self.carried = at, happens, 0
        self.link.each = self.count

    def count(self, frame):
        self.carried += frame.message_id in PARAMETERS
        if self.carried == self.at and frame.message_id in PARAMETERS:
            self.happens(self)


class GroundKilledError(Exception):
    """The ground is no more."""


def kill(_):
    raise GroundKilledError


def upload_to(vehicle, targets):
    """Read all of a vehicle and bring it to `targets`; None if it could not all be read."""
    listing = Listing(SOURCE, vehicle.now_s, LISTED_S)
    assert vehicle.run(listing, lambda: listing.done, vehicle.now_s + LONG_S)
    if not listing.complete:
        assert vehicle.sets == []
        return None
    upload = Upload(make_plan(targets, listing.values), SOURCE, vehicle.now_s)
    assert vehicle.run(upload, lambda: upload.ending is not None, vehicle.now_s + LONG_S)
    vehicle.settle(upload, SETTLE_S)
    return upload.ending


def messages_of_an_upload():
    vehicle = Numbered(0, Reached.cut)
    assert upload_to(vehicle, TARGETS).outcome is Outcome.APPLIED
    return vehicle.carried


MESSAGES = messages_of_an_upload()
EACH = range(1, MESSAGES + 1)


def can_be_finished_and_gone_back_from(vehicle):
    """From whatever there is, another upload gets the new values, and a roll back the old."""
    vehicle.at, before = 0, copy.copy(vehicle.server)
    for targets, wanted in ((TARGETS, NEW), (OLD, OLD)):
        vehicle.server = copy.deepcopy(before)
        assert upload_to(vehicle, targets).outcome in (Outcome.APPLIED, Outcome.SAME)
        assert vehicle.flying() == flown(wanted) == flown(vehicle.values)
        assert vehicle.values["FF_MODE"] == wanted["FF_MODE"]


def test_an_upload_has_messages_to_be_cut_at():
    assert 25 < MESSAGES < 60


@pytest.mark.parametrize("at", EACH)
def test_a_link_cut_at_any_message_is_told_as_it_is_and_mended_from(at):
    vehicle = Numbered(at, Reached.cut)
    ending = upload_to(vehicle, TARGETS)
    vehicle.cut(False)
    if ending is not None:
        is_told_as_it_is(vehicle, ending, OLD, NEW)
        assert ending.outcome in (Outcome.UNVERIFIED, Outcome.APPLIED)
    can_be_finished_and_gone_back_from(vehicle)


@pytest.mark.parametrize("forgets", [False, True], ids=["keeps what is staged", "forgets what is staged"])
@pytest.mark.parametrize("at", EACH)
def test_a_vehicle_that_starts_anew_at_any_message_ends_with_all_of_the_new_set_or_of_the_old(at, forgets):
    vehicle = Numbered(at, lambda vehicle: vehicle.restart(forgets=forgets))
    ending = upload_to(vehicle, TARGETS)
    is_told_as_it_is(vehicle, ending, OLD, NEW)
    if ending.outcome is not Outcome.APPLIED:  # the commit of a set that it had just forgotten
        assert (forgets, ending.outcome) == (True, Outcome.ROLLED_BACK)
        assert ending.sentence.startswith("FF_COMMIT")
        can_be_finished_and_gone_back_from(vehicle)


@pytest.mark.parametrize("forgets", [False, True], ids=["stays on", "starts anew meanwhile"])
@pytest.mark.parametrize("at", EACH)
def test_a_ground_killed_at_any_message_leaves_what_another_finishes_or_takes_back(at, forgets):
    vehicle = Numbered(at, kill)
    with pytest.raises(GroundKilledError):
        upload_to(vehicle, TARGETS)
    vehicle.at = 0
    if forgets:
        vehicle.restart()
    listing = Listing(SOURCE, vehicle.now_s, LISTED_S)
    vehicle.settle(listing, 6.0)  # what was under way arrives; nobody of before hears the answers
    assert vehicle.flying() in (flown(OLD), flown(NEW))
    can_be_finished_and_gone_back_from(vehicle)


NAMES = [coefficient.parameter_id(veh_cfg) for veh_cfg in range(4) for coefficient in COEFFICIENTS][:39]
OLD_FORTY = dict.fromkeys(NAMES, 10.0) | {"FF_MODE": 1.0}
NEW_FORTY = {name: 11.5 + n for n, name in enumerate(NAMES)} | {"FF_MODE": 2.0}
BAD_LINK = {"loss": 0.3, "duplicate": 0.2, "delay_s": 0.2, "jitter_s": 0.2}


def uploaded(seed):
    """Outcome and duration of an upload of the forty, whose claims must be true."""
    vehicle = Reached(OLD_FORTY, seed, **BAD_LINK)
    ending = upload_to(vehicle, NEW_FORTY)
    if ending is not None:
        is_told_as_it_is(vehicle, ending, OLD_FORTY, NEW_FORTY)
    return Outcome.NOT_SENT if ending is None else ending.outcome, vehicle.now_s - SETTLE_S


def test_forty_parameters_are_all_applied_and_what_is_said_is_so():
    assert {uploaded(seed)[0] for seed in range(10)} == {Outcome.APPLIED}


@pytest.mark.soak
def test_forty_parameters_are_all_applied_in_999_of_1000_runs_and_never_said_to_be_where_they_are_not():
    runs = [uploaded(seed) for seed in range(1000)]
    times_s = [took_s for outcome, took_s in runs if outcome is Outcome.APPLIED]
    assert len(times_s) >= 999, [seed for seed, run in enumerate(runs) if run[0] is not Outcome.APPLIED]
    keep(
        "parameters_over_a_bad_link",
        f"{len(times_s)} of 1000 runs complete, none said to be that was not; mean {mean(times_s):.0f} s, "
        f"longest {max(times_s):.0f} s",
    )
