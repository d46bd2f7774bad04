"""Shafts, heading and accelerometer tell of what they see, beside what they would read if nothing were hidden."""

import numpy as np
import pytest

from bridge.effects.actuators import DEAD_ZONE_SHIFTED
from bridge.effects.rigid_body import THRUST_BIAS
from bridge.effects.sensors import GYRO_BIAS, IMU_GRAVITY_LEAK
from identify.challenge.case import dive_of, draw_case
from identify.diagnose.nominal import nominal_of
from identify.diagnose.witness import WINDOW_S, weighed


def nominal_with(names, seed=300_901):
    case = draw_case(seed, names=names, size=0.8, seconds=120.0, rpm=True)
    configuration = next(iter(case.file.vehicle.configurations))
    return case, nominal_of(dive_of(case), case.file, configuration)


@pytest.fixture(scope="module")
def honest():
    return nominal_with([])[1]


def of_kind(nominal, kind):
    return [one for one in nominal.witnesses if one.kind == kind]


def test_where_nothing_hides_each_witness_reads_noise(honest):
    kinds = {one.kind for one in honest.witnesses}
    assert kinds == {"shaft", "heading", "specific_force"}
    for one in honest.witnesses:
        rows = weighed(one, [], honest.course).whitened(one.off[:, None])[:, 0]
        assert abs(rows.mean()) < 5 / np.sqrt(len(rows))
        assert 0.5 < rows.std() < 1.5


def test_shafts_that_stand_still_at_small_pulses_are_seen_thruster_by_thruster():
    case, nominal = nominal_with(["dead_zone"])
    half_width = case.truth()["effects"][0]["parameters"]["half_width"]
    act = DEAD_ZONE_SHIFTED.act(nominal.course, np.array([half_width]))
    for one in of_kind(nominal, "shaft"):
        seen = one.of(act, nominal.course)
        assert np.linalg.norm(one.off - seen) < 0.5 * np.linalg.norm(one.off)


def test_a_gyro_that_turns_at_rest_turns_on_beyond_the_heading():
    case, nominal = nominal_with(["gyro_bias"])
    bias = case.truth()["effects"][0]["parameters"]["z"]
    (heading,) = of_kind(nominal, "heading")
    assert heading.off.mean() == pytest.approx(-WINDOW_S * bias, rel=0.1)
    seen = heading.of(GYRO_BIAS.act(nominal.course, np.array([bias])), nominal.course)
    np.testing.assert_allclose(seen, -WINDOW_S * bias)


def test_an_accelerometer_that_is_tilted_reads_gravity():
    case, nominal = nominal_with(["imu_gravity_leak"])
    told = case.truth()["effects"][0]["parameters"]
    act = IMU_GRAVITY_LEAK.act(nominal.course, np.array([told["roll"], told["pitch"]]))
    for one in of_kind(nominal, "specific_force"):
        assert one.off.mean() == pytest.approx(one.of(act, nominal.course).mean(), abs=0.01)


def test_a_push_on_the_hull_is_seen_by_none_of_them(honest):
    act = THRUST_BIAS.act(honest.course, np.array([1.0, 0.0, 0.0, 0.0]))
    assert all(one.of(act, honest.course) is None for one in honest.witnesses)
