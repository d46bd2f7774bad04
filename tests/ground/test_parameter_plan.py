"""The plan of an upload: targets, sidecar, and values that are refused as implausible."""

import dataclasses
import json

import pytest

from bridge.errors import ConfigError, ParamRejected, ParamUnknown
from bridge.schema import build
from bridge.vehicle.parameters import set_crc
from gcs_plugin.params import float32
from gcs_plugin.params.comparison import Comparison, compared
from gcs_plugin.params.files import write_parameters
from gcs_plugin.params.identified import parameters_from_identification, sidecar_of
from gcs_plugin.params.last_accepted import AcceptedValue
from gcs_plugin.params.meaning import is_staged
from gcs_plugin.params.plan import Verdict, action_of, make_plan, taken_back
from gcs_plugin.params.plausible import implausible
from gcs_plugin.params.proposal import propose_rollback, propose_upload
from gcs_plugin.params.receipt import Line, begin
from gcs_plugin.params.sidecar import Interval, Sidecar, read_sidecar, sidecar_path, write_sidecar
from gcs_plugin.params.transfer import Outcome
from gcs_plugin.params.wanted import Wanted, wanted_by

PRESENT = {"FF0_M_U": float32.rounded(24.4), "FF0_D_U": 40.0, "FF_ACTIVE": 7.0, "FF_MODE": 1.0}


def verdicts(targets):
    return {row.name: row.verdict for row in make_plan(targets, PRESENT).rows}


def test_every_line_gets_its_verdict():
    assert verdicts(
        {"FF0_M_U": 24.4, "FF0_D_U": 42.13, "FF3_M_U": 30.0, "FF_ACTIVE": 9.0, "FF_MODE": 4.0}
    ) == {
        "FF0_M_U": Verdict.SAME,
        "FF0_D_U": Verdict.CHANGED,
        "FF3_M_U": Verdict.UNKNOWN,
        "FF_ACTIVE": Verdict.READ_ONLY,
        "FF_MODE": Verdict.REFUSED,
    }


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1e39, 1e6, 0.05, -24.4])
def test_a_mass_that_no_vehicle_has_is_refused(value):
    assert verdicts({"FF0_M_U": value}) == {"FF0_M_U": Verdict.REFUSED}


def test_a_mass_of_zero_means_not_set_and_may_be_restored():
    assert verdicts({"FF0_M_U": 0.0}) == {"FF0_M_U": Verdict.CHANGED}


@pytest.mark.parametrize("mode", [0.5, -1.0, 4.0])
def test_a_mode_that_does_not_exist_is_refused(mode):
    assert verdicts({"FF_MODE": mode}) == {"FF_MODE": Verdict.REFUSED}


def test_a_negative_zero_is_sent_as_zero():
    assert str(make_plan({"FF0_D_U": -0.0}, PRESENT).changes["FF0_D_U"]) == "0.0"


def test_one_refused_or_unknown_line_stops_the_whole_plan():
    with pytest.raises(ParamRejected, match="FF0_M_U: nan is not a finite number"):
        make_plan({"FF0_D_U": 42.0, "FF0_M_U": float("nan")}, PRESENT).check()
    with pytest.raises(ParamUnknown, match="no FF3_M_U"):
        make_plan({"FF0_D_U": 42.0, "FF3_M_U": 30.0}, PRESENT).check()


def test_an_autopilot_that_has_no_feed_forward_at_all_is_told_what_brings_one_and_what_works():
    with pytest.raises(
        ParamUnknown, match="PX4 is not supported: recordings of any vehicle can be identified"
    ):
        make_plan({"FF0_D_U": 42.0, "FF0_M_U": 30.0}, {"MPC_XY_P": 1.0}).check()


def held(active, **values):
    return {**values, "FF_COMMIT": active, "FF_ACTIVE": active}


HOLDS = {"FF0_M_U": 24.5, "FF0_D_U": 40.0, "FF0_X_UU": 0.0}


def test_what_is_held_and_not_in_force_is_staged_and_not_the_same():
    plan = make_plan(HOLDS, held(0.0, **HOLDS))
    assert plan.staged == {"FF0_M_U": 24.5, "FF0_D_U": 40.0}  # without a set 0 is as good as in force
    assert make_plan(HOLDS, held(4711.0, **HOLDS)).staged == HOLDS
    assert make_plan(HOLDS, held(float(set_crc(HOLDS)), **HOLDS)).staged == {}
    assert make_plan(HOLDS, HOLDS).staged == {}  # a vehicle that takes no sets flies what it holds


def test_beside_a_set_in_force_a_line_that_changes_makes_no_other_a_staged_one():
    present = held(float(set_crc(HOLDS)), **HOLDS)
    assert make_plan({**HOLDS, "FF0_D_U": 44.0}, present).summary() == "3 parameters: 1 changed, 2 same"


def test_lines_that_make_the_held_set_the_one_in_force_again_leave_the_others_the_same():
    present = held(float(set_crc(HOLDS)), **{**HOLDS, "FF0_D_U": 44.0})
    assert make_plan(HOLDS, present).summary() == "3 parameters: 1 changed, 2 same"


@pytest.mark.parametrize(
    ("present", "words"),
    [
        (held(0.0, **HOLDS), "put 2 parameters in force"),
        (held(4711.0, **{**HOLDS, "FF0_D_U": 44.0}), "write 1 parameter and put the 2 staged in force"),
        (held(float(set_crc(HOLDS)), **HOLDS), "write 1 parameter"),
        (held(0.0, FF0_M_U=0.0, FF0_D_U=0.0, FF0_X_UU=0.0), "write 2 parameters"),
    ],
)
def test_what_an_upload_is_about_to_do_is_said_as_it_is(present, words):
    wanted = {**HOLDS, "FF0_D_U": 41.0} if words == "write 1 parameter" else HOLDS
    assert action_of(make_plan(wanted, present)) == words


def estimate(name, value, identifiable=True):
    return {
        "name": name,
        "unit": "kg",
        "value": value,
        "identifiable": identifiable,
        "low95": 0.5,
        "given_thrust_low95": 1.0,
        "high95": 4.0,
        "given_thrust_high95": 2.0,
    }


def test_only_identifiable_coefficients_become_parameters():
    data = {
        "parameters": [
            estimate("M_u", 24.4),
            estimate("X_udot", 3.0),
            estimate("I_r", None, identifiable=False),
            estimate("D_q", 5.0),
        ]
    }
    assert parameters_from_identification(data, 1) == {"FF1_M_U": float32.rounded(24.4), "FF1_D_Q": 5.0}


def test_a_linear_damping_without_a_value_is_sent_as_none_beside_its_quadratic_one():
    data = {
        "parameters": [
            estimate("X_uu", 12.5),
            estimate("D_u", None, identifiable=False),
            estimate("Y_vv", 9.0),
            estimate("D_v", 3.0, identifiable=False),
        ]
    }
    assert parameters_from_identification(data, 0) == {"FF0_X_UU": 12.5, "FF0_Y_VV": 9.0, "FF0_D_U": 0.0}


@pytest.mark.parametrize("value", [None, float("nan"), -1.0, 1e7, "24", True])
def test_an_identification_unfit_to_send_is_refused_whole(value):
    with pytest.raises(ParamRejected, match="M_u"):
        parameters_from_identification({"parameters": [estimate("D_u", 40.0), estimate("M_u", value)]}, 0)


@pytest.mark.parametrize(
    "data", [{}, {"parameters": []}, {"parameters": ["x"]}, {"parameters": [estimate("X_udot", 3)]}]
)
def test_an_identification_without_coefficients_is_refused(data):
    with pytest.raises(ParamRejected):
        parameters_from_identification(data, 0)


def test_a_sidecar_says_where_the_values_came_from(tmp_path):
    path = tmp_path / "hovering.param"
    data = {
        "vehicle": {"name": "ruvifist", "sha256": "v"},
        "configuration": "hovering",
        "outcome": "converged",
        "parameters": [estimate("M_u", 24.4), estimate("I_r", None, identifiable=False)],
    }
    sidecar = sidecar_of(data, 0)
    assert sidecar.intervals == {"FF0_M_U": Interval("M_u", "kg", 1.0, 2.0)}
    by_weight = sidecar_of({**data, "thrust_scale": {"shift": 0.1, "weighed": True}}, 0)
    assert by_weight.intervals == {"FF0_M_U": Interval("M_u", "kg", 0.5, 4.0)}
    assert read_sidecar(path) is None
    assert write_sidecar(path, sidecar) == sidecar_path(path)
    assert read_sidecar(path) == sidecar
    sidecar_path(path).write_text('{"dive_sha256": 1}')
    with pytest.raises(ParamRejected, match="not a sidecar"):
        read_sidecar(path)


def test_an_accepted_effect_is_part_of_the_staged_set_and_zero_means_that_it_is_absent() -> None:
    present = {"FF0_X_UU": 0.0, "FF0_T8_GAIN": 0.75, "FF0_N_V": 0.0, "FF0_T_ASTERN": 0.0}
    assert all(is_staged(name) for name in present)
    plan = make_plan({"FF0_X_UU": 12.5, "FF0_T8_GAIN": 0.0, "FF0_N_V": -2.0, "FF0_T_ASTERN": 5.0}, present)
    assert [row.verdict for row in plan.rows] == [Verdict.CHANGED] * 3 + [Verdict.REFUSED]
    assert plan.rows[3].reason == "5 is outside 0.3 to 2"


def test_a_model_that_was_fitted_without_effects_takes_back_those_of_its_configuration() -> None:
    present = {
        "FF0_M_U": 96.0,
        "FF0_X_UU": 12.5,
        "FF0_T2_GAIN": 0.8,
        "FF0_N_V": 0.0,
        "FF1_X_UU": 9.0,
        "FF_MODE": 2.0,
    }
    assert taken_back({"FF0_M_U": 100.0}, present) == {"FF0_X_UU": 0.0, "FF0_T2_GAIN": 0.0}
    assert taken_back({"FF0_M_U": 100.0, "FF0_X_UU": 10.0}, present) == {"FF0_T2_GAIN": 0.0}
    assert taken_back({"FF_MODE": 1.0}, present) == {}


def test_the_code_stands_for_what_is_written_and_for_an_armed_vehicle():
    present = dict.fromkeys(("FF0_M_U", "FF0_M_V", "FF1_D_U"), 0.0)
    codes = {
        make_plan(values, present).code(armed=armed)
        for values in (
            {"FF0_M_U": 96.5},
            {"FF0_M_U": 96.625},
            {"FF0_M_V": 96.5},
            {"FF0_M_U": 96.5, "FF1_D_U": 1.0},
        )
        for armed in (False, True)
    }
    assert len(codes) == 8
    plan = make_plan({"FF0_M_U": 96.5}, present)
    assert plan.code(armed=False) == f"1-{set_crc({'FF0_M_U': 96.5}):06x}"
    assert plan.code(armed=True) == f"armed-{plan.code(armed=False)}"


SIDECAR = Sidecar("ab", "cd", "hovering", "likelihood", "0.1", {}, "ruvifist", "lake", "converged")


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "set.param"
    write_parameters(path, {"FF1_M_U": 96.5, "FF1_D_U": 42.25}, [])
    return path


def test_an_identification_says_where_it_is_from_and_what_is_doubted_of_what_it_sends(file):
    doubted = {"D_u": "the dive is too short", "D_r": "yaw was never pushed"}
    write_sidecar(file, dataclasses.replace(SIDECAR, doubted=doubted))
    wanted = wanted_by(file, "despite-doubts", despite_doubts=False)
    assert wanted.whole
    assert wanted.notes == ("from lake of ruvifist, configuration hovering, by likelihood: converged",)
    assert wanted.warnings == ("warning: D_u is doubted: the dive is too short",)


PRESENT_MODEL = {
    "FF1_M_U": 90.0,
    "FF1_D_U": 40.0,
    "FF1_D_R": 3.0,
    "FF1_I_R": 8.0,
    "FF1_X_UU": 0.0,
    "FF_MODE": 0.0,
}
DRY = {"FF1_M_U": (72.0, 1.0)}


def reason(name, value, half=None, last=None, last_half=None, centre=None, rigid=DRY, present=PRESENT_MODEL):
    """Why that value is not believed; 95 % intervals are `half` around `centre`, and `last_half` around `last`."""
    around = lambda centre, width: Interval(name, "", centre - width, centre + width)  # noqa: E731
    intervals = {} if half is None else {name: around(value if centre is None else centre, half)}
    accepted = {}
    if last is not None:
        accepted = {name: AcceptedValue(last, None if last_half is None else around(last, last_half), "2026")}
    return implausible(make_plan({name: value}, present), intervals, accepted, rigid, {}).get(name, "")


UNKNOWN = "its standard deviation, {}, is as large as the value: the dive did not tell it"
LIGHT = "{} is below the rigid body's own 72, which no water takes away"
FAR = "{} was accepted last, and both 95 % intervals together allow a change of {}"
TIMES = "{} was accepted last: this is {} times as much"
HEAVE = {"FF1_M_W": 90.0, "FF1_D_W": 40.0}


@pytest.mark.parametrize(
    ("name", "value", "known", "against"),
    [
        # a deviation as large as the value, if that is no small damping
        ("FF1_M_U", 100.0, {"half": 5.0}, ""),
        ("FF1_M_U", 100.0, {"half": 195.0}, ""),
        ("FF1_M_U", 100.0, {"half": 196.0}, UNKNOWN.format(100)),
        ("FF1_D_U", 42.0, {"half": 60.0}, ""),
        ("FF1_D_U", 4.0, {"half": 1.96 * 10.0}, UNKNOWN.format(10)),
        ("FF1_D_U", 4.0, {"half": 1.96 * 8.9}, ""),
        ("FF1_D_R", 0.1, {"half": 1.96 * 0.7}, ""),
        ("FF1_D_R", 0.1, {"half": 1.96 * 0.9}, UNKNOWN.format(0.9)),
        ("FF1_X_UU", 12.0, {"half": 90.0, "present": {"FF1_M_U": 24.5, "FF1_X_UU": 0.0}}, ""),
        # an interval of another value
        ("FF1_M_U", 119.5, {"half": 10.0, "centre": 100.0}, ""),
        ("FF1_M_U", 130.5, {"half": 10.0, "centre": 100.0},
         "130.5 is far outside its own 95 % interval, 90 to 110"),
        ("FF1_D_U", 0.0, {"half": 1.0, "centre": 56.0}, "0 is far outside its own 95 % interval, 55 to 57"),
        # a total mass below the rigid body
        ("FF1_M_U", 66.0, {"half": 3.0}, LIGHT.format(66)),
        ("FF1_M_U", 66.0, {}, LIGHT.format(66)),
        ("FF1_M_U", 66.0, {"half": 5.0}, ""),
        ("FF1_M_U", 66.0, {"half": 3.0, "rigid": {}}, ""),
        ("FF1_M_U", 0.0, {}, LIGHT.format(0)),
        # a change beyond both intervals and beyond what payload and water do; without intervals, by a factor
        ("FF1_M_U", 145.0, {"half": 5.0, "last": 100.0, "last_half": 5.0}, FAR.format(100, 10)),
        ("FF1_M_U", 125.0, {"half": 5.0, "last": 100.0, "last_half": 5.0}, ""),
        ("FF1_M_U", 125.0, {"half": 1.0, "last": 100.0, "last_half": 1.0}, ""),
        ("FF1_D_U", 80.0, {"half": 10.0, "last": 40.0, "last_half": 5.0}, ""),
        ("FF1_D_U", 119.0, {"last": 40.0}, ""),
        ("FF1_D_U", 121.0, {"last": 40.0}, TIMES.format(40, 3)),
        ("FF1_D_U", 13.0, {"half": 2.0, "last": 40.0}, TIMES.format(40, 0.33)),
        ("FF1_X_UU", 90.0, {"last": 12.0}, ""),
        # what is taken back and what is so already
        ("FF1_X_UU", 0.0, {"last": 12.0}, ""),
        ("FF1_D_W", 0.0, {"half": 50.0, "last": 40.0, "last_half": 1.0, "present": {"FF1_D_W": 40.0}}, ""),
        ("FF1_M_U", 90.0, {"half": 400.0}, ""),
        ("FF_MODE", 1.0, {"last": 3.0}, ""),
    ],
)  # fmt: skip
def test_a_value_is_believed_unless_its_dive_or_the_vehicle_speaks_against_it(name, value, known, against):
    assert reason(name, value, **known) == against


@pytest.mark.parametrize(
    ("name", "value", "known", "against"),
    [
        ("FF1_D_U", 0.0, {"last": 56.43}, TIMES.format(56.43, 0)),
        ("FF1_I_R", -0.0, {"last": 8.5}, TIMES.format(8.5, 0)),
        ("FF1_D_U", 0.0, {"half": 1.0, "last": 56.43, "last_half": 1.0}, FAR.format(56.43, 2)),
        ("FF1_D_W", 0.0, {"present": HEAVE}, ""),
        ("FF1_D_W", 0.0, {"half": 1.0, "present": HEAVE}, ""),
    ],
)
def test_a_coefficient_of_zero_is_believed_no_more_than_any_other_number(name, value, known, against):
    assert reason(name, value, **known) == against


def judged(targets, present=PRESENT_MODEL):
    return implausible(make_plan(targets, present), {}, {}, {}, {})


AXES = [("surge", "FF1_M_U", "FF1_D_U"), ("sway", "FF1_M_V", "FF1_D_V"), ("yaw", "FF1_I_R", "FF1_D_R")]


@pytest.mark.parametrize(("axis", "mass", "damping"), AXES)
def test_half_a_model_of_an_axis_is_no_value_to_write_whichever_half_it_is(axis, mass, damping):
    off = f"the feed-forward of {axis} stays off"
    empty, both = {mass: 0.0, damping: 0.0}, {mass: 90.0, damping: 40.0}
    assert judged({mass: 90.0}, empty) == {mass: f"without {damping} {off}"}
    assert judged({damping: 40.0}, empty) == {damping: f"without {mass} {off}"}
    assert judged({damping: 0.0}, both) == {damping: f"0 is not set: {off}"}
    assert judged({mass: 0.0}, both) == {mass: f"0 is not set: {off}"}
    assert judged({mass: 95.0}, {mass: 90.0, damping: 0.0}) == {mass: f"without {damping} {off}"}


BOTH_DRAGS = {"FF1_M_U": 100.0, "FF1_D_U": 40.0, "FF1_X_UU": 60.0}
LINEAR, SQUARED = {"FF1_D_U": 70.0}, {"FF1_X_UU": 90.0}
STAYS = (
    "drag is made up for already: {} would stay in force beside it, and was not fitted with it; send {} too, 0 for "
    "none"
)


@pytest.mark.parametrize(
    ("targets", "present", "against"),
    [
        (LINEAR, BOTH_DRAGS, {"FF1_D_U": STAYS.format("FF1_X_UU 60", "FF1_X_UU")}),
        (SQUARED, BOTH_DRAGS, {"FF1_X_UU": STAYS.format("FF1_D_U 40", "FF1_D_U")}),
        (SQUARED, BOTH_DRAGS | {"FF1_X_UU": 0.0}, {"FF1_X_UU": STAYS.format("FF1_D_U 40", "FF1_D_U")}),
        (LINEAR | {"FF1_X_UU": 0.0}, BOTH_DRAGS, {}),
        (LINEAR | {"FF1_X_UU": 60.0}, BOTH_DRAGS, {}),
        (LINEAR, BOTH_DRAGS | {"FF1_X_UU": 0.0}, {}),
        (LINEAR, BOTH_DRAGS | {"FF1_X_UU": 0.0, "FF1_Y_VV": 80.0}, {}),
        (LINEAR, {"FF1_M_U": 100.0, "FF1_D_U": 40.0}, {}),
    ],
)
def test_a_fitted_drag_that_would_act_beside_the_axis_s_other_drag_is_made_up_for_twice(
    targets, present, against
):
    fitted = {name: Interval(name, "", value - 1, value + 1) for name, value in targets.items()}
    assert implausible(make_plan(targets, present), fitted, {}, {}, {}) == against
    assert implausible(make_plan(targets, present), {}, {}, {}, {}) == {}, "typed by hand, or rolled back"


def test_a_mass_beside_quadratic_damping_alone_is_a_whole_model():
    empty = {"FF0_M_U": 0.0, "FF0_D_U": 40.0, "FF0_X_UU": 0.0}
    assert judged({"FF0_M_U": 90.0, "FF0_D_U": 0.0, "FF0_X_UU": 60.0}, empty) == {}
    off = "without FF0_D_U the feed-forward of surge stays off"
    assert judged({"FF0_M_U": 90.0}, empty | {"FF0_D_U": 0.0}) == {"FF0_M_U": off}


@pytest.mark.parametrize(("axis", "mass", "damping"), AXES)
def test_what_the_vehicle_holds_already_makes_a_model_whole(axis, mass, damping):
    del axis
    assert judged({mass: 90.0}, {mass: 0.0, damping: 40.0}) == {}
    assert judged({damping: 40.0}, {mass: 90.0, damping: 0.0}) == {}
    assert judged({mass: 90.0, damping: 40.0}, {mass: 0.0, damping: 0.0}) == {}
    assert judged({mass: 0.0, damping: 0.0}, {mass: 90.0, damping: 40.0}) == {}, "no model of an axis at all"
    assert judged({"FF1_M_W": 90.0}, {"FF1_M_W": 0.0, "FF1_D_W": 0.0}) == {}, "nothing is fed forward there"


def test_a_damping_by_which_the_vehicle_would_coast_for_hours_is_no_value_to_write():
    assert judged({"FF1_D_U": 0.0089}) == {
        "FF1_D_U": "0.0089 is next to no damping beside FF1_M_U 90: half of a model"
    }
    assert judged({"FF1_M_U": 80.0, "FF1_D_U": 0.0081}) == {}, "of the mass that comes with it"
    assert judged({"FF1_D_R": 0.0007}) == {
        "FF1_D_R": "0.0007 is next to no damping beside FF1_I_R 8: half of a model"
    }
    assert judged({"FF1_D_U": 0.0091, "FF1_D_R": 0.0009}) == {}


WORDS = {0.0: "off", 1.0: "shadow", 2.0: "ff", 3.0: "both"}
RAISED = [(now, then) for now in (0.0, 1.0) for then in (2.0, 3.0)] + [(3.0, 2.0)]


@pytest.mark.parametrize("now", WORDS)
@pytest.mark.parametrize("then", WORDS)
def test_a_mode_that_leaves_more_to_the_feed_forward_is_not_raised_by_a_file_by_the_way(now, then):
    words = (
        f"raises the feed-forward from {WORDS[now]} to {WORDS[then]}, which no file does by the way: "
        f"seatrial ff {WORDS[then]}"
    )
    assert reason("FF_MODE", then, present={"FF_MODE": now}) == (words if (now, then) in RAISED else "")


def test_another_program_reads_a_comparison_as_it_was_written(tmp_path, file):
    write_sidecar(file, dataclasses.replace(SIDECAR, doubted={"D_u": "the dive is too short"}))
    wanted = wanted_by(file, "despite-doubts", despite_doubts=False)
    present = {"FF1_M_U": 90.0, "FF_ACTIVE": 0.0, "FF_COMMIT": 0.0, "FF_MODE": 2.0}
    made = propose_upload(file, wanted, present, None, tmp_path, 1).comparison((1, 191), armed=True)
    assert made.parameters[1].doubted == "the dive is too short"
    read = build(Comparison, json.loads(json.dumps(dataclasses.asdict(made))), "it")
    assert read == made
    with pytest.raises(ConfigError, match="it: "):
        build(Comparison, {"summary": "3 parameters"}, "it")


def test_lines_are_chosen_of_those_that_change_and_bring_the_staged_ones_with_them(file, tmp_path):
    wanted = wanted_by(file, "despite-doubts", despite_doubts=True)
    present = {"FF1_M_U": 90.0, "FF_ACTIVE": 0.0, "FF_COMMIT": 0.0, "FF_MODE": 2.0}
    shown = propose_upload(file, wanted, present, None, tmp_path, 1).comparison((1, 191), armed=True)
    kinds = {"A": "changed", "B": "changed", "C": "staged", "D": "same", "E": "implausible"}
    line = shown.parameters[0]
    lines = tuple(dataclasses.replace(line, name=name, verdict=verdict) for name, verdict in kinds.items())
    shown = dataclasses.replace(shown, parameters=lines)
    assert (shown.changed, shown.staged, shown.choosable) == (("A", "B"), ("C",), ("A", "B", "E"))
    assert shown.only({"A", "B", "E"}) == ()
    assert shown.only({"B"}) == ("B", "C")


def test_half_of_a_model_is_chosen_only_if_the_file_does_not_hold_the_other_half(file, tmp_path):
    wanted = wanted_by(file, "despite-doubts", despite_doubts=True)
    present = {"FF1_M_U": 0.0, "FF1_D_U": 0.0, "FF_ACTIVE": 0.0, "FF_COMMIT": 0.0, "FF_MODE": 1.0}
    shown = propose_upload(file, wanted, present, None, tmp_path, 1).comparison((1, 191), armed=False)
    assert shown.half({"FF1_M_U"}).endswith("choose FF1_D_U too, or neither")
    assert shown.half({"FF1_M_U", "FF1_D_U"}) == ""
    mass_alone = dataclasses.replace(shown, parameters=shown.parameters[:1])
    assert mass_alone.half({"FF1_M_U"}) == ""


def test_a_gain_that_is_not_set_is_told_as_the_gain_of_1_that_it_is_before_and_after(tmp_path):
    file = tmp_path / "gap.param"
    write_parameters(file, {"FF0_T1_GAIN": 0.75, "FF0_T_ASTERN": 0.5, "FF0_X_UU": 12.5}, (), 1, 1)
    interval = Interval("T1_gain", "1", 0.7, 0.8)
    write_sidecar(file, dataclasses.replace(SIDECAR, intervals={"FF0_T1_GAIN": interval}))
    present = {"FF0_T1_GAIN": 0.0, "FF0_T_ASTERN": 0.0, "FF0_X_UU": 0.0}
    wanted = wanted_by(file, "despite-doubts", despite_doubts=True)
    gain, astern, drag = propose_upload(file, wanted, present, None, tmp_path, 1).lines
    assert gain.cells()[1:4] == ("1", "0.75", "-25 %")
    assert gain.change == pytest.approx(-5.0)
    assert gain.present == 0.0  # as the vehicle has it, for other programs
    assert astern.cells()[1:4] == ("1", "0.5", "-50 %")
    assert drag.cells()[1:4] == ("0", "12.5", "-")
    back = make_plan({"FF0_T1_GAIN": 0.0}, {"FF0_T1_GAIN": 0.75})
    (line,) = compared(back, None, {"FF0_T1_GAIN": AcceptedValue(0.0, "2026-11-21T064500Z", None)})
    assert line.cells()[1:4] == ("0.75", "1", "+33 %")
    assert line.cells()[5] == "1"
    assert Line("FF0_T1_GAIN", 0.0, 0.75, 0.75, Outcome.APPLIED, "").cells()[2:4] == ("1", "0.75")
    assert Line("FF0_T1_GAIN", 0.75, 0.0, 0.0, Outcome.APPLIED, "").cells()[2:4] == ("0.75", "1")


@pytest.mark.parametrize("outcome", Outcome)
def test_a_line_of_a_receipt_tells_that_it_was_read_back_or_why_not(outcome):
    became = "read back equal" if outcome is Outcome.APPLIED else "a sentence"
    line = Line("FF1_M_U", 0.0, 24.5, None, outcome, "a sentence")
    assert line.cells() == ("FF1_M_U", "kg", "not set", "-", became)


def test_a_mass_or_damping_of_zero_is_told_as_not_set_and_a_drag_of_zero_as_zero():
    def told(name):
        return Line(name, 0.0, 24.5, 24.5, Outcome.APPLIED, "").cells()[2:4]

    assert told("FF0_M_U") == told("FF0_D_U") == ("not set", "24.5")
    assert told("FF0_X_UU") == ("0", "24.5")


def test_a_roll_back_of_one_line_of_a_set_takes_back_all_of_the_set_with_the_mode_and_nothing_else(tmp_path):
    """Another program has changed the other line since: half of each is no model that anybody flew."""
    before = {"FF0_M_U": 24.5, "FF0_D_U": 40.0, "FF_MODE": 0.0, "FS_GCS_ENABLE": 1.0}
    upload = make_plan({"FF0_M_U": 26.0}, before)
    path = begin(upload, (1, 191), tmp_path / "2026-11-21T063000Z-before.param", None, 0.0).preimage
    now = {"FF0_M_U": 26.0, "FF0_D_U": 50.0, "FF_MODE": 3.0, "FS_GCS_ENABLE": 2.0}
    plan = propose_rollback(path, Wanted(before), now, tmp_path, 1).plan
    assert plan.changes == {"FF0_M_U": 24.5, "FF0_D_U": 40.0, "FF_MODE": 0.0}
