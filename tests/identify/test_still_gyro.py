"""A gyro that stands all but still while the attitude turns is left out; one that reads a still vehicle stays."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from turning_vehicle import readings, table, usual

from identify.checks.readings.missing_signals import missing_signals
from identify.checks.readings.still_gyro import without_still_gyro
from identify.dive import Dive, Signal
from identify.ingest.mapping.proposal_of_runs import propose

READ = readings()
DIVE = Dive(
    "turning",
    Path("turning.tlog"),
    "0" * 64,
    attitude=Signal(READ["t"], READ["attitude"]),
    gyro=Signal(READ["t"], READ["gyro"]),
)


def with_gyro_times(dive, factor, bias_rad_s=0.0):
    return replace(dive, gyro=Signal(dive.gyro.time_s, dive.gyro.value * factor + bias_rad_s))


def test_a_gyro_that_follows_the_attitude_stays_and_nothing_is_told():
    assert without_still_gyro(DIVE) is DIVE


def test_a_gyro_of_a_ten_millionth_of_the_turning_is_left_out_and_told_whatever_its_bias():
    for bias_rad_s in (0.0, 0.02):
        left = without_still_gyro(with_gyro_times(DIVE, 1e-7, bias_rad_s))
        assert left.gyro is None
        (note,) = left.notes
        assert note.startswith(
            "The gyro's rates change by less than 0.00001 rad/s, as no gyro's do, while the attitude"
        )
        assert "they are left out" in note


def test_of_a_gyro_that_was_left_out_nothing_says_that_it_was_not_recorded():
    (of_rates,) = (
        note for note in missing_signals(without_still_gyro(with_gyro_times(DIVE, 1e-7))) if "rate" in note
    )
    assert of_rates.startswith(
        "There is no rate of turn to go by: inertias and dampings in roll, pitch and yaw are "
    )


def test_rates_in_another_unit_are_no_still_gyro():
    milli = with_gyro_times(DIVE, 1e-3)
    assert without_still_gyro(milli) is milli


def test_a_gyro_of_yaw_alone_stays():
    of_yaw = DIVE.gyro.value * [np.nan, np.nan, 1.0]
    alone = replace(DIVE, gyro=Signal(DIVE.gyro.time_s, of_yaw))
    assert without_still_gyro(alone) is alone


def test_a_simulated_vehicle_that_does_not_turn_keeps_its_gyro():
    still = replace(DIVE, attitude=Signal(READ["t"], np.tile([1.0, 0.0, 0.0, 0.0], (len(READ["t"]), 1))))
    quiet = with_gyro_times(still, 1e-9)
    assert without_still_gyro(quiet) is quiet


def test_a_map_is_proposed_without_a_still_gyro_and_says_so():
    columns = usual(READ)
    columns |= {name: 1e-7 * columns[name] for name in "pqr"}
    proposal = propose(table(columns), Path("log.csv"))
    assert proposal.columns.gyro is None
    assert proposal.columns.euler is not None
    assert any(
        note.startswith("p, q, r: not used for gyro. The gyro's rates change by") for note in proposal.notes
    )
