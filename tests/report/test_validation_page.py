"""The page of validate: which mode errs least, the curves of each, and whether the feed-forward may be raised."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bridge.vehicle.config import load_vehicle
from bridge.vehicle.forecast import ForecastRow
from bridge.vehicle.mode import Mode
from identify.dive import Dive, Signal
from identify.report.page import render_report
from identify.report.plot import HATCHES, Group, grouped, stack
from identify.report.validation import Reference, error_line, tracking_section, validation_report
from identify.run.validate import Run, Validation, validate, verdict
from identify.validation.against_forecast import Held
from identify.validation.axis_criteria import Criterion
from identify.validation.raising import Raising
from identify.validation.tracking import AxisErrors, SteadyError, TrackingErrors, tracking_errors
from identify.words import safe, unbroken

FILE = load_vehicle("ruvifist:hovering")
AT_ORIGIN = (0.0, 0.0, 0.0)

pytestmark = pytest.mark.usefixtures("sketched")

NAN = math.nan
SURGE = AxisErrors("surge", "m/s", 0.0091, 0.0036, 0.0048, 0.0051, 0.3, 0.0042, -1.1528, 1.2, 2.4)
SWAY = AxisErrors("sway", "m/s", 0.0069, 0.0030, 0.0026, 0.0035, 0.25, 0.0031, 1.6706, 1.7, NAN)
YAW = AxisErrors("yaw", "rad/s", 0.02, 0.01, NAN, 0.015, 1.0, 0.012, 0.5, 0.6, 1.7)


def moving(name, late_s, dofs=(0,), start_s=0.0):
    """50 s in which the reference of each axis rises, holds and falls, and the vehicle follows `late_s` later."""
    time_s = np.arange(0.0, 50.0, 0.05)
    n = len(time_s)
    profile, late = (np.interp(time_s - d, [5, 10, 30, 35], [0.0, 0.4, 0.4, 0.0]) for d in (0.0, late_s))
    reference, nu = np.zeros((n, 14)), np.zeros((n, 6))
    for dof in dofs:
        reference[:, dof], reference[:, 6 + dof] = profile, np.gradient(profile, time_s)
        nu[:, dof] = late
    at_s = start_s + time_s
    return Dive(
        name,
        Path(f"{name}.tlog"),
        name[0] * 64,
        velocity=Signal(at_s, nu[:, :3]),
        gyro=Signal(at_s, nu[:, 3:]),
        nu_ref=Signal(at_s, reference),
        tau_pid=Signal(at_s, np.ones((n, 6))),
        tau_ff=Signal(at_s, np.zeros((n, 6))),
    )


def made(dives, judged=None):
    judged = judged or dict.fromkeys(dives)
    runs = (Run(label, dive, tracking_errors(dive), judged[label]) for label, dive in dives.items())
    return validation_report(Validation(FILE, tuple(runs), AT_ORIGIN))


WHOLE = tracking_errors(moving("x", 1.0)).axes[0]


def errs(overall, axis="surge"):
    return TrackingErrors("x", (replace(WHOLE, axis=axis, overall=overall),))


def labels(figure):
    return [text.get_text() for text in figure.draw(10.0).legends[0].get_texts()]


@pytest.mark.parametrize(
    ("errors", "said"),
    [
        (
            {"off": errs(0.04), "ff": errs(0.02), "both": errs(0.01)},
            "'both' errs least, mean absolute: surge 10 mm/s (75 % less than 'off').",
        ),
        (
            {"off": errs(0.0400), "shadow": errs(0.0401)},
            "'off' errs least, mean absolute: surge 40 mm/s (like 'shadow').",
        ),
        (
            {
                "off": TrackingErrors("p", (*errs(0.01).axes, *errs(0.04, "sway").axes)),
                "both": TrackingErrors("b", (*errs(0.02).axes, *errs(0.01, "sway").axes)),
            },
            "'off' errs least, mean absolute: surge 10 mm/s (50 % less than 'both'). "
            "'both' errs least, mean absolute: sway 10 mm/s (75 % less than 'off').",
        ),
        (
            {
                "off": TrackingErrors(
                    "p", (*errs(0.04).axes, *errs(0.02, "sway").axes, *errs(0.01, "yaw").axes)
                ),
                "shadow": TrackingErrors(
                    "s", (*errs(0.03).axes, *errs(0.02, "sway").axes, *errs(0.01, "yaw").axes)
                ),
                "both": TrackingErrors(
                    "b", (*errs(0.01).axes, *errs(0.005, "sway").axes, *errs(0.0099, "yaw").axes)
                ),
            },
            "'both' errs least, mean absolute: "
            "surge 10 mm/s (75 % less than 'off'), sway 5.0 mm/s (75 % less), yaw 9.9 mm/s (alike).",
        ),
        ({"off": errs(0.04)}, "'off' errs, mean absolute: surge 40 mm/s."),
        (  # No other dive tells of sway, so nothing there is the least.
            {"off": errs(0.04), "both": TrackingErrors("b", (*errs(0.02).axes, *errs(0.01, "sway").axes))},
            "'both' errs least, mean absolute: surge 20 mm/s (50 % less than 'off'). "
            "'both' errs, mean absolute: sway 10 mm/s.",
        ),
        (
            {"off": errs(math.nan)},
            "No dive has a reference that moves and a measured speed beside it: nothing to compare.",
        ),
    ],
)
def test_the_verdict_names_the_mode_that_errs_least_and_by_how_much(errors, said):
    assert verdict(errors) == said


def test_an_axis_has_its_errors_side_by_side_then_the_curves_of_each_dive_then_table_5():
    report = made({"off": moving("pid", 1.5), "both": moving("both", 0.2)})
    assert [section.heading for section in report.sections] == ["Every axis, over the whole mission", "Surge"]
    surge = report.sections[1]
    filed = ["errors in surge of all dives", "tracking surge off", "tracking surge both"]
    assert [figure.name for figure in surge.figures] == ["errors in surge by phase"]
    assert [figure.name for figure in surge.filed] == filed
    assert labels(surge.figures[0]) == labels(surge.filed[0]) == ["off", "both"]
    assert [box.get_title(loc="left") for box in surge.filed[1].draw(10.0).axes] == [
        "surge speed u, m/s",
        "error in surge, m/s",
        "surge force X, N",
    ]
    assert surge.tables[0].columns == ("Surge motion", "off", "both")


def test_errors_of_dives_are_laid_over_one_another_from_where_the_reference_first_moves():
    dives = {"off": moving("pid", 1.5), "both": moving("both", 1.5, start_s=700.0)}
    surge = made(dives).sections[1]
    (trace,) = surge.traces
    assert trace.labels == ("off", "both", "reference")
    assert trace.kinds == ("mode0", "mode1", "reference")
    early, late, wanted = dict(trace.panels)["speed, mm/s"]
    assert late[:50] == pytest.approx(early[:50], abs=10.0)
    assert (wanted[:29] == 0.0).all()
    assert wanted[31:60].min() > 0.0
    assert 'class="curve reference"' in render_report(made(dives))
    (box,) = surge.filed[0].draw(10.0).axes
    early, late = (line.get_data() for line in box.get_lines()[:2])
    assert early[0][0] == pytest.approx(0.0, abs=0.1)
    assert np.interp(early[0], *late) == pytest.approx(early[1], abs=0.01)


def test_the_error_is_measured_less_wanted_without_the_sensor_s_noise():
    dive = moving("pid", 0.0)
    noise = np.random.default_rng(1).normal(0.0, 0.02, dive.velocity.value.shape)
    line = error_line(
        0, replace(dive, velocity=Signal(dive.velocity.time_s, dive.velocity.value + 0.1 + noise)), AT_ORIGIN
    )
    assert line.y.mean() == pytest.approx(0.1, abs=0.002)
    assert line.y.std() < 0.02 * math.sqrt(4 * 0.5 / dive.velocity.rate_hz)


def test_a_dive_too_short_or_without_a_velocity_has_no_line_of_its_error():
    dive = moving("pid", 0.0)
    assert error_line(0, replace(dive, velocity=None), AT_ORIGIN) is None
    assert error_line(0, replace(dive, velocity=Signal(np.zeros(0), np.zeros((0, 3)))), AT_ORIGIN) is None
    assert error_line(0, dive.between(0.0, 0.5), AT_ORIGIN) is None


def test_neither_speed_nor_error_is_drawn_through_a_silence_of_the_dvl():
    dive = moving("pid", 0.5)
    spoke = (dive.velocity.time_s < 12.0) | (dive.velocity.time_s > 28.0)
    silent = replace(dive, velocity=Signal(dive.velocity.time_s[spoke], dive.velocity.value[spoke]))
    line = error_line(0, silent, AT_ORIGIN)
    assert np.isnan(line.y[(line.x > 12.1) & (line.x < 27.9)]).all()
    assert np.isfinite(line.y[(line.x < 11.9) | (line.x > 28.1)]).all()
    surge = made({"off": silent}).sections[1]
    curves = dict(surge.traces[0].panels)
    # The curves begin 3 s before the reference moves, 5 s into the dive.
    at_s = surge.traces[0].time_s + 2.0
    for curve in (curves["speed, mm/s"][0], curves["error, mm/s"][0]):
        assert np.isnan(curve[(at_s > 12.2) & (at_s < 27.8)]).all()


def test_what_a_dive_never_fed_forward_gets_no_panel_without_a_curve():
    baseline = moving("pid", 0.5)
    fed = replace(baseline, tau_ff=Signal(baseline.tau_ff.time_s, 2.0 * np.ones_like(baseline.tau_ff.value)))
    titles = {
        words: [title for title, _ in made(dives).sections[1].traces[0].panels]
        for words, dives in {"off": {"off": baseline}, "both": {"off": baseline, "shadow": fed}}.items()
    }
    speed_to_pid = ["speed, mm/s", "error, mm/s", "force of the PID, N"]
    assert titles == {"off": speed_to_pid, "both": [*speed_to_pid, "force of the feed-forward, N"]}
    drawn = [labels(figure) for figure in made({"off": baseline}).sections[1].filed]
    assert not any("feed-forward" in each for each in drawn)


def test_go_and_no_go_stand_first_and_what_they_rest_on_after_the_pictures():
    judged = Raising(
        Mode.OFF, Mode.BOTH, (Criterion("surge mass", False, "2.00 times, 0.71 to 1.41", "dive again"),)
    )
    report = made({"off": moving("pid", 1.5)}, {"off": judged})
    assert [section.heading for section in report.sections] == [
        "May the feed-forward be raised?",
        "Every axis, over the whole mission",
        "Surge",
        "What go and no-go rest on",
    ]
    assert report.verdict.startswith("off: NO-GO. 'off' errs")
    ((go, sentence),) = report.sections[0].judged
    assert not go
    assert sentence.startswith("off: NO-GO, don't raise it: surge mass.")
    html = render_report(report)
    assert f'<p class="judged no"><span aria-hidden="true">▲</span> {safe(unbroken(sentence))}</p>' in html
    assert 'class="judged yes"' not in html
    assert report.sections[3].tables[0].shown == (("surge mass", "no", "2.00 times, 0.71 to 1.41"),)


def test_the_page_says_of_a_baseline_that_it_is_one_and_gets_no_verdict():
    dive = moving("pid", 1.5)
    run = Run("off", dive, tracking_errors(dive), None, "off")
    first = validation_report(Validation(FILE, (run,), AT_ORIGIN)).sections[0]
    assert (first.heading, first.judged) == ("May the feed-forward be raised?", ())
    assert first.text.startswith("off: the baseline, flown by the PID with nothing fed forward")


def test_no_line_of_a_page_ends_between_a_number_and_its_unit():
    report = made({"off": moving("pid", 1.5)}, {})
    told = replace(report.sections[0], text="Were thrust 10 ms later, it would be 1 % larger.")
    html = render_report(replace(report, subtitle="computed in 50.1 s.", sections=(told,)))
    for figure in ("10 ms", "1 %", "50.1 s"):
        assert figure not in html
        assert figure.replace(" ", "\N{NO-BREAK SPACE}") in html


def test_what_was_foretold_and_flown_is_the_first_that_a_page_says():
    row = ForecastRow("surge", "m/s", "both", "ff", 0.0133, 0.006, 0.18)
    dive = moving("both", 0.2)
    run = Run("both", dive, tracking_errors(dive), None, "both", (Held(row, 0.0061, 0.18, True),))
    report = validation_report(Validation(FILE, (run,), AT_ORIGIN))
    assert report.verdict.startswith(
        "both: As foretold: surge 13 (ff) -> 6.0 mm/s, flown 6.1. 'both' errs, mean absolute: surge"
    )
    judged = replace(run, raising=Raising(Mode.BOTH, Mode.BOTH, ()))
    assert validation_report(Validation(FILE, (judged,), AT_ORIGIN)).verdict.startswith(
        "both: GO. As foretold: surge 13"
    )


@pytest.mark.parametrize(
    ("names", "labels"),
    [
        (
            ("2026-11-26T1045Z-weak-both", "2026-11-26T1102Z-weak-both"),
            ["1045Z-weak both", "1102Z-weak both"],
        ),
        (
            ("2026-11-26T1045Z-both", "2026-11-27T1045Z-both"),
            ["2026-11-26T1045Z both", "2026-11-27T1045Z both"],
        ),
        (("lake", "lake"), ["lake both", "lake both (2)"]),
        (("2026-11-26T1045Z-both",), ["both"]),
    ],
)
def test_dives_in_a_mode_are_named_without_what_they_share(names, labels):
    dive, both = moving("both", 0.2), Signal(np.array([0.0, 10.0]), np.full((2, 1), 3.0))
    dives = [replace(dive, name=name, ff_mode=both) for name in names]
    assert [run.label for run in validate(dives, FILE).runs] == labels


def test_every_axis_has_its_rows_whether_it_was_asked_to_move_or_not():
    dive = moving("pid", 1.5)
    swayed = dive.velocity.value + np.array([0.0, 0.05, 0.0])
    section = made({"off": replace(dive, velocity=Signal(dive.velocity.time_s, swayed))}).sections[0]
    assert section.heading == "Every axis, over the whole mission"
    rows = dict(section.tables[0].shown)
    assert rows["Sway, whole mission"] == rows["Sway, while others move"] == "50 mm/s"
    assert rows["Surge, while others move"] == "—"
    assert rows["Yaw, whole mission"] == "0 deg/s"


def test_a_dive_without_a_reference_makes_a_page_that_says_so():
    html = render_report(made({"off": replace(moving("pid", 0.0), nu_ref=None, notes=("Too short.",))}))
    assert "nothing to compare" in html
    assert "off: Too short." in html


def test_bars_of_a_mode_differ_by_hatch_as_well_as_by_colour():
    groups = [Group(name, (0.1, math.nan)) for name in ("off", "shadow", "ff", "both")]
    (box,) = stack([grouped("error", ("Overall", "Steady state"), groups)])(10.0).axes
    hatches = [container.patches[0].get_hatch() or "" for container in box.containers]
    assert hatches == list(HATCHES)
    assert box.get_ylim()[0] == 0.0


def test_errors_are_laid_out_like_table_5_with_the_runs_side_by_side():
    both = TrackingErrors("b", (SURGE, SWAY))
    alone = TrackingErrors("a", (SURGE,))
    surge, sway = tracking_section({"PID alone": alone, "Both": both}, {}).tables
    assert surge.columns == ("Surge motion", "PID alone", "Both")
    assert surge.shown == (
        ("Acceleration, mm/s", "9.1", "9.1"),
        ("Steady state, mm/s", "3.6", "3.6"),
        ("Deceleration, mm/s", "4.8", "4.8"),
        ("Overall, mm/s", "5.1", "5.1"),
        ("Acceleration, delay taken out, mm/s", "4.2", "4.2"),
        ("Delay, ms", "300", "300"),
        ("Steady |PID|, N", "1.20", "1.20"),
        ("Steady |PID − feed-forward|, N", "2.40", "2.40"),
    )
    assert sway.columns == ("Sway motion", "PID alone", "Both")
    assert sway.shown[0] == ("Acceleration, mm/s", "—", "6.9")
    assert sway.shown[-1] == ("Steady |PID − feed-forward|, N", "—", "—")


def test_published_errors_stand_in_a_column_of_their_own_with_their_source():
    values = {("surge", "Acceleration"): 0.0091, ("surge", "Overall"): 0.0051}
    paper = Reference("Paper, both", "Vangi et al., Table 5", values)
    errors = {"Both": TrackingErrors("b", (SURGE, YAW))}
    surge, yaw = tracking_section(errors, {}, paper).tables
    assert surge.columns == ("Surge motion", "Both", "Paper, both")
    assert [row[2] for row in surge.shown] == ["9.1", "—", "—", "5.1", "—", "—", "—", "—"]
    assert surge.caption.endswith("Paper, both: Vangi et al., Table 5.")
    assert yaw.columns == ("Yaw motion", "Both")
    assert [row[0].rpartition(", ")[2] for row in yaw.shown] == ["deg/s"] * 5 + ["ms", "N m", "N m"]
    assert yaw.shown[2] == ("Deceleration, deg/s", "—")
    assert "Vangi" not in yaw.caption


def test_the_speeds_held_stand_in_a_table_of_their_own_the_runs_side_by_side():
    slow, fast = SteadyError(0.2, -0.0012, 0.0004, 4), SteadyError(0.4, 0.0021, NAN, 1)
    errors = {
        "ff": TrackingErrors("a", (replace(SURGE, speeds=(slow, fast)),)),
        "both": TrackingErrors("b", (replace(SURGE, speeds=(fast,)),)),
        "sway": TrackingErrors("c", (SWAY,)),
    }
    *_, by_speed = tracking_section(errors, {}).tables
    assert by_speed.columns == ("Surge speed, mm/s", "ff", "both", "sway")
    assert by_speed.shown == (
        ("200", "−1.2 ± 0.4", "—", "—"),
        ("400", "+2.1", "+2.1", "—"),
    )
    # What follows ± on this page else is half of a 95 % interval.
    assert (
        "± one standard error of that mean over the runs at this speed, not half of a 95 % interval"
        in by_speed.caption
    )
