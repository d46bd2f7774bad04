"""Two uploads at once: of one vehicle the second is refused in words, of two both go, and no file is written twice."""

import pytest
from lossy_vehicle import SOURCE, LossyVehicle, crc_of

from bridge.errors import ParamRejected
from bridge.parameters import ACTIVE
from gcs_plugin.params.deadline import Timing
from gcs_plugin.params.plan import make_plan
from gcs_plugin.params.receipt import NONE_YET, Turn, begin, new_preimage, newest
from gcs_plugin.params.transfer import Outcome
from gcs_plugin.params.upload import Stage, Upload

UNIX_S = 1_795_000_000.0
OLD = {"FF0_M_U": 80.0, "FF0_D_U": 40.0, "FF0_M_V": 90.0}


def begun(folder, system):
    plan = make_plan({"FF0_M_U": 81.0}, OLD)
    return begin(plan, (system, 1), new_preimage(folder, UNIX_S), None, UNIX_S)


def test_an_upload_of_the_same_second_gets_the_next_number_and_leaves_the_other_s_files_as_they_were(
    tmp_path,
):
    one, other, third = (begun(tmp_path, system) for system in (1, 2, 1))
    names = [receipt.preimage.name.partition("Z")[2] for receipt in (one, other, third)]
    assert names == ["-before.param", "-2-before.param", "-3-before.param"]
    assert "# Onboard parameters for Vehicle 1" in one.preimage.read_text(encoding="utf-8")
    assert "# Onboard parameters for Vehicle 2" in other.preimage.read_text(encoding="utf-8")
    assert len(list(tmp_path.glob("*-receipt.json"))) == 3


def test_a_name_whose_receipt_is_there_is_taken_although_its_pre_image_was_deleted(tmp_path):
    begun(tmp_path, 1).preimage.unlink()
    assert begun(tmp_path, 1).preimage.name.endswith("Z-2-before.param")


def test_while_a_vehicle_is_written_to_another_upload_to_it_is_refused_and_one_to_another_vehicle_goes(
    tmp_path,
):
    with Turn(tmp_path / "receipts", 1):
        with pytest.raises(
            ParamRejected, match="to vehicle 1 is under way: nothing was sent; wait for its end"
        ):
            Turn(tmp_path / "receipts", 1)
        with Turn(tmp_path / "receipts", 2):
            begun(tmp_path / "receipts", 2)
    with Turn(tmp_path / "receipts", 1, NONE_YET):
        assert newest(tmp_path / "receipts", 1) == NONE_YET


def test_what_was_read_before_another_program_s_upload_is_not_written_upon(tmp_path):
    read_at = newest(tmp_path, 1)
    begun(tmp_path, 2)
    with Turn(tmp_path, 1, read_at):
        begun(tmp_path, 1)
    with pytest.raises(
        ParamRejected, match="another program wrote to vehicle 1 since it was read: nothing was sent"
    ):
        Turn(tmp_path, 1, read_at)
    with Turn(tmp_path, 1, newest(tmp_path, 1)):
        assert newest(tmp_path, 1) == (2, "begun")


def test_where_files_can_t_be_locked_everybody_has_the_turn(tmp_path, monkeypatch):
    def unable(*_):
        raise OSError(95, "Operation not supported")

    monkeypatch.setattr("gcs_plugin.locks.fcntl.flock", unable)
    with Turn(tmp_path, 1), Turn(tmp_path, 1):
        assert begun(tmp_path, 1).number == 1


def upload_beside(another_flies):
    """The ending of an upload beside which a program puts that set in force, with the vehicle."""
    vehicle = LossyVehicle(OLD)
    plan = make_plan({"FF0_M_U": 81.0}, vehicle.values)
    upload = Upload(plan, SOURCE, 0.0, Timing(deadline_s=60.0), crc_of)
    assert vehicle.run(
        upload, lambda: upload.stage is Stage.STAGE and vehicle.values["FF0_M_U"] == 81.0, 100.0
    )
    vehicle.flying, vehicle.values[ACTIVE] = another_flies, float(crc_of(another_flies))
    assert vehicle.run(upload, lambda: upload.ending is not None, 200.0)
    return upload.ending, vehicle


def test_a_set_that_another_program_put_in_force_meanwhile_is_not_committed_over():
    theirs = OLD | {"FF0_M_V": 95.0}
    ending, vehicle = upload_beside(theirs)
    assert ending.outcome is Outcome.ROLLED_BACK
    assert ending.sentence.startswith(
        "another program changed which set the vehicle flies since it was read; "
    )
    assert vehicle.flying == theirs


def test_the_same_set_put_in_force_by_another_program_meanwhile_is_no_hindrance():
    ours = OLD | {"FF0_M_U": 81.0}
    ending, vehicle = upload_beside(ours)
    assert (ending.outcome, vehicle.flying) == (Outcome.APPLIED, ours)


def test_stopped_between_the_last_read_back_and_the_commit_nothing_is_committed():
    vehicle = LossyVehicle(OLD)
    upload = Upload(
        make_plan({"FF0_M_U": 81.0}, vehicle.values), SOURCE, 0.0, Timing(deadline_s=60.0), crc_of
    )
    all_read_back = lambda: upload.stage is Stage.STAGE and upload.progress == (3, 4)  # noqa: E731
    assert vehicle.run(upload, all_read_back, 100.0)
    upload.abort("the vehicle was armed during the upload", vehicle.now_s)
    assert vehicle.run(upload, lambda: upload.ending is not None, 200.0)
    assert (upload.ending.outcome, vehicle.flying) == (Outcome.ROLLED_BACK, OLD)
    assert {name: vehicle.values[name] for name in OLD} == OLD
