"""Forty parameters to the vehicle over a link that loses a third each way: as a whole, run by run."""

from statistics import mean

import pytest
from figures import keep
from lossy_vehicle import SOURCE, Faults, LossyVehicle, crc_of

from bridge.vehicle.coefficients import COEFFICIENTS
from gcs_plugin.params.deadline import Timing
from gcs_plugin.params.listing import Listing
from gcs_plugin.params.plan import make_plan
from gcs_plugin.params.transfer import Outcome
from gcs_plugin.params.upload import Upload

NAMES = [one.parameter_id(veh_cfg) for veh_cfg in range(4) for one in COEFFICIENTS][:39]
OLD = dict.fromkeys(NAMES, 10.0) | {"FF_MODE": 1.0}
NEW = {name: 11.5 + n for n, name in enumerate(NAMES)} | {"FF_MODE": 2.0}
BAD_LINK = {"loss": 0.3, "duplicate": 0.2, "late_s": 0.2, "delay_s": 0.2}


def uploaded(seed):
    """How reading the vehicle and an upload of the forty end, for how long they went on, and whether what is said is
    so."""
    vehicle = LossyVehicle(OLD, Faults(**BAD_LINK), seed)
    listing = Listing(SOURCE, 0.0, Timing())
    assert vehicle.run(listing, lambda: listing.done)
    if not listing.complete:
        return Outcome.NOT_SENT, vehicle.now_s, vehicle.writes == 0
    upload = Upload(make_plan(NEW, listing.values), SOURCE, vehicle.now_s, Timing(), crc_of)
    assert vehicle.run(upload, lambda: upload.ending is not None)
    took_s = vehicle.now_s
    vehicle.settle(upload)
    held = {name: vehicle.values[name] for name in OLD}
    outcome = upload.ending.outcome
    true = {Outcome.APPLIED: held == NEW, Outcome.ROLLED_BACK: held == OLD}.get(outcome, True)
    flown = {name: vehicle.flying[name] for name in NAMES}
    whole = flown in ({name: OLD[name] for name in NAMES}, {name: NEW[name] for name in NAMES})
    return outcome, took_s, true and whole


def test_forty_parameters_are_all_applied_and_what_is_said_is_so():
    for seed in range(60):
        outcome, _, true = uploaded(seed)
        assert (outcome, true) == (Outcome.APPLIED, True), seed


@pytest.mark.soak
def test_forty_parameters_are_all_applied_in_999_of_1000_runs_and_never_said_to_be_where_they_are_not():
    runs = [uploaded(seed) for seed in range(1000)]
    assert [seed for seed, (_, _, true) in enumerate(runs) if not true] == []
    times_s = [took_s for outcome, took_s, _ in runs if outcome is Outcome.APPLIED]
    assert len(times_s) >= 999, [seed for seed, run in enumerate(runs) if run[0] is not Outcome.APPLIED]
    keep(
        "parameters_over_a_bad_link",
        f"{len(times_s)} of 1000 runs complete, none said to be that was not; mean {mean(times_s):.0f} s, "
        f"longest {max(times_s):.0f} s",
    )
