"""The wrench through curve, lag and geometry, against the response written out by hand."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.errors import FitError
from bridge.vehicle.config import Configuration, ThrustCurve, Thruster, Vehicle, VehicleFile, load_vehicle
from identify.dive import Array, Dive, Signal
from identify.forces import WrenchHistory, wrench
from identify.ingest.open import read_dive

LAG_S = 0.2
QUADRATIC = ThrustCurve(kind="quadratic", max_n=40.0, span_us=400.0, lag_s=LAG_S)
TWIN = (Thruster((1.0, 0.0, 0.0), (0.0, -0.5, 0.0)), Thruster((1.0, 0.0, 0.0), (0.0, 0.5, 0.0)))


def vehicle(curve: ThrustCurve = QUADRATIC, thrusters: tuple[Thruster, ...] = TWIN) -> VehicleFile:
    shape = Configuration(dry_mass_kg=10.0, inertia_kgm2=(1.0, 1.0, 1.0), thrusters=thrusters)
    return VehicleFile(Path("twin.yaml"), Vehicle("twin", {"twin": shape}, thrust_curve=curve), None, "0")


def dive(**signals: Signal) -> Dive:
    return Dive("twin", Path("twin.tlog"), "0", **signals)  # type: ignore[arg-type]


def pwm(time_s: list[float], *rows: tuple[float, ...]) -> Signal:
    return Signal(np.array(time_s), np.array(rows, np.float64))


STEP = pwm([0.0, 1.0, 2.0], (1500.0, 1500.0), (1700.0, 1700.0), (1500.0, 1700.0))


def history() -> WrenchHistory:
    return wrench(dive(pwm=STEP), vehicle(), "twin")


def test_a_step_answers_with_the_exponential_of_the_lag() -> None:
    # Each thruster gives 40 * 0.5^2 = 10 N at 1700 us.
    at = history().at(np.array([0.5, 1.0, 1.2, 1.9]))
    assert at[:, 0] == pytest.approx([0.0, 0.0, 20 * (1 - np.exp(-1)), 20 * (1 - np.exp(-4.5))])
    assert np.abs(at[:, 1:]).max() == 0.0


@pytest.mark.parametrize("dof", range(6))
def test_one_component_alone_is_that_of_all(dof: int) -> None:
    start_s, end_s = np.array([0.3, 1.1, 1.9]), np.array([1.4, 1.1, 2.6])
    whole, alone = history(), history().along(dof)
    assert np.array_equal(alone.at(end_s), whole.at(end_s)[:, [dof]])
    halves = whole.halves_between(start_s, end_s)[:, :, [dof]]
    assert np.array_equal(alone.halves_between(start_s, end_s), halves)
    assert alone.hidden == pytest.approx(whole.hidden[[dof]])


def test_one_thruster_alone_turns_the_vehicle() -> None:
    # At y = 0.5 a push of 10 N forward turns to port: N = -y X.
    late = history().at(np.array([10.0]))[0]
    assert late == pytest.approx([10, 0, 0, 0, 0, -5], abs=1e-12)


def test_the_mean_over_an_interval_is_the_exact_integral() -> None:
    # From 1.0 s to 1.4 s: 20 N minus what the lag still keeps back.
    kept_back = 20 * LAG_S * (1 - np.exp(-0.4 / LAG_S)) / 0.4
    mean = history().mean_between(np.array([1.0]), np.array([1.4]))
    assert mean[0, 0] == pytest.approx(20 - kept_back)


def test_an_interval_across_commands_equals_a_fine_sum() -> None:
    ours = history().mean_between(np.array([0.3]), np.array([2.7]))[0]
    fine_s = 0.3 + (np.arange(240_000) + 0.5) * 1e-5
    assert ours == pytest.approx(history().at(fine_s).mean(axis=0), abs=1e-8)


def test_two_halves_carry_the_area_and_the_first_moment_of_the_wrench() -> None:
    start_s, end_s = 0.9, 1.5
    early, late = history().halves_between(np.array([start_s]), np.array([end_s]))[0]
    fine_s = start_s + (np.arange(600_000) + 0.5) * 1e-6
    wrench_n = history().at(fine_s)
    assert 0.5 * (early + late) == pytest.approx(wrench_n.mean(axis=0), abs=1e-6)
    moment = (wrench_n * (end_s - fine_s)[:, None]).mean(axis=0) * 0.6
    assert (3 * early + late) * 0.36 / 8 == pytest.approx(moment, abs=1e-6)


def test_an_empty_interval_gives_the_value_itself() -> None:
    now = np.array([1.3])
    assert history().mean_between(now, now) == pytest.approx(history().at(now))


def test_without_a_lag_the_thrust_is_there_at_once() -> None:
    now = wrench(dive(pwm=STEP), vehicle(replace(QUADRATIC, lag_s=0.0)), "twin")
    assert now.at(np.array([0.999, 1.0, 1.5]))[:, 0] == pytest.approx([0, 20, 20])
    assert now.mean_between(np.array([0.5]), np.array([1.5]))[0, 0] == pytest.approx(10.0)


def slow(time_s: Array, asked: Array) -> Array:
    state = [asked[0]]
    for k, step in enumerate(np.diff(time_s)):
        state.append(asked[k] + (state[-1] - asked[k]) * np.exp(-step / LAG_S))
    return np.array(state)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.floats(0.001, 3.0), st.floats(1100, 1900)), min_size=2, max_size=60))
def test_the_scan_equals_the_step_by_step_recursion(commands: list[tuple[float, float]]) -> None:
    time_s = np.cumsum([step for step, _ in commands])
    signal = Signal(time_s, np.array([[us, us] for _, us in commands]))
    ours = wrench(dive(pwm=signal), vehicle(), "twin")
    assert ours.state == pytest.approx(slow(ours.time_s, ours.asked), abs=1e-9)


def test_tau_cmd_stands_in_for_missing_pwm_and_says_so() -> None:
    tau = Signal(np.array([0.0, 1.0]), np.array([[0.0] * 6, [1, 2, 3, 4, 5, 6]]))
    ours = wrench(dive(tau_cmd=tau), vehicle(), "twin")
    assert ours.source == "tau_cmd"
    assert ours.at(np.array([20.0]))[0] == pytest.approx([1, 2, 3, 4, 5, 6])
    assert any("TAU_CMD" in note for note in ours.notes)


def test_pwm_of_too_few_outputs_is_not_guessed_at() -> None:
    tau = Signal(np.array([0.0]), np.zeros((1, 6)))
    ours = wrench(dive(tau_cmd=tau, pwm=pwm([0.0], (1600.0,))), vehicle(), "twin")
    assert ours.source == "tau_cmd"
    assert any("1 thruster outputs" in note for note in ours.notes)


def test_outputs_beyond_the_thrusters_are_lights_and_the_like() -> None:
    more = pwm([0.0, 1.0], (1500, 1500, 1900), (1700, 1700, 1900))
    ours = wrench(dive(pwm=more), vehicle(), "twin")
    assert ours.at(np.array([20.0]))[0, 0] == pytest.approx(20.0)


def test_both_sources_are_compared() -> None:
    tau = Signal(STEP.time_s, np.array([[0.0] * 6, [22, 0, 0, 0, 0, 0], [10, 0, 0, 0, 0, -5]]))
    ours = wrench(dive(pwm=STEP, tau_cmd=tau), vehicle(), "twin")
    assert ours.source == "pwm"
    (note,) = ours.notes
    assert note.startswith("In surge the wrench from PWM differs from TAU_CMD by 1.2 N rms of 14 N; ")


def test_a_thruster_without_a_pulse_is_at_rest() -> None:
    ours = wrench(dive(pwm=pwm([0.0], (0.0, 1700.0))), vehicle(), "twin")
    assert ours.at(np.array([1.0]))[0, 0] == pytest.approx(10.0)
    assert any("without a pulse" in note for note in ours.notes)


def test_a_command_that_is_no_number_is_the_one_before_it() -> None:
    gap = pwm([0.0, 0.1, 0.2, 0.3], (1500.0, 1500.0), (1700.0, 1700.0), (np.nan, 1700.0), (1700.0, 1700.0))
    ours = wrench(dive(pwm=gap), vehicle(), "twin")
    assert ours.asked[:, 0] == pytest.approx([0.0, 20.0, 20.0, 20.0])
    assert ours.notes == ()


def test_tau_cmd_stands_in_where_a_command_is_unknown_for_long() -> None:
    gap = pwm([0.0, 1.0, 2.0, 3.0], (1500.0, 1500.0), (1700.0, 1700.0), (np.nan, 1700.0), (1700.0, 1700.0))
    tau = Signal(gap.time_s, np.outer([0.0, 20.0, 15.0, 20.0], np.eye(6)[0]))
    ours = wrench(dive(pwm=gap, tau_cmd=tau), vehicle(), "twin")
    assert ours.asked[:, 0] == pytest.approx([0.0, 20.0, 15.0, 20.0])
    assert any(note.startswith("1 command lacks a thruster") and "TAU_CMD" in note for note in ours.notes)


def test_commands_of_which_one_is_unknown_at_any_time_tell_no_wrench() -> None:
    gap = pwm([0.0, 1.0, 2.0, 3.0], (1500.0, np.nan), (np.nan, 1700.0), (np.nan, 1600.0), (1700.0, np.nan))
    with pytest.raises(FitError, match="tell no wrench, as at no time are those of all thrusters numbers"):
        wrench(dive(pwm=gap), vehicle(), "twin")


def test_nothing_at_all_is_refused() -> None:
    with pytest.raises(FitError, match="neither thruster commands"):
        wrench(dive(), vehicle(), "twin")


def test_replaying_the_commands_of_the_real_firmware_gives_its_motion() -> None:
    """ArduSub's own simulator has no added mass and purely quadratic drag; its source says how much."""
    path = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "ardusub_sitl" / "still.tlog.gz"
    if not path.exists():
        pytest.skip(f"{path} is not here")
    recorded = read_dive(path)
    assert recorded.velocity is not None
    assert recorded.gyro is not None
    step_s = 0.01
    time_s = np.arange(50.0, 500.0, step_s)
    file = load_vehicle("ardusub_vectored")
    tau = wrench(recorded, file, "vectored").mean_between(time_s, time_s + step_s)
    u = v = r = 0.0
    replayed = []
    for x, y, n in tau[:, [0, 1, 5]].tolist():
        replayed.append((u, v, r))
        u_dot = (x - 48.285 * u * abs(u)) / 10.5 + v * r
        v_dot = (y - 62.08 * v * abs(v)) / 10.5 - u * r
        r_dot = (n - 7.0757 * r * abs(r)) / 0.26808
        u, v, r = u + step_s * u_dot, v + step_s * v_dot, r + step_s * r_dot
    measured = np.column_stack((recorded.velocity.at(time_s)[:, :2], recorded.gyro.at(time_s)[:, 2]))
    rms = np.sqrt(np.mean((np.array(replayed) - measured) ** 2, axis=0))
    assert (rms < np.array([0.04, 0.04, 0.03])).all()
    assert (measured.std(axis=0) > 0.2).all()
