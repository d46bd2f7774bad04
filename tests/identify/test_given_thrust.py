"""What a thruster gave in a dive, told from how the vehicle moved."""

from dataclasses import replace

import numpy as np
import pytest
from test_forecast import FED, FILE, dived, weak

from bridge.vehicle.mode import Mode
from identify.dive import Signal
from identify.thrust.given_thrust import given_thrust, pushes


@pytest.mark.parametrize(("gain", "mode"), [(0.6, Mode.SHADOW), (0.8, Mode.BOTH), (1.0, Mode.SHADOW)])
def test_it_is_told_to_a_few_per_cent_in_every_mode(gain, mode):
    gave = given_thrust(dived(weak(gain), FED, mode, seed=9), FILE, "hovering", [1, 2])
    assert gave[1].gain == pytest.approx(gain, rel=0.05)
    assert gave[2].gain == pytest.approx(1.0, rel=0.05)
    assert all(given.half95 <= 0.1 * given.gain for given in gave.values())


def test_it_is_not_told_by_a_dive_that_lacks_what_it_takes_nor_of_a_thruster_that_pushes_no_such_axis():
    dive = dived(weak(0.8), FED, Mode.SHADOW, seed=9)
    shape = FILE.vehicle.configurations["hovering"]
    vertical = [number for number in range(1, len(shape.thrusters) + 1) if not pushes(shape, number)]
    assert vertical
    assert not pushes(shape, len(shape.thrusters) + 1)
    assert given_thrust(dive, FILE, "hovering", vertical) == {}
    for signal in ("nu_ref", "tau_ff", "pwm", "velocity"):
        assert given_thrust(replace(dive, **{signal: None}), FILE, "hovering", [1]) == {}


def test_a_reference_that_rests_tells_nothing_however_the_sea_moves_the_vehicle():
    dive = dived(weak(0.8), FED, Mode.SHADOW, seed=9)
    at_rest = replace(
        dive,
        nu_ref=Signal(dive.nu_ref.time_s, np.zeros_like(dive.nu_ref.value)),
        tau_ff=Signal(dive.tau_ff.time_s, np.zeros_like(dive.tau_ff.value)),
    )
    assert given_thrust(at_rest, FILE, "hovering", [1]) == {}
