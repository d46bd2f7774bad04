"""What Parameters says after a writing is so then, and with nothing left to take back its table stays."""

import pytest
from made_parameters import BEFORE, FakeVehicle, plan, receipt, rows
from parameters_shown import done, line_of, on_screen, typed
from screen_text import text

from gcs_plugin.params.last_accepted import keep_accepted
from gcs_plugin.params.plan import make_plan
from gcs_plugin.params.receipt import begin, finish, new_preimage
from gcs_plugin.params.transfer import Outcome, Result
from gcs_plugin.params.upload import Ending

NONE_LEFT = "no upload to this vehicle that stands is kept here"
UNIX_S = 1_795_165_923.0


class NothingLeft(FakeVehicle):
    """Its roll back has no upload to take back."""

    async def __call__(self, words, hear):
        found = await super().__call__(words, hear)
        if words[1] != "rollback":
            return found
        said = (
            "receipts: no upload to vehicle 1 that stands is kept there; give the -before.param to go back to"
        )
        return type(found)(2, None, errors=(said,), error_names=("NothingLeft",))


def is_back_at_the_file(app):
    shown = text(app)
    assert "ROLL BACK" not in shown
    assert "FF1_M_U" in shown
    assert "type" not in shown


def test_with_nothing_left_to_take_back_the_table_stays_with_the_sentence_and_no_file_is_asked_for():
    async def work(app, pilot):
        await typed(app, pilot, "r")
        await done(app, pilot)
        is_back_at_the_file(app)
        shown = " ".join(text(app).split())
        assert f"{NONE_LEFT}: there is nothing to take back" in shown
        assert "before.param" not in shown
        await typed(app, pilot, "u")
        assert "type 7 and Enter" in " ".join(text(app).split())

    on_screen(NothingLeft(), work)


@pytest.mark.parametrize("keys", [(), ("escape",)])
def test_where_the_vehicle_holds_the_values_before_already_no_empty_roll_back_is_left(keys):
    same = [{**one, "verdict": "same"} for one in rows()]

    async def work(app, pilot):
        await typed(app, pilot, "r", *keys)
        await done(app, pilot)
        is_back_at_the_file(app)
        assert "already: there is nothing to take back" in " ".join(text(app).split())

    on_screen(FakeVehicle(back=plan(file=str(BEFORE), parameters=same)), work)


def test_after_an_upload_the_title_says_what_was_done_and_no_values_before_are_named_where_none_differ():
    staged = [{**one, "present": one["target"], "verdict": "staged", "change": 0.0} for one in rows()]
    written = receipt(sentence="8 staged parameters read back, set 8205 is active")
    written["parameters"] = [{**line, "before": line["target"]} for line in written["parameters"]]
    held = FakeVehicle(plan(parameters=staged, active_crc=0.0, staged_crc=8205), written=written)

    async def work(app, pilot):
        assert "8 staged" in text(app)
        await typed(app, pilot, "u", "8", "enter")
        assert "✓ applied: 8 staged parameters read back" in text(app)
        assert "8 put in force" in text(app)
        assert "8 staged" not in text(app).replace("8 staged parameters", "")
        assert "values before" not in text(app)

    on_screen(held, work)


def test_after_an_upload_that_changes_values_the_title_says_so_and_the_values_before_are_named():
    async def work(app, pilot):
        assert "7 of 7 chosen" in text(app)
        await typed(app, pilot, "u", "7", "enter")
        assert "7 written" in text(app)
        assert "values before: receipts/2026-11-21T085300Z-before.param" in text(app)

    on_screen(FakeVehicle(), work)


def test_after_a_roll_back_last_accepted_is_what_stands_then(tmp_path):
    made = make_plan({"FF1_M_U": 101.25}, {"FF1_M_U": 90.0})
    begun = begin(made, (1, 1), new_preimage(tmp_path, UNIX_S), None, UNIX_S)
    results = {"FF1_M_U": Result(Outcome.APPLIED, "", 101.25)}
    keep_accepted(finish(begun, made, Ending(Outcome.APPLIED, "", results), 1.0), None, True)

    async def work(app, pilot):
        assert "101.25" not in text(app)
        await typed(app, pilot, "r", "7", "enter")
        assert "✓ applied" in text(app)
        assert line_of(app, "FF1_M_U").count("101.25") == 1
        assert line_of(app, "FF1_I_R").partition("✓")[0].split()[-3:] == ["--"] * 3, "nothing of it stands"
        assert "last accepted 101.25 kg (2026-11-20 09:12 UTC)" in " ".join(text(app).split())

    on_screen(FakeVehicle(), work, receipts=tmp_path)
