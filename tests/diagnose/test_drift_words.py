"""How far a model drifts, in words, by degree of freedom: made by hand, and read to the letter."""

import math

import numpy as np
import pytest

from identify.diagnose.gap.drift import Drift
from identify.diagnose.result import AxisShrink, Gap
from identify.diagnose.words.drift import changes, level, of_dive

NAN = math.nan


def axis(dof, before, after, floor=0.01, value=0.5):
    return AxisShrink(dof, before, after, floor, value, NAN, NAN, NAN)


SURGE, SWAY, HEAVE, YAW = (
    axis("surge", 0.03, 0.01), axis("sway", 0.05, 0.02), axis("heave", 0.02, 0.015), axis("yaw", 0.02, 0.0179),
)  # fmt: skip
OF_SURGE, OF_SWAY, OF_YAW = (
    "from 30 mm/s to 10 mm/s in surge",
    "from 50 mm/s to 20 mm/s in sway",
    "from 1.1 deg/s to 1.0 deg/s in yaw",
)


@pytest.mark.parametrize(
    ("axes", "said"),
    [
        ((SURGE,), f"falls {OF_SURGE}"),
        # A translation and a rotation, if the lesser changes by a tenth of the greater, in floors; else two of a kind.
        ((SURGE, YAW), f"falls {OF_SURGE} and {OF_YAW}"),
        ((YAW, HEAVE, SURGE), f"falls {OF_SURGE} and {OF_YAW}"),
        ((SURGE, axis("yaw", 0.02, 0.0181)), f"falls {OF_SURGE}"),
        ((HEAVE, SURGE, SWAY), f"falls {OF_SWAY} and {OF_SURGE}"),
        ((HEAVE, SURGE, SWAY, axis("yaw", 0.02, 0.0181)), f"falls {OF_SWAY} and {OF_SURGE}"),
        # The one that changes by more floors first.
        ((SURGE, axis("yaw", 0.02, 0.0179, 0.001)), f"falls {OF_YAW} and {OF_SURGE}"),
        ((SURGE, axis("yaw", 0.02, 0.03)), f"goes {OF_SURGE} and from 1.1 deg/s to 1.7 deg/s in yaw"),
        # Where there is no gap, or nothing changes, nothing is told.
        ((axis("surge", 0.03, 0.01, value=NAN), YAW), f"falls {OF_YAW}"),
        ((axis("surge", 0.03, 0.03),), ""),
        ((), ""),
    ],
)  # fmt: skip
def test_a_drift_changes_in_the_translation_and_the_rotation_that_change_most(axes, said):
    assert changes(axes) == said


def test_a_drift_is_told_in_the_two_degrees_of_freedom_that_drift_most_beside_their_noise():
    axes = (SURGE, axis("sway", 0.02, 0.045, 0.02), axis("yaw", 0.05, 0.01))
    assert level(axes) == (
        "2.9 deg/s in yaw (noise alone 0.57 deg/s) and 30 mm/s in surge (noise alone 10 mm/s)"
    )
    assert level(axes, before=False) == (
        "45 mm/s in sway (noise alone 20 mm/s) and 10 mm/s in surge (noise alone 10 mm/s)"
    )
    assert level(()) == "unknown"


def test_the_drift_of_a_whole_dive_is_that_of_five_seconds_in_what_is_fitted():
    floor = np.array([0.01, NAN, NAN, NAN, NAN, 0.02])

    def drifts(surge, yaw):
        off = np.tile([surge, 0.0, 0.0, 0.0, 0.0, yaw], (4, 1))
        return tuple(
            Drift(horizon_s, np.arange(4.0), share * off, floor)
            for horizon_s, share in ((1.0, 0.1), (5.0, 1.0), (20.0, 3.0))
        )

    before, after = drifts(0.05, 0.03), drifts(0.02, 0.03)
    surge, yaw = of_dive(Gap(2.0, before, after, {}, (), (), ()))
    assert (surge.dof, yaw.dof) == ("surge", "yaw")
    assert (surge.before, surge.after, surge.floor, surge.value) == pytest.approx((0.05, 0.02, 0.01, 0.75))
    assert (yaw.before, yaw.after, yaw.floor, yaw.value) == pytest.approx((0.03, 0.03, 0.02, 0.0))
    unsimulated, _ = of_dive(Gap(2.0, before, (), {}, (), (), ()))
    assert (unsimulated.before, unsimulated.after) == pytest.approx((0.05, 0.05))
    assert of_dive(Gap(2.0, before[:1], after, {}, (), (), ())) == ()
