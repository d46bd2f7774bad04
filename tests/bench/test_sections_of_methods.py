"""Cells, tables and figures of the benchmark's sections, from numbers that are known."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bench import speed, thrift
from bench.answers import answer, answered, methods
from bench.baselines import closed_form
from bench.campaigns import Dived
from bench.missions.mission import draw_one
from bench.paper_small import loss_settled_at, relative_errors, settled_at
from bench.reproduce.paper import TrainingCurves
from bench.steady import SETTLE_S, Held, held, lines, steady_errors
from bench.tracking import truly
from bridge.simulator.dive import WARM_UP_S
from bridge.simulator.missions import Leg
from bridge.vehicle.config import load_vehicle
from identify.dive import Dive, Signal

NAN = math.nan
WORDS = ("surge", "sway", "yaw")
FILE = load_vehicle("ruvifist:survey")
TIMED = {
    "samples": 10_500, "windows": 10_400, "read": 1.0, "first": {"likelihood": 9.0}, "again": {"likelihood": 3.0},
    "command": 8.0,
    "closed, filtered": 0.5, "closed": 0.0004, "small": 20.0, "settled": 36, "loss settled": 60, "epochs": 100,
    "epoch": 150.0, "threads": 2,
}  # fmt: skip


def _dived(nu: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> Dived:
    time_s = 0.05 * np.arange(1, len(nu) + 1)
    state = np.column_stack([np.zeros((len(nu), 3)), np.ones((len(nu), 1)), np.zeros((len(nu), 3)), nu])
    fog = Signal(time_s, np.ones((len(nu), 1)))
    return Dived(Dive("flown", Path("flown.tlog"), "0", fog=fog), FILE, "survey", {}, time_s, state)


def test_a_cell_is_the_rms_error_and_the_median_interval_of_those_that_answered() -> None:
    cell = thrift.cell([110.0, 90.0], [11.0, NAN], 100.0)
    assert cell == thrift.Cell(2, pytest.approx(0.1), pytest.approx(0.1))


def test_a_cell_without_answers_says_so() -> None:
    cell = thrift.cell([], [], 100.0)
    assert cell.count == 0
    assert math.isnan(cell.rms_error)


def test_a_parameter_settles_where_it_last_left_its_end() -> None:
    values = np.array([[10.0, 1.0], [98.0, 1.0], [101.5, 1.0], [100.5, 1.0], [100.0, 1.0]])
    empty = np.zeros(5)
    assert settled_at(TrainingCurves(("M_u", "D_u"), values, empty, empty, empty)) == 3
    assert settled_at(TrainingCurves(("M_u", "D_u"), values[-1:], empty, empty, empty)) == 0


def test_the_networks_loss_settles_where_it_last_left_its_end() -> None:
    loss = np.array([NAN, 9.0, 1.2, 1.02, 1.0])
    values = np.ones((5, 1))
    assert loss_settled_at(TrainingCurves(("M_u",), values, loss, loss, loss)) == 3
    assert loss_settled_at(TrainingCurves(("M_u",), values[:2], loss[3:], loss[3:], loss[3:])) == 1


def test_relative_errors_are_in_per_cent_of_the_truth() -> None:
    assert relative_errors({"M_u": 90.0, "D_u": 1.0}, {"M_u": 100.0}) == {"M_u": pytest.approx(-10.0)}


def test_a_steady_error_leaves_the_transient_out_and_counts_too_fast_as_positive_either_way() -> None:
    legs = (
        (Leg("change", "acceleration", 5.0, surge_m_s=-0.4, transient_s=5.0), 0.0, 5.0),
        (Leg("hold", "steady", 10.0, surge_m_s=-0.4), 5.0, 15.0),
    )
    nu = np.zeros((round((WARM_UP_S + 16.0) / 0.05), 6))
    since_s = 0.05 * np.arange(1, len(nu) + 1) - WARM_UP_S
    nu[since_s >= 5.0 + SETTLE_S - 1e-6, 0] = -0.41
    assert steady_errors(_dived(nu), legs) == {"surge 0.4": [pytest.approx(0.01)]}


def test_a_speed_is_told_by_its_mean_by_one_leg_and_by_what_the_true_parameters_do() -> None:
    flights = [
        ({"surge 0.4": [0.004, -0.002]}, {"surge 0.4": [0.003, -0.003]}),
        ({"surge 0.4": [0.004, -0.002]}, {"surge 0.4": [0.003, -0.003]}),
    ]
    page = "\n".join(lines(held("survey", flights), 2))
    assert "| survey | surge | 0.4 | 4 | +1.0 ± 1.7 | +0.0 ± 1.7 | 3.0 | 3.0 | 1.0 | 33.6 |" in page


def test_each_axis_is_judged_by_each_figure_at_the_speed_where_that_is_worst() -> None:
    calm, rough = np.array([-1.5, -1.5]), np.array([3.0, -3.0])
    speeds = [
        Held("survey", "surge", "0.2", calm, np.zeros(2)),
        Held("hovering", "surge", "0.4", rough, 0.9 * rough),
        Held("survey", "yaw", "0.2", np.full(2, -2.5), np.ones(2)),
    ]
    page = "\n".join(lines(speeds, 1))
    surge, sway, yaw = (next(row for row in page.splitlines() if row.startswith(f"| {a} ")) for a in WORDS)
    assert "| -1.5 ± 0.0 mm/s (survey at 0.2 m/s): met |" in surge
    assert "| 3.0 mm/s (hovering at 0.4 m/s): **missed** | 2.7 mm/s: **missed** |" in surge
    assert surge.endswith("| 1.5 mm/s (survey at 0.2 m/s): met |")
    assert sway == "| sway | was not flown | - | - | - |"
    assert "| -2.5 ± 0.0 mrad/s (survey at 0.2 rad/s): **missed** |" in yaw
    assert "| 1.0 mrad/s: met |" in yaw
    assert yaw.endswith("| 3.5 mrad/s (survey at 0.2 rad/s): **missed** |")


def test_a_mean_speed_that_so_few_legs_do_not_prove_is_said_to_be_so() -> None:
    scattered = np.array([1.0, 2.0, 1.0, 2.0])
    page = "\n".join(lines([Held("survey", "surge", "0.2", scattered, scattered)], 1))
    assert "| +1.5 ± 0.3 mm/s (survey at 0.2 m/s): met, though its 95 % interval passes it |" in page


def test_the_true_dive_has_the_true_velocities_and_no_gyro_beside_them() -> None:
    one = _dived(np.full((10, 6), 0.3))
    true = truly(one)
    assert true.velocity is not None
    assert true.gyro is not None
    assert true.fog is None
    assert (true.velocity.value == 0.3).all()


def test_a_refusal_is_an_answer_with_its_reason() -> None:
    mission = draw_one(100_003)
    empty = replace(mission.dive, velocity=None, gyro=None, fog=None)
    one = answer(answered("closed form", empty, mission.file, mission.configuration))
    assert one.value == {}
    assert "nothing can be identified" in one.refusal


def test_the_methods_of_others_answer_a_mission_with_finite_values() -> None:
    mission = draw_one(100_003, seconds=60.0)
    for name in methods()[-2:]:
        one = answer(answered(name, mission.dive, mission.file, mission.configuration))
        assert one.value
        assert all(math.isfinite(value) for value in one.value.values())
        assert set(one.half95) <= set(one.value)


def test_the_closed_form_needs_no_training_to_come_near_the_truth() -> None:
    mission = draw_one(100_003)
    found = closed_form.estimate(mission.dive, mission.file, mission.configuration, lambda *_report: None)
    for name, value in found.values().items():
        assert value == pytest.approx(mission.truth[name], rel=0.5)
        assert math.isnan(found[name].std)


def test_ratios_of_speed_are_to_one_epoch_and_to_convergence() -> None:
    page = "\n".join(speed.table(TIMED))
    assert "| `likelihood` | 4 | yes | 37.5 x | 2.25e+03 x |" in page
    assert "EXTRAPOLATED to 60 epochs | 9e+03 |" in page
    assert "10 s for the default is met" in page
    assert "is met (1125)" in " ".join(page.split())
