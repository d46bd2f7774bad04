"""Which manoeuvres are proposed: within the limits, and where they tell most."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from soak import rest_in_soak, rows_rest_in_soak

from bridge.errors import FitError
from bridge.simulator.missions import load_mission
from bridge.simulator.truth import load_truth
from bridge.vehicle.config import load_vehicle
from identify.estimators.misfit import STAMPED_S
from identify.planning.knowledge import NAMES, Knowledge, before_any_dive
from identify.planning.limits import Limits, Tank
from identify.planning.manoeuvres import HEAVE, SURGE, SWAY, YAW, Drive, coast_down, laps, square, sweep
from identify.planning.propose import drivable, mission_legs, propose, relative_std, stamped
from identify.planning.writing import instruction, mission_text, needs, pulses

FILE = load_vehicle("ruvifist:hovering")
TRUTH = load_truth(FILE, "hovering")
KNOWN = replace(before_any_dive(FILE, "hovering"), values=dict(TRUTH.model))
TANK = Tank(FILE, "hovering", KNOWN)
PUSH = Drive(SURGE, "push_surge_n", 24.0)
SPIN = Drive(YAW, "yaw_rad_s", 0.3)


def known_to(widths: dict[str, float]) -> Knowledge:
    precision = np.diag([widths[name] ** -2.0 if name in widths else 0.0 for name in NAMES])
    return replace(KNOWN, precision=precision)


@pytest.mark.parametrize(
    "family",
    [square(4.0, PUSH), square(32.0, PUSH), square(8.0, SPIN), sweep(PUSH), coast_down(32.0, PUSH),
     laps(4.0, Drive(SURGE, "surge_m_s", 0.4))],
    ids=lambda family: f"{family.kind} {family.period_s:g}",
)  # fmt: skip
def test_a_manoeuvre_ends_where_it_began_and_at_rest(family) -> None:
    manoeuvre = family.at(1.0, 2)
    assert manoeuvre.duration_s == pytest.approx(2 * family.period_s)
    trial = TANK.dive(manoeuvre.legs())
    place = np.cumsum(trial.nu[:, [SURGE, YAW]], axis=0) * 0.05
    room = max(trial.across_m, 0.1)
    assert np.all(np.abs(trial.nu[-1]) < 0.03)
    assert abs(place[-1, 0]) < 0.15 * room
    assert abs(place[-1, 1]) < 0.15


def test_a_square_wave_swings_about_the_place_where_it_began() -> None:
    trial = TANK.dive(square(4.0, PUSH).at(1.0, 5).legs())
    place = np.cumsum(trial.nu[:, SURGE]) * 0.05
    assert place.max() == pytest.approx(-place.min(), rel=0.5)


def test_the_same_manoeuvre_is_the_stronger_the_more_is_allowed() -> None:
    one = propose(FILE, "hovering", KNOWN, Limits(space_m=1.0), 60.0, [SURGE]).parts[0].manoeuvre
    assert TANK.dive(one.legs()).across_m <= 1.02
    assert 0 < one.amplitudes[0] < TANK.force(SURGE, 0.5)


def test_a_proposal_keeps_within_time_space_speed_and_thrust() -> None:
    limits = Limits(space_m=3.0, speed_m_s=0.3)
    found = propose(FILE, "hovering", KNOWN, limits, 150.0, [SURGE, YAW])
    assert found.duration_s <= 150.0
    assert found.trial.over(limits) <= 1.05
    assert found.trial.thrust_share <= 0.52


@pytest.mark.parametrize("space_m", rest_in_soak([0.6, 3.0]))
def test_every_manoeuvre_keeps_the_space_with_its_drift(space_m: float) -> None:
    found = propose(FILE, "hovering", KNOWN, Limits(space_m=space_m), 200.0, [SURGE, SWAY])
    assert 150.0 < found.duration_s <= 200.0
    assert all(0 < part.drift_m < part.needs_m <= space_m for part in found.parts)


def test_the_room_up_and_down_is_as_given_or_as_across_and_ends_at_the_surface() -> None:
    assert Limits(space_m=0.2).heave_m == 0.2
    assert Limits(depth_space_m=0.3).heave_m == 0.3
    assert Limits(depth_space_m=9.0).heave_m == 1.5


@pytest.mark.parametrize(
    ("limits", "room_m"),
    rows_rest_in_soak(
        [(Limits(depth_space_m=9.0), 1.5), (Limits(depth_space_m=0.2), 0.2), (Limits(space_m=0.2), 0.2)],
        keep=2,
    ),
    ids=["not to the surface", "as given", "as across"],
)
def test_every_manoeuvre_keeps_the_room_up_and_down(limits: Limits, room_m: float) -> None:
    found = propose(FILE, "hovering", KNOWN, limits, 120.0, [HEAVE])
    assert limits.heave_m == room_m
    assert all(0.5 * min(room_m, 0.5) < part.trial.depth_m <= room_m for part in found.parts)


def test_too_little_room_is_said_with_what_could_give_more() -> None:
    with pytest.raises(FitError, match=r"0\.001 m across and 0\.001 m up and down .* give more by --space"):
        propose(FILE, "hovering", KNOWN, Limits(space_m=0.001), 60.0, [SURGE])


def test_what_the_dive_alone_tells_stands_beside_what_it_tells_with_the_rest() -> None:
    place = NAMES.index("D_u")
    fresh = propose(FILE, "hovering", KNOWN, Limits(), 60.0, [SURGE])
    assert np.array_equal(fresh.alone, fresh.after)
    found = propose(FILE, "hovering", known_to({"D_u": 0.004}), Limits(), 60.0, [SURGE])
    assert found.after[place] ** -2 == pytest.approx(found.alone[place] ** -2 + 0.004**-2, rel=1e-3)


def test_what_hangs_on_when_thrust_acts_no_time_makes_narrower() -> None:
    """Yaw is quick, and half a millisecond of thrust's timing is worth more of its damping than all noise."""
    place = NAMES.index("D_r")
    short, long = (propose(FILE, "hovering", KNOWN, Limits(), s, [YAW]).after[place] for s in (60.0, 240.0))
    assert short / 2 < long < short
    precision = np.diag(np.full(len(NAMES), 100.0**2))
    timing = np.zeros((1, len(NAMES)))
    timing[0, place] = 0.02 * 100.0**2 / STAMPED_S
    assert relative_std(stamped(precision, timing))[place] == pytest.approx(np.hypot(0.01, 0.02))


def test_time_that_holds_no_whole_block_is_filled_with_cycles() -> None:
    found = propose(FILE, "hovering", KNOWN, Limits(), 60.0, [YAW])
    assert 55.0 <= found.duration_s <= 60.0


def test_what_is_known_least_is_aimed_at() -> None:
    sharp = known_to({"M_u": 1e-4, "D_u": 1e-4, "M_v": 1e-4, "D_v": 1e-4})
    found = propose(FILE, "hovering", sharp, Limits(), 90.0, [SURGE, YAW])
    assert {dof for part in found.parts for dof in part.manoeuvre.dofs} == {YAW}


def test_what_was_known_before_adds_to_what_the_dive_gives() -> None:
    fresh = propose(FILE, "hovering", KNOWN, Limits(), 60.0, [SURGE])
    place = NAMES.index("D_u")
    again = propose(FILE, "hovering", known_to({"D_u": float(fresh.after[place])}), Limits(), 60.0, [SURGE])
    assert np.isinf(fresh.before[place])
    assert again.after[place] <= fresh.after[place] / np.sqrt(2) * 1.01


def test_more_time_makes_intervals_narrower() -> None:
    short, long = (propose(FILE, "hovering", KNOWN, Limits(), s, [HEAVE]) for s in (60.0, 200.0))
    assert np.all(long.after[[NAMES.index("M_w"), NAMES.index("D_w")]] < 0.7 * short.after[[2, 8]])


def test_square_waves_are_chosen_before_laps_for_a_mass() -> None:
    found = propose(FILE, "hovering", known_to({"D_u": 1e-4}), Limits(), 60.0, [SURGE])
    assert found.parts[0].manoeuvre.kind == "square wave"
    assert found.parts[0].manoeuvre.period_s == 4.0


def test_too_little_time_is_said_with_what_it_would_take() -> None:
    with pytest.raises(
        FitError, match=r"takes 42 s with its rests, and there are 20 s; give --minutes 0\.7 or"
    ):
        propose(FILE, "hovering", KNOWN, Limits(), 20.0, [YAW])
    assert propose(FILE, "hovering", KNOWN, Limits(), 60.0 * 0.7, [YAW]).duration_s <= 42.0


def test_an_axis_that_no_thruster_pushes_is_left_out_or_refused() -> None:
    shape = FILE.vehicle.configurations["hovering"]
    flat = replace(shape, thrusters=tuple(t for t in shape.thrusters if t.direction[2] == 0.0))
    file = replace(FILE, vehicle=replace(FILE.vehicle, configurations={"hovering": flat}))
    assert drivable(Tank(file, "hovering", KNOWN), (SURGE, SWAY, HEAVE, YAW)) == (SURGE, SWAY, YAW)
    with pytest.raises(FitError, match="none of heave"):
        propose(file, "hovering", KNOWN, Limits(), 60.0, [HEAVE])


def test_the_mission_is_read_back_as_the_legs_that_were_promised(tmp_path: Path) -> None:
    found = propose(FILE, "hovering", KNOWN, Limits(), 100.0, [SURGE, YAW])
    path = tmp_path / "plan.yaml"
    path.write_text(mission_text(found, "ruvifist: a plan", "seatrial simulate", TANK), encoding="utf-8")
    mission = load_mission(path)
    promised = mission_legs([part.manoeuvre for part in found.parts])
    assert mission.duration_s == pytest.approx(found.duration_s)
    assert [leg for leg in mission.legs if leg.phase != "rest"] == [
        leg for leg in promised if leg.phase != "rest"
    ]
    assert all(instruction(part) in path.read_text(encoding="utf-8") for part in found.parts)


def test_a_crew_reads_force_period_seconds_and_room() -> None:
    found = propose(FILE, "hovering", KNOWN, Limits(), 60.0, [SURGE]).parts[0]
    assert instruction(found).startswith("surge: square wave ±")
    assert needs(found).endswith(" m across")
    told = pulses(found.manoeuvre, TANK)
    assert told.startswith("ahead: ")
    assert "on 1 2 3 4; astern: " in told


def test_a_turn_has_no_pulse_widths_and_stays_in_place() -> None:
    found = propose(FILE, "hovering", KNOWN, Limits(), 60.0, [YAW]).parts[0]
    assert pulses(found.manoeuvre, TANK) == ""
    assert needs(found) == "stays in place"
    assert instruction(found).endswith(" s, stays in place")


def test_nothing_known_is_infinitely_wide() -> None:
    precision = np.zeros((12, 12))
    precision[0, 0], precision[1, 1] = 100.0, 1e-20
    widths = relative_std(precision)
    assert widths[0] == pytest.approx(0.1)
    assert np.all(np.isinf(widths[1:]))


def test_time_goes_to_every_axis_of_which_nothing_is_known() -> None:
    found = propose(FILE, "hovering", KNOWN, Limits(), 120.0, [SURGE, YAW])
    assert {dof for part in found.parts for dof in part.manoeuvre.dofs} == {SURGE, YAW}
    assert np.all(np.isfinite(found.after[[NAMES.index(n) for n in ("M_u", "D_u", "I_r", "D_r")]]))
