"""The parts of a report: what each says of an identification, a dive, a training, a filter."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from soak import rest_in_soak

from bridge.vehicle.config import Configuration, Thruster, Water, load_vehicle
from identify.dive import Dive, Signal
from identify.doubt import Doubt, Outcome
from identify.identification import DragForce, Identification, Partner, added_mass, estimate
from identify.nuisance import disturbance, noise, time_constant, trim
from identify.report.figures import autocorrelation, dead_reckon
from identify.report.identification import (
    dive_section,
    identification_report,
    identification_section,
    innovations_section,
)
from identify.report.page import Report, write_report
from identify.report.tables import nuisance_tables
from identify.run.identify import Identified
from identify.run.joined_runs import joined

NAN = float("nan")


def identification(*parameters):
    return Identification(
        "likelihood",
        Outcome.CONVERGED,
        parameters,
        *("hovering", "dive-7", "ab" * 32, "ruvifist", "cd" * 32),
        duration_s=417.65,
        samples=10442,
        settings={"velocity_noise_m_s": 0.0052},
        notes=("The DVL is late.",),
        wall_s=0.23,
    )


MASS = estimate("M_u", 111.9, 0.7, 110.54, 113.28)
INERTIA = estimate("I_r", 15.2, 0.25, 14.71, 15.69)
UNKNOWN = estimate("I_q", NAN, NAN, NAN, NAN, "pitch is hardly excited")


def boxes(figure):
    """The plots of a figure, as the page draws them on a wide screen."""
    return figure.draw(10.0).axes


def marks(section):
    """Where the marks of the intervals stand, and their shape: a disc, a diamond, an arrow."""
    (box,) = boxes(section.figures[0])
    return [
        (float(line.get_xdata()[0]), float(line.get_ydata()[0]), str(line.get_marker()))
        for line in box.get_lines()
        if line.get_marker() != "None" and len(line.get_xdata())
    ]


def test_parameters_stand_with_interval_unit_truth_and_reason():
    section = identification_section(identification(MASS, INERTIA, UNKNOWN), {"M_u": 111.6, "I_r": 16.0})
    table, others = section.tables
    further = ("Standard error", "Partner", "Meaning")
    assert table.columns == ("Parameter", "Value", "95 % interval", "Unit", "Truth", "Truth is", *further)
    assert [" | ".join(row) for row in table.shown] == [
        "M_u | 111.9 | 110.5 to 113.3 | kg | 111.6 | inside | 0.63 % | — | total mass in surge: rigid body plus added",
        "I_r | 15.20 | 14.71 to 15.69 | kg m² | 16.00 | OUTSIDE | 1.7 % | — | "
        "total inertia in yaw: rigid body plus added",
        "I_q | — | — | kg m² | — | — | — | — | "
        "total inertia in pitch: rigid body plus added. Not identifiable: pitch is hardly excited",
    ]
    assert section.heading == "Identified parameters: dive-7, hovering, likelihood"
    assert "Recording dive-7: 6 min 58 s, 10\u00a0442 samples used." in section.text
    assert "1 of 2 known truths lie inside" in section.text
    assert "converged" in section.text
    assert others.shown == (("velocity_noise_m_s", "0.00520"),)
    assert "The DVL is late." in section.text
    assert section.warning == ""


def shape():
    thruster = Thruster((1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    return Configuration(
        dry_mass_kg=72.0,
        inertia_kgm2=(9.0, 10.0, 11.0),
        thrusters=(thruster,),
        inertia_std_kgm2=(0.0, 0.0, 0.0),
    )


def test_beside_the_interval_with_the_thrust_s_doubt_stands_the_one_given_the_thrust():
    mass = replace(MASS, scale_std=0.1 * MASS.value)
    table = identification_section(identification(mass, INERTIA), {"M_u": 111.0}, None).tables[0]
    assert table.columns[:4] == ("Parameter", "Value", "95 % interval", "Given the thrust")
    assert table.shown[0][:4] == ("M_u", "111.9", "92 to 136", "110.5 to 113.3")
    # A simulator's thrust is exact, so that its truth is judged by the narrow one.
    outside = identification_section(identification(mass), {"M_u": 120.0}, None).tables[0]
    assert "OUTSIDE" in outside.shown[0]
    assert (
        "Given the thrust" not in identification_section(identification(MASS), None, None).tables[0].columns
    )


def test_the_true_added_mass_is_the_true_total_less_the_rigid_body():
    added = [added_mass(total, shape()) for total in (MASS, UNKNOWN, INERTIA)]
    truth = {"M_u": 111.6, "I_q": 15.5, "I_r": 16.0}
    section = identification_section(identification(MASS, INERTIA, UNKNOWN, *added), truth, shape())
    rows = {row[0]: row[4:6] for row in section.tables[0].shown}
    assert rows["X_udot"] == ("39.6", "inside")
    assert rows["N_rdot"] == ("5.00", "OUTSIDE")
    assert rows["M_qdot"] == ("5.500", "—")
    assert "1 of 2 known truths lie inside" in section.text
    assert [(row, shape) for _, row, shape in marks(section)] == [(0, "o"), (1, "D"), (2, "o"), (3, "D")]


@pytest.mark.parametrize("outcome", [o for o in Outcome if o is not Outcome.CONVERGED])
def test_an_outcome_other_than_converged_is_a_warning_with_the_notes_that_explain_it(outcome):
    doubt = Doubt(("M_u",), "In surge the recorded velocity can't be what the controller used.")
    partly = identification_section(replace(identification(MASS), doubts=(doubt,)))
    assert partly.warning.split("\n\n") == ["Warning: some of these values are in doubt", doubt.sentence]
    assert doubt.sentence not in partly.text
    section = identification_section(replace(identification(MASS, UNKNOWN), outcome=outcome))
    headline, meaning, *why = section.warning.split("\n\n")
    assert headline == f"Warning: {outcome.value}"
    assert len(meaning) > 40
    assert why[-1] == "The DVL is late."
    assert ("Pitch is hardly excited." in why) == (outcome is Outcome.NOT_IDENTIFIABLE)
    assert "The DVL is late." not in section.text


def test_a_parameter_tells_its_partner_and_what_came_from_the_prior():
    mass = replace(MASS, partner=Partner("D_u", -0.5), share_from_prior=0.25)
    hardly = replace(INERTIA, partner=Partner("D_r", 0.02))
    section = identification_section(identification(mass, hardly))
    assert "truth" not in section.text + section.figures[0].caption
    (table, _) = section.tables
    assert "Truth" not in table.columns
    assert table.columns[4:7] == ("Standard error", "Partner", "From prior")
    assert [row[4:7] for row in table.shown] == [("0.63 %", "D_u −0.50", "25 %"), ("1.7 %", "—", "—")]


def test_what_was_fitted_beside_the_coefficients_stands_by_axis_in_words_with_units():
    fitted = {
        disturbance(0): 0.349,
        time_constant(0): 2.75,
        trim(0): -0.07,
        noise(0, "dvl", False): 0.00394,
        noise(2, "dvl", False): 0.004,
        noise(2, "depth", True): 0.002,
        trim(5): 0.0004,
        noise(5, "new_gyro", False): 0.0002,
        noise(5, "heading", True): 0.01,
    }
    by_axis, others = nuisance_tables(fitted, {"alpha": 0.5})
    assert by_axis.columns == ("Axis", "Disturbance", "Its time constant", "Trim", "Sensor noise")
    assert by_axis.shown == (
        ("surge", "0.349 N", "2.75 s", "−0.0700 N", "DVL 3.9 mm/s"),
        ("heave", "—", "—", "—", "DVL 4.0 mm/s, depth sensor 2.0 mm"),
        ("yaw", "—", "—", "0.000400 N m", "new_gyro 0.011 deg/s, heading 0.57 deg"),
    )
    assert others.shown == (("alpha", "0.500"),)
    assert [each.name for each in fitted][:4] == [
        "surge_disturbance_std_n", "surge_disturbance_time_constant_s", "surge_trim_n", "surge_dvl_noise_std_m_s"
    ]  # fmt: skip


def test_an_interval_that_would_dwarf_the_others_ends_in_arrows():
    wide = estimate("M_w", 100.0, 500.0, -900.0, 1100.0)
    section = identification_section(identification(MASS, INERTIA, wide))
    assert [shape for *_, shape in marks(section)] == ["o", "o", "<", ">", "o"]
    assert "arrow" in section.figures[0].caption
    arrows = {text.get_text(): text.get_ha() for text in boxes(section.figures[0])[0].texts}
    assert arrows == {"−1000 %": "left", "+1000 %": "right"}


@pytest.mark.parametrize(
    "half_percent", [[0.6, 0.9, 1.4, 8.0, 9.7], [1.0, 1.0, 1.0, 24.0], [10.0, 10.0, 39.0]]
)
def test_intervals_of_different_but_ordinary_width_are_drawn_whole(half_percent):
    wide = [estimate("M_u", 100.0, h / 2, 100.0 - h, 100.0 + h) for h in half_percent]
    section = identification_section(identification(*wide))
    assert {shape for *_, shape in marks(section)} == {"o"}
    assert "arrow" not in section.figures[0].caption
    (box,) = boxes(section.figures[0])
    ends = [float(line.get_xdata()[-1]) for line in box.get_lines() if len(line.get_xdata()) == 2]
    assert ends[: len(half_percent)] == pytest.approx(half_percent)
    assert max(ends) < box.get_xlim()[1]


def straight_dive():
    """200 s at 0.5 m/s ahead, heading east; bottom lock drops out once, the thrusters fall silent once."""
    time_s = 5.0 + np.arange(0.0, 200.0, 0.1)
    n = len(time_s)
    velocity = np.tile([0.5, 0.0, 0.0], (n, 1))
    velocity[500:520] = NAN
    east = np.tile([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)], (n, 1))
    pwm = np.full((n, 2), 1500.0)
    speaking = (time_s < 100) | (time_s > 103)
    return Dive(
        "dive-7",
        Path("/somewhere/dive-7.tlog"),
        "ab" * 32,
        velocity=Signal(time_s, velocity),
        attitude=Signal(time_s, east),
        pressure=Signal(time_s, np.full((n, 1), 101325.0 + 998.2 * 9.80665 * 0.6)),
        pwm=Signal(time_s[speaking], pwm[speaking]),
        ff_mode=Signal(time_s[::10], np.full((n // 10, 1), 1.0)),
        notes=("No altitude was recorded.",),
        counts={"frames": 12345},
    )


def test_two_dampings_of_an_axis_count_by_their_drag_at_the_dive_s_speed():
    linear = estimate("D_u", 10.0, 4.0, 2.0, 18.0)
    quadratic = estimate("X_uu", 40.0, 8.0, 24.0, 56.0)
    alone = estimate("D_r", 2.0, 0.1, 1.8, 2.2)
    drag = DragForce("surge", "D_u", "X_uu", 0.5, 15.0, 0.3, 14.4, 15.6, -0.98)
    unknown = DragForce("sway", "D_v", "Y_vv", 0.1, 1.0, 0.9, 0.0, 2.8, -0.5)
    answer = replace(identification(MASS, linear, quadratic, alone), drag_forces=(drag, unknown))
    file = load_vehicle("ruvifist:hovering")
    report = identification_report([Identified(straight_dive(), file, answer, ())], {})
    told = (
        "masses to 1.2 %, rotational dampings to 10 % and drag at the dive's speeds to 4.0 % or better given the "
        "thrust"
    )
    assert told in report.verdict


def test_a_pitch_that_no_thruster_pushed_does_not_hide_how_well_the_masses_are_known():
    surge, pitch = estimate("M_u", 110.0, 0.7, 108.9, 111.1), estimate("I_q", 16.0, 2.3, 12.0, 20.0)
    drag, turning = estimate("D_u", 50.0, 0.2, 49.5, 50.5), estimate("D_q", 30.0, 4.0, 24.0, 36.0)
    answer = identification(surge, pitch, drag, turning)
    report = identification_report(
        [Identified(straight_dive(), load_vehicle("ruvifist:hovering"), answer, ())], {}
    )
    told = (
        "masses to 1.0 %, inertias to 25 %, dampings to 1.0 % and rotational dampings to 20 % or better given the "
        "thrust"
    )
    assert told in report.verdict


def test_the_headline_says_that_data_and_model_disagree_before_it_says_how_well_anything_is_known():
    answer = replace(identification(MASS), outcome=Outcome.DISAGREES)
    report = identification_report(
        [Identified(straight_dive(), load_vehicle("ruvifist:hovering"), answer, ())], {}
    )
    assert report.verdict.startswith(
        "dive-7 (hovering), data and model disagree: 1 of 1 coefficients identified"
    )


def test_a_dive_shows_its_signals_with_rate_gap_and_what_was_unknown():
    (table,) = dive_section(straight_dive(), Water()).tables
    rows = {row[0]: row[1:] for row in table.shown}
    assert rows["velocity over the bottom"] == ("2\u00a0000", "10.0 Hz", "0.10 s", "1.0 %")
    assert rows["thruster commands"][2] == "3.2 s"


def test_thrusters_that_rest_at_another_pulse_are_drawn_about_that():
    dive = straight_dive()
    pushes = replace(dive, pwm=Signal(dive.pwm.time_s, np.full_like(dive.pwm.value, 1200.0)))
    figure = next(f for f in dive_section(pushes, Water(), 1100.0).figures if f.name.startswith("thrusters"))
    assert figure.caption.endswith("by the vehicle file they rest at 1100.")
    assert [box.get_ylim() for box in boxes(figure)] == [(990.0, 1210.0)] * 2


def test_the_time_between_two_runs_is_no_gap_of_a_signal():
    runs = [replace(straight_dive(), name=name, sha256=name * 64) for name in "ab"]
    (table,) = dive_section(joined(runs), Water()).tables
    rows = {row[0]: row[1:] for row in table.shown}
    assert rows["velocity over the bottom"][2] == "0.10 s"
    assert rows["thruster commands"][2] == "3.2 s"
    assert rows["feed-forward mode (FF_MODE)"][2] == "1.0 s"


def test_a_dive_says_where_it_comes_from_its_mode_its_notes_and_counts():
    section = dive_section(straight_dive(), Water())
    assert section.heading == "Recording: dive-7"
    text = section.text
    for words in (
        "dive-7.tlog",
        "3 min 20 s",
        "boot time 5.0 s",
        "shadow",
        "No altitude was recorded.",
        "frames 12\u00a0345",
    ):
        assert words in text
    assert "/somewhere" not in text


def test_a_dive_s_speeds_can_be_zoomed_beside_their_reference_and_stay_a_figure_for_files():
    dive = straight_dive()
    asked = Signal(dive.velocity.time_s, np.tile(np.arange(14.0), (len(dive.velocity), 1)))
    section = dive_section(replace(dive, nu_ref=asked), Water())
    (zoomed,) = section.traces
    assert [title for title, _ in zoomed.panels][:3] == ["surge, m/s", "sway, m/s", "heave, m/s"]
    assert zoomed.labels == ("measured", "reference")
    for dof, (_, (measured, reference)) in enumerate(zoomed.panels[:3]):
        np.testing.assert_array_equal(measured, dive.velocity.value[:, dof])
        assert set(reference) == {float(dof)}
    assert [figure.name for figure in section.filed] == [f"speeds {dive.name}"]


def test_no_speed_is_drawn_where_its_sensor_was_silent_and_each_as_long_as_it_spoke():
    dive = straight_dive()
    turned_s = 5.0 + np.concatenate([np.arange(0.0, 30.0, 0.02), np.arange(40.0, 250.0, 0.02)])
    asked_s = 5.0 + np.arange(0.0, 100.0, 0.1)
    dive = replace(
        dive,
        gyro=Signal(turned_s, np.tile([0.0, 0.0, 0.3], (len(turned_s), 1))),
        nu_ref=Signal(asked_s, np.full((len(asked_s), 14), 0.5)),
    )
    (zoomed,) = dive_section(dive, Water()).traces
    panels = {title.partition(",")[0]: curves for title, curves in zoomed.panels}
    shown = {
        "surge": panels["surge"][0],
        "yaw": panels["yaw"][0],
        "reference": panels["yaw"][1],
    }
    known_s = {name: zoomed.time_s[np.isfinite(curve)] for name, curve in shown.items()}
    assert {name: round(float(of[-1])) for name, of in known_s.items()} == {
        "surge": 200,
        "yaw": 250,
        "reference": 100,
    }
    assert not ((known_s["yaw"] > 30.0) & (known_s["yaw"] < 39.9)).any()
    assert ((known_s["surge"] > 30.0) & (known_s["surge"] < 39.9)).any()


def test_dead_reckoning_goes_north_when_turned_about_all_axes():
    time_s = np.array([0.0, 2.0])
    # 120 degrees about (1, 1, 1) takes x to y, y to z and z to x: heave becomes north.
    turned = Signal(time_s, np.full((2, 4), 0.5))
    east, north = dead_reckon(Signal(time_s, np.tile([0.0, 0.0, 3.0], (2, 1))), turned)
    assert (east[-1], north[-1]) == (pytest.approx(0.0), pytest.approx(6.0))


@pytest.mark.parametrize("name", rest_in_soak(["velocity", "pwm", "attitude", "pressure", "ff_mode"]))
def test_a_dive_with_next_to_nothing_of_a_signal_or_nothing_but_unknowns_still_makes_a_page(name, tmp_path):
    dive = straight_dive()
    signal = dive.signals()[name]
    kept = [Signal(signal.time_s[:samples], signal.value[:samples]) for samples in (0, 1)]
    unknown = Signal(signal.time_s, np.full_like(signal.value, NAN))
    alone = [Dive("x", Path("x"), "", **{name: short}) for short in kept]
    dives = (*(replace(dive, **{name: each}) for each in (*kept, unknown)), *alone, Dive("x", Path("x"), ""))
    sections = tuple(dive_section(each, Water()) for each in dives)
    report = Report("t", "", "", sections)
    assert write_report(tmp_path / "x.html", report).stat().st_size > 1000


def test_white_innovations_look_white_and_coloured_ones_do_not():
    white = np.random.default_rng(3).normal(size=4000)
    coloured = np.repeat(white[:800], 5)
    assert np.abs(autocorrelation(white, 20)).max() < 0.06
    assert autocorrelation(coloured, 20)[:4] == pytest.approx([0.8, 0.6, 0.4, 0.2], abs=0.05)


def test_autocorrelation_leaves_out_pairs_with_a_nan():
    value = np.tile([1.0, -1.0], 50)
    value[[10, 41, 70]] = NAN
    assert autocorrelation(value, 3) == pytest.approx([-1.0, 1.0, -1.0], abs=0.02)
    assert len(autocorrelation(np.array([1.0, NAN]), 3)) == 0
    assert len(autocorrelation(np.ones(10), 3)) == 0


def test_innovations_are_judged_by_size_and_share_beyond_the_limits():
    value = np.array([0.0, 3.0, 0.0, -3.0, NAN])[:, None]
    section = innovations_section(
        {"surge": Signal(np.arange(5.0), value), "sway": Signal(np.zeros(0), np.zeros((0, 1)))}, "dive-7"
    )
    assert "surge: root mean square 2.12 (1 is expected), 50 % beyond" in section.text
    assert len(section.figures) == 1
