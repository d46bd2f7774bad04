"""The parameter values that a crew accepted last, read from the receipts of uploads and roll backs."""

import dataclasses
import json
from functools import partial
from pathlib import Path

import pytest

from bridge.errors import ParamRejected, ParamUnwritten
from bridge.vehicle.forecast import Credit, ForecastRow
from bridge.vehicle.parameters import ACTIVE
from gcs_plugin.params import files
from gcs_plugin.params import sidecar as sidecars
from gcs_plugin.params.comparison import compared
from gcs_plugin.params.last_accepted import (
    AcceptedValue,
    accepted_of,
    accepted_values,
    keep_accepted,
    kept_of,
    last_accepted,
    model_in_force,
    newest_before,
    rolled_back,
    written_since,
)
from gcs_plugin.params.plan import make_plan
from gcs_plugin.params.proposal import propose_rollback, propose_upload
from gcs_plugin.params.receipt import Line, Receipt, begin, next_number
from gcs_plugin.params.sidecar import Interval, Sidecar, read_sidecar, write_with_sidecar
from gcs_plugin.params.transfer import Outcome
from gcs_plugin.params.unfinished import reminder, unfinished
from gcs_plugin.params.wanted import Wanted

MASS = Interval("M_u", "kg", 90.0, 110.0)
SIDECAR = Sidecar(
    "ab",
    "cd",
    "hovering",
    "likelihood",
    "0.1",
    {"FF1_M_U": MASS, "FF1_D_U": Interval("D_u", "N/(m/s)", 40.0, 50.0)},
    "ruvifist",
    "lake",
    "converged",
    doubted={"M_u": "too short", "D_u": "too slow"},
)


class Receipts:
    """A folder of receipts, an upload a minute, or one a minute before the last by a clock that is set back."""

    def __init__(self, path, minutes=1):
        self.path, self.minute, self.minutes, self.count = path, 30, minutes, 0

    def keep(self, outcome=Outcome.APPLIED, system=1, restores="", sidecar=SIDECAR, **values):
        self.minute += self.minutes
        self.count += 1
        before = self.path / f"2026-11-21T06{self.minute:02d}00Z-before.param"
        lines = tuple(Line(name, 1.0, value, value, outcome, "") for name, value in values.items())
        receipt = Receipt(outcome, "", system, 1, lines, before, None, "2026", 1.0, restores, self.count)
        text = json.dumps(receipt.to_json())
        self.path.mkdir(exist_ok=True)
        before.with_name(before.name.replace("-before.param", "-receipt.json")).write_text(text, "utf-8")
        keep_accepted(receipt, sidecar, True)
        return before

    def accepted(self, system=None):
        return {name: item.value for name, item in last_accepted(self.path, system).items()}


@pytest.fixture(params=[1, -1], ids=["clock goes on", "clock set back"])
def receipts(request, tmp_path):
    return Receipts(tmp_path / "receipts", request.param)


def stands(receipts):
    """Whether an upload can be rolled back in one step."""
    try:
        return bool(newest_before(receipts.path, 1))
    except ParamRejected:
        return False


def time_of(before):
    return before.name.removesuffix("-before.param")


def test_each_parameter_is_as_it_was_accepted_last(receipts):
    receipts.keep(FF1_M_U=100.0, FF1_D_U=45.0)
    later = receipts.keep(FF1_M_U=104.0)
    result = last_accepted(receipts.path)
    assert result["FF1_M_U"] == AcceptedValue(104.0, MASS, time_of(later))
    assert result["FF1_D_U"].value == 45.0


def test_what_was_accepted_keeps_what_its_source_said_of_the_lines_that_were_sent(receipts):
    before = receipts.keep(FF1_M_U=100.0)
    kept = read_sidecar(before.with_name(before.name.replace("before", "accepted")))
    assert kept == dataclasses.replace(SIDECAR, intervals={"FF1_M_U": MASS}, doubted={"M_u": "too short"})


def test_values_whose_doubts_cannot_be_kept_are_not_kept_either(receipts):
    receipts.keep(FF1_M_U=100.0)
    (receipts.path / f"2026-11-21T06{receipts.minute + receipts.minutes:02d}00Z-accepted.param.json").mkdir()
    with pytest.raises(ParamUnwritten):
        receipts.keep(FF1_M_U=104.0)
    assert receipts.accepted() == {"FF1_M_U": 100.0}


@pytest.mark.parametrize("older", [True, False], ids=["over older values", "anew"])
@pytest.mark.parametrize("blocked", ["of_lake.param", "of_lake.param.json"])
def test_values_and_their_sidecar_are_written_both_or_neither(tmp_path, monkeypatch, older, blocked):
    path = tmp_path / "of_lake.param"
    if older:
        write_with_sidecar(path, {"FF1_M_U": 100.0}, (), SIDECAR)
    before = {each.name: each.read_text("utf-8") for each in tmp_path.iterdir()}
    write = files.replace_text

    def full(at, text):
        if at.name == blocked:
            raise ParamUnwritten(f"{at}: no space left")
        write(at, text)

    monkeypatch.setattr(files, "replace_text", full)
    monkeypatch.setattr(sidecars, "replace_text", full)
    with pytest.raises(ParamUnwritten):
        write_with_sidecar(path, {"FF1_M_U": 104.0}, (), dataclasses.replace(SIDECAR, dive="sea"))
    assert {each.name: each.read_text("utf-8") for each in tmp_path.iterdir()} == before


@pytest.mark.parametrize(
    "outcome", [Outcome.UNVERIFIED, Outcome.REFUSED, Outcome.ROLLED_BACK, Outcome.NOT_SENT]
)
def test_an_upload_that_was_not_verified_is_not_accepted(receipts, outcome):
    receipts.keep(FF1_M_U=100.0)
    receipts.keep(outcome, FF1_M_U=104.0)
    assert receipts.accepted() == {"FF1_M_U": 100.0}


def test_a_roll_back_takes_back_its_upload_and_later_ones(receipts):
    receipts.keep(FF1_M_U=100.0)
    second = receipts.keep(FF1_M_U=104.0)
    receipts.keep(FF1_D_U=45.0)
    receipts.keep(restores=str(second), FF1_M_U=100.0)
    assert receipts.accepted() == {"FF1_M_U": 100.0}


def test_a_roll_back_that_failed_takes_nothing_back(receipts):
    first = receipts.keep(FF1_M_U=100.0)
    receipts.keep(Outcome.UNVERIFIED, restores=str(first), FF1_M_U=1.0)
    assert receipts.accepted() == {"FF1_M_U": 100.0}


def test_a_roll_back_to_a_file_of_another_name_takes_back_all(receipts):
    receipts.keep(FF1_M_U=100.0)
    receipts.keep(restores="of_yesterday.param", FF1_M_U=1.0)
    assert receipts.accepted() == {}


def test_one_step_back_after_another_goes_further_back(receipts):
    first, second = receipts.keep(FF1_M_U=100.0), receipts.keep(Outcome.UNVERIFIED, FF1_M_U=104.0)
    receipts.keep(Outcome.REFUSED, FF1_M_U=105.0)
    assert newest_before(receipts.path, 1) == second
    receipts.keep(restores=str(second), FF1_M_U=100.0)
    assert newest_before(receipts.path, 1) == first
    receipts.keep(restores=str(first), FF1_M_U=1.0)
    assert not stands(receipts)
    receipts.keep(FF1_M_U=107.0)
    assert receipts.accepted() == {"FF1_M_U": 107.0}


def test_vehicles_are_told_apart(receipts):
    first = receipts.keep(FF1_M_U=100.0)
    receipts.keep(system=2, FF1_M_U=50.0)
    assert (receipts.accepted(1), receipts.accepted(2)) == ({"FF1_M_U": 100.0}, {"FF1_M_U": 50.0})
    assert newest_before(receipts.path, 1) == first


def test_what_was_sent_to_another_vehicle_is_none_of_a_vehicles_receipts(receipts):
    other = dataclasses.replace(SIDECAR, vehicle="bluerov2")
    theirs = receipts.keep(FF1_M_U=50.0, sidecar=other)
    ours = receipts.keep(FF1_M_U=100.0)
    unnamed = receipts.keep(FF1_M_U=104.0, sidecar=None)
    begun = receipts.keep(Outcome.BEGUN, FF1_M_U=51.0)
    wanted = begun.with_name(begun.name.replace("-before.param", "-wanted.param"))
    write_with_sidecar(wanted, {"FF1_M_U": 51.0}, (), other, 1, 1)
    back = receipts.keep(restores=str(theirs), FF1_M_U=1.0)
    of = {
        name: [kept.preimage for kept in kept_of(receipts.path, name)]
        for name in ("ruvifist", "bluerov2", "")
    }
    assert of["ruvifist"] == [ours, unnamed]
    assert of["bluerov2"] == [theirs, unnamed, begun, back]
    assert of[""] == [theirs, ours, unnamed, begun, back]


def test_of_two_vehicles_with_the_same_address_neither_takes_back_what_the_other_accepted(receipts):
    other = dataclasses.replace(SIDECAR, vehicle="bluerov2")
    first = receipts.keep(FF1_M_U=100.0)
    theirs = receipts.keep(FF0_M_U=50.0, sidecar=other)
    ours = receipts.keep(FF1_M_U=104.0, sidecar=dataclasses.replace(SIDECAR, configuration="laden"))
    assert written_since(receipts.path, 1, theirs) == {"FF0_M_U"}
    receipts.keep(restores=str(theirs), FF0_M_U=1.0)
    assert receipts.accepted() == {"FF1_M_U": 104.0}
    assert model_in_force(receipts.path, "ruvifist").path.name.startswith(time_of(ours))
    assert (rolled_back(receipts.path, 1, "ruvifist") is None, newest_before(receipts.path, 1)) == (
        True,
        ours,
    )
    assert rolled_back(receipts.path, 1, "bluerov2").restores == str(theirs)
    receipts.keep(restores=str(first), FF1_M_U=1.0)
    assert receipts.accepted() == {}


def test_of_two_vehicles_with_the_same_address_neither_is_told_of_an_unfinished_upload_of_the_other(receipts):
    other = dataclasses.replace(SIDECAR, vehicle="bluerov2")
    begun = receipts.keep(Outcome.BEGUN, FF0_M_U=51.0)
    wanted = begun.with_name(begun.name.replace("-before.param", "-wanted.param"))
    write_with_sidecar(wanted, {"FF0_M_U": 51.0}, (), other, 1, 1)
    receipts.keep(FF1_M_U=100.0)
    assert unfinished(receipts.path, 1, "ruvifist") is None
    assert unfinished(receipts.path, 1, "bluerov2").preimage == begun
    for vehicle, told in ("ruvifist", False), ("bluerov2", True):
        wanted = Wanted({"FF1_M_U": 17.0}, sidecar=dataclasses.replace(SIDECAR, vehicle=vehicle))
        notes = propose_upload(Path("a.param"), wanted, {"FF1_M_U": 90.0}, None, receipts.path, 1).notes
        assert any("was never finished" in note for note in notes) is told


def test_a_roll_back_without_a_file_asks_for_it_where_uploads_of_two_vehicles_stand_at_the_address(receipts):
    other = dataclasses.replace(SIDECAR, vehicle="bluerov2")
    theirs = receipts.keep(FF0_M_U=50.0, sidecar=other)
    ours = receipts.keep(FF1_M_U=100.0)
    with pytest.raises(ParamRejected) as refused:
        newest_before(receipts.path, 1)
    assert f"{theirs} for bluerov2" in str(refused.value)
    assert f"{ours} for ruvifist" in str(refused.value)
    receipts.keep(restores=str(theirs), FF0_M_U=1.0)
    assert newest_before(receipts.path, 1) == ours


def test_an_upload_that_was_never_finished_is_what_a_roll_back_goes_back_to(receipts):
    first = receipts.keep(FF1_M_U=100.0)
    assert unfinished(receipts.path) is None
    begun = receipts.keep(Outcome.BEGUN, FF1_M_U=104.0)
    receipts.keep(Outcome.ROLLED_BACK, FF1_M_U=105.0)
    left = unfinished(receipts.path, 1)
    assert (left.time, left.preimage, left.written) == (time_of(begun), begun, {"FF1_M_U": 104.0})
    assert unfinished(receipts.path, 2) is None
    assert newest_before(receipts.path, 1) == begun
    receipts.keep(restores=str(begun), FF1_M_U=100.0)
    assert unfinished(receipts.path) is None
    assert newest_before(receipts.path, 1) == first


@pytest.mark.parametrize("outcome", [Outcome.APPLIED, Outcome.SAME])
def test_an_upload_that_finishes_another_is_rolled_back_to_what_was_before_both(receipts, outcome):
    receipts.keep(FF1_M_U=100.0)
    begun = receipts.keep(Outcome.BEGUN, FF1_M_U=104.0)
    receipts.keep(Outcome.BEGUN, FF1_M_U=104.0)
    receipts.keep(outcome, FF1_M_U=104.0)
    assert unfinished(receipts.path) is None
    assert newest_before(receipts.path, 1) == begun
    assert receipts.accepted() == {"FF1_M_U": 104.0}


def test_what_was_so_already_of_other_lines_finishes_nothing(receipts):
    begun = receipts.keep(Outcome.BEGUN, FF1_M_U=104.0)
    receipts.keep(Outcome.SAME, FF1_D_U=45.0)
    assert unfinished(receipts.path).preimage == begun


def test_a_roll_back_that_was_never_finished_is_told_and_takes_nothing_back(receipts):
    first = receipts.keep(FF1_M_U=100.0)
    receipts.keep(Outcome.BEGUN, restores=str(first), FF1_M_U=1.0)
    assert unfinished(receipts.path).restores == str(first)
    assert newest_before(receipts.path, 1) == first
    assert receipts.accepted() == {"FF1_M_U": 100.0}


def test_a_roll_back_without_lines_that_was_never_finished_is_told_until_another_settles_it(receipts):
    """Of an upload that only put a set in force: it takes that out of force again, and writes no value."""
    first = receipts.keep(FF1_M_U=100.0)
    receipts.keep(Outcome.BEGUN, restores=str(first))
    left = unfinished(receipts.path)
    assert left.restores == str(first)
    warning, remedy = reminder(dataclasses.replace(left, active_crc=0), {ACTIVE: 13247.0})
    assert warning.endswith("was never finished; set 13247 flies")
    assert "finish it:" in remedy
    receipts.keep(restores=str(first))
    assert unfinished(receipts.path) is None


FORM = (
    '{"vehicle": {"system": 1}, "outcome": "begun", "number": @number, "active_crc": @active_crc, '
    '"parameters": [{"name": "FF1_M_U", "outcome": "begun", "target": @target}]}'
)
NUMBERS = {"number": "9", "active_crc": "7", "target": "1.5"}


def filled(**numbers):
    text = FORM
    for key, value in (NUMBERS | numbers).items():
        text = text.replace(f"@{key}", value)
    return text


@pytest.mark.parametrize(
    "text",
    [
        "", "[]", "{}", '{"vehicle": 3}', '{"vehicle": {"system": 1}}', "\xff", FORM,
        *(filled(number=number) for number in ("1e400", "Infinity", "-1", "2.5", "true", f"{2**53 + 1}")),
        *(filled(active_crc=crc) for crc in ("1e999", "NaN", f"{2**32}")),
        *(filled(target=target) for target in ("1e400", "-Infinity", "NaN", "1e39", '"inf"', "9" * 299)),
    ],
)  # fmt: skip
def test_a_damaged_receipt_or_file_is_left_out_and_so_is_a_number_that_none_of_ours_has(receipts, text):
    strange = receipts.path / "2026-11-21T070000Z-receipt.json"
    before = receipts.keep(FF1_M_U=100.0)
    strange.write_text(filled(), "utf-8")
    assert unfinished(receipts.path).written == {"FF1_M_U": 1.5}
    strange.write_text(text, "latin-1")
    assert unfinished(receipts.path) is None
    assert newest_before(receipts.path, 1) == before
    later = receipts.keep(FF1_M_U=104.0)
    Path(str(later).replace("before.param", "accepted.param")).write_text("FF1_M_U,nan\n", "utf-8")
    assert receipts.accepted() == {"FF1_M_U": 100.0}


@pytest.mark.parametrize("number", [2**53 - 1, 2**53, 2**53 + 1, 10**299])
def test_a_strangers_number_never_makes_a_receipt_of_ours_unreadable(receipts, number):
    receipts.path.mkdir()
    strange = receipts.path / "2026-11-20T070000Z-receipt.json"
    strange.write_text(f'{{"vehicle": {{"system": 9}}, "outcome": "applied", "number": {number}}}', "utf-8")
    receipts.count = next_number(receipts.path) - 1
    before = receipts.keep(FF1_M_U=100.0)
    assert newest_before(receipts.path, 1) == before


def test_a_change_is_told_in_per_cent_and_then_in_halves_of_the_interval():
    plan = make_plan({"FF1_M_U": 100.0, "FF1_D_U": 45.0, "FF1_M_V": 5.0}, {"FF1_M_U": 85.0, "FF1_D_U": 45.0})
    lines = compared(plan, SIDECAR, {"FF1_M_U": AcceptedValue(96.5, MASS, "2026")})
    assert [line.change for line in lines] == [1.5, 0.0, None]
    assert lines[0].cells() == ("FF1_M_U", "85", "100", "+18 %", "kg", "96.5", "+1.5", "changed")
    assert lines[2].cells()[1:7] == ("-", "5", "-", "kg", "-", "-")
    assert [dataclasses.replace(lines[0], target=target).percent for target in (83.0, 9e4, -9e4)] == [
        "-2.4 %", ">999 %", "<-999 %"
    ]  # fmt: skip


def test_a_mode_is_told_by_its_name_and_its_change_is_no_share():
    (line,) = compared(make_plan({"FF_MODE": 1.0}, {"FF_MODE": 3.0}), None, {})
    assert line.cells()[:4] == ("FF_MODE", "both", "shadow", "-")


FORETOLD = dataclasses.replace(
    SIDECAR,
    dived="2026-11-21T06:00:00Z",
    foretold=(ForecastRow("surge", "m/s", "both", "ff", 0.0133, 0.006, 0.18),),
    credits=(Credit(1, 1.0, 0.8, None, acting=False),),
)


def test_the_model_in_force_is_that_of_the_newest_upload_that_stands(tmp_path):
    receipts = Receipts(tmp_path / "receipts")
    assert model_in_force(receipts.path, "ruvifist", "hovering") is None
    receipts.keep(FF1_M_U=100.0)
    before = receipts.keep(sidecar=FORETOLD, FF1_M_U=101.0)
    model = model_in_force(receipts.path, "ruvifist", "hovering")
    assert (model.sidecar.foretold, model.sidecar.credits, model.sidecar.dived) == (
        FORETOLD.foretold, FORETOLD.credits, FORETOLD.dived,
    )  # fmt: skip
    assert (model.since, model.path.name) == ("2026-11-21T06:32:00Z", "2026-11-21T063200Z-accepted.param")
    assert model_in_force(receipts.path, "ruvifist") == model
    assert model_in_force(receipts.path, "ruvifist", "survey") is None
    assert model_in_force(receipts.path, "another", "hovering") is None
    receipts.keep(restores=str(before), FF1_M_U=100.0)
    assert model_in_force(receipts.path, "ruvifist", "hovering").sidecar.foretold == ()


def test_a_roll_back_of_one_vehicle_takes_back_nothing_of_another(receipts):
    other = dataclasses.replace(SIDECAR, vehicle="bluerov2", configuration="standard")
    before = receipts.keep(FF1_M_U=100.0)
    receipts.keep(system=2, sidecar=other, FF0_M_U=16.0)
    receipts.keep(restores=str(before), FF1_M_U=1.0)
    assert model_in_force(receipts.path, "ruvifist") is None
    assert model_in_force(receipts.path, "bluerov2").sidecar.configuration == "standard"
    assert receipts.accepted() == receipts.accepted(2) == {"FF0_M_U": 16.0}


@pytest.mark.parametrize("of", ["ruvifist", "bluerov2", None])
def test_a_file_is_held_against_what_its_own_vehicle_accepted(receipts, of):
    other = dataclasses.replace(SIDECAR, vehicle="bluerov2")
    receipts.keep(FF1_M_U=100.0)
    receipts.keep(system=2, sidecar=other, FF1_M_U=16.0)
    file = receipts.path / "identified.param"
    if of is None:
        file.write_text("FF1_M_U,101\n")
    else:
        write_with_sidecar(file, {"FF1_M_U": 101.0}, (), dataclasses.replace(SIDECAR, vehicle=of))
    accepted = {name: item.value for name, item in accepted_of(file, receipts.path).items()}
    assert accepted == {"FF1_M_U": 100.0 if of == "ruvifist" else 16.0}


def test_the_model_that_a_vehicle_is_watched_by_is_of_no_other_vehicle_of_its_address(receipts):
    receipts.keep(FF1_M_U=100.0)
    receipts.keep(sidecar=dataclasses.replace(SIDECAR, vehicle="bluerov2"), FF1_M_U=16.0)
    assert accepted_values(receipts.path, "ruvifist", 1) == {"FF1_M_U": 100.0}
    assert accepted_values(receipts.path, "bluerov2", 1) == {"FF1_M_U": 16.0}


@pytest.mark.parametrize(("of", "accepted"), [("ruvifist", 100.0), ("bluerov2", 16.0)])
def test_a_set_is_held_against_what_its_vehicle_accepted_though_another_has_its_address(
    receipts, of, accepted
):
    receipts.keep(FF1_M_U=100.0)
    receipts.keep(sidecar=dataclasses.replace(SIDECAR, vehicle="bluerov2"), FF1_M_U=16.0)
    file, wanted = (
        Path("a.param"),
        Wanted({"FF1_M_U": 17.0}, sidecar=dataclasses.replace(SIDECAR, vehicle=of)),
    )
    for propose in (partial(propose_upload, only=None), propose_rollback):
        (line,) = propose(file, wanted, {"FF1_M_U": 90.0}, receipts=receipts.path, system=1).lines
        assert line.accepted == accepted


def test_an_upload_to_one_vehicle_settles_no_unfinished_one_to_another(receipts):
    cut = receipts.keep(Outcome.BEGUN, FF1_M_U=100.0)
    receipts.keep(system=2, FF0_M_U=16.0)
    assert unfinished(receipts.path).preimage == cut
    assert unfinished(receipts.path, 2) is None
    receipts.keep(FF1_M_U=100.0)
    assert unfinished(receipts.path) is None


def test_a_model_that_was_sent_again_is_in_force_since_it_was_sent_first(tmp_path):
    receipts = Receipts(tmp_path / "receipts")
    receipts.keep(FF1_M_U=100.0)
    receipts.keep(sidecar=FORETOLD, FF1_M_U=101.0)
    receipts.keep(Outcome.SAME, sidecar=FORETOLD, FF1_M_U=101.0)
    assert model_in_force(receipts.path, "ruvifist", "hovering").since == "2026-11-21T06:32:00Z"


def test_at_an_earlier_time_the_model_is_in_force_that_stood_then(tmp_path):
    receipts = Receipts(tmp_path / "receipts")
    receipts.keep(FF1_M_U=100.0)
    before = receipts.keep(sidecar=FORETOLD, FF1_M_U=101.0)
    receipts.keep(restores=str(before), FF1_M_U=100.0)

    def foretold_at(time: str) -> bool:
        return bool(
            model_in_force(receipts.path, "ruvifist", "hovering", f"2026-11-21T06:{time}Z").sidecar.foretold
        )

    assert model_in_force(receipts.path, "ruvifist", "hovering", "2026-11-21T06:30:59Z") is None
    assert not foretold_at("31:59")
    assert foretold_at("32:00")
    assert foretold_at("32:59")
    assert not foretold_at("33:00")


def test_a_model_of_which_a_part_alone_was_sent_foretells_nothing(tmp_path):
    before = tmp_path / "2026-11-21T063000Z-before.param"
    line = Line("FF1_M_U", 1.0, 101.0, 101.0, Outcome.APPLIED, "")
    receipt = Receipt(Outcome.APPLIED, "", 1, 1, (line,), before, None, "2026", 1.0, "", 1)
    kept = read_sidecar(keep_accepted(receipt, FORETOLD, False))
    assert kept.foretold == ()
    assert kept.credits == FORETOLD.credits


@pytest.mark.parametrize(
    ("part", "key", "value"),
    [
        ("foretold", "unit", "furlongs"),
        ("foretold", "axis", "x"),
        ("credits", "found", 0.0),
        ("credits", "thruster", 0),
    ],
)
def test_a_sidecar_that_foretells_of_no_axis_or_of_no_thruster_is_refused(tmp_path, part, key, value):
    path = tmp_path / "mended.param"
    data = dataclasses.asdict(FORETOLD)
    data[part][0][key] = value
    path.with_name("mended.param.json").write_text(json.dumps(data), encoding="utf-8")
    with pytest.raises(ParamRejected, match=f"{part}: "):
        read_sidecar(path)


def test_a_roll_back_is_about_what_its_upload_and_later_ones_that_stand_wrote(receipts):
    receipts.keep(FF1_M_W=1.0)
    first = receipts.keep(FF1_M_U=100.0)
    second = receipts.keep(FF1_D_U=45.0)
    receipts.keep(Outcome.ROLLED_BACK, FS_GCS_ENABLE=1.0)
    assert written_since(receipts.path, 1, first) == {"FF1_M_U", "FF1_D_U"}
    receipts.keep(restores=str(second), FF1_D_U=1.0)
    assert written_since(receipts.path, 1, first) == {"FF1_M_U"}
    receipts.keep(Outcome.BEGUN, FF1_M_V=7.0)
    assert written_since(receipts.path, 1, first) == {"FF1_M_U", "FF1_M_V"}


def test_lines_that_an_upload_found_to_be_so_already_are_not_its_own(receipts):
    before = receipts.keep(Outcome.SAME, FS_GCS_ENABLE=2.0)
    assert written_since(receipts.path, 1, before) == set()


def test_the_receipt_beside_a_file_tells_in_any_folder_and_none_tells_nothing(receipts, tmp_path):
    before = receipts.keep(FF1_M_U=100.0)
    assert written_since(tmp_path / "elsewhere", 1, before) == {"FF1_M_U"}
    assert written_since(receipts.path, 1, tmp_path / "of_yesterday.param") is None


def test_an_upload_makes_its_folder_and_those_above_it(tmp_path):
    plan = make_plan({"FF1_M_U": 104.0}, {"FF1_M_U": 100.0})
    begun = begin(plan, (1, 1), tmp_path / "dives" / "receipts" / "a-before.param", None, 0.0)
    assert begun.preimage.read_text().endswith("FF1_M_U,100\n")


def test_an_upload_takes_no_file_that_another_has_just_claimed(tmp_path):
    plan, claimed = make_plan({"FF1_M_U": 104.0}, {"FF1_M_U": 100.0}), tmp_path / "a-before.param"
    claimed.touch()
    names = [begin(plan, (1, 1), claimed, None, 0.0).preimage.name for _ in range(2)]
    assert names == ["a-2-before.param", "a-3-before.param"]
    assert claimed.read_text() == ""
