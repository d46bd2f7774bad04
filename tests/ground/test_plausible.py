"""A value that its interval, the rigid body or what was accepted last speaks against is refused with the reason."""

import pytest

from bridge.errors import ParamRejected
from gcs_plugin.params.files import Interval
from gcs_plugin.params.last_accepted import AcceptedValue
from gcs_plugin.params.plan import Verdict, make_plan
from gcs_plugin.params.plausible import implausible

PRESENT = {"FF1_M_U": 90.0, "FF1_D_U": 40.0, "FF1_D_R": 3.0, "FF1_I_R": 8.0, "FF1_X_UU": 0.0, "FF_MODE": 0.0}
DRY = {"FF1_M_U": (72.0, 1.0)}


def reason(name, value, half=None, last=None, last_half=None, rigid=DRY, present=PRESENT):
    """Why that value is not believed; `half` and `last_half` are halves of 95 % intervals."""
    around = lambda centre, width: Interval(name, "", centre - width, centre + width)  # noqa: E731
    intervals = {} if half is None else {name: around(value, half)}
    accepted = {}
    if last is not None:
        accepted = {name: AcceptedValue(last, None if last_half is None else around(last, last_half), "2026")}
    return implausible(make_plan({name: value}, present), intervals, accepted, rigid).get(name, "")


@pytest.mark.parametrize(
    ("name", "value", "half"), [("FF1_M_U", 100.0, 5.0), ("FF1_D_U", 42.0, 60.0), ("FF1_X_UU", 12.0, 90.0)]
)
def test_a_value_that_its_dive_told_and_an_effect_of_any_size_are_believed(name, value, half):
    assert reason(name, value, half) == ""


def test_a_value_with_a_deviation_as_large_as_itself_is_not_believed():
    assert reason("FF1_M_U", 100.0, 195.0) == ""
    assert reason("FF1_M_U", 100.0, 196.0) == (
        "its standard deviation, 100, is as large as the value: the dive did not tell it"
    )
    assert "as large as the value" in reason("FF1_D_U", 4.0, 1.96 * 10.0)


def test_a_damping_that_is_known_to_be_small_is_believed():
    assert reason("FF1_D_U", 4.0, 1.96 * 8.9) == ""
    assert reason("FF1_D_R", 0.1, 1.96 * 0.7) == ""
    assert "as large as the value" in reason("FF1_D_R", 0.1, 1.96 * 0.9)


def test_a_value_that_its_interval_does_not_belong_to_is_not_believed():
    plan = make_plan({"FF1_M_U": 130.5}, PRESENT)
    interval = {"FF1_M_U": Interval("M_u", "kg", 90.0, 110.0)}
    assert implausible(plan, interval, {}, {}) == {
        "FF1_M_U": "130.5 is far outside its own 95 % interval, 90 to 110"
    }
    assert implausible(make_plan({"FF1_M_U": 119.5}, PRESENT), interval, {}, {}) == {}


def test_a_total_mass_below_the_rigid_body_is_not_believed():
    assert reason("FF1_M_U", 66.0, 3.0) == ("66 is below the rigid body's own 72, which no water takes away")
    assert reason("FF1_M_U", 66.0) != ""
    assert reason("FF1_M_U", 66.0, 5.0) == ""
    assert reason("FF1_M_U", 66.0, 3.0, rigid={}) == ""


def test_a_change_far_beyond_both_intervals_is_not_believed():
    assert reason("FF1_M_U", 145.0, 5.0, 100.0, 5.0) == (
        "100 was accepted last, and both 95 % intervals together allow a change of 10"
    )
    assert reason("FF1_M_U", 125.0, 5.0, 100.0, 5.0) == ""
    assert reason("FF1_M_U", 125.0, 1.0, 100.0, 1.0) == "", "25 % is no more than payload and water do"
    assert reason("FF1_D_U", 80.0, 10.0, 40.0, 5.0) == ""


def test_without_intervals_only_a_change_by_a_factor_is_not_believed():
    assert reason("FF1_D_U", 119.0, last=40.0) == ""
    assert reason("FF1_D_U", 121.0, last=40.0) == "40 was accepted last: this is 3 times as much"
    assert reason("FF1_D_U", 13.0, 2.0, 40.0) == "40 was accepted last: this is 0.33 times as much"
    assert reason("FF1_X_UU", 90.0, last=12.0) == ""


def test_what_is_taken_back_and_what_is_so_already_needs_no_belief():
    assert reason("FF1_X_UU", 0.0, last=12.0) == ""
    assert reason("FF1_D_W", 0.0, 50.0, 40.0, 1.0, present={"FF1_D_W": 40.0}) == ""
    assert reason("FF1_M_U", 90.0, 400.0) == ""
    assert reason("FF_MODE", 1.0, last=3.0) == ""


def test_a_coefficient_of_zero_is_believed_no_more_than_any_other_number():
    interval = {"FF1_D_U": Interval("D_u", "N/(m/s)", 55.59, 57.28)}
    present = {"FF1_D_U": 56.43}
    assert implausible(make_plan({"FF1_D_U": 0.0}, present), interval, {}, {}) == {
        "FF1_D_U": "0 is far outside its own 95 % interval, 55.59 to 57.28"
    }
    assert reason("FF1_D_U", 0.0, last=56.43) == "56.43 was accepted last: this is 0 times as much"
    assert reason("FF1_I_R", -0.0, last=8.5) == "8.5 was accepted last: this is 0 times as much"
    assert reason("FF1_M_U", 0.0) == "0 is below the rigid body's own 72, which no water takes away"
    assert "both 95 % intervals together" in reason("FF1_D_U", 0.0, 1.0, 56.43, 1.0)
    heave = {"FF1_M_W": 90.0, "FF1_D_W": 40.0}
    unfed = (reason("FF1_D_W", 0.0, present=heave), reason("FF1_D_W", 0.0, 1.0, present=heave))
    assert unfed == ("", ""), "nothing speaks against it"


AXES = [("surge", "FF1_M_U", "FF1_D_U"), ("sway", "FF1_M_V", "FF1_D_V"), ("yaw", "FF1_I_R", "FF1_D_R")]


@pytest.mark.parametrize(("axis", "mass", "damping"), AXES)
def test_half_a_model_of_an_axis_is_no_value_to_write_whichever_half_it_is(axis, mass, damping):
    off = f"the feed-forward of {axis} stays off"
    empty, both = {mass: 0.0, damping: 0.0}, {mass: 90.0, damping: 40.0}
    judged = lambda targets, present: implausible(make_plan(targets, present), {}, {}, {})  # noqa: E731
    assert judged({mass: 90.0}, empty) == {mass: f"without {damping} {off}"}
    assert judged({damping: 40.0}, empty) == {damping: f"without {mass} {off}"}
    assert judged({damping: 0.0}, both) == {damping: f"0 is not set: {off}"}
    assert judged({mass: 0.0}, both) == {mass: f"0 is not set: {off}"}
    assert judged({mass: 95.0}, {mass: 90.0, damping: 0.0}) == {mass: f"without {damping} {off}"}


def test_a_mass_beside_quadratic_damping_alone_is_a_whole_model():
    judged = lambda targets, present: implausible(make_plan(targets, present), {}, {}, {})  # noqa: E731
    empty = {"FF0_M_U": 0.0, "FF0_D_U": 40.0, "FF0_X_UU": 0.0}
    assert judged({"FF0_M_U": 90.0, "FF0_D_U": 0.0, "FF0_X_UU": 60.0}, empty) == {}
    off = "without FF0_D_U the feed-forward of surge stays off"
    assert judged({"FF0_M_U": 90.0}, empty | {"FF0_D_U": 0.0}) == {"FF0_M_U": off}


@pytest.mark.parametrize(("axis", "mass", "damping"), AXES)
def test_what_the_vehicle_holds_already_makes_a_model_whole(axis, mass, damping):
    del axis
    judged = lambda targets, present: implausible(make_plan(targets, present), {}, {}, {})  # noqa: E731
    assert judged({mass: 90.0}, {mass: 0.0, damping: 40.0}) == {}
    assert judged({damping: 40.0}, {mass: 90.0, damping: 0.0}) == {}
    assert judged({mass: 90.0, damping: 40.0}, {mass: 0.0, damping: 0.0}) == {}
    assert judged({mass: 0.0, damping: 0.0}, {mass: 90.0, damping: 40.0}) == {}, "no model of an axis at all"
    assert judged({"FF1_M_W": 90.0}, {"FF1_M_W": 0.0, "FF1_D_W": 0.0}) == {}, "nothing is fed forward there"


def test_a_damping_by_which_the_vehicle_would_coast_for_hours_is_no_value_to_write():
    judged = lambda targets: implausible(make_plan(targets, PRESENT), {}, {}, {})  # noqa: E731
    assert judged({"FF1_D_U": 0.0089}) == {
        "FF1_D_U": "0.0089 is next to no damping beside FF1_M_U 90: half of a model"
    }
    assert judged({"FF1_M_U": 80.0, "FF1_D_U": 0.0081}) == {}, "of the mass that comes with it"
    assert judged({"FF1_D_R": 0.0007}) == {
        "FF1_D_R": "0.0007 is next to no damping beside FF1_I_R 8: half of a model"
    }
    assert judged({"FF1_D_U": 0.0091, "FF1_D_R": 0.0009}) == {}


WORDS = {0.0: "off", 1.0: "shadow", 2.0: "only", 3.0: "both"}
RAISED = [(now, then) for now in (0.0, 1.0) for then in (2.0, 3.0)] + [(3.0, 2.0)]


@pytest.mark.parametrize("now", WORDS)
@pytest.mark.parametrize("then", WORDS)
def test_a_mode_that_leaves_more_to_the_feed_forward_is_not_raised_by_a_file_by_the_way(now, then):
    words = (
        f"raises the feed-forward from {WORDS[now]} to {WORDS[then]}, which no file does by the way: "
        f"seatrial ff {WORDS[then]}"
    )
    assert reason("FF_MODE", then, present={"FF_MODE": now}) == (words if (now, then) in RAISED else "")


def test_one_implausible_line_stops_all_until_it_is_left_out_or_taken_by_name():
    plan = make_plan({"FF1_M_U": 60.0, "FF1_D_U": 42.0}, PRESENT)
    judged = plan.judged({"FF1_M_U": "too light"})
    assert judged.changes == {"FF1_D_U": 42.0}
    with pytest.raises(
        ParamRejected, match=r"FF1_M_U: too light; nothing was sent.*--accept-implausible FF1_M_U"
    ):
        judged.check()
    judged.chosen(("FF1_D_U",)).check()
    assert judged.with_implausible().changes == plan.changes
    assert judged.count(Verdict.IMPLAUSIBLE) == 1
