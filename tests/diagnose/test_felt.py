"""A cause that shafts tell of loudly is none where the motion says nothing of it; intervals keep to what can be."""

from dataclasses import replace

import numpy as np
import pytest

from bridge.vehicle.thrusters import shaft_speed
from identify.challenge.case import dive_of, draw_case
from identify.diagnose.candidates import Cause
from identify.diagnose.findings import parameters_of
from identify.diagnose.nominal import nominal_of
from identify.diagnose.search import LEAST_GAIN, LEAST_MOTION_NATS, explain
from identify.diagnose.weighing import weighing_of
from identify.dive import Signal
from identify.effects.actuators import SATURATION, thruster_lag
from identify.effects.shaft import thrust_by_shaft
from identify.identification import Z95

MOST_TOLD = 0.9
LIBRARY = (SATURATION,)


@pytest.fixture(scope="module")
def told():
    """The nominal fit of a vehicle that hides nothing, whose speed controllers tell no fast turning; and the thrust of
    what they tell at most, N."""
    case = draw_case(300_904, names=[], seconds=100.0, rpm=True)
    dive, curve = dive_of(case), case.file.vehicle.thrust_curve
    thrust_n = thrust_by_shaft(curve, dive.rpm.value)
    most_n = MOST_TOLD * np.abs(thrust_n).max()
    speeds = 60.0 * shaft_speed(curve, np.clip(thrust_n, -most_n, most_n))
    deaf = replace(dive, rpm=Signal(dive.rpm.time_s, speeds))
    return nominal_of(deaf, case.file, case.configuration), most_n


def test_controllers_that_tell_no_fast_turning_limit_no_thrust(told):
    nominal, most_n = told
    alone = weighing_of(nominal, LIBRARY).fitted([Cause(SATURATION, np.array([most_n]))])
    assert alone.gain > 10 * LEAST_GAIN
    assert alone.motion_nats < LEAST_MOTION_NATS
    assert explain(nominal, LIBRARY, lambda *_report: None).causes == ()


def test_an_interval_ends_where_a_parameter_does(told):
    nominal, most_n = told
    lag = thruster_lag(nominal.course.lag_s)
    fit = weighing_of(nominal, LIBRARY).fitted([Cause(SATURATION, np.array([most_n]))])
    wide = replace(fit, causes=(Cause(lag, np.array([0.08])),), covariance=np.array([[1.0]]))
    told = parameters_of(wide, 0)["time_constant"]
    assert (told.value, told.low95, told.high95) == (0.08, 0.0, pytest.approx(0.08 + Z95))
    close = replace(wide, causes=(Cause(lag, np.array([4.9])),))
    assert parameters_of(close, 0)["time_constant"].high95 == 5.0
