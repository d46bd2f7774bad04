"""Going back is no order to act: a roll back never leaves more to the feed-forward."""

import pytest

from bridge.vehicle.feedforward import Mode
from gcs_plugin.params.plan import not_raised

GOES_BACK = {
    (Mode.SHADOW, Mode.OFF), (Mode.BOTH, Mode.OFF), (Mode.BOTH, Mode.SHADOW), (Mode.ALONE, Mode.OFF),
    (Mode.ALONE, Mode.SHADOW), (Mode.ALONE, Mode.BOTH),
}  # fmt: skip


@pytest.mark.parametrize("before", Mode)
@pytest.mark.parametrize("present", Mode)
def test_a_mode_comes_back_only_where_it_leaves_no_more_to_the_feed_forward(before, present):
    targets = {"FF_MODE": float(before), "FF0_M_U": 24.0}
    kept = not_raised(targets, {"FF_MODE": float(present)})
    assert ("FF_MODE" in kept) == (before is present or (present, before) in GOES_BACK)
    assert kept["FF0_M_U"] == 24.0


def test_a_mode_that_nobody_knows_does_not_come_back():
    assert not_raised({"FF_MODE": 9.0}, {"FF_MODE": 3.0}) == {}
    assert not_raised({"FF_MODE": 0.0}, {}) == {"FF_MODE": 0.0}
