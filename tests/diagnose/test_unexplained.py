"""What is left beside the causes: slow forces, bursts, periods."""

import math
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from fakes.planted import damped, drawn_nominal, planted_nominal
from soak import rows_rest_in_soak

from bridge.arrays import Array
from identify.challenge.case import Case, dive_of, draw_case
from identify.challenge.scenario import Planted, Scenario
from identify.diagnose.causes import candidates, seas
from identify.diagnose.causes.candidates import Cause, companions, other_forms, possible_forms
from identify.diagnose.causes.evidence import Candidates
from identify.diagnose.causes.seas import period_interval, seas_of
from identify.diagnose.causes.weighing import weighing_of
from identify.diagnose.filters.backwards import scores, scores_of_each
from identify.diagnose.filters.nominal import Nominal, nominal_of, refitted
from identify.diagnose.filters.regression import regression_of
from identify.diagnose.nominal_fit import fitted_nominal
from identify.diagnose.remainder import lines, slow, unexplained
from identify.diagnose.remainder.bursts import _AxisScores, _Stretches, _StretchScores, bursts, mixture_gain
from identify.diagnose.remainder.generic_forces import of_other_speeds, of_the_past, unit_forces
from identify.diagnose.remainder.slow import slow_axes, slow_forces
from identify.diagnose.remainder.unexplained import GenericForce, Unexplained, beyond_chance, unexplained_of
from identify.diagnose.result import Next
from identify.diagnose.verdict import next_for_unexplained, stand_in, unexplained_forces
from identify.dive import Signal
from identify.effects.actuators import thruster_lag
from identify.effects.course import lagged
from identify.effects.effect import Act
from identify.effects.environment import STEADY_CURRENT, TETHER, waves
from identify.effects.sensors import DVL_LEVER_ARM
from identify.effects.supply import LOAD_SAG
from identify.estimators.likelihood.axis import DISTURBANCE, TIME_CONSTANT


def left_by(wrench, columns):
    """Share of a wrench's square that columns leave of it."""
    base = np.column_stack(columns)
    size, *_ = np.linalg.lstsq(base, wrench, rcond=None)
    return np.sum((wrench - base @ size) ** 2) / np.sum(wrench**2)


def waters_of(acts):
    return [act.water[:, 0] for act in acts if act.water is not None]


def columns_of(acts, dof):
    return [act.wrench[:, dof] for act in acts]


def test_turning_that_later_readings_show_does_not_move_the_accelerations_that_forces_are_sought_by(nominal):
    """Heave that its Coriolis force alone moves would otherwise know of the pitching that is to be predicted."""
    course, mass = nominal.course, nominal.course.mass
    by_later = replace(course, nu_dot=-course.coriolis_of(mass, nominal.motion.nu) / mass)
    by_earlier = -course.coriolis_of(mass, course.nu) / mass
    assert np.max(np.abs(by_later.nu_dot - by_earlier)) > 1e-3
    foreseen = unexplained._foreseen(replace(nominal, course=by_later))
    np.testing.assert_allclose(foreseen.nu_dot, by_earlier, atol=1e-12)


def test_an_odd_force_turns_with_the_motion_and_thrust_that_it_depends_on_and_an_even_one_does_not(nominal):
    course, dofs = nominal.course, [0, 1, 5]
    back = replace(course, nu=-course.nu, nu_dot=-course.nu_dot, asked_n=-course.asked_n, rpm=-course.rpm)

    def forces_of(course):
        parts = [
            unit_forces(course, dofs),
            of_other_speeds(course, dofs),
            *(of_the_past(course, d) for d in dofs),
        ]
        return [(parity, force) for part in parts for _, parity, force in part if parity]

    sign = {"odd": -1.0, "even": 1.0}
    forces = forces_of(course)
    assert len(forces) > 50
    for (parity, force), (_, turned) in zip(forces, forces_of(back), strict=True):
        np.testing.assert_allclose(turned, sign[parity] * force, rtol=1e-6, atol=1e-9)


def test_a_force_of_a_speed_is_named_by_it_and_one_of_turning_by_the_yaw_rate(nominal):
    course, speeds = nominal.course, []
    for dof in (0, 5):
        speeds.append([variable for variable, *_ in of_other_speeds(course, [dof])])
        named = {variable for variable, *_ in of_the_past(course, dof)}
        assert named == {*speeds[-1]}
        assert {variable for variable, *_ in unit_forces(course, [dof])} & {"speed", "yaw_rate"} == named
    assert speeds == [["speed"], ["yaw_rate"]]


def drawn_course(count=400):
    """Whatever moves, pushes and is read, each by chance; the thrust is the wrench."""
    rng = np.random.default_rng(11)
    nu, nu_dot, thrust_n = rng.standard_normal((3, count, 6))
    depth_m, altitude_m, voltage_v = 5.0 + rng.standard_normal((3, count))
    return SimpleNamespace(
        nu=nu, nu_dot=nu_dot, thrust_n=thrust_n, wrench_of=lambda thrust_n: thrust_n, since_s=0.5 * np.arange(count),
        step_s=0.5, depth_m=depth_m, altitude_m=altitude_m, voltage_v=voltage_v, euler=rng.standard_normal((count, 3)),
        position_m=rng.standard_normal((count, 2)), world=tuple(rng.standard_normal((3, count, 3))),
    )  # fmt: skip


def test_each_force_that_is_tried_is_a_product_or_power_of_what_it_is_named_by():
    course = drawn_course()
    (u, w), (x, z) = course.nu[:, [0, 2]].T, course.thrust_n[:, [0, 2]].T
    share, psi, (north, east) = course.since_s / course.since_s[-1], course.euler[:, 2], course.position_m.T
    depth, high, voltage = course.depth_m, course.altitude_m, course.voltage_v
    far, (of_north, of_east, _) = np.hypot(north, east), course.world
    forces = {
        ("speed", "odd"): [force for v in (u, w) for force in (v * abs(v), v**3, np.sign(v) * abs(v) ** 0.5)]
        + [abs(u) * w, u * abs(w)],
        ("speed", "even"): [u**2, w**2, abs(u), abs(w), u * w],
        ("acceleration", "odd"): [course.nu_dot[:, 0], course.nu_dot[:, 2]],
        ("thrust", "odd"): [x, z, x * abs(x), z * abs(z), x * abs(u), z * abs(w)],
        ("thrust", "even"): [abs(x), abs(z)],
        ("thrust_sign", "odd"): [np.tanh(10.0 * push / push.std()) for push in (x, z)],
        ("heading", None): [np.sin(psi), np.cos(psi), np.sin(2 * psi), np.cos(2 * psi)],
        ("time", None): [share, share**2, share**3, share * u, share * w, share * x, share * z],
        ("depth", None): [depth - depth.mean(), depth**2 - (depth**2).mean(), depth * u, depth * w],
        ("altitude", None): [high - high.mean(), high**2 - (high**2).mean(), high * u, high * w],
        ("voltage", None): [voltage - voltage.mean(), voltage * x, voltage * z],
        ("position", None): [
            force for k in (0, 1)
            for force in (north * of_north[:, k], east * of_east[:, k], far * np.sign(course.nu[:, k]))
        ],
    }  # fmt: skip
    found = list(unit_forces(course, [0, 2]))
    for (variable, parity), expected in forces.items():
        given = [force for name, of, force in found if (name, of) == (variable, parity)]
        for force in expected:
            assert any(np.allclose(each, force / force.std()) for each in given), (variable, parity)
        assert len(given) == len(expected)
    assert len(found) == sum(map(len, forces.values()))


def test_water_follows_a_speed_within_one_and_a_half_three_six_and_twelve_seconds():
    speed = np.concatenate([np.zeros(500), np.ones(1000)])
    past = [
        force for *_, force in of_the_past(SimpleNamespace(nu=np.tile(speed[:, None], 6), step_s=0.02), 0)
    ]
    for k, past_s in enumerate((1.5, 3.0, 6.0, 12.0)):
        before, square, beside, apart = past[4 * k : 4 * k + 4]
        assert np.searchsorted(before, 1.0 - np.exp(-1.0)) == pytest.approx(500 + past_s / 0.02, abs=2)
        np.testing.assert_allclose(square, before * abs(before))
        np.testing.assert_allclose(beside, (before - speed) * abs(before))
        np.testing.assert_allclose(apart, (before - speed) * abs(before - speed))
    assert len(past) == 16


def test_a_force_that_is_little_beside_the_thrust_is_not_left(nominal, monkeypatch):
    wrench, speed = np.zeros_like(nominal.course.nu), nominal.course.nu[:, 2]
    thrust = nominal.course.wrench_of(nominal.course.thrust_n)[:, 2]
    wrench[:, 2] = 0.2 * np.std(thrust) / np.std(speed**2) * speed**2
    weighing = weighing_of(replace(refitted(nominal, [Act(wrench=wrench)]), acts=()), ())
    fit = weighing.fitted(())
    assert 2 in {shape.dof for shape in unexplained_of(weighing, fit).shapes}
    monkeypatch.setattr(unexplained, "LEAST_FORCE", 0.5)
    assert 2 not in {shape.dof for shape in unexplained_of(weighing, fit).shapes if shape.timing is None}


@pytest.mark.parametrize(("share", "is_left"), [(0.5, False), (10.0, True)])
def test_a_steady_push_within_the_thrust_curve_s_error_of_the_thrust_is_no_force(
    nominal, monkeypatch, share, is_left
):
    """share: the push by that error."""
    weighing = weighing_of(nominal, ())
    fit, innovations = weighing.fitted(()), weighing.rows.axes[2]
    (steady,) = innovations.prewhitened(
        innovations.by_force(np.ones((len(innovations.problem.axis.time_s), 1)))
    ).T
    push = np.sqrt(400.0 / (steady @ steady))
    thrust = nominal.course.wrench_of(nominal.course.thrust_n)[:, innovations.problem.axis.dof]
    monkeypatch.setattr(unexplained, "LEAST_FORCE", push / share / np.sqrt(np.mean(thrust**2)))
    known = unexplained._known(weighing, fit)
    value = fit.value.copy()
    value[known.slices[2]] += push * steady
    axis = unexplained._axis_with_causes(weighing, value, known, 2, at_sea=False)
    gain = axis.sums(Candidates(steady[:, None], axis.piece)).evidence([0]).gain
    assert (gain > 11.7) is is_left


@pytest.mark.parametrize(("apart", "count"), [(0.01, 0), (0.1, 1)])
def test_a_large_force_that_masses_and_dampings_take_up_but_for_little_is_little(apart, count):
    """Thrust less inertia less drag is next to nothing, whatever the size of the thrust in it."""
    rng = np.random.default_rng(4)
    thrust, other, noise = rng.standard_normal((3, 4000))
    axis = unexplained._Axis(
        SimpleNamespace(problem=SimpleNamespace(axis=SimpleNamespace(dof=5))),
        100.0 * apart * other + noise,
        thrust[:, None],
        np.zeros(1),
        np.repeat(np.arange(20), 200),
    )
    columns = Candidates(100.0 * (thrust + apart * other)[:, None], axis.piece)
    selectable = SimpleNamespace(
        of=lambda _axis: ([("thrust", "odd", thrust, None)], columns), least_force=lambda _dof: 0.02
    )
    assert len(unexplained._of_axis(axis, selectable)) == count


def test_forces_after_the_first_small_one_are_left_out_but_for_those_with_a_timing_of_their_own():
    def weighed(size, timing=None):
        return unexplained._Weighed(GenericForce(0, "thrust", "odd", np.zeros(1), timing), 20.0, size)

    forces = [weighed(4.0), weighed(0.1, "steady"), weighed(3.9), weighed(9.0)]
    large = unexplained._large(forces, np.array([0.5, 0.5, 0.5, 1.0]), 2.0)
    assert [each.size for each in large] == [4.0, 0.1]


@pytest.mark.parametrize(
    ("dof", "gain", "is_beyond"),
    [(0, 11.6, False), (0, 11.8, True), (5, 11.8, True), (4, 99.0, False), (3, 101.0, True)],
)
def test_a_force_is_beyond_chance_from_twelve_nats_on_and_in_roll_and_pitch_from_a_hundred(
    dof, gain, is_beyond
):
    assert beyond_chance(GenericForce(dof, "time", None, np.zeros(1)), gain) is is_beyond


@pytest.mark.parametrize("is_there", [True, False])
def test_forces_in_place_of_a_cause_save_more_than_it_does_where_another_force_acts(nominal, is_there):
    course = nominal.course
    turned, wrench = DVL_LEVER_ARM.act(course, np.array([0.0, 0.1, 0.0])), np.zeros_like(course.nu)
    wrench[:, 0] = 20.0 * course.nu[:, 5]
    act = turned if is_there else Act(wrench=wrench)
    weighing = weighing_of(replace(refitted(nominal, [act]), acts=()), (DVL_LEVER_ARM,))
    fit = weighing.fitted((Cause(DVL_LEVER_ARM, np.array([0.0, 0.05, 0.0])),))
    assert fit.gain > 11.7
    assert stand_in(unexplained_of(weighing, fit).instead, fit.gain) is not is_there


def test_a_slow_rest_of_a_quick_cause_is_kin_of_it(nominal):
    course = nominal.course
    lag, _ = thruster_lag(course.lag_s)
    cause = Cause(lag, np.array([course.lag_s + 0.1]))
    slow = lagged(cause.act(course).wrench, course.step_s, 0.9)[:, 0]
    known = columns_of([cause.slope(course, 0), *other_forms(course, cause)], 0)
    with_kin = left_by(slow, [*known, *columns_of(companions(course, cause), 0)])
    assert with_kin < 0.1 * left_by(slow, known)


@pytest.mark.parametrize(
    "cause",
    [
        Cause(waves(4.0), np.array([1.0, 0.5, -0.3, 0.8, 0.0, 0.0])),
        Cause(STEADY_CURRENT, np.array([0.1, 0.05])),
    ],
    ids=["waves", "current"],
)
def test_water_that_moves_turns_the_hull_too(nominal, cause):
    course = nominal.course
    act = cause.act(course)
    push = act.wrench if act.water is None else course.pushed_by(act.water)
    munk = course.nu[:, 0] * push[:, 1]
    forms = [form for form in possible_forms(course, cause) if form.wrench is not None]
    turning = columns_of(forms, 5)
    assert left_by(munk, turning) < 1e-9
    # The moment by the hull's own drift is no water's.
    assert left_by(course.nu[:, 0] * course.nu[:, 1], turning) > 0.1


def test_water_turns_a_hull_by_a_lever_and_by_its_own_drift_as_munk_has_it():
    course, force = drawn_course(), np.random.default_rng(13).standard_normal((400, 3))
    acts = [act.wrench for act in candidates._moments(course, force)]
    for push, moments in ((force, acts[:4]), (np.gradient(force, 0.5, axis=0), acts[4:])):
        assert not np.any([moment[:, :3] for moment in moments])
        of_y_and_z, of_z_and_x, ahead, back = (moment[:, 3:] for moment in moments)
        np.testing.assert_allclose(of_y_and_z, push[:, [1, 0, 1]])
        np.testing.assert_allclose(of_z_and_x, push[:, [2, 2, 0]])
        np.testing.assert_allclose(np.cross(course.nu[:, :3], push), (ahead - back) * [1.0, -1.0, 1.0])


def test_a_current_that_turns_as_it_comes_and_goes_is_kin_of_a_steady_one(nominal):
    course = nominal.course
    cause = Cause(STEADY_CURRENT, np.array([0.05, 0.02]))
    middle = 2.0 * course.since_s / course.since_s[-1] - 1.0
    turned = (middle[:, None] ** 2 * STEADY_CURRENT.act(course, np.array([0.0, 0.01])).water)[:, 0]
    known = waters_of([cause.slope(course, 0), cause.slope(course, 1), *other_forms(course, cause)])
    with_kin = left_by(turned, [*known, *waters_of(companions(course, cause))])
    assert with_kin < 0.05 * left_by(turned, known)


def test_a_supply_that_gives_way_by_another_law_is_kin_of_load_sag(nominal):
    course = nominal.course
    load = (np.abs(course.thrust_n) ** 1.4).sum(axis=1, keepdims=True)
    wrench = course.wrench_of(lagged(load, course.step_s, 0.3) * course.thrust_n)[:, 0]
    assert left_by(wrench, columns_of(companions(course, Cause(LOAD_SAG, np.array([0.05]))), 0)) < 1e-9


def test_forces_that_chance_or_the_causes_would_leave_are_not_unexplained():
    shapes = tuple(GenericForce(dof, "heading", None, np.zeros(3)) for dof in (0, 5, 4))
    left = Unexplained(shapes, (30.0, 12.0, 90.0), (1.0, 1.0, 1.0), explained=750.0)
    assert unexplained_forces(left) == shapes[:1]


@pytest.mark.parametrize(
    ("variable", "said"),
    [("heading", "opposite headings"), ("depth", "two depths"), ("altitude", "heights above the bottom"),
     ("voltage", "empty battery"), ("thrust_sign", "thrusters at a time"), ("position", "out and back")],
)  # fmt: skip
def test_what_is_left_says_what_to_dive_next(nominal, variable, said):
    more = next_for_unexplained(
        [GenericForce(0, variable, None, nominal.course.depth_m)], nominal.course, None
    )
    assert said in more.manoeuvres[0]
    assert more.splits == ()


@pytest.mark.parametrize(
    ("variable", "dof", "timing", "said"),
    [("speed", 0, None, "steady runs ahead and astern at three speeds"),
     ("speed", 1, None, "steady runs to port and to starboard at three speeds"),
     ("yaw_rate", 5, None, "steady turns both ways at three rates"),
     ("acceleration", 2, None, "starts and stops up and down, quick and slow"),
     ("acceleration", 5, None, "turns begun and ended both ways, quickly and slowly"),
     ("time", 0, "drifting", "five minutes on one spot, and five more with the thrusters off"),
     ("time", 0, None, "the same leg with a fresh and with an empty battery")],
)  # fmt: skip
def test_a_force_is_isolated_by_the_motion_that_is_large_where_it_is(variable, dof, timing, said):
    """However large, or steady, the others are: a rate of turn is small in rad/s."""
    course = drawn_course()
    course.nu[:, :5], course.nu_dot[:, :5] = 1.0 + 50.0 * course.nu[:, :5], 50.0 * course.nu_dot[:, :5]
    course.nu[:, 3] = course.nu_dot[:, 3] = 50.0 + 0.1 * course.nu[:, 3]
    square = (course.nu_dot if variable == "acceleration" else course.nu)[:, dof] ** 2
    force = 5.0 * square.mean() + square
    more = next_for_unexplained([GenericForce(0, variable, "even", force, timing)], course, None)
    assert more.manoeuvres == (said,)


def test_two_of_the_strongest_are_asked_for_beside_what_tells_the_causes_apart(nominal):
    left = [
        GenericForce(0, variable, None, nominal.course.depth_m)
        for variable in ("voltage", "time", "heading", "depth")
    ]
    more = next_for_unexplained(
        left, nominal.course, Next(("coast-down",), ("voltage log",), ("fouling", "battery_sag"))
    )
    assert more.manoeuvres == (
        "the same leg with a fresh and with an empty battery",
        "the same leg on opposite headings",
        "coast-down",
    )
    assert (more.sensors, more.splits) == (("voltage log",), ("fouling", "battery_sag"))


def test_a_gyro_that_is_off_is_left_though_nothing_pushes(nominal):
    off = tuple(
        replace(witness, off=witness.off - 0.05) for witness in nominal.witnesses if witness.kind == "heading"
    )

    def turns_unseen(now):
        weighing = weighing_of(now, ())
        left = unexplained_of(weighing, weighing.fitted(()))
        return [
            size for force, size in zip(left.shapes, left.forces, strict=True) if force.timing == "steady"
        ]

    assert turns_unseen(replace(nominal, witnesses=off)) == [0.0]
    assert turns_unseen(nominal) == []


def test_a_reading_that_is_wrong_by_geometry_has_no_bent_forms(nominal):
    course = nominal.course
    cause = Cause(DVL_LEVER_ARM, np.array([0.1, 0.2, 0.0]))
    ahead = cause.act(course).velocity[:, 0]
    others = [act.velocity[:, 0] for some in (possible_forms, companions) for act in some(course, cause)]
    turning = course.nu[:, 5] * np.abs(course.nu[:, 5])
    assert left_by(turning, [ahead, *others]) > 0.05
    assert left_by(course.since_s * ahead, [ahead, *others]) < 1e-9


def test_lines_beside_the_strongest_of_a_sea_are_kin_of_it(nominal):
    course = nominal.course
    whole_s = course.since_s[-1]
    cause = Cause(waves(6.0), np.array([1.0, 0.5, -0.3, 0.8, 0.2, 0.1]))
    neighbour = Cause(waves(1.0 / (1.0 / 6.0 + 2.0 / whole_s)), np.array([0.3, 0.9, 0.1, 0.0, 0.0, 0.0]))
    other = neighbour.act(course).wrench[:, 0]
    slopes = [cause.slope(course, p) for p in range(6)]
    assert left_by(other, columns_of([*slopes, *companions(course, cause)], 0)) < 0.05
    assert left_by(other, columns_of([*slopes, *other_forms(course, cause)], 0)) > 0.5


@pytest.mark.parametrize(("at", "off"), [(4, -0.4), (4, 0.0), (4, 0.3), (1, 0.4)])
def test_a_line_s_rate_is_read_between_those_of_a_spectrum(at, off):
    rate = 1.0 + 0.5 * np.arange(9)
    true = rate[at] + 0.5 * off
    assert seas._peak(rate, np.exp(-3.0 * (rate - true) ** 2), at) == pytest.approx(true)


def test_a_line_s_rate_is_that_of_the_spectrum_where_this_ends_or_is_flat():
    rate, spectrum = np.arange(1.0, 5.0), np.array([4.0, 3.0, 3.0, 3.0])
    assert [seas._peak(rate, spectrum, at) for at in (0, 2, 3)] == [1.0, 3.0, 4.0]


def seas_by(monkeypatch, lines, lasting_s=600.0):
    """Cycles in a dive of its seas, by name, if the spectrum of a usual disturbance has so much more power in lines, by
    cycles, and a hundredfold beyond 300 of them."""
    cycles = np.arange(1, 1501)
    power = np.where(cycles > 300, 100.0, 1.0)
    for at, more in lines.items():
        power[at - 1] *= more
    spectrum = cycles / lasting_s, power / (1.0 + (cycles / lasting_s / 0.1) ** 2)
    monkeypatch.setattr(seas, "_disturbance_spectrum", lambda _: spectrum)
    told = [(each.name, each.variant.removesuffix(" s").replace(" and ", ", ")) for each in seas_of(None)]
    return [(name, [lasting_s / float(period) for period in periods.split(", ")]) for name, periods in told]


def test_a_sea_has_the_strongest_line_of_its_band_and_four_lines_within_a_fifth_of_that(monkeypatch):
    """A current comes and goes in 15 to 200 s, waves in 1.5 to 12 s."""
    outside = {2: 900.0, 47: 900.0, 410: 900.0}
    of_waves = {100: 100.0, 101: 30.0, 121: 50.0, 79: 50.0, 110: 20.0, 111: 15.0, 95: 10.0, 119: 5.0, 85: 4.5}
    found = seas_by(monkeypatch, outside | {10: 50.0, 39: 60.0} | of_waves)
    assert [name for name, _ in found] == ["varying_current", "waves", "waves"]
    assert found[0][1] == pytest.approx([39.0], rel=0.01)
    assert found[1][1] == found[2][1][:1]
    assert found[2][1] == pytest.approx([100.3, 110.3, 95.0, 119.0], rel=0.003)
    found = seas_by(monkeypatch, {15: 3.0, 100: 100.0, 81: 4.5, 119: 3.9})
    assert found[-1][1] == pytest.approx([100.0, 81.0], rel=0.003)
    # A short dive tells no current by the seven rates that it resolves.
    assert [len(seas_by(monkeypatch, {5: 50.0}, lasting_s)) for lasting_s in (120.0, 150.0)] == [1, 2]


def test_a_sea_of_one_period_goes_with_the_rates_within_a_fifth_of_its_own_that_a_dive_resolves(nominal):
    course, sea = nominal.course, Cause(waves(6.0), np.full(6, 2.0))
    lasting_s = float(course.since_s[-1])
    rates = range(1, math.ceil(0.2 * lasting_s / 6.0) + 1)
    expected = [wave(2 * np.pi * k / lasting_s * course.since_s) for k in rates for wave in (np.sin, np.cos)]
    band = [change.args[0][:, 0] for _, change in candidates._band(course, sea)]
    assert len(rates) == 4
    np.testing.assert_allclose(band[: len(expected)], expected, atol=1e-9)
    assert len(band) % len(expected) == 0


def test_a_tether_pulls_down_as_well(nominal):
    course = nominal.course
    cause = Cause(TETHER, np.array([0.3, 1.0, -0.5]))
    pull = np.linalg.norm(cause.act(course).wrench[:, :3], axis=1)
    down = pull**2 * course.world[2][:, 2]
    assert left_by(down, columns_of(companions(course, cause), 2)) < 1e-9


@pytest.mark.parametrize(("off_m_s2", "count"), [(0.012, 0), (0.3, 1)])
def test_an_accelerometer_is_off_beyond_its_zero_or_not_at_all(off_m_s2, count):
    case = draw_case(300_914, names=(), seconds=240.0)
    dive = dive_of(case)
    read = dive.specific_force
    off = replace(read, value=read.value + np.array([off_m_s2, 0.0, 0.0]))
    nominal = planted_nominal(case, replace(dive, specific_force=off))
    left = unexplained_forces(unexplained_of(weighing := weighing_of(nominal, ()), weighing.fitted(())))
    assert [(shape.dof, shape.timing) for shape in left] == [(0, "steady")] * count


@pytest.fixture(scope="module")
def weighing():
    return weighing_of(drawn_nominal(seconds=240.0), ())


def left_of(name, seed):
    """What is left of a short dive that hides one effect which no library has."""
    case = draw_case(seed, names=(name,), size=0.8, seconds=240.0)
    weighing = weighing_of(planted_nominal(case), ())
    return unexplained_of(weighing, weighing.fitted(()))


def test_a_filter_run_backwards_weighs_any_force_as_it_does_forwards(weighing):
    rng = np.random.default_rng(1)
    for axis in weighing.rows.axes:
        force, left = rng.standard_normal(len(axis.problem.axis.time_s)), rng.standard_normal(len(axis.std))
        forwards = axis.prewhitened(axis.by_force(force[:, None]))[:, 0] @ left
        assert scores(axis, left) @ force == pytest.approx(forwards, rel=1e-9)
        of_each = scores_of_each(axis, np.column_stack([np.zeros(len(left)), left, -left]))
        assert np.array_equal(of_each.T, [np.zeros(len(force)), scores(axis, left), -scores(axis, left)])


def test_a_dive_that_obeys_its_model_leaves_nothing_that_comes_and_goes(weighing):
    assert not unexplained_forces(unexplained_of(weighing, weighing.fitted(())))


@pytest.mark.parametrize(
    ("name", "dof", "variable", "timing"),
    rows_rest_in_soak([
        ("knocks", 5, "time", "intermittent"), ("own_wake", 0, "speed", "transient"),
        ("vortex_shedding", 1, "speed", "periodic"), ("ballast_pump", 2, "time", "periodic"),
    ]),
)  # fmt: skip
def test_a_force_that_comes_and_goes_is_unexplained(name, dof, variable, timing):
    left = left_of(name, 330_901)
    assert (dof, variable, timing) in {
        (force.dof, force.variable, force.timing) for force in unexplained_forces(left)
    }


@pytest.mark.parametrize(
    ("with_changes", "timing", "share", "is_left"),
    [
        (True, "intermittent", 0.005, False), (True, "intermittent", 0.02, True),
        (False, "intermittent", 0.002, False), (False, "intermittent", 0.005, True),
        (False, "periodic", 0.005, False), (False, "periodic", 0.02, True),
    ],
)  # fmt: skip
def test_a_burst_counts_from_a_hundredth_of_the_thrust_on_and_apart_from_its_changes_from_less(
    weighing, monkeypatch, with_changes, timing, share, is_left
):
    course = weighing.now.course
    thrust = course.wrench_of(course.thrust_n)[:, 1]
    changes = np.abs(np.diff(thrust, prepend=thrust[:1]))
    force = np.where(changes > 5.0 * np.std(changes), 1.0, 0.0) if with_changes else np.ones(len(thrust))
    burst = GenericForce(1, "time", None, force, timing)
    found = unexplained._Weighed(burst, 50.0, share * float(np.std(thrust)))
    monkeypatch.setattr(unexplained, "_bursts", lambda *_: [found])
    left = unexplained_of(weighing, weighing.fitted(()))
    assert any(shape is burst for shape in left.shapes) is is_left
    # Of no cause nothing is in the place.
    assert left.instead == 0.0


def test_a_loud_stretch_now_and_then_is_foretold_and_one_noise_is_not():
    rng = np.random.default_rng(2)
    noise, piece = rng.standard_normal(400) ** 2, np.arange(400) // 20
    assert mixture_gain(noise, 1, piece) < 3.0
    noise[::17] *= 16.0
    assert mixture_gain(noise, 1, piece) > 20.0


@pytest.mark.parametrize(
    ("lasting_s", "later_s", "left", "forgets"),
    [
        (1000.0, 8.0, 0.31, False), (1000.0, 8.0, 0.29, True),
        # In a short dive chance leaves as much: of 92 s, four of its standard errors are 0.59.
        (100.0, 8.0, 0.61, False), (100.0, 8.0, 0.57, True),
        (40.0, 60.0, 1.0, True),
    ],
)  # fmt: skip
def test_a_sea_is_forgotten_after_four_of_its_correlation_times_but_for_a_third_and_chance(
    monkeypatch, lasting_s, later_s, left, forgets
):
    asked = []
    monkeypatch.setattr(slow, "_correlation", lambda _, steps: asked.append(steps) or left)
    now = SimpleNamespace(course=SimpleNamespace(since_s=[0.0, lasting_s], step_s=0.5))
    assert slow._forgets(np.zeros(2), later_s / 4.0, now) is forgets
    assert asked in ([], [2.0 * later_s])


def test_a_series_is_as_like_itself_some_steps_later_as_its_products_say():
    turning = np.tile([3.0, 1.0], 50)
    assert [slow._correlation(turning, steps) for steps in (0.2, 1.0, 2.4)] == pytest.approx(
        [-1.0, -1.0, 1.0]
    )
    assert slow._correlation(np.array([2.0, 0.0, 0.0, 2.0]), 9.0) == pytest.approx(-1.0)
    assert slow._correlation(np.full(9, 4.0), 1.0) == 0.0


@pytest.mark.parametrize(
    ("memories_s", "known", "found"),
    [
        # Roll tells nothing of the sea; half as slow again as the median of the others is as slow as a sea may be.
        ((2.0, 2.0, 3.1, 9.0), {}, {2: 2.0, 3: 2.0}),
        ((2.0, 2.0, 2.9, 1.0), {}, {}),
        ((2.0, 1.0, 2.2, 3.1), {}, {3: 2.0}),
        # Of a single other axis it counts as one of 4 s.
        ((2.0, 5.9, 9.0, 9.0), {"feedback_unrecorded": (2,)}, {3: 3.95}),
        ((2.0, 6.1, 9.0, 9.0), {"force_undetermined": (2, 3)}, {1: 4.0}),
        ((2.0, 6.1, 9.0, 9.0), {"filtered": (0, 1, 2)}, {3: 4.0}),
    ],
)
def test_a_disturbance_is_slow_that_lasts_half_as_long_again_as_the_sea_of_the_other_axes(
    monkeypatch, memories_s, known, found
):
    theta = np.zeros((4, 5))
    theta[:, TIME_CONSTANT] = np.log(memories_s)
    problems = [SimpleNamespace(axis=SimpleNamespace(dof=dof)) for dof in range(4)]
    slices = [slice(5 * k, 5 * k + 5) for k in range(4)]
    joint = SimpleNamespace(problems=problems, slices=slices, at=lambda _: problems)
    nothing = {"filtered": (), "feedback_unrecorded": (), "force_undetermined": ()}
    monkeypatch.setattr(slow, "_disturbance", lambda *_: None)
    monkeypatch.setattr(slow, "_forgets", lambda *_: False)
    now = SimpleNamespace(joint=joint, theta=theta.ravel(), **(nothing | known))
    seas = {dof: sea.memory_s for dof, sea in slow.slow_axes(now).items()}
    assert seas == pytest.approx(found)


@dataclass(frozen=True)
class Slowing:
    """Stands in for an axis that is the likelier the longer its disturbance lasts."""

    axis: SimpleNamespace
    prior_mean: Array
    prior_precision: Array

    def log_likelihood(self, theta: Array) -> float:
        return 10.0 * float(np.exp(theta[TIME_CONSTANT])) - 500.0


def test_a_slow_force_saves_what_its_disturbance_does_beyond_one_that_lasts_half_as_long_again_as_the_sea(
    monkeypatch,
):
    climbed = []
    monkeypatch.setattr(slow, "_disturbance", lambda *_: np.ones(3))
    monkeypatch.setattr(
        slow,
        "climb",
        lambda problem, theta, _: climbed.append((problem, theta)) or SimpleNamespace(theta=theta),
    )
    theta = np.zeros(5)
    theta[TIME_CONSTANT] = np.log(9.0)
    axis = Slowing(SimpleNamespace(dof=1), np.zeros(5), np.ones(5))
    force = slow._slow(axis, theta, None, slow.Sea(2.0, -0.7))
    assert (force.dof, force.gain) == (1, pytest.approx(10.0 * (9.0 - 1.5 * 2.0)))
    (_, free), (held, start) = climbed
    assert (free == theta).all()
    for at, value in ((TIME_CONSTANT, np.log(3.0)), (-1, -0.7)):
        assert start[at] == held.prior_mean[at] == pytest.approx(value)
        assert held.prior_precision[at] > 1e5
    assert sorted(held.prior_precision)[:3] == [1.0] * 3


def test_a_wild_reading_is_no_blow(weighing):
    axis, rows = (
        weighing.rows.axes[0],
        np.random.default_rng(3).standard_normal(len(weighing.rows.axes[0].std)),
    )
    time_s = weighing.now.course.time_s
    wild = rows.copy()
    wild[::150] += 30.0
    gains = [max(burst.gain for burst in bursts({0: (axis, values)}, time_s)) for values in (rows, wild)]
    assert gains[1] < gains[0] + 5.0


def test_a_velocity_that_is_read_seldom_for_some_time_makes_no_burst_of_noise():
    """Where it is read seldom, noise makes little of a push's score."""
    case = draw_case(391_518, kind="none", seconds=240.0)
    dive = dive_of(case)
    velocity = dive.velocity
    kept = ((velocity.time_s - velocity.time_s[0]) % 60.0 < 30.0) | (np.arange(len(velocity)) % 16 == 0)
    seldom = replace(dive, velocity=Signal(velocity.time_s[kept], velocity.value[kept]))
    now = planted_nominal(case, seldom)
    for axis in regression_of(now.joint, now.theta, ()).axes[:2]:
        noise = np.random.default_rng(6).standard_normal(len(axis.std))
        found = bursts({axis.problem.axis.dof: (axis, noise)}, now.course.time_s)
        assert max((burst.gain for burst in found), default=0.0) < 11.7


@pytest.mark.parametrize("is_sampled", [True, False])
def test_a_stretch_in_which_slow_commands_jump_tells_of_no_burst(is_sampled):
    rng = np.random.default_rng(7)
    at_s = 0.02 * np.arange(12_000)
    jumps = (at_s / 3.0).astype(int) % 10 == 4
    hidden = np.where(jumps, 8.0, 0.2) if is_sampled else np.zeros(0)
    score = rng.standard_normal(len(at_s)) * np.where(jumps, 6.0, 1.0)
    of = _AxisScores(at_s, score, [rng.standard_normal((len(at_s), 128))], hidden)
    stretches = _Stretches(3.0, 0.0, ((0.0, 240.0),))
    (scores_by_stretch,) = stretches.sums(of, (0.0,))
    assert (stretches.beside_noise(scores_by_stretch, of).uneven < 0.5) is is_sampled


def test_of_two_runs_each_has_its_whole_stretches_and_what_is_before_between_and_after_them_is_in_none():
    stretches = _Stretches(4.0, 0.5, ((0.0, 11.0), (20.0, 30.0), (40.0, 41.0)))
    assert stretches.count == 4
    index, within = stretches.at(np.array([1.9, 2.0, 5.0, 6.0, 10.0, 15.0, 21.0, 22.0, 29.0, 30.0, 40.5]))
    assert index.tolist() == [-1, 0, 0, 1, -1, -1, -1, 2, 3, -1, -1]
    assert within.tolist() == [0.0, 0.0, 0.75, 0.0, 0.0, 0.0, 0.0, 0.0, 0.75, 0.0, 0.0]


@pytest.mark.parametrize("rate", [0.0, 2.0])
def test_a_stretch_has_the_sum_of_its_instants_scores_and_what_comes_after_the_last_has_none(rate):
    at_s = 0.25 * np.arange(103)
    scores_of_all = np.random.default_rng(3).standard_normal((len(at_s), 3))
    stretches = _Stretches(5.0, 0.5, ((0.0, 25.5),))
    totals = stretches._turned(at_s)(rate)(scores_of_all)
    assert totals.shape == (stretches.count, 1 if rate == 0 else 2, 3)
    for k, total in enumerate(totals):
        of_it = (at_s >= 2.5 + 5.0 * k) & (at_s < 7.5 + 5.0 * k)
        # Before the first stretch of a run the weight is that of its first instant, none.
        weight = np.sin(np.pi * (at_s[of_it] - 2.5 - 5.0 * k) / 5.0) ** 2
        waves = [weight] if rate == 0 else [weight * wave(rate * at_s[of_it]) for wave in (np.cos, np.sin)]
        assert np.allclose(total, [wave @ scores_of_all[of_it] for wave in waves])


def test_a_line_in_time_is_among_the_lines_however_strong_those_in_the_way_are(weighing, monkeypatch):
    """At a steady speed a push of one period has many lines in the way travelled."""
    axis, course = weighing.rows.axes[0], weighing.now.course
    clocks = list(lines.clocks(course))
    ways = [replace(clocks[0], by="way") for _ in range(4)]
    monkeypatch.setattr(lines, "clocks", lambda _: (*ways, clocks[0]))
    (column,) = axis.by_course(course, [np.sin(2 * np.pi * course.since_s / 2.0)]).T
    rows = np.random.default_rng(5).standard_normal(len(axis.std)) + 5.0 * column
    found = lines.clusters(axis, rows, course)
    in_time = [cluster for cluster in found if cluster.clock.by == "time"]
    assert min(abs(2 * np.pi / cluster.rates[0] - 2.0) for cluster in in_time) < 0.02


def test_a_line_s_sidebands_are_within_twelve_rates_that_the_dive_resolves_of_it(monkeypatch):
    """Four rates are tried for each: their price is that of one of twenty-four."""
    rates, nats = np.arange(400.0), np.zeros(400)
    nats[[200, 248, 252]] = 50.0, 20.0, 30.0
    monkeypatch.setattr(lines, "_spectrum", lambda *_: (rates, nats))
    alone, with_sidebands = next(lines._peaks(None, None, None, None))
    assert (alone.rates, with_sidebands.rates) == ((200.0,), (200.0, 248.0))


def test_of_a_spectrum_the_three_strongest_lines_of_ten_nats_are_told_with_six_sidebands_at_most(monkeypatch):
    def peaks(nats_at, count=1000):
        nats = np.zeros(count)
        nats[[*nats_at]] = [*nats_at.values()]
        monkeypatch.setattr(lines, "_spectrum", lambda *_: (np.arange(float(count)), nats))
        clock = lines.Clock("time", np.zeros(1), (0.6, 60.0), np.ones(1))
        return [[cluster.rates for cluster in line] for line in lines._peaks(clock, None, None, None)], [
            [cluster.price_nats for cluster in line] for line in lines._peaks(clock, None, None, None)
        ]

    strong = {200: 40.0, 400: 30.0, 600: 20.0, 800: 10.5}
    beside = {200 + 5 * k: 5.3 + 0.1 * k for k in range(1, 9)} | {195: 5.1}
    rates, prices = peaks(strong | beside)
    assert rates == [[(200.0,), (200.0, 240.0, 235.0, 230.0, 225.0, 220.0, 215.0)], [(400.0,)], [(600.0,)]]
    assert prices == [[pytest.approx(3.9), pytest.approx(3.9 + 6 * 3.2)], [3.9], [3.9]]
    assert peaks({200: 10.1, 400: 9.9})[0] == [[(200.0,)]]
    # A dive too short for its chance level tells no line.
    assert (peaks({40: 30.0}, 79)[0], peaks({40: 30.0}, 80)[0]) == ([], [[(40.0,)]])


def test_a_rate_saves_one_nat_by_chance_and_those_of_a_band_are_four_for_each_that_a_dive_resolves():
    time_s = 900.0 + 0.1 * np.arange(6001)

    def spectrum(period_s, lasting=6001):
        noise = np.random.default_rng(12).standard_normal(lasting)
        wave = 0.3 * np.sin(2 * np.pi * time_s[:lasting] / period_s)
        clock = lines.Clock("time", time_s[:lasting], (0.6, 60.0), np.ones(lasting))
        return lines._spectrum(clock, noise + wave, time_s[:lasting], time_s[:lasting])

    rate, nats = spectrum(np.inf)
    assert nats.mean() == pytest.approx(1.0, abs=0.1)
    assert (rate[0], rate[-1]) == pytest.approx((2 * np.pi / 60.0, 2 * np.pi / 0.6), rel=0.03)
    assert np.diff(rate) == pytest.approx(2 * np.pi / 2400.0, rel=1e-3)
    # A wave of an amplitude of 0.3 of the noise has 0.3^2 / 4 of the power of n instants.
    best = []
    for period_s in (3.0, 4.0, 5.0, 7.0, 11.0, 17.0):
        rate, nats = spectrum(period_s)
        assert 2 * np.pi / rate[np.argmax(nats)] == pytest.approx(period_s, rel=5e-3)
        best.append(nats.max())
    assert np.mean(best) == pytest.approx(0.0225 * 6001, rel=0.25)
    assert [len(spectrum(np.inf, count)[0]) > 0 for count in (1199, 1202)] == [False, True]


def test_a_line_is_one_in_time_or_in_the_way_travelled_where_its_size_goes_with_the_speed_s_square():
    nu = np.zeros((5, 6))
    nu[:, 1] = 0.5, -0.5, 0.25, 0.5, 1.0
    in_time, *in_way = lines.clocks(SimpleNamespace(nu=nu, since_s=np.arange(5.0), step_s=2.0))
    assert (in_time.by, in_time.band, in_time.size.tolist()) == ("time", (0.6, 60.0), [1.0] * 5)
    np.testing.assert_array_equal(in_time.phase, range(5))
    assert [(clock.by, clock.band) for clock in in_way] == [("way", (0.3, 8.0))] * 6
    even, odd = in_way[2:4]
    np.testing.assert_allclose(even.phase, [0.0, 1.0, 2.0, 2.5, 3.5])
    np.testing.assert_allclose(even.size, nu[:, 1] ** 2)
    np.testing.assert_allclose(odd.size, nu[:, 1] * abs(nu[:, 1]))


@pytest.mark.parametrize("at_sea", [False, True])
def test_a_line_in_time_is_a_periodic_force_in_still_water_and_one_of_the_sea_s_at_sea(weighing, at_sea):
    course, fit, innovations = weighing.now.course, weighing.fitted(()), weighing.rows.axes[0]
    known, value = unexplained._known(weighing, fit), fit.value.copy()
    line = np.sin(2 * np.pi * course.since_s / 2.0)[:, None]
    value[known.slices[0]] += 5.0 * innovations.prewhitened(innovations.by_course(course, line.T))[:, 0]
    axis = unexplained._axis_with_causes(weighing, value, known, 0, at_sea)
    found = {(item.shape.variable, item.shape.timing) for item in unexplained._lines(axis, course, at_sea)}
    assert (("time", "periodic") in found) is not at_sea


@pytest.mark.parametrize("long_s", [3.0, 6.0])
@pytest.mark.parametrize("later", [0.0, 0.5])
def test_blows_are_found_in_the_middle_of_a_stretch_and_between_two(weighing, later, long_s):
    axis, time_s = weighing.rows.axes[0], weighing.now.course.time_s
    since = weighing.now.course.since_s / long_s - later
    blows = np.where(since.astype(int) % 5 == 2, np.sin(np.pi * since) ** 2, 0.0)
    (column,) = axis.by_course(weighing.now.course, [blows]).T
    noise = np.random.default_rng(4).standard_normal(len(axis.std))
    best = max(bursts({0: (axis, noise + 5.0 * column)}, time_s), key=lambda burst: burst.gain)
    assert best.gain > 11.7
    assert np.corrcoef(np.abs(best.force(time_s)), blows)[0, 1] > 0.9


PERIOD_S = 90.0


def pushed(time_s: Array, vehicle_nm: float) -> Array:
    """Slow, with no period and no end: two turns that never come back in step."""
    return vehicle_nm * (np.sin(2 * np.pi * time_s / PERIOD_S) + np.sin(2.7 * np.pi * time_s / PERIOD_S))


def fitted(case: Case) -> Nominal:
    return fitted_nominal(dive_of(case), case.file, case.configuration)


def time_s(now: Nominal, dof: int) -> float:
    """The correlation time that was fitted to an axis's disturbance."""
    problems = zip(now.joint.problems, now.joint.slices, strict=True)
    (of_axis,) = [of_axis for problem, of_axis in problems if problem.axis.dof == dof]
    return float(np.exp(now.theta[of_axis][TIME_CONSTANT]))


@pytest.fixture(scope="module")
def quiet() -> Case:
    return draw_case(391_518, kind="none", seconds=300.0)


@pytest.fixture(scope="module")
def still(quiet: Case) -> Nominal:
    """Its filters: the disturbance of a sea is not slow."""
    now = fitted(quiet)
    assert all(force.gain < 11.7 for force in slow_forces(now))
    return now


def with_times(now: Nominal, times_s: dict[int, float]) -> Nominal:
    """The same filters with other correlation times by degree of freedom."""
    theta = now.theta.copy()
    for problem, of_axis in zip(now.joint.problems, now.joint.slices, strict=True):
        theta[of_axis.start + TIME_CONSTANT] = np.log(times_s[problem.axis.dof])
    return replace(now, theta=theta)


def test_a_memory_that_is_held_behind_a_filter_tells_nothing_of_the_sea(
    still: Nominal, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(slow, "_forgets", lambda *_: False)
    filtered = with_times(still, {dof: 1.5 if dof < 3 else 5.5 for dof in range(6)})
    assert set(slow_axes(filtered)) == {3, 4, 5} & {p.axis.dof for p in still.joint.problems}
    assert slow_axes(replace(filtered, filtered=(0, 1, 2))) == {}


def test_roll_and_pitch_do_not_tell_the_other_axes_how_long_the_sea_remembers(
    still: Nominal, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(slow, "_forgets", lambda *_: False)
    assert slow_axes(with_times(still, {dof: 0.5 if dof in (2, 3, 4) else 1.5 for dof in range(6)})) == {}


def test_a_dive_that_is_short_beside_the_sea_shows_no_slow_force(still: Nominal) -> None:
    lasting_s = float(still.course.since_s[-1])
    rising = np.linspace(-1.0, 1.0, len(still.course.time_s))
    assert not slow._forgets(rising, 0.01 * lasting_s, still)
    assert slow._forgets(rising, 0.13 * lasting_s, still)


def test_a_slow_push_that_the_disturbance_took_up_is_told_with_its_axis_and_course() -> None:
    quiet = draw_case(391_520, kind="none", seconds=300.0)
    size = 2.0 * float(quiet.vehicle.disturbance[5])

    def apply(scenario: Scenario, _: np.random.Generator) -> None:
        scenario.push[:, 5] += pushed(scenario.time_s, size)

    now = fitted(replace(quiet, planted=(Planted("push", {}, apply, 1.0, novel=True),)))
    assert [*slow_axes(now)] == [5]
    (push,) = slow_forces(now)
    true = pushed(now.course.time_s, size)
    assert push.gain > 23.4
    assert np.corrcoef(push.force, true)[0, 1] > 0.8
    assert np.std(push.force) == pytest.approx(np.std(true), rel=0.3)
    weighing = weighing_of(now, ())
    shapes = [(shape.dof, shape.timing) for shape in unexplained_of(weighing, weighing.fitted(())).shapes]
    assert (5, "drifting") in shapes


@pytest.mark.parametrize(
    ("name", "seed", "near", "parameters"),
    [("waves", 300_911, 0.15, 6), ("varying_current", 300_912, 0.3, 4)],
)
def test_a_sea_that_comes_and_goes_is_among_the_candidates_with_its_period(name, seed, near, parameters):
    case = draw_case(seed, names=[name], size=0.7, seconds=200.0)
    true_s = case.truth()["effects"][0]["parameters"]["period"]
    of_name = [effect for effect in seas_of(planted_nominal(case)) if effect.name == name]
    assert of_name
    for effect in of_name:
        lines_s = [
            float(period) for period in effect.variant.removesuffix(" s").replace(" and ", ", ").split(", ")
        ]
        assert all(line_s == pytest.approx(true_s, rel=near) for line_s in lines_s)
        assert len(effect.parameters) == len(lines_s) * parameters


def test_the_force_that_periods_are_read_from_lacks_nothing_of_the_hull_s_own_quadratic_drag():
    case = draw_case(300_933, names=["quadratic_drag"], seconds=100.0)
    now = nominal_of(dive_of(case), damped(case.file, "both"), case.configuration)
    disturbance = [float(np.exp(now.theta[of_axis][DISTURBANCE])) for of_axis in now.joint.slices]
    assert np.all(np.std(seas._missing(now), axis=0) < 1.2 * np.array(disturbance[:3]))


def test_a_period_is_known_to_half_a_turn_in_the_dive():
    low, high = period_interval(90.0, 600.0)
    assert (1 / low - 1 / 90.0) * 600.0 == pytest.approx(0.5)
    assert (1 / 90.0 - 1 / high) * 600.0 == pytest.approx(0.5)


@pytest.mark.parametrize("dims", [1, 2])
def test_stretches_of_noise_are_as_even_as_a_gaussian_and_one_that_is_loud_makes_them_uneven(dims):
    total = 3.0 * np.random.default_rng(8).standard_normal((100_000, dims))
    assert _StretchScores(total).uneven == pytest.approx(0.0, abs=0.05)
    assert _StretchScores(np.vstack([total[:50], np.full((1, dims), 30.0)])).uneven > 1.0
