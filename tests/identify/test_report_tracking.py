"""How a report shows the tracking of several runs: Table 5's rows, the runs side by side, a figure an axis."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from identify.dive import Dive, Signal
from identify.report.page import Figure
from identify.report.validation import Reference, tracking_section
from identify.validate import METHOD, AxisErrors, SteadyError, TrackingErrors, tracking_errors

NAN = math.nan
SURGE = AxisErrors("surge", "m/s", 0.0091, 0.0036, 0.0048, 0.0051, 0.3, 0.0042, -1.1528, 1.2, 2.4)
SWAY = AxisErrors("sway", "m/s", 0.0069, 0.0030, 0.0026, 0.0035, 0.25, 0.0031, 1.6706, 1.7, NAN)
YAW = AxisErrors("yaw", "rad/s", 0.02, 0.01, NAN, 0.015, 1.0, 0.012, 0.5, 0.6, 1.7)


def moving_dive(*columns: int) -> Dive:
    """40 s in which the reference of each column rises, holds and falls, and the vehicle follows 0.5 s later."""
    time_s = np.arange(0.0, 40.0, 0.05)
    n = len(time_s)
    profile = np.interp(time_s, [2.0, 7.0, 30.0, 35.0], [0.0, 0.4, 0.4, 0.0])
    late = np.interp(time_s - 0.5, [2.0, 7.0, 30.0, 35.0], [0.0, 0.4, 0.4, 0.0])
    reference, velocity, rate = np.zeros((n, 14)), np.zeros((n, 3)), np.zeros((n, 3))
    for column in columns:
        reference[:, column], reference[:, 6 + column] = profile, np.gradient(profile, time_s)
        target = velocity if column < 3 else rate
        target[:, column % 3] = late
    return Dive(
        "run",
        Path("run.tlog"),
        "",
        velocity=Signal(time_s, velocity),
        gyro=Signal(time_s, rate),
        nu_ref=Signal(time_s, reference),
        tau_pid=Signal(time_s, np.ones((n, 6))),
        tau_ff=Signal(time_s, np.zeros((n, 6))),
    )


def test_errors_are_laid_out_like_table_5_with_the_runs_side_by_side():
    both = TrackingErrors("b", (SURGE, SWAY))
    alone = TrackingErrors("a", (SURGE,))
    surge, sway = tracking_section({"PID alone": alone, "Both": both}, {}).tables
    assert surge.columns == ("Surge motion", "PID alone", "Both")
    assert surge.rows == (
        ("Acceleration, m/s", "0.0091", "0.0091"),
        ("Steady state, m/s", "0.0036", "0.0036"),
        ("Deceleration, m/s", "0.0048", "0.0048"),
        ("Overall, m/s", "0.0051", "0.0051"),
        ("Acceleration, delay taken out, m/s", "0.0042", "0.0042"),
        ("Delay, ms", "300", "300"),
        ("Steady |PID|, N", "1.20", "1.20"),
        ("Steady |PID − feed-forward|, N", "2.40", "2.40"),
    )
    assert sway.columns == ("Sway motion", "PID alone", "Both")
    assert sway.rows[0] == ("Acceleration, m/s", "—", "0.0069")
    assert sway.rows[-1] == ("Steady |PID − feed-forward|, N", "—", "—")


def test_published_errors_stand_in_a_column_of_their_own_with_their_source():
    values = {("surge", "Acceleration"): 0.0091, ("surge", "Overall"): 0.0051}
    paper = Reference("Paper, both", "Vangi et al., Table 5", values)
    errors = {"Both": TrackingErrors("b", (SURGE, YAW))}
    surge, yaw = tracking_section(errors, {}, paper).tables
    assert surge.columns == ("Surge motion", "Both", "Paper, both")
    assert [row[2] for row in surge.rows] == ["0.0091", "—", "—", "0.0051", "—", "—", "—", "—"]
    assert surge.caption.endswith("Paper, both: Vangi et al., Table 5.")
    assert yaw.columns == ("Yaw motion", "Both")
    assert [row[0].rpartition(", ")[2] for row in yaw.rows] == ["rad/s"] * 5 + ["ms", "N m", "N m"]
    assert yaw.rows[2] == ("Deceleration, rad/s", "—")
    assert "Vangi" not in yaw.caption


def test_the_page_says_how_noise_was_kept_out_of_the_errors_and_how_much_is_left():
    noisy = replace(SURGE, noise=0.00127)
    (table,) = tracking_section({"PID": TrackingErrors("a", (noisy,))}, {}).tables
    assert METHOD in table.caption
    assert table.caption.endswith("Noise of the sensor that is left in it, m/s rms: PID 0.0013.")


def test_the_speeds_held_stand_in_a_table_of_their_own_the_runs_side_by_side():
    slow, fast = SteadyError(0.2, -0.0012, 0.0004, 4), SteadyError(0.4, 0.0021, NAN, 1)
    errors = {
        "FF": TrackingErrors("a", (replace(SURGE, speeds=(slow, fast)),)),
        "both": TrackingErrors("b", (replace(SURGE, speeds=(fast,)),)),
        "sway": TrackingErrors("c", (SWAY,)),
    }
    *_, by_speed = tracking_section(errors, {}).tables
    assert by_speed.columns == ("Surge speed, m/s", "FF", "both", "sway")
    assert by_speed.rows == (
        ("0.20", "−0.0012 ± 0.0004", "—", "—"),
        ("0.40", "+0.0021", "+0.0021", "—"),
    )


def test_each_run_has_a_figure_for_each_axis_that_moved():
    dives = {"PID alone": moving_dive(0, 5), "Both": moving_dive(1)}
    section = tracking_section({mode: tracking_errors(dive) for mode, dive in dives.items()}, dives)
    assert [f.caption.partition(":")[0] for f in section.figures] == [
        "PID alone, surge",
        "PID alone, yaw",
        "Both, sway",
    ]
    assert [[box.get_title(loc="left") for box in boxes(f)] for f in section.figures] == [
        ["surge speed u, m/s", "error in surge, m/s", "surge force X, N"],
        ["yaw rate r, rad/s", "error in yaw, rad/s", "yaw moment N, N m"],
        ["sway speed v, m/s", "error in sway, m/s", "sway force Y, N"],
    ]
    words = [text.get_text() for text in section.figures[0].draw(10.0).legends[0].get_texts()]
    assert words == ["measured", "reference", "PID", "feed-forward"]


def boxes(figure: Figure) -> list[Axes]:
    return figure.draw(10.0).axes


def test_runs_without_a_reference_make_an_empty_section():
    dive = Dive("run", Path("run.tlog"), "")
    section = tracking_section({"Off": tracking_errors(dive)}, {"Off": dive})
    assert (section.text, section.tables, section.figures) == ("", (), ())
