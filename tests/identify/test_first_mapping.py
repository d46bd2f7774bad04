"""Physics that contradicts a recording names the signal, the evidence and the mend."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from turning_vehicle import readings

from identify.checks.mapping.first_mapping import mends
from identify.checks.mapping.mend import Mend, mended
from identify.checks.sensors.sensor_pairs import agreeing
from identify.dive import Dive, Signal
from identify.ingest.rotation import to_earth

READ = readings()


def dive(read=READ):
    def signal(key):
        value = read[key]
        return Signal(read["t"], value if value.ndim == 2 else value[:, None])

    return Dive(
        "log", Path("log"), "", velocity=signal("velocity"), gyro=signal("gyro"), specific_force=signal("force"),
        attitude=signal("attitude"), pressure=signal("pressure"), depth=signal("depth"),
    )  # fmt: skip


def changed(name, factors, order=()):
    return mended(dive(), Mend(name, factors, "", "", order))


def without(recorded, *names):
    return replace(recorded, **dict.fromkeys(names))


def test_a_recording_that_agrees_with_itself_is_left_alone_and_its_signals_bear_each_other_out():
    assert mends(dive()) == ()
    assert agreeing(dive()) == {
        ("attitude", "gyro"),
        ("attitude", "specific_force"),
        ("velocity", "depth"),
        ("velocity", "specific_force"),
        ("depth", "pressure"),
    }


CHANGES = [
    ("gyro", (1.0, -1.0, 1.0), ()),
    ("gyro", (1.0, 1.0, -1.0), ()),
    ("gyro", (np.degrees(1.0),) * 3, ()),
    ("gyro", (np.radians(1.0),) * 3, ()),
    ("gyro", (1e3,) * 3, ()),
    ("gyro", (1e3 * np.radians(1.0),) * 3, ()),
    ("gyro", (1e-3,) * 3, ()),
    ("gyro", (1e-3 * np.degrees(1.0),) * 3, ()),
    ("gyro", (1.0, 1.0, 1.0), (1, 0, 2)),
    ("gyro", (1.0, -1.0, -1.0), ()),
    ("attitude", (1.0, -1.0, -1.0), ()),
    ("velocity", (-1.0, 1.0, 1.0), ()),
    ("velocity", (1.0, -1.0, 1.0), ()),
    ("velocity", (1.0, -1.0, -1.0), ()),
    ("velocity", (100.0, 100.0, 100.0), ()),
    ("specific_force", (1.0, -1.0, -1.0), ()),
    ("specific_force", (1 / 9.80665,) * 3, ()),
    ("specific_force", (-1.0, -1.0, -1.0), ()),
    ("attitude", (np.radians(1.0), np.radians(1.0), 1.0), ()),
    ("depth", (-1.0,), ()),
    ("depth", (100.0,), ()),
    ("depth", (1 / 0.3048,), ()),
    ("depth", (1 / 0.0254,), ()),
    ("velocity", (1 / 0.3048,) * 3, ()),
    ("velocity", (3600 / 1852,) * 3, ()),
    ("velocity", (3.6,) * 3, ()),
    ("pressure", (0.001,), ()),
    ("pressure", (1e5 / 6894.757293168361,), ()),
    ("pressure", (10.0,), ()),
]


@pytest.mark.parametrize(("name", "factors", "order"), CHANGES)
def test_a_signal_that_was_changed_is_found_and_mended_back(name, factors, order):
    wrong = changed(name, factors, order)
    (mend,) = mends(wrong)
    assert mend.signal == name
    assert mend.order == order
    value = getattr(mended(wrong, mend), name).value
    truth = getattr(dive(), name).value
    if name == "attitude":  # a quaternion and its negative are the same attitude
        value = value * np.sign(np.sum(value * truth, axis=1, keepdims=True))
    assert value == pytest.approx(truth, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize(
    ("name", "factor", "unit"),
    [
        ("depth", 1 / 0.3048, "it is in feet"),
        ("depth", 1 / 0.0254, "it is in inches"),
        ("velocity", 3600 / 1852, "it is in knots"),
        ("velocity", 1 / 0.3048, "it is in ft/s"),
        ("gyro", np.degrees(1.0), "it is in degrees, or the attitude is"),
        ("gyro", np.radians(1.0), "it is in rad/s, taken for deg/s"),
        ("gyro", 1e3, "it is in mrad/s, taken for rad/s"),
        ("gyro", 1e3 * np.radians(1.0), "it is in mrad/s, taken for deg/s"),
        ("pressure", 1e5 / 6894.757293168361, "as psi taken for bar"),
        ("pressure", 0.001, "as kPa taken for Pa"),
    ],
)
def test_the_sentence_names_the_unit_that_a_column_is_in(name, factor, unit):
    width = getattr(dive(), name).value.shape[1]
    (mend,) = mends(changed(name, (factor,) * width))
    assert unit in mend.problem


def test_a_depth_in_feet_is_found_by_heave_alone_and_a_velocity_in_feet_by_a_depth_that_pressure_bears_out():
    (mend,) = mends(without(changed("depth", (1 / 0.3048,)), "pressure", "specific_force"))
    assert (mend.signal, mend.factors) == ("depth", pytest.approx((0.3048,)))
    assert "it is in feet" in mend.problem
    (mend,) = mends(without(changed("velocity", (1 / 0.3048,) * 3), "specific_force"))
    assert (mend.signal, mend.factors) == ("velocity", pytest.approx((0.3048,) * 3))
    assert "the velocity is in ft/s" in mend.problem


def test_a_velocity_in_feet_is_found_by_a_pressure_where_no_depth_is_recorded():
    (mend,) = mends(without(changed("velocity", (1 / 0.3048,) * 3), "depth", "specific_force"))
    assert (mend.signal, mend.factors) == ("velocity", pytest.approx((0.3048,) * 3))


def test_an_absolute_pressure_in_bar_that_was_taken_for_dbar_from_the_surface_loses_the_airs_again():
    right = dive()
    wrong = replace(right, pressure=Signal(READ["t"], 0.1 * READ["pressure"][:, None] + 101325.0))
    (mend,) = mends(wrong)
    assert (mend.signal, mend.factors, mend.offset) == ("pressure", (10.0,), -1013250.0)
    assert mended(wrong, mend).pressure.value == pytest.approx(right.pressure.value, rel=1e-9)


def test_a_right_pressure_is_left_alone_where_the_depth_is_in_a_unit_that_no_map_knows():
    assert [mend for mend in mends(changed("depth", (10.0,))) if mend.signal == "pressure"] == []


@pytest.mark.parametrize("factor", [1.0, 1e-4])
def test_a_pressure_that_counts_from_the_surface_gets_the_airs(factor):
    right = dive()
    wrong = replace(right, pressure=Signal(READ["t"], factor * (READ["pressure"][:, None] - 101325.0)))
    (mend,) = mends(wrong)
    assert (mend.signal, mend.offset) == ("pressure", 101325.0)
    assert mend.factors == pytest.approx((1 / factor,), rel=0.001)
    assert mended(wrong, mend).pressure.value == pytest.approx(right.pressure.value, rel=0.001)
    assert "counts from the surface" in mend.problem
    assert "add 101325 Pa" in mend.remedy


NED = to_earth(READ["attitude"], READ["velocity"])
AXES = [
    (NED, (1.0, 1.0, 1.0), (), "north, east, down"),
    (NED[:, [1, 0, 2]] * np.array([1.0, 1.0, -1.0]), (1.0, 1.0, -1.0), (1, 0, 2), "east, north, up"),
    (NED * np.array([1.0, -1.0, -1.0]), (1.0, -1.0, -1.0), (), "those of the attitude, with z up"),
]


@pytest.mark.parametrize(("velocity", "factors", "order", "words"), AXES)
def test_a_velocity_in_earth_axes_is_found_by_the_accelerometer_and_turned_by_the_attitude(
    velocity, factors, order, words
):
    wrong = replace(dive(), velocity=Signal(READ["t"], velocity))
    made = mends(wrong)
    right = wrong
    for mend in made:
        right = mended(right, mend)
    assert {mend.signal for mend in made} == {"velocity"}
    assert right.velocity.value == pytest.approx(READ["velocity"], abs=1e-6)
    (turning,) = [mend for mend in made if mend.frame]
    assert "in earth axes" in turning.problem
    assert "add `frame: NED` to `velocity`" in turning.remedy
    if len(made) == 1:
        assert (turning.factors, turning.order) == (factors, order)
        assert turning.problem.endswith(words)


def test_a_gyro_in_degrees_with_a_turned_sign_is_mended_in_both():
    (mend,) = mends(changed("gyro", (57.29577951, 57.29577951, -57.29577951)))
    assert mend.factors == pytest.approx((0.01745329, 0.01745329, -0.01745329))


def test_depth_in_centimetres_is_found_by_heave_where_pressure_is_not_recorded():
    (mend,) = mends(without(changed("depth", (100.0,)), "pressure"))
    assert (mend.signal, mend.factors) == ("depth", pytest.approx((0.01,)))


@pytest.mark.parametrize("factor", [100.0, 1 / 0.3048])
def test_where_the_velocity_is_too_large_for_the_depth_its_own_unit_is_mended_as_no_depth_has_one_that_long(
    factor,
):
    (mend,) = mends(without(changed("velocity", (factor,) * 3), "pressure", "specific_force"))
    assert (mend.signal, mend.factors) == ("velocity", pytest.approx((1 / factor,) * 3))


def test_an_accelerometer_alone_turns_all_that_nothing_contradicts_to_its_frame():
    flu = (1.0, -1.0, -1.0)
    wrong = without(changed("specific_force", flu), "depth", "pressure", "attitude")
    assert {mend.signal for mend in mends(wrong)} == {"velocity", "gyro", "specific_force"}
    assert all(mend.factors == flu for mend in mends(wrong))


def test_an_accelerometer_of_the_other_sign_turns_no_gyro_where_depth_says_that_the_velocity_is_right():
    level = dive(readings(size=0.01))
    (mend,) = mends(mended(level, Mend("specific_force", (1.0, -1.0, -1.0), "", "")))
    assert mend.signal == "specific_force"


def test_a_sway_of_the_other_sign_is_a_frame_where_nothing_tells_of_heave():
    (mend,) = mends(without(changed("velocity", (1.0, -1.0, -1.0)), "depth", "pressure"))
    assert (mend.signal, mend.factors) == ("velocity", (1.0, -1.0, -1.0))


@pytest.mark.parametrize(
    ("factors", "mended_by"),
    [((1, -1, -1, 1, -1, -1), ((1.0, -1.0, -1.0) * 2,)), ((1,) * 6, ()), ((-1, -1, 1, 1, 1, 1), ())],
)
def test_a_wrench_in_axes_forward_left_up_is_turned_where_the_motion_goes_against_it(factors, mended_by):
    moved = dive()
    assert moved.velocity is not None
    assert moved.gyro is not None
    nu = np.column_stack([moved.velocity.value, moved.gyro.value])
    force = 20.0 * np.gradient(nu, READ["t"], axis=0) + 8.0 * nu
    pushed = replace(moved, tau_cmd=Signal(READ["t"], force * factors))
    assert tuple(mend.factors for mend in mends(pushed)) == mended_by


def test_a_velocity_that_hardly_changes_beside_the_accelerometer_is_not_turned_round():
    """As that of an autopilot whose estimate goes on beside a vehicle that is carried about."""
    still = without(changed("velocity", (1.0, -0.05, 1.0)), "depth", "pressure")
    assert [mend for mend in mends(still) if mend.signal == "velocity"] == []
    turned = without(changed("velocity", (1.0, -1.0, 1.0)), "depth", "pressure")
    assert [mend.signal for mend in mends(turned) if mend.signal == "velocity"] == ["velocity"]


def test_a_sentence_names_the_evidence_and_the_edit_of_the_map():
    (mend,) = mends(changed("gyro", (1.0, -1.0, 1.0)))
    assert "y: correlation -1.00" in mend.sentence
    assert mend.sentence.endswith("multiply `scale` of `gyro` by [1, -1, 1].")
    (swapped,) = mends(changed("gyro", (1.0, 1.0, 1.0), (1, 0, 2)))
    assert swapped.sentence.endswith("give the columns of `gyro` in the order 2, 1, 3.")


def test_noise_without_motion_contradicts_nothing():
    noise = np.random.default_rng(1)
    count = len(READ["t"])
    still = Dive(
        "log",
        Path("log"),
        "",
        velocity=Signal(READ["t"], noise.normal(0.0, 0.01, (count, 3))),
        gyro=Signal(READ["t"], noise.normal(0.0, 0.002, (count, 3))),
        specific_force=Signal(READ["t"], noise.normal((0.0, 0.0, -9.81), 0.05, (count, 3))),
        attitude=Signal(READ["t"], np.tile((1.0, 0.0, 0.0, 0.0), (count, 1))),
        depth=Signal(READ["t"], noise.normal(2.0, 0.005, (count, 1))),
    )
    assert mends(still) == ()
    assert agreeing(still) == set()


def test_a_short_recording_is_left_alone():
    assert mends(changed("gyro", (1.0, -1.0, 1.0)).between(0.0, 5.0)) == ()


def test_a_quaternion_whose_real_part_was_taken_from_its_first_column_and_stands_last_is_told_by_the_gyro():
    right = dive()
    wrong = replace(right, attitude=Signal(right.attitude.time_s, np.roll(right.attitude.value, -1, axis=1)))
    (mend,) = mends(wrong)
    assert mend.sentence == (
        "The gyro contradicts how the attitude turns, and agrees with it if the quaternion's real part is the last of "
        "its columns; begin `columns` of `quaternion` with its last column."
    )
    value = mended(wrong, mend).attitude.value
    assert np.abs(np.sum(value * right.attitude.value, axis=1)) == pytest.approx(1.0, abs=1e-9)
