"""What a dive can identify, and how long it counts as, before any fit."""

import math
from dataclasses import replace

import closed_loop
import numpy as np
import pytest
from soak import rows_rest_in_soak

from bridge.errors import FitError
from bridge.vehicle.coefficients import COEFFICIENTS
from bridge.vehicle.config import load_vehicle
from identify.challenge.case import dive_of, draw_case
from identify.dive import Dive, Signal
from identify.estimators.excitation import excitation, spans
from identify.estimators.refusals import common_s, lasting, too_short
from identify.estimators.table import METHODS, estimator
from identify.statistics import Z95

FILE = closed_loop.vehicle_file()
HEAVY = load_vehicle("bluerov2_heavy")
PROMPT = replace(
    HEAVY, vehicle=replace(HEAVY.vehicle, thrust_curve=replace(HEAVY.vehicle.thrust_curve, lag_s=0.0))
)
NAMES = [c.name for c in COEFFICIENTS]


@pytest.fixture(scope="module")
def dive():
    return closed_loop.dive(np.random.default_rng(100_003))


def foretold_stds(dive, file=FILE, configuration="only"):
    return {
        coefficient.name: coefficient.relative_std
        for coefficient in excitation(dive, file, configuration).coefficients
    }


def fitted_stds(dive, file=FILE, configuration="only"):
    """By name, the standard error that the wider half of the fit's interval has; inf where it refuses."""
    fit = estimator("likelihood")(dive, file, configuration, lambda *_: None)
    return {
        name: math.log(max(parameter.high95 / parameter.value, parameter.value / parameter.low95)) / Z95
        if (parameter := fit[name]).identifiable
        else math.inf
        for name in NAMES
    }


def agree(foretold, fitted, names=NAMES):
    """Those of `names` that are foretold to within a third of what is found, either way; both may say not at all."""
    return [
        name
        for name in names
        if foretold[name] == pytest.approx(fitted[name], rel=0.35)
        or (foretold[name] > 0.3 and fitted[name] > 0.3)
    ]


PUSHED = [name for name in NAMES if not name.endswith(("_p", "_q"))]


@pytest.mark.parametrize(
    ("seed", "names", "seconds"),
    rows_rest_in_soak([(300_103, ["quadratic_drag"], 200.0), (300_101, [], 150.0)]),
)
def test_it_foretells_what_the_fit_says_of_vehicles_of_which_only_the_weight_is_known(seed, names, seconds):
    case = draw_case(seed, names=names, seconds=seconds)
    drawn = dive_of(case), case.file, case.configuration
    foretold = foretold_stds(*drawn)
    assert agree(foretold, fitted_stds(*drawn), PUSHED) == PUSHED
    # No thruster pushed there: that it rights itself is all that would tell.
    assert {foretold[name] for name in set(NAMES) - set(PUSHED)} == {math.inf}


def test_it_foretells_the_standard_errors_of_the_likelihood(dive):
    foretold, fitted = foretold_stds(dive), fitted_stds(dive)
    for name in ("M_u", "D_u"):
        assert foretold[name] == pytest.approx(fitted[name], rel=0.15)


def test_a_drag_that_the_model_lacks_is_foretold_as_what_the_fit_will_widen_by():
    curved = closed_loop.dive(np.random.default_rng(100_009), quadratic=20.0)
    foretold, fitted = foretold_stds(curved), fitted_stds(curved)
    assert fitted["D_u"] > 10 * fitted_stds(closed_loop.dive(np.random.default_rng(100_009)))["D_u"]
    assert agree(foretold, fitted, ["M_u", "D_u"]) == ["M_u", "D_u"]


def test_thrust_that_stays_the_same_identifies_nothing(dive):
    held = np.zeros_like(dive.tau_cmd.value)
    held[:, 0] = 5.0
    still = replace(dive, tau_cmd=Signal(dive.tau_cmd.time_s, held))
    assert not any(coefficient.identifiable for coefficient in excitation(still, FILE, "only").coefficients)


def test_a_dive_twice_as_long_tells_root_two_more():
    short, long = (closed_loop.dive(np.random.default_rng(100_004), seconds=s) for s in (200.0, 400.0))
    assert foretold_stds(short)["M_u"] / foretold_stds(long)["M_u"] == pytest.approx(math.sqrt(2), rel=0.15)


def test_a_dive_without_commands_without_readings_or_too_short_says_why(dive):
    for less, why in (
        (replace(dive, tau_cmd=None), "neither thruster commands"),
        (replace(dive, velocity=None), "no axis has thrust and readings of motion together for 20 s"),
        (dive.between(0.0, 15.0), "the dive lasts 15 s, but identification needs at least 20 s"),
    ):
        answer = excitation(less, FILE, "only")
        assert why in answer.note
        assert not any(coefficient.identifiable for coefficient in answer.coefficients)


FINER = 10


def rolling(push_nm):
    """Five minutes in which a vehicle is pushed in roll from one side to the other, and rights itself."""
    rng, step_s, mass, damping = np.random.default_rng(100_005), 0.02, 0.45, 0.4
    shape = PROMPT.vehicle.configurations["heavy"]
    stiffness = shape.centre_of_gravity_below_buoyancy_m * shape.dry_mass_kg * 9.80665
    time_s = np.arange(0.0, 300.0, step_s)
    push = push_nm * np.sign(np.sin(2 * np.pi * time_s / 12.0))
    rate, angle, off = np.zeros((3, len(time_s)))
    fine_s, keep = step_s / FINER, math.exp(-step_s / 1.5)
    for k in range(len(time_s) - 1):
        off[k + 1] = keep * off[k] + 0.01 * math.sqrt(1 - keep**2) * rng.normal()
        p, phi = rate[k], angle[k]
        for _ in range(FINER):
            p += fine_s * (push[k] + off[k] - damping * p - stiffness * phi) / mass
            phi += fine_s * p
        rate[k + 1], angle[k + 1] = p, phi
    gyro = np.zeros((len(time_s), 3))
    gyro[:, 0] = rate + 0.0012 * rng.normal(size=len(rate))
    read = angle + 0.0003 * rng.normal(size=len(angle))
    still = np.zeros(len(time_s))
    attitude = np.column_stack([np.cos(read / 2), np.sin(read / 2), still, still])
    wrench = np.zeros((len(time_s), 6))
    wrench[:, 3] = push
    return Dive(
        "rolling",
        FILE.path,
        "1" * 64,
        gyro=Signal(time_s, gyro),
        attitude=Signal(time_s, attitude),
        tau_cmd=Signal(time_s, wrench),
    )


def test_roll_is_promised_where_thrusters_push_it_and_not_where_it_only_rights_itself():
    dive = rolling(0.1)
    pushed, fitted = (of(dive, PROMPT, "heavy") for of in (foretold_stds, fitted_stds))
    assert agree(pushed, fitted, ["I_p", "D_p"]) == ["I_p", "D_p"]
    assert pushed["I_p"] < 0.1
    assert not any(
        coefficient.identifiable for coefficient in excitation(rolling(0.0), PROMPT, "heavy").coefficients
    )


def test_all_twelve_are_told_in_their_order_with_null_for_what_is_not_known(dive):
    data = excitation(dive, FILE, "only").to_json()
    assert [coefficient["name"] for coefficient in data["coefficients"]] == NAMES
    assert [coefficient["name"] for coefficient in data["coefficients"] if coefficient["identifiable"]] == [
        "M_u",
        "D_u",
    ]
    assert data["coefficients"][1] == {"name": "M_v", "relative_std": None, "identifiable": False}
    assert data["coefficients"][0]["identifiable"] is True


def test_spans_are_seconds_thrust_and_speed_of_each_axis(dive):
    surge, sway, *_, yaw = spans(dive)
    assert surge.seconds == pytest.approx(300.0, abs=0.5)
    assert surge.speed == pytest.approx(0.8, abs=0.15)
    assert surge.thrust == pytest.approx(np.ptp(np.percentile(dive.tau_cmd.value[:, 0], (1, 99))))
    assert sway.thrust == 0.0
    assert (yaw.seconds, math.isnan(yaw.speed)) == (0.0, True)


def test_spans_take_thrust_from_the_thrusters_where_no_wrench_is_recorded(dive):
    time_s = dive.velocity.time_s
    pwm = np.where((time_s // 10) % 2, 1600.0, 1400.0)[:, None]
    with_pwm = replace(dive, tau_cmd=None, pwm=Signal(time_s, pwm))
    assert math.isnan(spans(with_pwm)[0].thrust)
    assert spans(with_pwm, FILE, "only")[0].thrust > 5.0


VOLTAGE = Signal(np.array([0.0, 417.0]), np.full((2, 1), 16.0))


def moving_dive(seconds=30.0):
    return replace(closed_loop.dive(np.random.default_rng(7), seconds=seconds), voltage=VOLTAGE)


@pytest.mark.parametrize("method", METHODS)
def test_a_battery_that_goes_on_makes_a_short_dive_no_longer(method):
    with pytest.raises(
        FitError, match=r"are both in it for 15 s of 417 s, but identification needs at least 20 s"
    ):
        estimator(method)(moving_dive(15.0), closed_loop.vehicle_file(), "only", lambda *_: None)


def test_commands_and_velocity_that_hardly_meet_are_a_short_dive():
    whole = moving_dive(60.0)
    parted = replace(
        whole,
        velocity=whole.velocity.between(0.0, 35.0),
        gyro=None,
        tau_cmd=whole.tau_cmd.between(25.0, 60.0),
    )
    assert common_s(parted, 0) == pytest.approx(9.9)
    with pytest.raises(FitError, match="are both in it for 10 s"):
        lasting(parted)


def test_twenty_seconds_to_the_nearest_are_enough():
    bare = replace(moving_dive(20.0), voltage=None)
    assert 19.5 < bare.duration_s < 20.0
    lasting(bare)
    assert too_short(moving_dive(20.0), 0) == ""


def test_an_axis_that_was_read_for_a_shorter_time_than_the_others_is_left_out_alone():
    whole = moving_dive(60.0)
    time_s = whole.velocity.time_s
    spoilt = np.where((time_s < 15.0)[:, None], whole.velocity.value, np.nan)
    gyro = Signal(time_s, np.random.default_rng(8).normal(size=(len(time_s), 3)))
    parted = replace(whole, velocity=Signal(time_s, spoilt), gyro=gyro)
    lasting(parted)
    assert too_short(parted, 0) == (
        "thruster commands and the velocity in surge were both recorded for 15 s, but at least 20 s are needed"
    )
    assert too_short(parted, 5) == ""
    answer = estimator("likelihood")(parted, closed_loop.vehicle_file(), "only", lambda *_: None)
    assert answer["M_u"].reason == too_short(parted, 0)
