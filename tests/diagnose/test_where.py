"""Where a gap lies, and where it lies if the log lacks what the controller used."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from fakes.planted import damped, diagnosed, planted_nominal

from bridge.vehicle.coefficients import DOFS
from identify.challenge.case import dive_of, draw_case
from identify.checks.actuation.controller import unrecorded
from identify.diagnose import diagnose as module
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.causes.weighing import weighing_of
from identify.diagnose.filters.nominal import nominal_of
from identify.diagnose.gap import missing as missing_module
from identify.diagnose.gap.drift import Drift
from identify.diagnose.gap.missing import (
    PHASES,
    Missing,
    beyond_refit,
    character_of,
    depends_on,
    disturbance_of,
    drowned,
    hull_of,
    missing_of,
    phases_of,
    phases_of_motion,
    power_of_drift,
    power_of_generic,
    power_of_remainder,
    shares_of,
    slices_of,
    with_unexplained,
)
from identify.diagnose.gap.simulation import EACH, missing_wrench_of, simulation_of, slope_of
from identify.diagnose.notes import outliers_note
from identify.diagnose.remainder.unexplained import GenericForce, Unexplained, unexplained_of
from identify.diagnose.result import Disturbance
from identify.diagnose.unjudged import unjudged_notes
from identify.effects.hydrodynamics import COUPLED_DAMPING, QUADRATIC_DRAG
from identify.estimators.likelihood.axis import DAMPING, DISTURBANCE, TIME_CONSTANT


def lacking(nominal, cause):
    """What the nominal model lacks beside one with the cause in its forces."""
    nu = nominal.motion.nu
    before = simulation_of(nominal, nominal.theta, nu)
    after = simulation_of(
        nominal,
        nominal.theta,
        nu,
        missing_wrench_of([cause], nominal.course),
        slope_of([cause], nominal.course),
    )
    return missing_of(before, after, np.zeros_like(after.nu), np.zeros((len(after.nu), 3)), nominal)


def test_a_drag_in_surge_lies_in_surge_and_goes_with_the_speed(nominal):
    cause = Cause(QUADRATIC_DRAG, np.array([30.0, 0, 0, 0, 0, 0]))
    missing = lacking(nominal, cause)
    np.testing.assert_allclose(missing.wrench, cause.act(nominal.course).wrench[::EACH], atol=1e-9)
    shares = shares_of(missing.power, phases_of(nominal.course, EACH))
    assert {share.dof for share in shares} == {"surge"}
    assert sum(share.share for share in shares) == pytest.approx(1.0)
    assert list(shares) == sorted(shares, key=lambda share: -share.share)
    first = depends_on(missing, nominal, EACH)[0]
    assert (first.dof, first.variable, first.parity) == ("surge", "speed", "odd")
    assert 0.5 < first.strength <= 1.0


def test_slices_by_speed_put_a_drag_where_it_is_fast_and_each_cut_is_whole(nominal):
    missing = lacking(nominal, Cause(QUADRATIC_DRAG, np.array([30.0, 0, 0, 0, 0, 0])))
    slices = slices_of(missing.power, nominal.course, EACH)
    by_speed = [part for part in slices if part.by == "speed" and part.dof == "surge"]
    assert by_speed[-1].share > by_speed[0].share
    for by in {part.by for part in slices}:
        assert sum(part.share for part in slices if part.by == by and part.dof == "surge") == pytest.approx(
            1.0
        )


def test_a_power_is_cut_into_thirds_of_the_dive_by_each_variable_and_into_octants_of_the_compass():
    nu, euler, power = np.zeros((9, 6)), np.zeros((9, 3)), np.zeros((9, 6))
    nu[:, 1], euler[:, 2], power[:, 0] = range(9), [-3.0] * 4 + [0.5] * 4 + [3.5], range(1, 10)
    power[:, 1:3] = 0.0045, 0.0055
    # Nothing is cut by a voltage that was not recorded, or a depth that stays.
    course = SimpleNamespace(
        nu=nu, euler=euler, since_s=10.0 * nu[:, 1], depth_m=np.ones(9), voltage_v=np.full(9, np.nan),
        position_m=np.zeros((9, 2)),
    )  # fmt: skip
    slices = slices_of(power, course, 1)
    assert {part.dof for part in slices} == {"surge", "heave"}
    for by, each in (("speed", 1.0), ("time", 10.0)):
        (low, middle, high) = (part for part in slices if (part.by, part.dof) == (by, "surge"))
        assert (low.low, low.high, middle.high, high.high) == pytest.approx(
            (0.0, each * 8 / 3, each * 16 / 3, each * 8)
        )
        assert (low.share, middle.share, high.share) == pytest.approx((6 / 45, 15 / 45, 24 / 45))
    by_heading = [part for part in slices if (part.by, part.dof) == ("heading", "surge")]
    assert [part.share for part in by_heading] == pytest.approx([19 / 45, 0, 0, 0, 26 / 45, 0, 0, 0])
    assert (by_heading[0].low, by_heading[4].low) == pytest.approx((-np.pi, 0.0))
    assert {part.by for part in slices} == {"speed", "time", "heading"}


def test_shares_below_a_tenth_of_a_per_cent_are_dropped_and_the_others_are_of_the_rest():
    power = np.zeros((4, 6))
    power[:, 0], power[3, 5], power[0, 1], power[0, 2] = [1.0, 1.0, 2.0, 0.0], 5.985, 0.009, 0.015
    shares = shares_of(power, np.array([0, 0, 1, 1]))
    assert [(share.dof, share.phase, share.share) for share in shares] == [
        ("yaw", PHASES[1], pytest.approx(0.5985)),
        ("surge", PHASES[0], pytest.approx(0.2)),
        ("surge", PHASES[1], pytest.approx(0.2)),
        ("heave", PHASES[0], pytest.approx(0.0015)),
    ]


@pytest.mark.parametrize(
    ("by_speed", "off", "felt", "where"),
    [(0.0, 0.05, 0.0, {1}), (0.0, 0.0, 0.05, {0}), (0.03, 0.0, 0.0, set())],
    ids=["a velocity", "an accelerometer", "a scale, which a refit takes up"],
)
def test_a_reading_that_is_off_lies_in_the_degree_of_freedom_that_it_spoils(
    nominal, by_speed, off, felt, where
):
    model = simulation_of(nominal, nominal.theta, nominal.motion.nu)
    wrong = by_speed * model.nu + off * np.eye(6)[1]
    feels = np.tile([felt, 0.0, 0.0], (len(model.nu), 1))
    power = missing_of(model, model, wrong, feels, nominal).power
    assert {*np.flatnonzero(power.sum(axis=0) > 1e-12)} == where


def test_a_force_lies_where_it_acts_however_far_the_nominal_model_is_bent_to_make_up_for_it(nominal):
    course, pushed = nominal.course, np.zeros_like(nominal.course.nu)
    pushed[:, 0] = 2.0 * np.sin(course.time_s)
    bent = nominal.theta.copy()
    for problem, of_axis in zip(nominal.joint.problems, nominal.joint.slices, strict=True):
        if problem.axis.dof == 5:
            bent[of_axis.start + DAMPING] += 2.0
    before, after = (simulation_of(nominal, theta, nominal.motion.nu) for theta in (bent, nominal.theta))
    still = np.zeros_like(after.nu)
    missing = missing_of(before, after.less(pushed[::EACH]), still, still[:, :3], nominal)
    assert missing.power.mean(axis=0).argmax() == 5
    power = beyond_refit(missing, pushed, nominal, EACH).power.mean(axis=0)
    assert power[0] > 0
    assert power[1:].max() < 0.1 * power[0]


def test_what_a_refit_takes_up_whole_is_no_power_of_a_gap(nominal):
    course = nominal.course
    pushed = 3.0 * course.nu_dot * np.eye(6)[0] + course.coriolis_of(3.0 * np.eye(6)[0], course.nu)
    model = simulation_of(nominal, nominal.theta, nominal.motion.nu)
    still = np.zeros_like(model.nu)
    missing = missing_of(model, model, still, still[:, :3], nominal)
    power = beyond_refit(missing, pushed - 2.0 * course.nu, nominal, EACH).power
    assert power.max() == pytest.approx(0.0, abs=1e-9)


@pytest.fixture(scope="module")
def draggy():
    """A hull that has quadratic drag by its vehicle file, in a dive that hides nothing else."""
    case = draw_case(300_933, names=["quadratic_drag"], seconds=100.0)
    return nominal_of(dive_of(case), damped(case.file, "both"), case.configuration)


def test_what_a_hull_s_own_quadratic_drag_takes_up_is_no_power_of_a_gap(draggy):
    model = simulation_of(draggy, draggy.theta, draggy.motion.nu)
    still = np.zeros_like(model.nu)
    missing = missing_of(model, model, still, still[:, :3], draggy)
    course = draggy.course
    power = beyond_refit(missing, -5.0 * np.abs(course.nu) * course.nu, draggy, EACH).power
    assert power.max() == pytest.approx(0.0, abs=1e-9)


def test_a_hull_in_which_nobody_pushes_is_held_against_the_force_that_its_whole_drag_takes(draggy):
    unpushed = replace(draggy, built=replace(draggy.built, unpushed={0: "no thrust there"}))
    (surge,) = (each for each in disturbance_of(unpushed) if each.dof == "surge")
    course = draggy.course
    takes = course.mass[0] * course.nu_dot[:, 0]
    takes += (
        course.damping[0] * course.nu[:, 0] + course.quadratic[0] * np.abs(course.nu[:, 0]) * course.nu[:, 0]
    )
    assert surge.share == pytest.approx(min((surge.std / np.std(takes)) ** 2, 1.0))
    assert hull_of(draggy).quadratic == tuple(course.quadratic)


class TestPhases:
    def phases(self, nominal, nu):
        course = replace(nominal.course, time_s=0.02 * np.arange(len(nu)), nu=nu)
        return [PHASES[k] for k in phases_of(course, 1)]

    def test_a_leg_that_starts_holds_and_stops_is_told_so(self, nominal):
        speed = np.concatenate(
            [
                np.zeros(500),
                np.linspace(0, 0.5, 250),
                np.full(1000, 0.5),
                np.linspace(0.5, 0, 250),
                np.zeros(500),
            ]
        )
        nu = np.zeros((len(speed), 6))
        nu[:, 0] = speed
        phases = self.phases(nominal, nu)
        assert (phases[200], phases[600], phases[1200], phases[1900], phases[2300]) == (
            "rest", "accelerating", "steady", "decelerating", "rest",
        )  # fmt: skip

    def test_turning_and_going_astern_are_told(self, nominal):
        nu = np.zeros((2000, 6))
        nu[:1000, 0], nu[1000:, 0], nu[1500:, 5] = 0.4, -0.4, 0.3
        phases = self.phases(nominal, nu)
        assert (phases[500], phases[1250], phases[1750]) == ("steady", "reversing", "turning")

    def test_a_speed_changes_from_a_quarter_of_the_dives_quickest_change_on(self):
        """It turns from 0.03 rad/s on."""
        gaining = np.repeat([0.1, -0.1, 0.02, -0.02, 0.03, -0.03, 0.0, 0.0, 0.0], 100)
        nu = np.zeros((900, 6))
        nu[:, 0] = 0.5 + 0.1 * np.cumsum(gaining)
        nu[700:800, 5], nu[800:, 5] = 0.029, 0.031
        phases = [PHASES[k] for k in phases_of_motion(nu, 0.1)]
        assert phases[50::100] == [
            "accelerating", "decelerating", "steady", "steady", "accelerating", "decelerating", "steady", "steady",
            "turning",
        ]  # fmt: skip

    @pytest.mark.parametrize(("most", "rest"), [(0.025, 0.02), (0.5, 0.075)])
    def test_it_rests_below_two_centimetres_a_second_or_fifteen_per_cent_of_its_speed(self, most, rest):
        nu = np.zeros((800, 6))
        nu[:, 2] = np.repeat([0.98 * rest, most, 1.02 * rest, most], 200)
        phases = [PHASES[k] for k in phases_of_motion(nu, 0.1)]
        assert phases[100::200] == ["rest", "steady", "steady", "steady"]


def test_thrust_is_drowned_where_the_disturbance_takes_nine_tenths_of_it_in_all_that_is_driven():
    def drowns(*axes):
        return drowned([Disturbance("surge", 1.0, share, driven) for share, driven in axes])

    assert drowns((0.9, True), (0.95, True), (0.1, False))
    assert not drowns((0.89, True), (0.95, True))
    assert not drowns((0.95, False))


def test_without_a_cause_it_lies_where_the_drift_exceeds_its_floor():
    off = np.tile([[3.0, 1.0, 0.0, 0.0, 0.0, 1.0]], (50, 1))
    off[:, 1:3] = np.nan
    floor = np.array([1.0, np.nan, np.nan, 1.0, 1.0, 1.0])
    power = power_of_drift(Drift(5.0, np.arange(50.0), off, floor), np.arange(0.0, 50.0, 0.5), range(6))
    np.testing.assert_allclose(power[:, 0], 3.0**2 - 1.0)
    np.testing.assert_array_equal(power[:, 1:], 0.0)


def test_the_fit_as_a_vehicle_has_its_disturbances_and_the_geometric_mean_of_their_times(nominal):
    hull, logs = hull_of(nominal), []
    for problem, of_axis in zip(nominal.joint.problems, nominal.joint.slices, strict=True):
        theta = nominal.theta[of_axis]
        assert hull.disturbance[problem.axis.dof] == pytest.approx(np.exp(theta[DISTURBANCE]))
        logs += [theta[TIME_CONSTANT]] * (problem.axis.dof in (0, 1, 5))
    assert len(logs) == 3
    assert hull.disturbance_time_s == pytest.approx(np.exp(np.mean(logs)))
    assert (hull.mass, hull.damping) == (tuple(nominal.course.mass), tuple(nominal.course.damping))


def test_of_squares_the_excess_over_one_of_their_mean_is_kept():
    square = np.zeros((2, 6))
    square[:, 0], square[:, 1] = (1.0, 7.0), (0.5, 1.5)
    np.testing.assert_allclose(missing_module._excess(square)[:, :2], [[0.75, 0.0], [5.25, 0.0]])


def test_a_drift_is_looked_at_in_some_degrees_of_freedom_alone_also_where_it_is_below_its_floor():
    off = np.tile([[3.0, 0.5, 0.5, 0.5, 0.5, 0.9]], (50, 1))
    power = power_of_drift(Drift(5.0, np.arange(50.0), off, np.ones(6)), np.arange(0.0, 50.0, 0.5), [1, 5])
    assert power.sum(axis=0).argmax() == 5
    np.testing.assert_array_equal(power[:, [0, 2, 3, 4]], 0.0)


def test_what_is_too_little_to_be_sure_of_lies_where_most_speaks_for_it_but_not_in_what_is_levelled():
    force, later = np.ones(10), np.repeat([0.0, 2.0], 5)
    shapes = (
        GenericForce(4, "thrust", "odd", force),
        GenericForce(2, "depth", None, later),
        GenericForce(0, "speed", "odd", force),
    )
    power = power_of_generic(Unexplained(shapes, (60.0, 10.0, 4.0), (0.1, 0.2, 0.1)), 1)
    np.testing.assert_allclose(power.mean(axis=0), [4.0, 0.0, 10.0, 0.0, 0.0, 0.0])
    assert power[:5, 2].max() == 0.0
    assert not len(power_of_generic(Unexplained(shapes[:1], (60.0,), (0.1,)), 1))


def test_where_a_force_is_twice_as_large_four_times_as_much_speaks_for_it():
    growing = GenericForce(0, "speed", "odd", np.array([1.0, 2.0]))
    power = power_of_generic(Unexplained((growing,), (10.0,), (0.1,)), 1)
    np.testing.assert_allclose(power[:, 0], [4.0, 16.0])


def test_a_moment_that_goes_with_the_speed_of_another_axis_goes_with_nothing_less_plain(nominal):
    course = nominal.course
    high = replace(course, altitude_m=20.0 + 0.01 * np.sin(course.since_s))
    cause = Cause(COUPLED_DAMPING, np.array([0.0, 2.0]))
    in_high = replace(nominal, course=high)
    missing = lacking(in_high, cause)
    of_yaw = [dependence for dependence in depends_on(missing, in_high, EACH) if dependence.dof == "yaw"]
    assert [(dependence.variable, dependence.parity) for dependence in of_yaw] == [("speed", "odd")]


def test_what_a_hulls_own_quadratic_drag_takes_up_depends_on_no_speed():
    case = draw_case(300_933, names=["quadratic_drag"], seconds=90.0)
    now = nominal_of(dive_of(case), damped(case.file, "quadratic"), case.configuration)
    course, wrench = now.course, np.zeros((len(now.course.nu[::EACH]), 6))
    nu = course.nu[::EACH, 0]
    wrench[:, 0] = 30.0 * np.abs(nu) * nu + 0.1 * np.cos(course.euler[::EACH, 2])
    missing = Missing(course.time_s[::EACH], wrench, 0.0 * wrench, wrench**2)
    assert [dependence.variable for dependence in depends_on(missing, now, EACH)] == ["heading"]


def test_a_missing_force_of_an_axis_with_a_twentieth_of_the_power_depends_on_nothing(nominal):
    course = nominal.course
    wrench = np.tile(np.cos(course.euler[::EACH, 2:]), 6)
    power = np.zeros_like(wrench)
    power[0, :3] = 89.0, 5.0, 6.0
    missing = Missing(course.time_s[::EACH], wrench, 0.0 * wrench, power)
    assert {dependence.dof for dependence in depends_on(missing, nominal, EACH)} == {"surge", "heave"}


ANGLE = 2.0 * np.pi * np.arange(400) / 400
UNITS = [np.cos(k * ANGLE) / np.sqrt(200.0) for k in (1, 2, 3, 4)]


@pytest.mark.parametrize(
    ("shares", "told"),
    [
        # Three at most, and none of less than a twentieth of the force's power.
        ((0.2, 0.45, 0.25, 0.1), {"depth": 0.45, "time": 0.25, "heading": 0.2}),
        ((0.04, 0.045, 0.855, 0.06), {"time": 0.855, "voltage": 0.06}),
        # What is named first is told where it does nearly as well as the best.
        ((0.4926, 0.5, 0.0074, 0.0), {"heading": 0.4926, "depth": 0.5}),
        ((0.475, 0.5, 0.025, 0.0), {"depth": 0.5, "heading": 0.475}),
    ],
)
def test_a_missing_force_depends_on_the_variables_that_take_most_of_its_power(shares, told):
    variables = ("heading", "depth", "time", "voltage")
    force = 7.0 + sum(30.0 * np.sqrt(share) * unit for share, unit in zip(shares, UNITS, strict=True))
    forces = [(v, None, 2.0 + 9.0 * unit) for v, unit in zip(variables, UNITS, strict=True)]
    found = missing_module._of_axis(0, force, np.ones((400, 1)), forces)
    assert [each.variable for each in found] == [*told]
    assert [each.strength for each in found] == pytest.approx([*told.values()])


def test_what_is_left_is_told_by_the_shapes_that_foretell_it_most():
    force = np.zeros(10)
    left = Unexplained(
        (
            GenericForce(1, "heading", None, force),
            GenericForce(0, "position", None, force),
            GenericForce(5, "speed", "odd", force),
        ),
        (40.0, 20.0, 5.0),
        (1.0, 1.0, 1.0),
    )
    character = character_of(left)
    assert (character.frame, character.parity, character.timing) == ("world", "neither", "steady")
    assert character.dof == ("surge", "sway")
    assert character.depends_on == ("heading", "position", "speed")


def test_the_character_of_what_is_left_is_that_of_most_nats_and_a_degree_of_freedom_counts_from_three_tenths_on():
    shapes = [
        (GenericForce(0, "heading", None, np.zeros(3), "drifting"), 10.5),
        (GenericForce(1, "depth", "odd", np.zeros(3), "periodic"), 7.2),
        (GenericForce(3, "altitude", "odd", np.zeros(3), "periodic"), 3.1),
        (GenericForce(2, "thrust", "even", np.zeros(3), "intermittent"), 7.0),
        (GenericForce(5, "thrust", "even", np.zeros(3), "intermittent"), 3.2),
    ]
    for k, told in ((0, ("world", "neither", "drifting")), (1, ("neither", "odd", "periodic")),
                    (3, ("body", "even", "intermittent"))):  # fmt: skip
        more = [(shape, nats + 0.5 * (at == k)) for at, (shape, nats) in enumerate(shapes)]
        of, gains = zip(*more, strict=True)
        character = character_of(Unexplained(of, gains, (1.0,) * 5))
        assert (character.frame, character.parity, character.timing) == told
    assert character.dof == ("surge", "sway", "heave", "yaw")
    assert character.depends_on == ("heading", "depth", "altitude", "thrust")


def drift_of(off):
    """Of windows a second apart, over floors that all of it, what hides included, came to."""
    return Drift(1.0, np.arange(len(off), dtype=float), off, np.sqrt(np.mean(off**2, axis=0)))


def test_what_comes_and_goes_unexplained_lies_where_most_windows_are_far_quieter_than_their_floor():
    off = np.random.default_rng(100_311).normal(size=(400, 6)) * [0.01, 0.01, 0.01, 0.001, 0.001, 0.001]
    off[::8, 5] += 0.01
    off[:, 4] = np.nan
    power = power_of_remainder(drift_of(off), np.arange(400.0) + 0.5, range(6))
    assert power.sum(axis=0).argmax() == 5
    assert power[::8, 5].sum() > 0.9 * power[:, 5].sum()
    assert power[:, 5].mean() == pytest.approx(np.mean((off[:, 5] / 0.001) ** 2) - 1.0, rel=0.4)
    assert power[:, :3].mean(axis=0).max() < 0.2
    assert not power_of_remainder(drift_of(off), np.arange(400.0), (0, 1))[:, 2:].any()


def test_a_generic_force_counts_for_no_more_than_the_nats_that_it_saves(nominal):
    course = nominal.course
    force = np.sin(0.7 * course.time_s)
    nothing = Missing(course.time_s[::EACH], *np.zeros((3, len(course.time_s[::EACH]), 6)))
    left = Unexplained((GenericForce(0, "thrust", "odd", force),), (20.0,), (1000.0,))
    power = with_unexplained(nothing, left, nominal, EACH).power
    seconds = float(course.time_s[-1] - course.time_s[0])
    (of_axis,) = [
        of_axis
        for problem, of_axis in zip(nominal.joint.problems, nominal.joint.slices, strict=True)
        if problem.axis.dof == 0
    ]
    disturbances = seconds / (2 * np.exp(nominal.theta[of_axis][TIME_CONSTANT]))
    assert power[:, 0].mean() == pytest.approx(2 * 20.0 / disturbances, rel=0.01)
    small = with_unexplained(nothing, replace(left, forces=(1e-6,)), nominal, EACH).power
    assert 0 < small[:, 0].mean() < 1e-6


@pytest.fixture(scope="module")
def case():
    return draw_case(391_720, names=["wrong_feedback_log", "quadratic_drag"], size=0.9, seconds=85.0)


def where(case) -> set[str]:
    diagnosis = diagnosed(case, QUADRATIC_DRAG)
    assert {finding.name for finding in diagnosis.findings} == {"wrong_feedback_log", "quadratic_drag"}
    return {share.dof for share in diagnosis.gap.where}


def test_a_gap_lies_where_the_log_is_wrong_unless_a_cause_in_the_motion_is_accepted_too(case, monkeypatch):
    doubted = {
        DOFS[lack.dof] for lack in unrecorded(dive_of(case), case.file.vehicle.water) if lack.dof in (0, 1, 5)
    }
    assert doubted
    by_drag = where(case)
    assert by_drag - doubted
    found_of = module.findings_of

    def possible(*given):
        return tuple(
            finding if finding.cause.effect.acts_on == "log" else replace(finding, probability=0.4)
            for finding in found_of(*given)
        )

    monkeypatch.setattr(module, "findings_of", possible)
    assert where(case) <= doubted


def test_no_unknown_force_is_looked_for_where_the_controller_may_have_used_the_same_unrecorded_velocity(case):
    nominal = planted_nominal(case)
    assert 1 in nominal.feedback_unrecorded
    assert nominal.feedback_suspected == (0, 2)
    assert "In surge and heave no unknown force" in " ".join(unjudged_notes(nominal))
    assert not {*nominal.feedback_suspected, *nominal.feedback_unrecorded} & pushed(nominal)
    # As if the recorded velocity were the controller's: its answers to the sea look like forces there.
    trusted = replace(
        nominal, feedback_unrecorded=tuple(dof for dof in nominal.feedback_unrecorded if dof > 2)
    )
    assert trusted.feedback_suspected == ()
    assert {0, 2} <= pushed(trusted)


def pushed(nominal) -> set[int]:
    """The degrees of freedom in which an unknown force is found, with nothing else to name."""
    weighing = weighing_of(nominal, ())
    return {shape.dof for shape in unexplained_of(weighing, weighing.fitted(())).shapes}


def test_a_fit_flown_as_a_hull_is_disturbed_for_as_long_as_surge_sway_and_yaw_are(nominal):
    times_s = [
        np.exp(nominal.theta[of_axis][TIME_CONSTANT])
        for problem, of_axis in zip(nominal.joint.problems, nominal.joint.slices, strict=True)
        if problem.axis.dof in (0, 1, 5)
    ]
    assert len(times_s) == 3
    assert np.ptp(times_s) > 0.01
    assert hull_of(nominal).disturbance_time_s == pytest.approx(np.prod(times_s) ** (1 / 3))


def test_readings_that_the_fit_dropped_are_called_spikes_only_where_they_are_few():
    """Of 1000 readings 5 are dropped in yaw, and 27 in pitch."""

    def dropped(dof, count):
        read = np.zeros(1000)
        kept = np.where(np.arange(1000) < count, np.nan, read)
        return SimpleNamespace(axis=SimpleNamespace(dof=dof, reading=read), reading=kept)

    def noted(*problems):
        return outliers_note(SimpleNamespace(joint=SimpleNamespace(problems=problems)))

    (few,) = noted(dropped(5, 5))
    assert (
        few == "Readings far off what the fit expects there, as spikes are, were left out: 5 in yaw (0.5 %)."
    )
    (many,) = noted(dropped(4, 27), dropped(5, 5))
    assert many.endswith("; so many in pitch are motion that the model lacks, rather than spikes.")
    assert noted(dropped(4, 0)) == ()
