"""Forces that a fit's model lacks are doubted axis by axis, and those that it has are not."""

from dataclasses import replace

import closed_loop
import network_tasks
import numpy as np
import pytest
from soak import rest_in_soak, rows_rest_in_soak

from identify.challenge.case import dive_of, draw_case
from identify.checks.fit.missing_forces import lacking_doubts, missing_forces_words
from identify.dive import Signal
from identify.doubt import Culprit, Outcome
from identify.estimators.axes.build import build_axes
from identify.estimators.axes.motion import Motion
from identify.estimators.likelihood.answer import estimate
from identify.estimators.likelihood.axis import DAMPING
from identify.estimators.likelihood.fit import fit_axes
from identify.estimators.likelihood.scoring import climb
from identify.estimators.missing_forces.drag_and_timing import Force, doubts_of, with_forces
from identify.estimators.missing_forces.forms import Forms, Kind
from identify.estimators.missing_forces.screening import Lack, in_standard_errors, lacks_of, screen_of
from identify.estimators.missing_forces.spectral_peak import peak_of

FILE = closed_loop.vehicle_file()
SURGE, SWAY, YAW = 0, 1, 5
TELLING = "holds a force that the model lacks"
SECONDS, PERIOD_S = 200.0, 3.5


def heading(time_s):
    """It swings 1.5 rad to both sides, and not as the steps in speed."""
    return 1.5 * np.sin(2 * np.pi * time_s / 57.0)


def north(time_s, _):
    return 4.0 * np.cos(heading(time_s))


def weak_astern(_, thrust_n):
    return -0.3 * min(thrust_n, 0.0)


def fading(time_s, thrust_n):
    return -0.4 * thrust_n * time_s / SECONDS


def waves(time_s, _):
    return 3.0 * np.sin(2 * np.pi * time_s / PERIOD_S)


def dived(push=closed_loop.no_push, seed=0):
    return closed_loop.dive(np.random.default_rng(seed), SECONDS, push=push, heading=heading)


def with_the_steps(time_s):
    return 0.8 * np.sin(2 * np.pi * time_s / 40.0) + 0.8 * np.sin(2 * np.pi * time_s / 57.0)


def spoilt(seed):
    """A dive with a pull to the east that turns with the steps in speed, so that it is much like a drag."""
    return closed_loop.dive(
        np.random.default_rng(seed),
        SECONDS,
        push=lambda time_s, _: 6.0 * np.sin(with_the_steps(time_s)),
        heading=with_the_steps,
    )


def fitted(dive):
    built = build_axes(dive, FILE, "only")
    return built, fit_axes(built, FILE.vehicle.configurations["only"], network_tasks.quiet)


def identified(dive):
    return estimate(dive, FILE, "only", network_tasks.quiet)


def lacks(dive, spoilt=()):
    built, fit = fitted(dive)
    return lacks_of(fit.joint, fit.theta, built, dive, spoilt, doubts_of(fit.joint, fit.theta))


@pytest.mark.parametrize(
    ("push", "kind", "words", "culprit"),
    [
        (north, Kind.WORLD, "a current's or a tether's", Culprit.RECORDING),
        (weak_astern, Kind.THRUST, "astern", Culprit.MODEL),
        (fading, Kind.THRUST, "later in the dive", Culprit.MODEL),
        (waves, Kind.SWING, "every 3.5 s", Culprit.RECORDING),
    ],
)
def test_a_force_that_the_model_lacks_is_doubted_by_its_kind_and_sends_to_diagnose(
    push, kind, words, culprit
):
    dive = dived(push)
    (lack,) = lacks(dive)
    assert (lack.dof, lack.kind) == (SURGE, kind)
    answer = identified(dive)
    (doubt,) = [doubt for doubt in answer.doubts if TELLING in doubt.problem]
    assert doubt.problem.startswith("In surge the recording")
    assert words in doubt.problem
    assert f"({lack.score:.0f} standard errors)" in doubt.problem
    assert "seatrial diagnose" in doubt.remedy
    assert doubt.about == ("M_u", "D_u")
    assert (doubt.culprit, doubt.outcome) == (culprit, Outcome.DISAGREES)


def test_thrust_that_differs_by_less_than_a_curve_is_known_to_is_not_doubted(monkeypatch):
    quiet = closed_loop.dive(
        np.random.default_rng(0),
        SECONDS,
        noise=3e-4,
        disturbance=0.02,
        push=lambda _, thrust_n: -0.01 * min(thrust_n, 0.0),
        heading=heading,
    )
    assert lacks(quiet) == ()
    monkeypatch.setattr("identify.estimators.missing_forces.screening.LEAST_FORCE", 0.0)
    assert [lack.kind for lack in lacks(quiet)] == [Kind.THRUST]


def test_a_dvl_that_reads_the_turning_as_speed_is_doubted():
    dive = dived()
    time_s = dive.velocity.time_s
    rates = np.outer(0.4 * np.sign(np.sin(2 * np.pi * time_s / 13.0)), [0.0, 0.0, 1.0])
    value = dive.velocity.value + 0.1 * rates[:, ::-1]
    turned = replace(dive, velocity=Signal(time_s, value), gyro=Signal(time_s, rates))
    assert [lack.kind for lack in lacks(turned) if lack.dof == SURGE] == [Kind.TURNING]


@pytest.mark.parametrize(
    ("names", "kinds"), rows_rest_in_soak([(["weak_thruster"], {Kind.ACROSS}), ([], set())])
)
def test_a_weak_thruster_that_drives_several_axes_is_doubted_in_each(names, kinds):
    case = draw_case(320_000, names=names)
    dive = dive_of(case)
    built = build_axes(dive, case.file, case.configuration)
    fit = fit_axes(built, case.file.vehicle.configurations[case.configuration], network_tasks.quiet)
    lacking = lacks_of(fit.joint, fit.theta, built, dive, (), doubts_of(fit.joint, fit.theta))
    assert {lack.kind for lack in lacking} == kinds
    assert {lack.dof for lack in lacking} == ({SURGE, SWAY, YAW} if names else set())
    for doubt in lacking_doubts(lacking, "linear"):
        assert "goes with other axes' thrust, as where a thruster that drives both is weak" in doubt.problem
        assert "masses and dampings there and in those axes are off" in doubt.remedy
        assert doubt.culprit is Culprit.MODEL


@pytest.mark.parametrize("count", rest_in_soak([10, 30]))
def test_of_dives_that_lack_nothing_none_is_doubted(count):
    assert [lacks(dived(seed=seed)) for seed in range(count)] == [()] * count


def test_a_force_that_turns_with_the_steps_spoils_the_damping_and_its_interval_holds_the_truth(monkeypatch):
    dives = [spoilt(seed) for seed in range(6)]
    widened = [identified(dive)["D_u"] for dive in dives]
    monkeypatch.setattr("identify.estimators.answer.lacks_of", lambda *_: ())
    narrow = [identified(dive)["D_u"] for dive in dives]
    truth = closed_loop.DAMPING
    assert [each.low95 < truth < each.high95 for each in narrow] == [False] * 6
    assert [each.low95 < truth < each.high95 for each in widened] == [True] * 6
    assert [each.value for each in widened] == [each.value for each in narrow]


def test_a_step_of_scoring_goes_the_way_of_the_fit_with_the_force_and_no_less_far():
    dive = spoilt(0)
    built, fit = fitted(dive)
    (lack,) = lacks_of(fit.joint, fit.theta, built, dive, (), doubts_of(fit.joint, fit.theta))
    wider = with_forces(fit.joint, fit.theta, [Force(SURGE, lack.shape)])
    change, looser = wider.included()
    before = climb(fit.joint, fit.theta)
    after = climb(wider.problem, wider.start)
    std = np.sqrt(np.diag(np.linalg.inv(before.precision)))
    with_force = np.sqrt(
        np.diag(np.linalg.inv(wider.problem.score(wider.start)[1] + np.diag(wider.problem.prior_precision)))
    )
    assert looser == pytest.approx(np.maximum(with_force[wider.kept] / std, 1.0), rel=0.05)
    assert looser[DAMPING] > 1.1
    moved = (after.theta[wider.kept] - before.theta)[DAMPING]
    assert moved > std[DAMPING]
    assert moved < change[DAMPING] < 3.0 * moved


def test_a_recording_of_another_vehicle_and_an_axis_with_hidden_readings_are_not_tested():
    dive = dived(north)
    built, fit = fitted(dive)
    tests = doubts_of(fit.joint, fit.theta)
    assert lacks(dive)
    assert lacks(dive, spoilt=(SURGE,)) == ()
    assert lacks_of(fit.joint, fit.theta, replace(built, strange="another"), dive, (), tests) == ()


def test_where_another_doubt_is_clearer_it_explains_the_force():
    dive = dived(north)
    built, fit = fitted(dive)
    tests = doubts_of(fit.joint, fit.theta)
    (lack,) = lacks_of(fit.joint, fit.theta, built, dive, (), tests)
    late = replace(tests[SURGE].late, score=-lack.score - 0.1)
    clearer = {SURGE: replace(tests[SURGE], late=late)}
    assert lacks_of(fit.joint, fit.theta, built, dive, (), clearer) == ()


def test_the_answer_to_a_force_is_the_change_of_the_predictions_by_it():
    _, fit = fitted(dived())
    problem = fit.joint.at(fit.theta)[0]
    theta = fit.theta[fit.joint.slices[0]]
    screen = screen_of(problem, theta)
    shapes = np.random.default_rng(1).normal(size=(len(problem.reading), 2))
    pushed = replace(problem, axis=replace(problem.axis, force=problem.axis.force + shapes[:, :1]))
    error, variance = pushed.filtered(theta, np.inf)
    change = screen.white - (error / np.sqrt(variance))[screen.read]
    assert screen.responses(shapes)[:, 0] == pytest.approx(change, abs=1e-9)


@pytest.mark.parametrize("course", [0.0, 0.7, -2.0])
def test_the_way_back_to_the_start_is_as_long_as_the_way_from_there_on_any_course(course):
    dive = closed_loop.dive(np.random.default_rng(0), 60.0, heading=lambda time_s: course + 0 * time_s)
    built, fit = fitted(dive)
    time_s, nu = built.motion.time_s, 0 * built.motion.nu
    nu[:, SURGE] = 0.5
    axis = fit.joint.problems[0].axis
    north, east, back = (
        Forms(replace(built, motion=Motion(time_s, nu)), dive).of(fit.joint.problems[0])[Kind.WORLD].T
    )
    assert north == pytest.approx(np.cos(course))
    assert east == pytest.approx(np.sin(course))
    way = 0.5 * (axis.time_s - 0.5 * axis.step_s - time_s[0])
    # The way is summed at steps of 0.1 s.
    assert back == pytest.approx(-way, abs=0.5 * 0.1 + 1e-9)


def test_a_force_that_the_fit_chooses_itself_is_never_lacking():
    _, fit = fitted(dived(north))
    problem, theta = fit.joint.at(fit.theta)[0], fit.theta[fit.joint.slices[0]]
    (test,) = screen_of(problem, theta).tested({Kind.WORLD: np.ones((len(problem.reading), 1))})
    assert test.score == 0.0


@pytest.mark.parametrize("degrees", [1, 2, 6])
def test_the_chance_of_a_statistic_is_at_most_that_of_its_standard_errors(degrees):
    from scipy.stats import chi2

    assert in_standard_errors(degrees, degrees) == 0.0
    for statistic in (degrees + 1.0, 30.0, 300.0):
        score = in_standard_errors(statistic, degrees)
        assert chi2.logsf(statistic, degrees) <= -0.5 * score**2
    assert in_standard_errors(1e4, degrees) == pytest.approx(100.0, rel=0.01)


def test_a_swing_in_white_noise_has_its_period_and_white_noise_has_none():
    time_s = np.arange(3000) / 10.0
    noise = np.random.default_rng(2).normal(size=(200, len(time_s)))
    peak = peak_of(time_s, noise[0] + 0.4 * np.sin(2 * np.pi * time_s / PERIOD_S))
    assert peak.score > 8.0
    assert peak.period_s == pytest.approx(PERIOD_S, rel=PERIOD_S / 300.0)
    # exp(-2.5^2 / 2) of 200 are 9.
    assert sum(peak_of(time_s, white).score > 2.5 for white in noise) <= 15
    assert peak_of(time_s[:150], noise[0, :150]).score == 0.0


def test_a_swing_has_its_period_though_the_readings_pause():
    """The DVL loses the bottom for a third of the dive: its readings stand in two halves."""
    whole_s = np.arange(3000) / 10.0
    time_s = whole_s[(whole_s < 90.0) | (whole_s > 190.0)]
    noise = np.random.default_rng(2).normal(size=len(time_s))
    peak = peak_of(time_s, noise + 0.4 * np.sin(2 * np.pi * time_s / PERIOD_S))
    assert peak.score > 8.0
    assert peak.period_s == pytest.approx(PERIOD_S, rel=PERIOD_S / 300.0)


def test_axes_of_a_kind_share_a_doubt_and_quadratic_damping_is_doubted_where_it_is_fitted():
    shape = np.zeros(3)
    lacking = [
        Lack(YAW, Kind.THRUST, 9.4, shape),
        Lack(SURGE, Kind.WORLD, 8.0, shape),
        Lack(2, Kind.THRUST, 6.0, shape),
    ]
    thrust, world = lacking_doubts(lacking, "both")
    assert thrust.about == ("M_w", "I_r", "D_w", "D_r", "Z_ww", "N_rr")
    assert thrust.problem.startswith("In heave and yaw")
    assert "(9 standard errors)" in thrust.problem
    assert world.about == ("M_u", "D_u", "X_uu")
    assert lacking_doubts(lacking[1:2], "linear")[0].about == ("M_u", "D_u")
    assert lacking_doubts(lacking[1:2], "quadratic")[0].about == ("M_u", "X_uu")
    assert lacking_doubts((), "both") == ()


def test_a_force_that_is_known_by_its_kind_alone_is_named_where_it_moves_a_coefficient():
    others = [Lack(2, Kind.THRUST, 8.0, np.zeros(0)), Lack(0, Kind.THRUST, 7.0, np.zeros(0))]
    assert missing_forces_words((), (), others) == "a force in surge and heave which goes with the thrust"
    assert missing_forces_words((), (YAW,), others[:1]).startswith(
        "thrust at another time in yaw and a force in heave"
    )
