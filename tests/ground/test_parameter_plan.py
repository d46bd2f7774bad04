"""The plan, the targets of an identification and the sidecar."""

import pytest

from bridge.errors import ParamRejected, ParamUnknown
from bridge.parameters import set_crc
from gcs_plugin.params import float32
from gcs_plugin.params.comparison import compared
from gcs_plugin.params.files import Sidecar, intervals_of, read_sidecar, sidecar_path, write_sidecar
from gcs_plugin.params.plan import (
    Verdict,
    action_of,
    is_staged,
    make_plan,
    parameters_from_identification,
    taken_back,
)

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


def test_lines_can_be_chosen_and_nothing_is_skipped_in_silence():
    plan = make_plan({"FF0_D_U": 42.0, "FF3_M_U": 30.0}, PRESENT)
    assert plan.summary() == "2 parameters: 1 changed, 1 not on the vehicle"
    chosen = plan.chosen(["FF0_D_U"])
    chosen.check()
    assert chosen.changes == {"FF0_D_U": 42.0}
    with pytest.raises(ParamUnknown, match="no line FF9"):
        plan.chosen(["FF9"])


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


def test_rows_print_with_comparable_values():
    plan = make_plan({"FF0_M_U": 24.4, "FF3_M_U": 30.0}, PRESENT)
    assert [line.cells() for line in compared(plan, {}, {})] == [
        ("FF0_M_U", "kg", "24.4", "24.4", "-", "-", "same"),
        ("FF3_M_U", "kg", "-", "30", "-", "-", "not on the vehicle: the vehicle has no such parameter"),
    ]


def estimate(name, value, identifiable=True):
    return {
        "name": name,
        "unit": "kg",
        "value": value,
        "identifiable": identifiable,
        "low95": 1.0,
        "high95": 2.0,
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
    assert parameters_from_identification(data, 1, ["M_u"]) == {"FF1_M_U": float32.rounded(24.4)}


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
    intervals = intervals_of({"parameters": [estimate("M_u", 24.4)]}, {"M_u": "FF0_M_U"})
    sidecar = Sidecar("dive", "vehicle", "hovering", "likelihood", "0.1.0", intervals)
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
