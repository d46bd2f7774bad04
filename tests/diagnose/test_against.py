"""A simulator beside a real dive: what it must gain, what it has otherwise, what it has to spare."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bridge.errors import LogError
from bridge.vehicle.config import load_vehicle
from identify.challenge.case import Case, check_of, dive_of, draw_case
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.filters.nominal import nominal_of
from identify.diagnose.gap.drift import Drift
from identify.diagnose.result import NOTHING, Diagnosis, Finding, Gap, Share, Value
from identify.diagnose.simulators import comparison
from identify.diagnose.simulators.comparison import Against, against, compared, differ, plain
from identify.diagnose.simulators.simulator import Simulator, simulator_of
from identify.diagnose.words.against import (
    cause_lines,
    difference_lines,
    difference_sentence,
    lines,
    thrust_sentences,
    verdict_sentence,
)
from identify.dive import Dive, Signal
from identify.effects.effect import Effect
from identify.effects.library import library
from tui.commands.diagnose import configuration_of_both

FILE = load_vehicle("ruvifist:hovering")
LIBRARY = library(FILE.vehicle.configurations["hovering"], 0.1)
NAN = math.nan


def effect(name: str, number: int = 0) -> Effect:
    return next(item for item in LIBRARY if item.name == name and item.number == number)


def finding_of(name: str, number: int = 0, size: float = 1.0, also: tuple[str, ...] = ()) -> Finding:
    hidden = effect(name, number)
    cause = Cause(hidden, hidden.none() + size * (hidden.start() - hidden.none()))
    parameters = {key: value(v, unit) for key, (v, unit) in hidden.answer_parameters(cause.values).items()}
    return Finding(cause, also, {}, 0.99, parameters, 50.0)


def value(v: float, unit: str = "kg") -> Value:
    """Known to 1 %."""
    return Value(v, unit, 0.98 * v, 1.02 * v)


def drift(off: float) -> Drift:
    floor = np.array([0.01, 0.01, NAN, NAN, NAN, 0.01])
    return Drift(5.0, np.arange(20.0), off * np.ones((20, 6)) * floor, floor)


def diagnosis(*causes: Finding, values: dict[str, float] | None = None, before: float = 4.0) -> Diagnosis:
    sizes = {"M_u": 100.0, "D_u": 40.0, "M_v": 120.0, "D_v": 60.0, "M_r": 9.0} | (values or {})
    numbers = {name: value(v) for name, v in sizes.items()}
    gap = Gap(before, (drift(before),), (drift(1.1),), {}, (Share("surge", "steady", 1.0),), (), ())
    return Diagnosis(
        "dive", "ruvifist", "hovering", "explained" if causes else "no_gap", gap, causes, (), None, None, None, None,
        (), 1.0, None, NOTHING, numbers,
    )  # fmt: skip


def test_an_effect_of_the_dive_alone_is_what_the_simulator_must_gain():
    comparison = compared(diagnosis(finding_of("quadratic_drag")), diagnosis())
    assert [each.name for each in comparison.lacks] == ["quadratic_drag"]
    assert comparison.differences == comparison.spare == ()
    assert verdict_sentence(comparison) == (
        "Your simulator must gain quadratic drag: all of the gap lies in surge, steady; with the vehicle's numbers its "
        "5 s drift falls from 40 mm/s to 11 mm/s in surge and from 2.3 deg/s to 0.63 deg/s in yaw."
    )


def test_an_effect_that_both_have_but_not_as_much_is_a_number_to_change():
    comparison = compared(
        diagnosis(finding_of("thruster_lag", size=2.0)), diagnosis(finding_of("thruster_lag"))
    )
    (each,) = comparison.differences
    assert (each.of, each.name) == ("thruster_lag", "time_constant")
    assert each.share < 0
    assert "its thruster lag's time constant is " in verdict_sentence(comparison)


@pytest.mark.parametrize(
    ("vehicle", "simulator"),
    [
        (diagnosis(finding_of("quadratic_drag"), before=1.1), diagnosis(finding_of("quadratic_drag"))),
        (
            diagnosis(finding_of("thruster_lag", also=("command_delay",))),
            diagnosis(finding_of("command_delay")),
        ),
        (diagnosis(before=1.1), diagnosis(values={"M_u": 88.0})),
    ],
    ids=["alike", "causes that can't be told apart", "a number that costs no drift"],
)
def test_what_both_have_or_costs_no_drift_is_no_matter(vehicle, simulator):
    comparison = compared(vehicle, simulator)
    assert comparison.lacks == comparison.spare == comparison.differences == ()


def test_the_same_effect_of_another_thruster_is_another():
    comparison = compared(
        diagnosis(finding_of("weak_thruster", 2)), diagnosis(finding_of("weak_thruster", 1))
    )
    assert [each.cause.effect.number for each in comparison.lacks] == [2]
    assert [each.cause.effect.number for each in comparison.spare] == [1]
    assert (
        "Its own recording shows weak thruster 1, which this dive does not: look whether it should be there."
        in lines(comparison)
    )


def possible(finding: Finding, probability: float = 0.42) -> Finding:
    return replace(finding, probability=probability)


MAYBE_DRAG = possible(finding_of("quadratic_drag"))


@pytest.mark.parametrize(
    ("vehicle", "simulator", "kind", "name", "said"),
    [
        (diagnosis(MAYBE_DRAG), diagnosis(), "lacks", "quadratic_drag", "Your simulator may lack quadratic drag (42"),
        (diagnosis(), diagnosis(MAYBE_DRAG), "spare", "quadratic_drag", "Its own recording may show quadratic drag"),
        (diagnosis(possible(finding_of("added_payload"))), diagnosis(values={"M_u": 88.0}), "stories", "added_payload",
         "Added payload (42 % probable) may make masses and dampings differ so: "),
    ],
    ids=lambda given: given if isinstance(given, str) else "",
)  # fmt: skip
def test_what_is_less_probable_than_not_is_told_as_what_may_be(vehicle, simulator, kind, name, said):
    comparison = compared(vehicle, simulator)
    assert any(line.startswith(said) for line in (verdict_sentence(comparison), *lines(comparison)))
    data = plain(comparison)["against"]
    assert data["possible"][kind] == [name]
    assert data.get(kind, []) == []


def test_what_both_show_and_one_hardly_the_simulator_may_have_already():
    drag = finding_of("quadratic_drag")
    comparison = compared(diagnosis(drag), diagnosis(possible(drag)))
    (line,) = cause_lines(comparison)
    assert line.startswith(
        "Your simulator may have it already (42 % probable): Quadratic drag, 99 % probable: "
    )
    data = plain(comparison)["against"]
    assert (data["has"], data["possible"]["has"]) == ([], ["quadratic_drag"])


def test_beside_what_is_sure_an_effect_that_may_lack_ends_the_verdict():
    drag, zone = possible(finding_of("quadratic_drag")), finding_of("dead_zone")
    both = compared(diagnosis(zone, drag), diagnosis(values={"M_u": 88.0}))
    said = verdict_sentence(both)
    assert said.startswith("Your simulator must gain dead zone: ")
    assert said.endswith(" Its M_u is 12 % too small. It may lack quadratic drag (42 % probable), too.")


def test_the_water_of_a_simulator_s_run_is_not_its_own():
    sim = diagnosis(finding_of("steady_current"), finding_of("tether"), finding_of("quadratic_drag"))
    assert [cause.effect.name for cause in simulator_of(sim).causes] == ["quadratic_drag"]
    assert [each.name for each in compared(diagnosis(), sim).spare] == ["quadratic_drag"]


def test_a_mass_that_is_off_is_told_in_per_cent_of_the_vehicle_s():
    comparison = compared(diagnosis(), diagnosis(values={"M_u": 88.0}))
    (each,) = comparison.differences
    assert each.share == pytest.approx(-0.12)
    assert difference_sentence(each) == ("its M_u is 12 % too small: 88.0 kg, the vehicle's is 100 kg")
    assert verdict_sentence(comparison).startswith(
        "Your simulator lacks no effect that this dive shows, but its M_u is 12 % too small; "
    )


STRONGER = {"M_u": 125.0, "D_u": 50.0, "M_v": 150.0, "D_v": 75.0, "M_w": 250.0, "D_w": 125.0}
IN_HEAVE = {"M_w": 200.0, "D_w": 100.0}


def test_masses_and_drags_that_other_thrust_explains_are_no_numbers_to_change():
    comparison = compared(diagnosis(values=STRONGER), diagnosis(values=IN_HEAVE))
    assert comparison.differences == ()
    assert plain(comparison)["verdict"] == "explained"
    assert verdict_sentence(comparison).startswith(
        "Your simulator lacks no effect that this dive shows, but its thrust is 25 % too strong; "
    )


def test_a_number_that_other_thrust_does_not_explain_is_told_at_the_simulator_s_thrust():
    comparison = compared(diagnosis(values=STRONGER | {"D_v": 150.0}), diagnosis(values=IN_HEAVE))
    (each,) = comparison.differences
    assert each.share == pytest.approx(-0.5, abs=0.01)
    assert difference_sentence(each) == (
        "its D_v is 50 % too small: 60.0 kg, the vehicle's is 120 kg at the simulator's thrust"
    )
    (data,) = plain(comparison)["against"]["differences"]
    assert data["thrust_taken_out"] == pytest.approx(0.8, abs=0.005)


def test_what_the_dive_has_most_evidence_of_is_told_first():
    drag, lag = replace(finding_of("quadratic_drag"), gain_nats=12.0), finding_of("thruster_lag", size=2.0)
    comparison = compared(diagnosis(drag, lag), diagnosis(finding_of("thruster_lag"), values={"M_u": 88.0}))
    starts = [line.split()[:2] for line in difference_lines(comparison)]
    assert starts == [["Its", "thruster"], ["Its", "M_u"], ["Quadratic", "drag,"], ["Your", "simulator"]]
    by_nats = [each.nats for each in comparison.differences]
    assert by_nats == sorted(by_nats, reverse=True)
    assert by_nats[-1] > drag.gain_nats


def test_where_thrust_pushes_against_the_motion_nothing_is_told_of_thrust():
    comparison = compared(replace(diagnosis(), first=("It goes the other way.",)), diagnosis())
    assert comparison.thrust.whole is not None
    assert thrust_sentences(comparison) == ()
    assert thrust_sentences(compared(diagnosis(), diagnosis()))[0].startswith(
        "The vehicle's thrust is not told from the simulator's: 1.0"
    )


def test_what_no_candidate_explains_is_never_told_as_nothing():
    comparison = compared(replace(diagnosis(before=1.3), verdict="unknown"), diagnosis())
    assert verdict_sentence(comparison) == (
        "Your simulator lacks something that no candidate explains: all of the gap lies in surge, steady."
    )


@pytest.mark.parametrize(
    ("of_the_dive", "causes", "said"),
    [
        ("partly", (finding_of("quadratic_drag"),), "partly"),
        ("partly", (), "unknown"),
        ("unknown", (finding_of("quadratic_drag"),), "unknown"),
    ],
)
def test_of_a_dive_that_is_explained_in_part_or_not_the_simulator_s_gap_is_no_more(of_the_dive, causes, said):
    vehicle = replace(diagnosis(*causes), verdict=of_the_dive)
    assert compared(vehicle, diagnosis()).verdict == said


def test_a_cause_that_a_refit_takes_up_is_the_story_of_the_numbers_and_no_effect_to_gain():
    payload = finding_of("added_payload")
    comparison = compared(diagnosis(payload), diagnosis(values={"M_u": 88.0}))
    assert comparison.lacks == ()
    assert comparison.stories == (payload,)
    said = lines(comparison)[1]
    assert said.startswith("Added payload would make masses and dampings differ so: ")
    assert "(mass " in said
    assert " kg (95 %: " in said
    assert compared(diagnosis(payload), diagnosis()).stories == ()


def test_no_more_than_three_numbers_stand_in_the_verdict_the_worst_first():
    off = {"M_u": 90.0, "D_u": 60.0, "M_v": 100.0, "D_v": 40.0}
    said = verdict_sentence(compared(diagnosis(), diagnosis(values=off)))
    assert (
        "its D_u is 50 % too large, its D_v is 33 % too small, its M_v is 17 % too small and 1 more" in said
    )


@pytest.mark.parametrize(
    ("first", "other", "apart"),
    [
        (value(100.0), value(105.0), True),
        (value(100.0), value(103.0), False),
        (Value(100.0, "kg", 99.99, 100.01), Value(100.5, "kg", 100.49, 100.51), False),
        (Value(100.0, "kg", NAN, NAN), value(200.0), False),
        (Value(1.0, "kg", 0.5, 9.0), value(5.0), False),
    ],
)
def test_numbers_differ_beyond_three_standard_errors_and_one_per_cent(
    first: Value, other: Value, apart: bool
):
    assert differ(first, other) is apart


def test_a_number_counts_by_the_half_of_the_vehicle_s_interval_towards_the_simulator_s():
    mine = Value(100.0, "kg", 90.2, 104.9)
    for its, errors in ((109.8, 3.92), (90.2, 1.96)):
        nats = comparison._difference("", "M_u", value(its), mine, 1.0).nats
        assert nats == pytest.approx(0.5 * errors**2, rel=1e-4)


def test_degrees_of_freedom_that_a_recording_does_not_tell_are_named():
    comparison = compared(diagnosis(), diagnosis())
    assert comparison.untold == ("heave", "roll", "pitch", "yaw")
    assert lines(comparison)[-1].startswith("In heave, roll, pitch and yaw nothing is said of masses")


def test_a_hull_whose_drag_is_quadratic_alone_is_told_by_that():
    numbers = {"M_u": value(100.0), "X_uu": value(40.0, "N s2/m2"), "M_v": value(120.0)}
    either = replace(diagnosis(), numbers=numbers)
    assert compared(either, either).untold == ("sway", "heave", "roll", "pitch", "yaw")


def test_the_verdict_and_the_effects_of_plain_data_are_of_what_the_simulator_must_gain():
    drag, zone = finding_of("quadratic_drag"), finding_of("dead_zone")
    has_it = plain(compared(diagnosis(drag, before=1.1), diagnosis(drag)))
    assert (has_it["verdict"], has_it["effects"]) == ("no_gap", [])
    assert (has_it["against"]["has"], has_it["against"]["lacks"]) == (["quadratic_drag"], [])
    assert has_it["against"]["drift"] == {"before": 1.1, "after": pytest.approx(1.1), "floor": 1}
    lacks_one = plain(compared(diagnosis(drag, zone), diagnosis(drag)))
    assert [each["name"] for each in lacks_one["effects"]] == lacks_one["against"]["lacks"] == ["dead_zone"]
    assert lacks_one["verdict"] == "explained"
    numbers = plain(compared(diagnosis(drag), diagnosis(drag, values={"M_u": 88.0})))
    assert (numbers["verdict"], numbers["effects"]) == ("explained", [])
    assert numbers["against"]["differences"]


def test_a_drift_beyond_chance_of_which_no_number_is_off_beyond_doubt_is_told_as_such():
    comparison = compared(diagnosis(before=1.3), diagnosis())
    assert comparison.differences == comparison.lacks == ()
    assert plain(comparison)["verdict"] == "ambiguous"
    assert verdict_sentence(comparison) == (
        "Your simulator lacks no effect that this dive shows, and of its numbers none is off beyond doubt, but its 5 s "
        "drift is 13 mm/s in surge (noise alone 10 mm/s) and 13 mm/s in sway (noise alone 10 mm/s); with the vehicle's "
        "numbers its 5 s drift falls from 13 mm/s to 11 mm/s in surge and from 0.74 deg/s to 0.63 deg/s in yaw: give "
        "longer recordings of both, with the same manoeuvres."
    )


@pytest.mark.parametrize("damping", ["linear", "both"])
def test_a_simulator_s_numbers_are_held_as_near_to_the_dive_s_as_its_own_recording_lets_them(damping):
    """Of the two drags of a hull it may lack the quadratic."""
    case = draw_case(150031, names=[], seconds=60.0)
    vehicle, name = case.file.vehicle, case.configuration
    shape = replace(vehicle.configurations[name], damping=damping)
    file = replace(case.file, vehicle=replace(vehicle, configurations={name: shape}))
    nominal = nominal_of(dive_of(case), file, name)
    mass = nominal.course.mass
    values = {"M_u": value(1.3 * mass[0]), "D_u": Value(20.0, "N/(m/s)", 1.0, 1000.0)}
    held = Simulator(values, ()).filters_of(nominal)
    assert held.course.mass[0] == pytest.approx(0.98 * 1.3 * mass[0], rel=0.005)
    assert held.course.damping[0] == pytest.approx(nominal.course.damping[0], rel=0.005)


def test_recordings_of_two_configurations_are_not_compared():
    whole = replace(FILE, configuration=None)
    names = list(whole.vehicle.configurations)
    first, second = (of_configuration(whole.vehicle.veh_cfg(name)) for name in names[:2])
    assert configuration_of_both(first, replace(first, name="other"), whole) == names[0]
    with pytest.raises(LogError, match="drive the simulator in the same one"):
        configuration_of_both(first, second, whole)


def of_configuration(index: int) -> Dive:
    signal = Signal(np.array([0.0, 1.0]), np.full((2, 1), float(index)))
    return Dive("dive", Path("dive"), "", veh_cfg=signal)


@pytest.fixture(scope="module")
def pair() -> tuple[Case, Case]:
    """A vehicle with a dead zone, and its simulator without."""
    real = draw_case(150002, names=["dead_zone"], size=0.8, seconds=80.0)
    return real, draw_case(150002, names=[], seconds=80.0)


def test_a_planted_effect_is_what_the_plain_simulator_lacks(pair: tuple[Case, Case]):
    real, sim = pair
    few = [item for item in LIBRARY if item.name in ("dead_zone", "quadratic_drag", "reverse_thrust_loss")]
    shares: list[float] = []
    comparison: Against = against(
        dive_of(real),
        check_of(sim),
        real.file,
        real.file,
        real.configuration,
        effects=few,
        progress=lambda share, _: shares.append(share),
    )
    assert [each.name for each in comparison.lacks] == ["dead_zone"]
    assert comparison.spare == ()
    truth = real.truth()["effects"][0]["parameters"]["half_width"]
    assert comparison.lacks[0].parameters["half_width"].value == pytest.approx(truth, rel=0.25)
    assert comparison.vehicle.gap.drifts[1].total > 1.5 * comparison.vehicle.gap.after[1].total
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
