"""Thrusts to pulse widths and back, by curve, voltage and dead zone."""

import numpy as np
import pytest

from bridge.errors import ConfigError
from bridge.vehicle.config import CONFIGS, Configuration, ThrustCurve, Thruster, load_vehicle
from bridge.vehicle.thrusters import (
    Allocator,
    Curve,
    Pulses,
    QuadraticCurve,
    allocation_matrix,
    shaft_speed,
    thrust_curve,
)

T200 = thrust_curve(ThrustCurve(), CONFIGS)
RUVIFIST = load_vehicle("ruvifist").vehicle


@pytest.mark.parametrize("configuration", ["survey", "hovering"])
def test_a_wrench_within_the_limits_comes_out_as_it_went_in(configuration):
    tau = [12.0, 0.5, -6.0, 0.3, -0.4, 2.0]
    thrusts, wrench, scale = Allocator(RUVIFIST.configurations[configuration], T200).allocate(tau)
    np.testing.assert_allclose(wrench, tau, atol=1e-9)
    assert scale == 1.0
    assert len(thrusts) == 8


def test_a_wrench_beyond_the_limit_keeps_its_direction_and_puts_the_busiest_thruster_at_the_limit():
    hovering = RUVIFIST.configurations["hovering"]
    tau = np.array([300.0, 60.0, 0.0, 0.0, 0.0, 20.0])
    thrusts, wrench, scale = Allocator(hovering, T200).allocate(tau)
    np.testing.assert_allclose(wrench, scale * tau, atol=1e-9)
    assert 0 < scale < 1
    assert max(thrusts.max() / 40.0, thrusts.min() / T200.min_n) == pytest.approx(1.0)


def test_a_wrench_that_no_thruster_can_make_is_told_as_zero():
    configuration = Configuration(10.0, (1.0, 1.0, 1.0), (Thruster((1.0, 0.0, 0.0), (0.0, 0.0, 0.0)),))
    _, wrench, _ = Allocator(configuration, T200).allocate([3.0, 5.0, 0.0, 0.0, 0.0, 1.0])
    np.testing.assert_allclose(wrench, [3.0, 0, 0, 0, 0, 0], atol=1e-12)


def test_the_allocation_matrix_holds_force_and_moment_of_one_newton():
    half = Thruster((0.0, 1.0, 0.0), (0.4, 0.0, 0.1), gain=0.5)
    matrix = allocation_matrix(Configuration(10.0, (1.0, 1.0, 1.0), (half,)))
    np.testing.assert_allclose(matrix[:, 0], [0.0, 0.5, 0.0, -0.05, 0.0, 0.2])


@pytest.mark.parametrize(
    ("pwm_us", "thrust_n"), [(1100, -39.908), (1472, 0), (1500, 0), (1528, 0), (1900, 51.436)]
)
def test_the_t200_at_16_v_gives_its_published_thrust(pwm_us, thrust_n):
    assert T200.thrust(pwm_us) == pytest.approx(thrust_n)


def test_the_inverse_jumps_over_the_dead_zone_and_rests_at_1500():
    np.testing.assert_array_less(1528.0, T200.pwm([1e-6, 0.1]))
    np.testing.assert_array_less(T200.pwm([-1e-6, -0.1]), 1472.0)
    assert T200.pwm(0.0) == 1500.0


def test_thrust_beyond_the_table_is_held_at_its_ends():
    np.testing.assert_allclose(T200.pwm([-100.0, 100.0]), [1100.0, 1900.0])
    np.testing.assert_allclose(T200.thrust([900.0, 2000.0]), [-39.908, 51.436])


def test_a_voltage_between_two_of_the_table_lies_between_them_in_proportion():
    at = {
        v: thrust_curve(ThrustCurve(voltage_v=v), CONFIGS).thrust([1200.0, 1533.0, 1700.0])
        for v in (14, 15.5, 16)
    }
    np.testing.assert_allclose(at[15.5], 0.25 * at[14] + 0.75 * at[16])


@pytest.mark.parametrize("voltage_v", [10.0, 12.0, 14.0, 16.0, 18.0, 20.0])
def test_every_voltage_of_the_table_can_be_inverted(voltage_v):
    curve = thrust_curve(ThrustCurve(voltage_v=voltage_v), CONFIGS)
    wanted = np.linspace(curve.min_n, curve.max_n, 173)
    np.testing.assert_allclose(curve.thrust(curve.pwm(wanted)), wanted, atol=1e-9)


def test_the_quadratic_law_is_its_formula_with_a_dead_band():
    law: Curve = QuadraticCurve(50.0, 400.0, 25.0)
    np.testing.assert_allclose(law.thrust([1300, 1480, 1700, 1900, 2000]), [-12.5, 0.0, 12.5, 50.0, 50.0])
    np.testing.assert_allclose(law.pwm([-12.5, 0.0, 12.5, 80.0]), [1300, 1500, 1700, 1900])


def test_shaft_speed_follows_the_square_root_of_thrust_with_its_sign():
    curve = ThrustCurve(forward_n_s2=0.01, reverse_n_s2=0.04)
    np.testing.assert_allclose(shaft_speed(curve, [4.0, -4.0, 0.0]), [20.0, -10.0, 0.0])


def test_a_table_beside_the_vehicle_file_goes_before_the_shipped_one(tmp_path):
    (tmp_path / "t200.csv").write_text(
        "# mine\nvoltage_v,pwm_us,thrust_n\n16,1100,-4\n16,1500,0\n16,1900,4\n"
    )
    assert thrust_curve(ThrustCurve(), tmp_path).thrust(1700) == pytest.approx(2.0)


def test_a_table_that_was_changed_is_read_anew(tmp_path):
    table = tmp_path / "t200.csv"
    table.write_text("voltage_v,pwm_us,thrust_n\n16,1100,-4\n16,1500,0\n16,1900,4\n")
    assert thrust_curve(ThrustCurve(), tmp_path).thrust(1900) == pytest.approx(4.0)
    table.write_text("voltage_v,pwm_us,thrust_n\n16,1100,-40\n16,1500,0\n16,1900,40\n")
    assert thrust_curve(ThrustCurve(), tmp_path).thrust(1900) == pytest.approx(40.0)


@pytest.mark.parametrize("name", ["../own.csv", "tables/../../own.csv", "{folder}/own.csv"])
def test_a_table_outside_the_vehicle_files_folder_is_never_read(tmp_path, name):
    (tmp_path / "own.csv").write_text("voltage_v,pwm_us,thrust_n\n16,1100,-4\n16,1500,0\n16,1900,4\n")
    with pytest.raises(ConfigError, match="leads out of the vehicle file's folder"):
        thrust_curve(ThrustCurve(file=name.format(folder=tmp_path)), tmp_path / "mine")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (None, "can't read"),
        ("pwm,thrust\n", "starts with"),
        ("voltage_v,pwm_us,thrust_n\n16,x,3\n", "three numbers"),
        ("voltage_v,pwm_us,thrust_n\n16,1100,-4\n16,1500,0\n16,1700,nan\n16,1900,4\n", "three numbers"),
        ("voltage_v,pwm_us,thrust_n\n16,1100,-4,1\n16,1500,0,0\n16,1900,4,1\n", "three numbers"),
        ("voltage_v,pwm_us,thrust_n\n16,1100,-inf\n16,1500,0\n16,1900,4\n", "three numbers"),
        ("voltage_v,pwm_us,thrust_n\n", "no voltage at all"),
        ("voltage_v,pwm_us,thrust_n\n12,1500,0\n", "not 16 V"),
    ],
)
def test_a_table_that_cannot_serve_is_refused_with_what_to_do(tmp_path, text, says):
    if text is not None:
        (tmp_path / "own.csv").write_text(text)
    with pytest.raises(ConfigError, match=says):
        thrust_curve(ThrustCurve(file="own.csv"), tmp_path)


FILE = load_vehicle("ruvifist")
CURVE = thrust_curve(FILE.vehicle.thrust_curve, FILE.path.parent)


def test_beyond_the_straight_part_the_pulse_widths_give_the_very_thrust():
    wanted = np.array([-30.0, -2.0, 2.0, 12.5])
    np.testing.assert_allclose(CURVE.thrust(Pulses(CURVE, 1.9)(wanted)), wanted, atol=1e-9)


def test_the_straight_part_runs_through_neutral_and_meets_the_curve_on_both_sides():
    pulses = Pulses(CURVE, 2.0)
    ahead, astern = CURVE.pwm([2.0, -2.0])
    assert pulses(np.array([0.0])) == pytest.approx([1500.0])
    assert pulses(np.array([1.0, -1.0])) == pytest.approx([(1500 + ahead) / 2, (1500 + astern) / 2])
    assert pulses(np.array([1.999999, -1.999999])) == pytest.approx([ahead, astern], abs=1e-3)


def test_each_thruster_may_have_its_own_straight_part():
    near, far = Pulses(CURVE, np.array([0.0, 3.0]))(np.array([1.0, 1.0]))
    assert near == pytest.approx(CURVE.pwm(1.0))
    assert far == pytest.approx(1500 + (CURVE.pwm(3.0) - 1500) / 3)


ONE_WAY = ThrustCurve(kind="quadratic", max_n=4.0, neutral_us=1100.0, span_us=800.0, one_way=True)


def test_a_thruster_that_pushes_one_way_rests_at_and_below_its_neutral():
    curve = thrust_curve(ONE_WAY, CONFIGS)
    np.testing.assert_allclose(curve.thrust([1000, 1100, 1500, 1900, 2000]), [0.0, 0.0, 1.0, 4.0, 4.0])
    np.testing.assert_allclose(curve.pwm([-1.0, 0.0, 1.0, 4.0]), [1100.0, 1100.0, 1500.0, 1900.0])
    assert curve.ends_us == (1100.0, 1900.0)
    assert curve.min_n == 0.0


def test_a_curve_of_another_neutral_is_the_same_curve_elsewhere():
    moved = thrust_curve(ThrustCurve(kind="quadratic", max_n=4.0, neutral_us=1480.0), CONFIGS)
    plain = thrust_curve(ThrustCurve(kind="quadratic", max_n=4.0), CONFIGS)
    pulses = np.arange(1100.0, 1901.0, 50.0)
    np.testing.assert_allclose(moved.thrust(pulses - 20.0), plain.thrust(pulses), atol=1e-12)
    np.testing.assert_allclose(moved.pwm([-2.0, 0.0, 2.0]), plain.pwm([-2.0, 0.0, 2.0]) - 20.0)


def one_way_table(tmp_path, **keys):
    rows = [f"16,{pulse},{force}" for pulse, force in ((1100, 0.0), (1300, 1.0), (1900, 7.0))]
    (tmp_path / "ours.csv").write_text("voltage_v,pwm_us,thrust_n\n" + "\n".join(rows) + "\n")
    return thrust_curve(ThrustCurve(file="ours.csv", **keys), tmp_path)


def test_a_table_may_rest_at_another_pulse(tmp_path):
    curve = one_way_table(tmp_path, neutral_us=1100.0)
    np.testing.assert_allclose(curve.thrust([900, 1100, 1200, 1900]), [0.0, 0.0, 0.5, 7.0])
    assert curve.ends_us == (1100.0, 1900.0)


def test_a_table_that_pushes_ahead_below_neutral_is_refused(tmp_path):
    with pytest.raises(ConfigError, match=r"pushes ahead at 1300 us, below thrust_curve: neutral_us of 1500"):
        one_way_table(tmp_path)
    (tmp_path / "turned.csv").write_text("voltage_v,pwm_us,thrust_n\n16,1500,0\n16,1900,-7\n")
    with pytest.raises(
        ConfigError, match=r"pushes astern at 1900 us, above thrust_curve: neutral_us of 1500"
    ):
        thrust_curve(ThrustCurve(file="turned.csv"), tmp_path)


def test_thrusters_that_push_one_way_are_never_driven():
    with pytest.raises(ConfigError, match="push one way alone"):
        Allocator(RUVIFIST.configurations["survey"], thrust_curve(ONE_WAY, CONFIGS))
