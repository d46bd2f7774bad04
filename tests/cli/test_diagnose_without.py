"""`seatrial diagnose --without EFFECT`: a library that lacks it."""

import pytest

from bridge.errors import ConfigError
from bridge.vehicle.config import load_vehicle
from identify.effects.library import library
from identify.run.diagnose import effects_without

FILE = load_vehicle("ruvifist:survey")


def test_what_is_left_out_is_not_tried_and_all_else_is() -> None:
    whole = library(FILE.vehicle.configurations["survey"], FILE.vehicle.thrust_curve.lag_s)
    left = effects_without(["weak_thruster", "tether"], "survey", FILE)
    assert {effect.name for effect in whole} - {effect.name for effect in left} == {"weak_thruster", "tether"}


def test_an_effect_that_does_not_exist_is_refused_with_those_that_do() -> None:
    with pytest.raises(
        ConfigError, match=r"there is no effect 'kraken' to leave out; there are .*battery_sag"
    ):
        effects_without(["kraken"], "survey", FILE)
