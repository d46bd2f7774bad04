"""An accepted diagnosis foretells the tracking error of the next dive, which then comes as foretold."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from soak import rest_in_soak

from bridge.simulator.direct import Noise, simulate_truth
from bridge.simulator.missions import rest, run, turn
from bridge.simulator.truth import load_truth
from bridge.vehicle.coefficients import AcceptedEffect
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.legs import Mission
from bridge.vehicle.mode import Mode
from identify.diagnose.result import Accepted, Hull, Value
from identify.dive import Dive, Signal
from identify.run.validate import validate
from identify.validation.against_forecast import Foretelling, Foretellings
from identify.validation.axis_criteria import Criterion
from identify.validation.forecast import Forecast, fed_by, forecast, forecast_lines, mission_in, twin_of
from identify.validation.raising import Raising

FILE = load_vehicle("ruvifist:hovering")
TRUTH = load_truth(FILE, "hovering")
HULL = ("M_u", "M_v", "I_r", "D_u", "D_v", "D_r")
FED = {name: TRUTH.model[name] for name in HULL}
BEGAN_S = 1_790_000_000.0

SHORT = Mission(
    "short",
    tuple(
        rest("start", 6.0)
        + run("ahead", 0.4, 0.0, 3.2)
        + rest("between", 3.0)
        + run("aside", 0.0, 0.3, 2.4)
        + rest("before the turn", 3.0)
        + turn("turn", 1.2, 0.2, "smooth")
        + rest("end", 6.0)
    ),
)


def weak(gain):
    """The vehicle with a first thruster that gives so much of its curve."""
    return replace(TRUTH, effects={"T1_gain": gain})


def dived(truth, fed, mode, seed, file=FILE, began_s=BEGAN_S):
    flown = simulate_truth(file, "hovering", SHORT, seed=seed, parameters=fed, mode=mode, truth=truth)
    time_s, each, read = flown.time_s, Noise().velocity_ticks, flown.column("nu_fb")
    asked = [actuation.reference for actuation in flown.actuations]
    reference = [(*r.nu, *r.nu_dot, r.heading_rad, r.depth_m) for r in asked]
    signals = {name: Signal(time_s, flown.column(name)) for name in ("tau_pid", "tau_ff", "tau_cmd")}
    flat = {name: np.full((len(time_s), 1), value) for name, value in (("mode", float(mode)), ("cfg", 1.0))}
    return Dive(
        f"{mode.word}-{seed}",
        Path("d.tlog"),
        f"{seed}",
        velocity=Signal(time_s[::each], read[::each, :3]),
        gyro=Signal(time_s, read[:, 3:]),
        attitude=Signal(time_s, flown.state[:, 3:7]),
        nu_ref=Signal(time_s, np.array(reference)),
        pwm=Signal(time_s, flown.column("pwm_us")),
        ff_mode=Signal(time_s, flat["mode"]),
        veh_cfg=Signal(time_s, flat["cfg"]),
        unix_at_boot_s=began_s,
        **signals,
    )


def accepted(values):
    return Accepted({name: Value(value, "", value, value) for name, value in values.items()}, (), ())


def fitted(truth=TRUTH):
    """The fit of a diagnosis that found all of it exactly."""
    force, moment = truth.disturbance_n, truth.disturbance_nm
    return Hull(truth.mass, truth.damping, (force,) * 3 + (moment,) * 3, truth.disturbance_time_s, (0.0,) * 6)


MENDED = {**FED, "T1_gain": 0.8}


@pytest.fixture(scope="module")
def before():
    """The feed-forward alone, which knows nothing of a weak thruster."""
    return dived(weak(0.8), FED, Mode.ALONE, seed=101)


@pytest.fixture(scope="module")
def shares():
    """The progress of what was foretold."""
    return []


@pytest.fixture(scope="module")
def foresight(before, shares):
    return forecast(accepted(MENDED), fitted(), before, FILE, "hovering", shares.append)


@pytest.fixture
def in_one_sea(monkeypatch):
    """A short mission is flown once, and not in three seas: for what no mean of three makes clearer."""
    monkeypatch.setattr("identify.validation.forecast.MOST_SEAS", 1)


def foretelling_of(foresight, dive):
    return Foretelling(
        "ruvifist", "hovering", dive.name, dive.sha256, "2026-09-21T14:13:20Z", ("weak thruster",),
        foresight.rows, foresight.credits,
    )  # fmt: skip


def just(foresight: Forecast, dive: Dive) -> Foretellings:
    """Every dive is compared with what was foretold."""
    return lambda *_: foretelling_of(foresight, dive)


@pytest.mark.parametrize("mode", rest_in_soak([Mode.ALONE, Mode.BOTH]))
def test_the_next_dive_comes_as_foretold_within_a_third_and_is_a_go(before, foresight, mode):
    after = dived(weak(0.8), MENDED, mode, seed=202, began_s=BEGAN_S + 600)
    (run,) = validate([after], FILE, just(foresight, before)).runs
    assert [held.foretold.axis for held in run.held] == ["surge", "sway", "yaw"]
    for held in run.held:
        assert held.flown == pytest.approx(held.foretold.after, rel=1 / 3)
        assert held.kept
    assert run.raising.go
    assert "thruster 1 made up for" in [criterion.quantity for criterion in run.raising.criteria]


def test_it_is_told_from_how_much_the_error_falls_in_words_and_figures(foresight):
    alone = {row.axis: row for row in foresight.rows if row.mode == "ff"}
    assert alone["surge"].before > 2 * alone["surge"].after
    assert alone["yaw"].before > 4 * alone["yaw"].after
    assert {row.flown for row in foresight.rows} == {"ff"}
    both, ff = forecast_lines(foresight)
    assert both.startswith("foretold for the next dive in both, rms over the whole mission: surge 1")
    assert " (ff) -> " in both
    assert " mm/s, yaw " in ff
    assert ff.endswith(" deg/s")
    assert foresight.why == ()


@pytest.mark.usefixtures("foresight")
def test_its_progress_runs_through_all_missions_that_are_flown(shares):
    assert shares == sorted(shares)
    assert (shares[0], len(set(shares))) == (0.0, len(shares))
    assert {0.0, 1 / 3, 2 / 3} <= set(shares)


def test_unmended_or_made_up_for_twice_it_is_no_go(before, foresight):
    unmended = dived(weak(0.8), FED, Mode.ALONE, seed=303, began_s=BEGAN_S + 600)
    twice = dived(TRUTH, MENDED, Mode.BOTH, seed=404, file=on_board(0.8), began_s=BEGAN_S + 600)
    first, second = validate([unmended, twice], FILE, just(foresight, before)).runs
    assert first.held == ()  # the accepted values were not in force
    assert not first.raising.go
    assert "thruster 1 made up for too little" in first.raising.sentence
    assert not second.raising.go
    assert "yaw not as foretold, thruster 1 made up for twice" in second.raising.sentence
    assert [held.kept for held in second.held if held.foretold.axis == "yaw"] == [False]


def on_board(gain):
    """A vehicle whose own file makes up for its first thruster."""
    shape = FILE.vehicle.configurations["hovering"]
    thrusters = (replace(shape.thrusters[0], gain=gain), *shape.thrusters[1:])
    shapes = {**FILE.vehicle.configurations, "hovering": replace(shape, thrusters=thrusters)}
    return replace(FILE, vehicle=replace(FILE.vehicle, configurations=shapes))


def of_thruster(raising: Raising) -> Criterion:
    (criterion,) = (each for each in raising.criteria if each.quantity.startswith("thruster 1"))
    return criterion


@pytest.mark.parametrize("mode", [Mode.SHADOW, Mode.BOTH])
def test_a_thruster_that_is_no_longer_weak_is_no_go_before_and_after_the_feed_forward_acts_and_the_way_out_is_named(
    before, foresight, mode
):
    repaired = dived(TRUTH, MENDED, mode, seed=505, began_s=BEGAN_S + 600)
    (run,) = validate([repaired], FILE, just(foresight, before)).runs
    criterion = of_thruster(run.raising)
    assert criterion.quantity == "thruster 1 changed since it was diagnosed"
    will = "will be " if mode is Mode.SHADOW else ""
    assert criterion.words.startswith(f"{will}asked as if it gave 80 % of its curve; in this dive it gave ")
    assert not run.raising.go
    assert (
        "oll back what was accepted (seatrial params rollback), or diagnose this dive" in run.raising.sentence
    )


def test_in_shadow_a_go_rests_on_what_the_thruster_gives(before, foresight):
    still_weak = dived(weak(0.8), MENDED, Mode.SHADOW, seed=606, began_s=BEGAN_S + 600)
    untold = replace(still_weak, pwm=None)
    known, unknown = validate([still_weak, untold], FILE, just(foresight, before)).runs
    assert known.raising.go, known.raising.sentence
    assert of_thruster(known.raising).quantity == "thruster 1 made up for"
    assert not unknown.raising.go
    assert of_thruster(unknown.raising).quantity == "thruster 1 not known in shadow"


def test_in_shadow_a_gain_that_the_vehicle_has_by_itself_is_seen_to_act_twice_once_it_is_raised(
    before, foresight
):
    by_itself = dived(TRUTH, MENDED, Mode.SHADOW, seed=707, file=on_board(0.8), began_s=BEGAN_S + 600)
    (run,) = validate([by_itself], FILE, just(foresight, before)).runs
    assert of_thruster(run.raising).quantity == "thruster 1 made up for twice"
    assert not run.raising.go


def test_a_thruster_as_weak_as_both_gains_together_make_up_for_is_made_up_for_once(before, foresight):
    weaker = dived(weak(0.8), MENDED, Mode.BOTH, seed=808, file=on_board(0.8), began_s=BEGAN_S + 600)
    (run,) = validate([weaker], FILE, just(foresight, before)).runs
    assert of_thruster(run.raising).quantity == "thruster 1 made up for"
    assert of_thruster(run.raising).words.startswith("asked as if it gave 64 % of its curve; in this dive it")
    assert run.raising.go, run.raising.sentence


def test_a_dive_before_the_diagnosed_one_and_that_one_itself_are_not_held_against_it(before, foresight):
    earlier = dived(weak(0.8), FED, Mode.ALONE, seed=303, began_s=BEGAN_S - 600)
    runs = validate([earlier, before], FILE, just(foresight, before)).runs
    assert [run.held for run in runs] == [(), ()]
    assert not any("thruster 1" in c.quantity for run in runs for c in run.raising.criteria)


@pytest.mark.usefixtures("in_one_sea")
def test_a_model_that_does_not_fly_as_the_dive_did_foretells_nothing(before):
    heavy = {**MENDED, "M_u": 200.0, "D_u": 20.0}
    foretelling = forecast(
        accepted(heavy), replace(fitted(), disturbance=(9.0,) * 6), before, FILE, "hovering"
    )
    assert "surge" not in {row.axis for row in foretelling.rows}
    assert any(
        why.startswith("How the next dive tracks in surge is not foretold: the model errs by")
        for why in foretelling.why
    )


def test_an_effect_that_can_t_be_flown_is_named_and_nothing_foretold(before):
    coupled = replace(
        accepted(MENDED), effects=(AcceptedEffect("coupled_damping", "coupled damping", {"Y_r": 2.0}),)
    )
    foretelling = forecast(coupled, fitted(), before, FILE, "hovering")
    assert foretelling.rows == ()
    assert foretelling.why == (
        "How the next dive tracks is not foretold: the simulated vehicle has no coupled damping.",
    )


def test_a_vehicle_that_makes_up_for_it_by_itself_is_told_and_nothing_foretold():
    dive = dived(TRUTH, {}, Mode.OFF, seed=7, file=on_board(0.8))
    foretelling = forecast(accepted(MENDED), fitted(), dive, FILE, "hovering")
    assert foretelling.rows == ()
    (credit,) = foretelling.credits
    assert (credit.assumed, credit.found, credit.acting) == (1.0, 0.8, False)
    assert credit.allocated == pytest.approx(0.8, abs=1e-3)
    assert "as if it gave 80 % of its curve already, by itself" in forecast_lines(foretelling)[0]


@pytest.mark.usefixtures("in_one_sea")
def test_a_dive_that_flew_with_the_accepted_gain_says_that_it_was_accepted_before():
    dive = dived(weak(0.8), MENDED, Mode.BOTH, seed=8)
    assert fed_by(dive, FILE, "hovering") == pytest.approx(MENDED, rel=2e-3)
    foretelling = forecast(accepted(MENDED), fitted(), dive, FILE, "hovering")
    assert [row.before for row in foretelling.rows if row.mode == "both"] == pytest.approx(
        [row.after for row in foretelling.rows if row.mode == "both"], rel=1 / 3
    )
    assert any("it was accepted before" in line for line in forecast_lines(foretelling))


@pytest.mark.usefixtures("in_one_sea")
def test_a_gain_that_is_accepted_no_longer_is_foretold_to_be_taken_back():
    """A thruster was repaired, and still made up for in this dive."""
    dive = dived(TRUTH, MENDED, Mode.BOTH, seed=10)
    repaired = replace(
        accepted(FED),
        effects=(AcceptedEffect("weak_thruster", "weak_thruster of thruster 1", {"gain": 1.0}, 1),),
    )
    assert repaired.taken_back == {"T1_gain"}
    (yaw,) = (
        row
        for row in forecast(repaired, fitted(), dive, FILE, "hovering").rows
        if (row.axis, row.mode) == ("yaw", "both")
    )
    assert yaw.after < yaw.before / 2


def test_the_twin_of_a_hull_with_quadratic_drag_alone_is_braked_by_that_and_by_an_accepted_value_of_it():
    hull = replace(fitted(), damping=(1e-9,) * 6, quadratic=(40.0, 60.0, 80.0, 1.0, 2.0, 3.0))
    assert twin_of(hull, {}).quadratic == hull.quadratic
    assert max(twin_of(hull, {}).damping) < 1e-6
    assert twin_of(hull, {"X_uu": 50.0}).quadratic == (50.0, *hull.quadratic[1:])


def test_the_reference_is_flown_as_it_was_recorded(before):
    mission = mission_in(before)
    at_s = float(mission.time_s[0])
    for since_s in (0.0, 7.3, 20.0, 31.12):
        wanted, again = SHORT.reference(at_s + since_s), mission.reference(since_s)
        assert again.nu == pytest.approx(wanted.nu, abs=2e-4)
        assert again.heading_rad == pytest.approx(wanted.heading_rad, abs=1e-3)
        assert again.depth_m == pytest.approx(wanted.depth_m)
    turned = before.nu_ref.value.copy()
    turned[:, 12] = np.remainder(turned[:, 12] + 3.0 + np.pi, 2 * np.pi) - np.pi
    wrapped = mission_in(replace(before, nu_ref=Signal(before.nu_ref.time_s, turned)))
    assert np.ptp(wrapped.value[:, 12]) == pytest.approx(1.2, abs=0.01)


def test_a_dive_without_a_mission_or_a_mode_foretells_nothing_and_says_why(before):
    for lacking, why in (("nu_ref", "has no reference"), ("ff_mode", "tells no FF_MODE")):
        foretelling = forecast(
            accepted(MENDED), fitted(), replace(before, **{lacking: None}), FILE, "hovering"
        )
        assert foretelling.rows == ()
        assert why in foretelling.why[0]
