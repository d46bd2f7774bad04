"""Information of a motion on mass and damping, priors, and the proposed manoeuvres."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from soak import rest_in_soak, rows_rest_in_soak

from bridge.errors import ConfigError, FitError
from bridge.simulator.direct import QUIET, simulate_truth
from bridge.simulator.missions import load_mission, survey
from bridge.simulator.truth import load_truth
from bridge.vehicle.autopilot import Autopilot
from bridge.vehicle.coefficients import BY_NAME, HEAVE, SURGE, SWAY, YAW
from bridge.vehicle.config import Prior, ThrustCurve, load_vehicle
from bridge.vehicle.legs import Leg, Mission
from bridge.vehicle.mode import Mode
from bridge.vehicle.navigation import Navigation
from bridge.vehicle.references import Reference
from identify.planning.knowledge import (
    COUNTED,
    NAMES,
    AxisNoise,
    after,
    axis_of,
    before_any_dive,
)
from identify.planning.limits import Limits, Tank
from identify.planning.manoeuvres import Drive, coast_down, laps, square, sweep
from identify.planning.propose import drivable, mission_legs, propose, relative_std, stamped
from identify.planning.writing import DOUBT, instruction, mission_text, needs, notes, pulses
from identify.run.plan import before_dives

FILE = load_vehicle("ruvifist:hovering")
TRUTH = load_truth(FILE, "hovering")
KNOWN = replace(before_any_dive(FILE, "hovering"), values=dict(TRUTH.model))
TANK = Tank(FILE, "hovering", KNOWN)
PUSH = Drive(SURGE, "push_surge_n", 24.0)
SPIN = Drive(YAW, "yaw_rad_s", 0.3)


@pytest.fixture
def few(monkeypatch):
    """The families of manoeuvres that a plan tries: for tests that do not judge which of all it takes."""
    return lambda *families: monkeypatch.setattr("identify.planning.propose._families", lambda *_: families)


def known_to(widths):
    precision = np.diag([widths[name] ** -2.0 if name in widths else 0.0 for name in COUNTED])
    return replace(KNOWN, precision=precision)


@pytest.mark.parametrize(
    "family",
    rest_in_soak(
        [square(4.0, PUSH), square(8.0, SPIN), sweep(PUSH), coast_down(32.0, PUSH),
         laps(4.0, Drive(SURGE, "surge_m_s", 0.4)), square(32.0, PUSH)],
        keep=5,
    ),
    ids=lambda family: f"{family.kind} {family.period_s:g}",
)  # fmt: skip
def test_a_manoeuvre_ends_where_it_began_and_at_rest(family):
    manoeuvre = family.at(1.0, 2)
    assert manoeuvre.duration_s == pytest.approx(2 * family.period_s)
    trial = TANK.dive(manoeuvre.legs())
    place = np.cumsum(trial.nu[:, [SURGE, YAW]], axis=0) * 0.05
    room = max(trial.across_m, 0.1)
    assert np.all(np.abs(trial.nu[-1]) < 0.03)
    assert abs(place[-1, 0]) < 0.15 * room
    assert abs(place[-1, 1]) < 0.15


def test_a_proposal_keeps_within_time_space_speed_and_thrust():
    limits = Limits(space_m=3.0, speed_m_s=0.3)
    result = propose(TANK, limits, 90.0, [SURGE, YAW])
    assert result.duration_s <= 90.0
    assert result.trial.over(limits) <= 1.05
    assert result.trial.thrust_share <= 0.52


class Tumbling(Tank):
    """Vehicle A, were it to tumble at a push of more than 3 N, and in laps."""

    def dive(self, legs):
        trial = super().dive(legs)
        tumbles = any(abs(leg.push_surge_n or 0.0) > 3.0 or leg.surge_m_s for leg in legs)
        return replace(trial, nu=50 * trial.nu) if tumbles else trial


def test_a_push_at_which_the_hull_tumbles_leaves_one_just_below_it(few):
    few(square(4.0, PUSH))
    (part,) = propose(Tumbling(FILE, "hovering", KNOWN), Limits(), 60.0, [SURGE]).parts
    assert 2.4 < part.manoeuvre.amplitudes[0] <= 3.0


@pytest.mark.soak
@pytest.mark.parametrize("space_m", [0.6, 3.0])
def test_every_manoeuvre_keeps_the_space_with_its_drift(space_m):
    result = propose(TANK, Limits(space_m=space_m), 200.0, [SURGE, SWAY])
    assert 150.0 < result.duration_s <= 200.0
    assert all(0 < part.drift_m < part.needs_m <= space_m for part in result.parts)


@pytest.mark.parametrize(
    ("limits", "room_m"),
    rows_rest_in_soak(
        [(Limits(depth_space_m=9.0), 1.5), (Limits(depth_space_m=0.2), 0.2), (Limits(space_m=0.2), 0.2)],
        keep=2,
    ),
    ids=["not to the surface", "as given", "as across"],
)
def test_every_manoeuvre_keeps_the_room_up_and_down(limits, room_m):
    result = propose(TANK, limits, 120.0, [HEAVE])
    assert limits.heave_m == room_m
    assert all(0.5 * min(room_m, 0.5) < part.trial.depth_m <= room_m for part in result.parts)


def test_too_little_room_is_said_with_what_could_give_more(few):
    few(square(4.0, PUSH))
    with pytest.raises(FitError, match=r"0\.001 m across and 0\.001 m up and down .* give more by --space"):
        propose(TANK, Limits(space_m=0.001), 60.0, [SURGE])


def test_what_the_dive_alone_tells_stands_beside_what_it_tells_with_the_rest(few):
    few(square(4.0, PUSH))
    place = NAMES.index("D_u")
    fresh = propose(TANK, Limits(), 60.0, [SURGE])
    assert np.isinf(fresh.before[place])
    assert np.array_equal(fresh.alone, fresh.after)
    result = propose(Tank(FILE, "hovering", known_to({"D_u": 0.004})), Limits(), 60.0, [SURGE])
    assert result.after[place] ** -2 == pytest.approx(result.alone[place] ** -2 + 0.004**-2, rel=1e-3)


def test_what_hangs_on_when_thrust_acts_no_time_makes_narrower(few):
    """Yaw is quick, and half a millisecond of thrust's timing is worth more of its damping than all noise."""
    few(square(8.0, SPIN))
    place = NAMES.index("D_r")
    short, long = (propose(TANK, Limits(), s, [YAW]).after[place] for s in (60.0, 240.0))
    assert short / 2 < long < short
    precision = np.diag(np.full(len(NAMES), 100.0**2))
    timing = np.zeros((1, len(NAMES)))
    timing[0, place] = 0.02 * 100.0**2 / 0.0005
    assert relative_std(stamped(precision, timing))[place] == pytest.approx(np.hypot(0.01, 0.02))


def test_what_is_known_least_is_aimed_at():
    sharp = known_to({"M_u": 1e-4, "D_u": 1e-4, "M_v": 1e-4, "D_v": 1e-4})
    result = propose(Tank(FILE, "hovering", sharp), Limits(), 90.0, [SURGE, YAW])
    assert {dof for part in result.parts for dof in part.manoeuvre.dofs} == {YAW}


def test_what_is_asked_for_alone_is_aimed_at():
    result = propose(TANK, Limits(), 90.0, [SURGE, YAW], know=["I_r"])
    assert {dof for part in result.parts for dof in part.manoeuvre.dofs} == {YAW}
    with pytest.raises(
        FitError, match=r"no plan tells M_w; along the axes planned it tells M_u, D_u, I_r, D_r"
    ):
        propose(TANK, Limits(), 90.0, [SURGE, YAW], know=["M_w", "I_r"])


def test_laps_that_take_longer_than_there_is_time_are_not_even_tried(monkeypatch):
    dived, dive = [], Tank.dive

    def counted(tank, legs):
        dived.append(sum(leg.duration_s for leg in legs))
        return dive(tank, legs)

    monkeypatch.setattr(Tank, "dive", counted)
    wide = propose(TANK, Limits(1e9), 120.0, (SURGE,))
    assert max(dived) <= 120.0
    assert wide.parts[0].manoeuvre.kind != "laps"


def test_too_little_time_is_said_with_what_it_would_take():
    with pytest.raises(
        FitError, match=r"takes 42 s with its rests, and there are 20 s; give --minutes 0\.7 or"
    ):
        propose(TANK, Limits(), 20.0, [YAW])
    assert propose(TANK, Limits(), 60.0 * 0.7, [YAW]).duration_s <= 42.0


def test_an_axis_that_no_thruster_pushes_is_left_out_or_refused():
    shape = FILE.vehicle.configurations["hovering"]
    flat = replace(shape, thrusters=tuple(t for t in shape.thrusters if t.direction[2] == 0.0))
    file = replace(FILE, vehicle=replace(FILE.vehicle, configurations={"hovering": flat}))
    assert drivable(Tank(file, "hovering", KNOWN), (SURGE, SWAY, HEAVE, YAW)) == (SURGE, SWAY, YAW)
    with pytest.raises(FitError, match="none of heave"):
        propose(Tank(file, "hovering", KNOWN), Limits(), 60.0, [HEAVE])


def test_the_mission_is_read_back_as_the_legs_that_were_promised_and_as_a_crew_reads_them(few, tmp_path):
    few(square(4.0, PUSH), square(8.0, SPIN))
    result = propose(TANK, Limits(), 100.0, [SURGE, YAW])
    path = tmp_path / "plan.yaml"
    path.write_text(mission_text(result, "ruvifist: a plan", "seatrial simulate", TANK), encoding="utf-8")
    mission = load_mission(path)
    promised = mission_legs([part.manoeuvre for part in result.parts])
    assert mission.duration_s == pytest.approx(result.duration_s)
    assert [leg for leg in mission.legs if leg.phase != "rest"] == [
        leg for leg in promised if leg.phase != "rest"
    ]
    assert all(instruction(part) in path.read_text(encoding="utf-8") for part in result.parts)
    first = result.parts[0]
    assert first.manoeuvre.period_s == 4.0
    assert instruction(first).startswith("surge: square wave ±")
    assert needs(first).endswith(" m across")
    words = pulses(first.manoeuvre, TANK)
    assert words.startswith("ahead: ")
    assert "on 1 2 3 4; astern: " in words


@pytest.mark.parametrize("neutral_us", [1100.0, 1500.0])
def test_a_plan_gives_pulse_widths_of_the_thrusters_that_push_and_of_none_at_rest(few, neutral_us):
    few(square(4.0, PUSH))
    push = propose(TANK, Limits(), 60.0, [SURGE]).parts[0].manoeuvre
    curve = ThrustCurve("quadratic", max_n=50.0, neutral_us=neutral_us)
    tank = Tank(replace(FILE, vehicle=replace(FILE.vehicle, thrust_curve=curve)), "hovering", KNOWN)
    groups = re.findall(r"\d+ on ([\d ]+)", pulses(push, tank))
    assert {number for group in groups for number in group.split()} == {"1", "2", "3", "4"}


def test_a_turn_fills_its_time_has_no_pulse_widths_and_stays_in_place():
    plan = propose(TANK, Limits(), 60.0, [YAW])
    assert 55.0 <= plan.duration_s <= 60.0
    result = plan.parts[0]
    assert pulses(result.manoeuvre, TANK) == ""
    assert needs(result) == "stays in place"
    assert instruction(result).endswith(" s, stays in place")
    assert f"±{math.degrees(result.manoeuvre.amplitudes[0]):.3g} deg/s" in instruction(result)
    assert result.manoeuvre.by_hand.startswith("turning right"), "right alone is a push aside"


def test_a_drag_that_the_time_of_the_thrust_hides_in_waves_is_told_by_turns_at_a_steady_rate():
    plan = propose(TANK, Limits(), 150.0, [YAW])
    assert "laps" in [part.manoeuvre.kind for part in plan.parts]
    known = dict(zip(NAMES, plan.after, strict=True))
    # By waves alone, however many, 0.0074.
    assert known["D_r"] < 0.003
    assert known["I_r"] < 0.004


def test_time_goes_to_what_is_asked_to_be_known_best(few):
    few(square(4.0, PUSH), square(8.0, SPIN))

    def surge_s(**aims):
        plan = propose(TANK, Limits(), 240.0, [SURGE, YAW], know=("D_u", "D_r"), aims=aims)
        return sum(part.manoeuvre.duration_s for part in plan.parts if SURGE in part.manoeuvre.dofs)

    assert surge_s(D_u=0.002, D_r=0.02) > 2 * surge_s(D_u=0.02, D_r=0.004)


STEP_S = 0.05
MASS, DAMPING = 64.0, 42.0
"""Vehicle A: 64 kg in all, 21 N of drag at 0.5 m/s."""


def square_wave(force_n, period_s, seconds):
    """Velocity under a square wave of force between two rests of 8 s."""
    time_s = np.arange(0.0, seconds + 16.0, STEP_S)
    since_s = time_s - 8.0
    force = force_n * np.sign(np.cos(2 * np.pi * (since_s + 0.25 * STEP_S) / period_s))
    force[(since_s < 0) | (since_s >= seconds)] = 0.0
    keep = np.exp(-DAMPING / MASS * STEP_S)
    velocity = np.zeros(len(time_s))
    for i in range(1, len(time_s)):
        velocity[i] = keep * velocity[i - 1] + (1 - keep) * force[i - 1] / DAMPING
    return velocity


def exact_information(velocity, noise, every, more=()):
    """dm' S^-1 dm of readings every so many steps, the trim force projected out; S by brute force. `more`: forces
    beside those of mass and damping."""
    n = len(velocity)
    keep, gain = np.exp(-DAMPING / MASS * STEP_S), (1 - np.exp(-DAMPING / MASS * STEP_S)) / DAMPING
    answer = gain * np.array([[keep ** (i - 1 - j) if j < i else 0.0 for j in range(n)] for i in range(n)])
    lag = np.abs(np.arange(n)[:, None] - np.arange(n)) * STEP_S
    force = noise.disturbance**2 * np.exp(-lag / noise.time_constant_s)
    acceleration = np.gradient(velocity, STEP_S)
    shapes = np.column_stack(
        [answer @ shape for shape in (-MASS * acceleration, -DAMPING * velocity, *more, np.ones(n))]
    )
    read = slice(0, None, every)
    covariance = (answer @ force @ answer.T)[read, read]
    covariance += noise.velocity / (STEP_S * every) * np.eye(len(covariance))
    whole = shapes[read].T @ np.linalg.solve(covariance, shapes[read])
    return np.asarray(whole[:-1, :-1] - np.outer(whole[:-1, -1], whole[-1, :-1]) / whole[-1, -1])


@pytest.mark.parametrize("period_s", [4.0, 16.0])
def test_it_is_the_exact_gaussian_information_within_a_few_percent(period_s):
    noise = AxisNoise(1.0, 1.5, 0.004**2 / 10)
    velocity = square_wave(20.0, period_s, 32.0)
    exact = exact_information(velocity, noise, 2)
    axis = axis_of(STEP_S, velocity, MASS, DAMPING, 0.0, noise)
    result = np.diag(axis.information(axis.answers))
    # The trim force and the ends of the record, which the spectrum leaves out, cost the slow wave most.
    assert np.sqrt(result) == pytest.approx(np.sqrt(np.diag(exact)), rel=0.08)
    assert abs(exact[0, 1]) < 0.1 * np.sqrt(exact[0, 0] * exact[1, 1])


def test_quadratic_drag_beside_the_linear_one_leaves_it_as_wide_as_exactly():
    """The motion and its impedance are those of the linear drag; the quadratic one is so small that it changes them
    by nothing."""
    noise, small = AxisNoise(1.0, 1.5, 0.004**2 / 10), 1e-3
    velocity = square_wave(20.0, 8.0, 32.0)
    exact = exact_information(velocity, noise, 2, [-small * np.abs(velocity) * velocity])
    axis = axis_of(STEP_S, velocity, MASS, DAMPING, small, noise)
    ours = axis.information(axis.answers)
    wide = [np.sqrt(np.linalg.inv(each)[1, 1]) for each in (ours, exact)]
    assert wide[0] == pytest.approx(wide[1], rel=0.1)
    assert wide[0] > 2 / np.sqrt(ours[1, 1]), "both resemble each other"


def test_a_vehicle_with_quadratic_drag_is_pushed_harder_and_its_drags_are_promised_less(few):
    few(square(8.0, PUSH))
    hard = before_dives(load_vehicle("bluerov2"))
    linear = {name: value for name, value in hard.knowledge.values.items() if name in BY_NAME}
    easy = Tank(hard.file, hard.configuration_name, replace(hard.knowledge, values=linear))
    linear_only, both = (propose(tank, Limits(space_m=3.0), 60.0, [SURGE]) for tank in (easy, hard))
    place = NAMES.index("D_u")
    assert both.after[place] > 2 * linear_only.after[place]
    assert both.parts[0].manoeuvre.amplitudes > linear_only.parts[0].manoeuvre.amplitudes


def test_time_goes_first_to_what_is_known_worse_than_asked():
    before = known_to({"M_u": 0.035, "D_u": 0.035, "I_r": 1e-4, "D_r": 0.04})
    tank = Tank(FILE, "hovering", before)

    def axes(**aim):
        parts = propose(tank, Limits(), 45.0, [SURGE, YAW], **aim).parts
        return {dof for part in parts for dof in part.manoeuvre.dofs}

    assert (axes(), axes(aims=dict.fromkeys(("M_u", "D_u", "I_r", "D_r"), 0.04))) == ({SURGE}, {YAW})


def test_surge_mass_of_vehicle_a_is_known_to_0_28_percent_by_a_square_wave_and_to_2_85_by_the_lap():
    """60 s at 1 N; the disturbance's time constant (4.5 s) and the DVL (4 mm/s at 8 Hz) are chosen here."""
    file = load_vehicle("ruvifist:survey")
    shape = replace(file.vehicle.configurations["survey"], dry_mass_kg=45.0)
    file = replace(file, vehicle=replace(file.vehicle, configurations={"survey": shape}))
    knowledge = before_any_dive(file, "survey")
    knowledge = replace(knowledge, values={**knowledge.values, "M_u": MASS, "D_u": DAMPING})
    tank, noise = Tank(file, "survey", knowledge), AxisNoise(1.0, 4.5, 0.004**2 / 8)

    def known_to(legs):
        axis = axis_of(STEP_S, tank.dive(legs).nu[:, 0], MASS, DAMPING, 0.0, noise)
        return float(100 / np.sqrt(axis.information(axis.answers)[0, 0]))

    wave = square(4.0, Drive(SURGE, "push_surge_n", 24.0)).at(1.0, 15)
    lap = [leg for leg in survey().legs if leg.name.startswith("lap 0.5 m/s, ")][:8]
    assert wave.duration_s == 60.0
    assert sum(leg.duration_s for leg in lap) == pytest.approx(61.0)
    assert known_to(wave.legs()) == pytest.approx(0.28, rel=0.1)
    assert known_to(lap) == pytest.approx(2.85, rel=0.12)


def with_shape(**changes):
    shape = replace(FILE.vehicle.configurations["hovering"], **changes)
    return replace(FILE, vehicle=replace(FILE.vehicle, configurations={"hovering": shape}))


def identified(**changes):
    """The JSON of an identification that found surge, its mass and damping entangled."""
    parameters = [{"name": name, "value": None} for name in NAMES]
    parameters[NAMES.index("M_u")]["value"] = 110.0
    parameters[NAMES.index("D_u")]["value"] = 55.0
    return {
        "configuration": "hovering",
        "vehicle": {"name": "ruvifist"},
        "outcome": "converged",
        "parameters": parameters,
        "covariance": {"of": ["M_u", "D_u"], "matrix": [[1.21, -0.3], [-0.3, 0.5]]},
        "nuisance": {"surge_disturbance_std_n": 0.8, "surge_disturbance_time_constant_s": 4.0,
                     "surge_dvl_noise_std_m_s": 0.006},
        **changes,
    }  # fmt: skip


def test_a_prior_goes_before_the_files_model_and_that_before_a_guess_which_is_said():
    shape = with_shape(model={"M_u": 120.0, "M_v": 120.0, "D_v": 0.0}, priors={"M_u": Prior(111.0, 2.22)})
    bare = before_any_dive(load_vehicle("bluerov2_heavy"), "heavy")
    assert any("no DVL and no IMU" in sentence for sentence in bare.sentences)
    assert any("beside an autopilot the IMU is the autopilot's" in sentence for sentence in bare.sentences)
    known = before_any_dive(FILE, "hovering")
    assert (known.values["M_u"], known.values["D_r"]) == pytest.approx((72.0 * 1.4, 10.5 * 0.7))
    assert any("M_u" in sentence and "far off" in sentence for sentence in known.sentences)
    assert np.all(np.isinf(relative_std(known.precision)))
    known = before_any_dive(shape, "hovering")
    assert known.guessed == set(NAMES) - {"M_u"}
    assert (known.values["M_u"], known.values["M_v"]) == (111.0, 120.0)
    assert known.values["D_v"] == pytest.approx(72.0 * 0.7)
    assert relative_std(known.precision)[NAMES.index("M_u")] == pytest.approx(0.02)
    assert after(identified(), FILE, "hovering", "a.json").guessed == set(NAMES) - {"M_u", "D_u"}
    vague = identified(covariance={"of": ["M_u", "D_u"], "matrix": [[11.0**2, 0.0], [0.0, 0.5]]})
    assert after(vague, FILE, "hovering", "a.json").guessed == set(NAMES) - {"D_u"}


def test_an_identification_brings_its_values_its_widths_and_its_noise():
    known = after(identified(), FILE, "hovering", "hovering.json")
    widths = dict(zip(NAMES, relative_std(known.precision), strict=True))
    assert known.values["M_u"] == 110.0
    assert widths["M_u"] == pytest.approx(1.1 / 110.0)
    assert widths["D_u"] == pytest.approx(np.sqrt(0.5) / 55.0)
    assert np.isinf(widths["M_v"])
    noise = known.noise[0]
    assert (noise.disturbance, noise.time_constant_s) == (0.8, 4.0)
    assert noise.velocity == pytest.approx(0.006**2 / 10.0)
    assert known.noise[1] == before_any_dive(FILE, "hovering").noise[1]


def test_an_identification_with_quadratic_drag_brings_that_too():
    source = before_dives(load_vehicle("bluerov2"))
    of, values = ["D_u", "X_uu"], {"D_u": 4.0, "X_uu": 20.0}
    said = identified(
        configuration="standard",
        vehicle={"name": "bluerov2"},
        parameters=[{"name": name, "value": values.get(name)} for name in COUNTED],
        covariance={"of": of, "matrix": [[0.04, -0.09], [-0.09, 0.25]]},
    )
    known = after(said, source.file, "standard", "first.json")
    assert (known.values["X_uu"], known.values["N_rr"]) == (20.0, 1.55)
    assert relative_std(known.precision)[NAMES.index("D_u")] == pytest.approx(0.05)


def test_a_value_that_is_hardly_known_is_not_planned_with_but_its_width_counts():
    vague = identified(covariance={"of": ["M_u"], "matrix": [[(0.8 * 110.0) ** 2]]})
    known = after(vague, FILE, "hovering", "hovering.json")
    assert known.values["M_u"] == pytest.approx(72.0 * 1.4)
    assert relative_std(known.precision)[0] == pytest.approx(0.8)
    assert any("M_u" in sentence for sentence in known.sentences)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"configuration": "survey"}, "configuration 'survey'"),
        ({"vehicle": {"name": "other"}}, "vehicle 'other'"),
        ({"covariance": {"of": ["M_u"], "matrix": [[1.0, 2.0]]}}, "not an identification"),
        ({"parameters": 3}, "not an identification"),
        *(
            ({"covariance": {"of": of, "matrix": matrix}}, "is damaged, for its covariance is none")
            for of, matrix in (
                (["M_u"], [[None]]),
                (["M_u"], [[-1.0]]),
                (["M_u", "M_u"], [[1.0, 0.5], [0.5, 1.0]]),
                (["M_u", "D_u"], [[1.0, 0.5], [0.4, 1.0]]),
                (["M_u", "D_u"], [[1.0, 2.0], [2.0, 1.0]]),
            )
        ),
        (
            {"parameters": [{"name": "M_u", "value": 1e300}, {"name": "D_u", "value": 55.0}]},
            "M_u is 1e\\+300",
        ),
        ({"nuisance": {"surge_disturbance_std_n": float("inf")}}, "surge_disturbance_std_n is no finite"),
    ],
)
def test_what_is_no_identification_of_this_configuration_is_refused(changes, says):
    with pytest.raises(ConfigError, match=says):
        after(identified(**changes), FILE, "hovering", "odd.json")


def test_a_single_coefficient_that_a_dive_does_not_tell_is_spoken_of_as_one():
    told = NAMES[1:]
    known = after(
        identified(
            parameters=[{"name": name, "value": 50.0} for name in NAMES],
            covariance={"of": list(told), "matrix": np.eye(len(told)).tolist()},
        ),
        FILE,
        "hovering",
        "a.json",
    )
    assert any(f"nothing of {NAMES[0]}: its value is the vehicle file's" in each for each in known.sentences)


def test_the_answer_of_another_verb_is_refused_by_what_it_lacks():
    with pytest.raises(
        ConfigError, match=r"as seatrial identify --json writes it \(it lacks 'configuration'\)"
    ):
        after({"verdict": "no_gap"}, FILE, "hovering", "diagnosis.json")


def test_values_that_hardly_correlate_need_not_do_so_alike_to_the_last_digit():
    """What an inversion leaves of none differs above and below the diagonal."""
    said = identified(covariance={"of": ["M_u", "D_u"], "matrix": [[1.21, 3e-14], [5e-14, 0.5]]})
    known = after(said, FILE, "hovering", "a.json")
    assert relative_std(known.precision)[NAMES.index("M_u")] == pytest.approx(1.1 / 110.0)


def test_the_doubts_of_the_dive_and_of_what_leans_on_them_stand_beside_what_a_plan_after_it_promises():
    sentence = "In heave 68 % follows from nothing recorded."
    doubt = {"about": ["M_w"], "sentence": sentence, "outcome": "converged", "also": ["D_w"]}
    known = after(identified(doubts=[doubt]), FILE, "hovering", "a.json")
    assert known.doubted == {"M_w": (sentence,), "D_w": (sentence,)}
    assert known.doubts == (sentence,)
    assert notes(known)[0] == f"{DOUBT} {sentence}"
    assert after(identified(), FILE, "hovering", "a.json").doubted == {}


def test_what_a_dive_had_no_readings_for_is_doubted_and_what_it_said_too_little_of_is_not():
    parameters = identified()["parameters"]
    reasons = {"M_w": "no velocity in heave was recorded", "D_w": "no velocity in heave was recorded",
               "D_u": "the dive says too little of surge"}  # fmt: skip
    doubted = [
        {**parameter, "reason": reasons[parameter["name"]]} if parameter["name"] in reasons else parameter
        for parameter in parameters
    ]
    known = after(identified(parameters=doubted), FILE, "hovering", "a.json")
    sentence = "Of M_w and D_w it told nothing: no velocity in heave was recorded."
    assert known.doubted == {"M_w": (sentence,), "D_w": (sentence,)}


STILL = (0.0,) * 6
PUSHED = Reference(
    (0.0, 0.2, 0, 0, 0, 0), (0.0, 0.1, 0, 0, 0, 0), 0.0, 0.6, (24.0, None, None, None, None, 0.0)
)
MOVING = Navigation(
    velocity=(0.3, 0.0, 0.0),
    velocity_time_s=0.0,
    rate=(0.0, 0.0, 0.1),
    rate_time_s=0.0,
    attitude=(1.0, 0.0, 0.0, 0.0),
    attitude_time_s=0.0,
    heading_rad=0.2,
    depth_m=0.6,
    depth_time_s=0.0,
)


def pilot(mode):
    model = {"M_u": 111.6, "D_u": 56.2, "M_v": 112.4, "D_v": 53.1, "I_r": 16.0, "D_r": 26.1}
    return Autopilot(FILE.vehicle, "hovering", lambda _: model, FILE.path.parent, mode)


@pytest.mark.parametrize("mode", list(Mode))
def test_the_thrusters_give_a_push_itself_in_every_mode(mode):
    actuation = pilot(mode).step(0.0, MOVING, PUSHED)
    assert actuation.tau_cmd[0] == pytest.approx(24.0)
    assert actuation.tau_cmd[5] == pytest.approx(0.0, abs=1e-9)
    assert actuation.tau_pid[0] == actuation.tau_pid[5] == 0.0
    alone = pilot(mode).step(0.0, MOVING, replace(PUSHED, push=(None,) * 6))
    assert actuation.tau_pid[1] == alone.tau_pid[1]


def test_a_push_begins_the_loop_anew_afterwards():
    fresh, used = pilot(Mode.OFF), pilot(Mode.OFF)
    hold = replace(PUSHED, push=(None,) * 6)
    for tick in range(10):
        used.step(0.05 * tick, MOVING, hold)
    used.step(0.5, replace(MOVING, velocity_time_s=0.5, rate_time_s=0.5, attitude_time_s=0.5), PUSHED)
    late = replace(MOVING, velocity_time_s=0.55, rate_time_s=0.55, attitude_time_s=0.55)
    fresh.step(0.5, late, PUSHED)
    assert used.step(0.55, late, hold).tau_pid[0] == fresh.step(0.55, late, hold).tau_pid[0]


def test_a_vehicle_that_lost_its_velocity_is_pushed_no_more():
    autopilot = pilot(Mode.OFF)
    autopilot.step(0.0, MOVING, PUSHED)
    actuation = autopilot.step(5.1, MOVING, PUSHED)
    assert actuation.tau_cmd[0] == pytest.approx(0.0, abs=1e-9)


def test_a_pushed_body_ends_at_force_over_damping_and_then_coasts():
    truth = load_truth(FILE, "hovering").calm()
    legs = (
        Leg(20.0, "ahead", "steady", push_surge_n=20.0),
        Leg(4.0, "coast", "deceleration", push_surge_n=0.0),
    )
    run = simulate_truth(FILE, "hovering", Mission("push", legs), seed=1, noise=QUIET, truth=truth)
    steady = 20.0 / truth.damping[0]
    assert run.nu[399, 0] == pytest.approx(steady, rel=1e-3)
    # The thrusters' lag is dead time in all but name: thrust dies out with it.
    coasted = steady * math.exp(
        -(4.0 - 0.05 - FILE.vehicle.thrust_curve.lag_s) * truth.damping[0] / truth.mass[0]
    )
    assert run.nu[-1, 0] == pytest.approx(coasted, rel=2e-3)
    assert np.all(run.column("tau_pid")[:, 0] == 0.0)


def test_a_leg_of_a_file_may_push_and_alternate(tmp_path):
    path = tmp_path / "square.yaml"
    path.write_text(
        "name: square\nlegs:\n  - {duration_s: 5, phase: rest}\n"
        "  - {duration_s: 2, push_surge_n: 24, push_sway_n: 0, alternate: 3}\n"
    )
    mission = load_mission(path)
    assert [leg.push_surge_n for leg in mission.legs] == [None, 24.0, -24.0, 24.0]
    assert mission.reference(6.0).push == (24.0, 0.0, None, None, None, None)
    assert mission.reference(4.0).push == (None,) * 6


def test_an_axis_is_not_pushed_and_led_at_once(tmp_path):
    path = tmp_path / "both.yaml"
    path.write_text("name: both\nlegs:\n  - {name: odd, duration_s: 5, push_surge_n: 3, surge_m_s: 0.3}\n")
    with pytest.raises(ConfigError, match="pushed or has a velocity to keep, not both"):
        load_mission(path)
