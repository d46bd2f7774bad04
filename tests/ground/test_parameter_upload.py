"""An upload as a whole: the old set or the new flies, and of two uploads at once one waits its turn."""

from contextlib import closing

import pytest
from fakes.parameters_over_a_link import SOURCE, Reached, flown, is_told_as_it_is
from soak import rest_in_soak

from bridge.errors import ParamError, ParamRejected
from bridge.vehicle.parameters import COMMIT, set_crc
from gcs_plugin.params.plan import make_plan
from gcs_plugin.params.receipt import NONE_YET, Turn, begin, new_preimage, newest
from gcs_plugin.params.transfer import Outcome, SetValue
from gcs_plugin.params.upload import Stage, Upload

BAD_LINK = {"loss": 0.3, "duplicate": 0.2, "jitter_s": 0.2}
OLD = {f"FF{c}_{kind}_{dof}": 10.0 + c for c in (0, 1) for kind in "MD" for dof in "UVW"} | {"FF_MODE": 2.0}
TARGETS = {"FF0_M_U": 24.5, "FF0_M_V": 40.5, "FF0_D_U": 42.25, "FF_MODE": 3.0}


def upload_to(vehicle, targets=TARGETS, act=None, present=None):
    upload = Upload(make_plan(targets, present or vehicle.values), SOURCE, 0.0)
    assert vehicle.run(upload, lambda: upload.ending is not None or (act and act(upload, vehicle)), 2000.0)
    assert vehicle.run(upload, lambda: upload.ending is not None, 2000.0)
    vehicle.settle(upload)
    return upload.ending


NEW = OLD | TARGETS


def is_old(vehicle):
    return {n: vehicle.values[n] for n in OLD} == OLD and vehicle.flying() == flown(OLD)


def test_a_vehicle_that_takes_nothing_from_here_ends_an_upload_soon_and_nothing_is_called_rolled_back():
    vehicle = Reached(OLD, bound=True)
    ending = upload_to(vehicle)
    assert is_old(vehicle)
    assert ending.outcome is Outcome.REFUSED
    assert ending.sentence.endswith(
        "the vehicle does not permit it; it may take orders from another ground alone; "
        "the vehicle took none of the values that were sent"
    )
    assert {ending.results[name].outcome for name in TARGETS if name != "FF_MODE"} == {Outcome.REFUSED}
    assert vehicle.now_s < 20.0


def test_a_vehicle_that_can_not_keep_a_set_is_to_be_looked_at_for_its_disk(monkeypatch):
    vehicle = Reached(OLD)

    def full(*_):
        raise ParamError("disk full")

    monkeypatch.setattr(vehicle.server._memory, "save", full)
    ending = upload_to(vehicle)
    assert is_old(vehicle)
    assert ending.outcome is Outcome.ROLLED_BACK
    assert "refused: the vehicle does not take it: its disk can't be written" in ending.sentence


def forced_off(stage, ordered):
    """What another program does: it orders OFF once, in a stage of the upload."""

    def act(upload, vehicle):
        if upload.stage is stage and not ordered:
            ordered.append(vehicle.now_s)
            vehicle.server.write("FF_MODE", 0.0, False)
            upload.overrule(vehicle.now_s)

    return act


@pytest.mark.parametrize("stage", [Stage.STAGE, Stage.COMMIT, Stage.LIVE])
@pytest.mark.parametrize("faults", [{}, BAD_LINK])
@pytest.mark.parametrize("seed", rest_in_soak(range(10), keep=3))
def test_an_off_of_another_in_the_middle_is_raised_by_nothing_that_an_upload_writes(seed, faults, stage):
    vehicle = Reached(OLD, seed, **faults)
    ordered = []

    ending = upload_to(vehicle, act=forced_off(stage, ordered))
    assert ordered
    assert vehicle.values["FF_MODE"] == 0.0
    assert ending.outcome in (Outcome.ROLLED_BACK, Outcome.UNVERIFIED)
    assert ending.sentence.startswith("OFF was ordered meanwhile and wins: FF_MODE is not raised")
    assert {n: v for n, v in vehicle.values.items() if n in flown(OLD)} == flown(OLD)


@pytest.mark.parametrize("faults", [{}, BAD_LINK])
@pytest.mark.parametrize("seed", rest_in_soak(range(10), keep=3))
def test_an_off_of_another_while_an_upload_is_taken_back_is_undone_by_no_mode_from_before(
    seed, faults, monkeypatch
):
    vehicle, ordered = Reached(OLD, seed, **faults), []
    set_mode = vehicle.server._set_mode
    monkeypatch.setattr(
        vehicle.server, "_set_mode", lambda value, armed: 3 if value == 3.0 else set_mode(value, armed)
    )

    ending = upload_to(vehicle, act=forced_off(Stage.UNDO, ordered))
    assert ordered
    assert vehicle.values["FF_MODE"] == 0.0
    assert ending.outcome in (Outcome.ROLLED_BACK, Outcome.UNVERIFIED)
    assert vehicle.flying() == flown(OLD)
    is_told = ending.sentence.endswith("as it was, but for FF_MODE: OFF was ordered meanwhile and wins")
    assert is_told == (ending.outcome is Outcome.ROLLED_BACK)


def test_an_upload_of_the_mode_alone_that_an_off_overrules_says_so_and_sends_nothing():
    vehicle = Reached(OLD)
    ending = upload_to(vehicle, {"FF_MODE": 3.0}, act=lambda upload, vehicle: upload.overrule(vehicle.now_s))
    assert (ending.outcome, vehicle.values["FF_MODE"]) == (Outcome.NOT_SENT, 2.0)
    assert ending.sentence == "OFF was ordered meanwhile and wins: FF_MODE is not raised; nothing was written"


def test_the_mode_is_switched_only_after_the_commit():
    vehicle = Reached(OLD)
    seen = []

    def watch(_, vehicle):
        seen.append((vehicle.values["FF_MODE"], vehicle.flying()["FF0_M_U"]))
        return False

    upload_to(vehicle, act=watch)
    assert (3.0, 10.0) not in seen
    assert seen[-1] == (3.0, 24.5)


def test_what_is_so_already_is_not_written_and_what_was_staged_and_never_committed_is_committed():
    vehicle = Reached(OLD)
    assert upload_to(vehicle, {"FF0_M_U": 10.0}).outcome is Outcome.SAME
    assert vehicle.sends == 0
    vehicle.server.write("FF0_M_U", 24.5, False)
    assert upload_to(vehicle, {"FF0_M_U": 24.5}).outcome is Outcome.APPLIED
    assert vehicle.flying()["FF0_M_U"] == 24.5


@pytest.mark.parametrize("seed", rest_in_soak(range(10), keep=3))
@pytest.mark.parametrize(
    "fault",
    [{"refuses": {"FF0_M_V"}}, {"stores": {"FF0_D_U": 0.5}}, {"refuses": {"FF_MODE"}}, {"armed": True}],
    ids=lambda fault: next(iter(fault)) + str(next(iter(fault.values()))),
)
def test_one_refusal_takes_everything_back(seed, fault):
    vehicle = Reached(OLD, seed, **BAD_LINK, **fault, errors=bool(seed % 2))
    ending = upload_to(vehicle)
    assert ending.outcome in (Outcome.ROLLED_BACK, Outcome.UNVERIFIED)
    assert Outcome.APPLIED not in {r.outcome for r in ending.results.values()}
    is_told_as_it_is(vehicle, ending, OLD, NEW)
    if "stores" not in fault:
        assert ending.outcome is Outcome.ROLLED_BACK


@pytest.mark.parametrize("seed", rest_in_soak(range(10), keep=3))
def test_a_refusal_behind_the_first_commit_leaves_no_set_in_force_as_before(seed):
    vehicle = Reached(OLD, seed, **BAD_LINK, refuses={"FF_MODE"})
    assert vehicle.server.write("FF_COMMIT", 0.0, False) is None
    ending = upload_to(vehicle)
    assert (ending.outcome, vehicle.server.active_crc) == (Outcome.ROLLED_BACK, 0)
    assert ending.sentence.endswith("every value that was written is back as it was")


@pytest.mark.parametrize("stage", [Stage.STAGE, Stage.COMMIT, Stage.LIVE])
@pytest.mark.parametrize("seed", rest_in_soak(range(8), keep=2))
def test_a_vehicle_armed_in_any_stage_has_the_old_set_or_all_of_the_new(stage, seed):
    vehicle = Reached(OLD, seed, jitter_s=0.1)
    vehicle.server.unproven = lambda: ""

    def arm(upload, vehicle):
        if upload.stage is not stage or not vehicle.sets:
            return False
        vehicle.armed = True
        upload.abort("the vehicle was armed", vehicle.now_s)
        return True

    ending = upload_to(vehicle, act=arm)
    is_told_as_it_is(vehicle, ending, OLD, NEW)
    assert ending.outcome is (Outcome.APPLIED if stage is Stage.LIVE else Outcome.ROLLED_BACK)
    if stage is Stage.STAGE:
        assert "the vehicle was armed" in ending.sentence


def test_a_commit_that_nobody_answered_is_said_with_the_number_to_look_for():
    vehicle = Reached(OLD)

    def cut(_, vehicle):
        if vehicle.flying() == flown(NEW):
            vehicle.cut()
        return vehicle.link.incoming.cut

    ending = upload_to(vehicle, act=cut)
    assert ending.outcome is Outcome.UNVERIFIED
    assert f"if FF_ACTIVE reads {set_crc(flown(NEW))}" in ending.sentence
    assert {r.outcome for n, r in ending.results.items() if n != "FF_MODE"} == {Outcome.UNVERIFIED}
    assert ending.results["FF_MODE"].outcome is Outcome.NOT_SENT


def test_a_vehicle_that_starts_anew_at_every_commit_ends_at_the_deadline():
    vehicle = Reached(OLD, 1, jitter_s=0.1)
    upload = Upload(make_plan(TARGETS, vehicle.values), SOURCE, 0.0)

    def ended():
        if upload.stage is Stage.COMMIT:
            upload.on_reboot(vehicle.now_s)
        return upload.ending is not None

    assert vehicle.run(upload, ended, 90.0)
    is_told_as_it_is(vehicle, upload.ending, OLD, NEW)


@pytest.mark.parametrize("seed", rest_in_soak(range(20), keep=4))
def test_a_vehicle_without_commit_is_written_directly_and_taken_back_directly(seed):
    values = {"SERVO1_MIN": 1100.0, "SERVO1_MAX": 1900.0, "SERVO1_TRIM": 1500.0}
    targets = {"SERVO1_MIN": 1000.0, "SERVO1_MAX": 2000.0}
    good = Reached(values, seed, **BAD_LINK)
    assert upload_to(good, targets, present=values).outcome is Outcome.APPLIED
    assert {name: good.values[name] for name in values} == values | targets
    stubborn = Reached(values, seed, **BAD_LINK, refuses={"SERVO1_MAX"})
    ending = upload_to(stubborn, targets, present=values)
    assert ending.outcome is Outcome.ROLLED_BACK
    assert {name: stubborn.values[name] for name in values} == values
    assert ending.results["SERVO1_MAX"].outcome is Outcome.REFUSED


@pytest.mark.parametrize(
    ("left_out", "stage", "says"),
    [((), Stage.STAGE, True), ((), Stage.LIVE, False), (("FF_COMMIT", "FF_ACTIVE"), Stage.STAGE, False)],
    ids=["before a commit", "after it", "without commits"],
)
def test_a_roll_back_that_nobody_answers_says_that_what_flies_was_not_changed_where_that_is_so(
    left_out, stage, says
):
    vehicle, cut = Reached(OLD), []
    present = {name: value for name, value in vehicle.values.items() if name not in left_out}

    def lost(upload, vehicle):
        if upload.stage is stage and vehicle.sets:
            vehicle.cut()
            cut.append(upload.stage)
        return cut

    ending = upload_to(vehicle, act=lost, present=present)
    assert (cut, ending.outcome) == ([stage], Outcome.UNVERIFIED)
    assert ("; what it flies was not changed; connect again" in ending.sentence) is says
    assert ending.sentence.endswith("connect again and roll back to the values before")


def test_what_was_written_is_taken_back_once_no_write_can_be_under_way_and_given_up_after_twenty_seconds():
    upload = Upload(make_plan({"A": 2.0, "B": 3.0}, {"A": 0.5, "B": 1.5}), SOURCE, 5.0)
    assert upload.tick(5.0) == [SetValue("A", 2.0), SetValue("B", 3.0)]
    upload.abort("stopped", 6.0)
    assert (upload.stage, upload.tick(15.9)) == (Stage.UNDO, [])
    assert upload.tick(16.0) == [SetValue("A", 0.5), SetValue("B", 1.5)]
    upload.tick(35.9)
    assert upload.ending is None
    upload.tick(36.0)
    assert upload.ending.outcome is Outcome.UNVERIFIED
    assert upload.ending.sentence.startswith(
        "stopped; and the roll back failed: the vehicle has answered nothing"
    )


def test_what_is_done_only_grows_through_the_stages_and_ends_whole():
    vehicle, steps = Reached(OLD), []
    upload = Upload(make_plan(TARGETS, vehicle.values), SOURCE, 0.0)

    def note():
        steps.append((upload.stage, upload.progress))
        return upload.ending is not None

    assert vehicle.run(upload, note)
    assert [item[1][0] for item in steps] == sorted(item[1][0] for item in steps)
    # Twelve of the set, the commit, and the mode.
    assert {item[1][1] for item in steps} == {14}
    first_of = {
        stage: next(done for at, done in steps if at is stage) for stage in (Stage.COMMIT, Stage.LIVE)
    }
    assert first_of == {Stage.COMMIT: (12, 14), Stage.LIVE: (13, 14)}
    assert steps[-1] == (Stage.DONE, (14, 14))


UNIX_S = 1_795_000_000.0
BEFORE = {"FF0_M_U": 80.0, "FF0_D_U": 40.0, "FF0_M_V": 90.0}


def begun(folder, system):
    plan = make_plan({"FF0_M_U": 81.0}, BEFORE)
    return begin(plan, (system, 1), new_preimage(folder, UNIX_S), None, UNIX_S)


def test_an_upload_of_the_same_second_gets_the_next_number_and_leaves_the_other_s_files_as_they_were(
    tmp_path,
):
    first, other, third = (begun(tmp_path, system) for system in (1, 2, 1))
    names = [receipt.preimage.name.partition("Z")[2] for receipt in (first, other, third)]
    assert names == ["-before.param", "-2-before.param", "-3-before.param"]
    assert "# Onboard parameters for Vehicle 1" in first.preimage.read_text(encoding="utf-8")
    assert "# Onboard parameters for Vehicle 2" in other.preimage.read_text(encoding="utf-8")
    assert len(list(tmp_path.glob("*-receipt.json"))) == 3
    third.preimage.unlink()
    assert begun(tmp_path, 1).preimage.name.endswith("Z-4-before.param"), "its receipt is still there"


def test_while_a_vehicle_is_written_to_another_upload_to_it_is_refused_and_one_to_another_vehicle_goes(
    tmp_path,
):
    with closing(Turn(tmp_path / "receipts", 1)):
        with pytest.raises(
            ParamRejected, match="to vehicle 1 is under way: nothing was sent; wait for its end"
        ):
            Turn(tmp_path / "receipts", 1)
        with closing(Turn(tmp_path / "receipts", 2)):
            begun(tmp_path / "receipts", 2)
    with closing(Turn(tmp_path / "receipts", 1, NONE_YET)):
        assert newest(tmp_path / "receipts", 1) == NONE_YET


def test_what_was_read_before_another_program_s_upload_is_not_written_upon(tmp_path):
    read_at = newest(tmp_path, 1)
    begun(tmp_path, 2)
    with closing(Turn(tmp_path, 1, read_at)):
        begun(tmp_path, 1)
    with pytest.raises(
        ParamRejected, match="another program wrote to vehicle 1 since it was read: nothing was sent"
    ):
        Turn(tmp_path, 1, read_at)
    with closing(Turn(tmp_path, 1, newest(tmp_path, 1))):
        assert newest(tmp_path, 1) == (2, Outcome.BEGUN)


def test_where_files_can_t_be_locked_everybody_has_the_turn(tmp_path, monkeypatch):
    def unable(*_):
        raise OSError(95, "Operation not supported")

    monkeypatch.setattr("bridge.locks.fcntl.flock", unable)
    with closing(Turn(tmp_path, 1)), closing(Turn(tmp_path, 1)):
        assert begun(tmp_path, 1).number == 1


@pytest.mark.parametrize(
    ("flies", "outcome"), [({"FF0_M_V": 95.0}, Outcome.ROLLED_BACK), ({"FF0_M_U": 81.0}, Outcome.APPLIED)]
)
def test_a_set_that_another_program_put_in_force_meanwhile_is_not_committed_over_if_it_is_another(
    flies, outcome
):
    theirs = BEFORE | {"FF0_M_U": 81.0} | flies
    vehicle = Reached(BEFORE)
    upload = Upload(make_plan({"FF0_M_U": 81.0}, vehicle.values), SOURCE, 0.0)
    assert vehicle.run(
        upload, lambda: upload.stage is Stage.STAGE and vehicle.values["FF0_M_U"] == 81.0, 100.0
    )
    for name, value in (flies | {COMMIT: set_crc(theirs)}).items():
        vehicle.server.write(name, value, False)
    assert vehicle.run(upload, lambda: upload.ending is not None, 200.0)
    assert (upload.ending.outcome, vehicle.flying()) == (outcome, theirs)
    if outcome is Outcome.ROLLED_BACK:
        assert upload.ending.sentence.startswith("another program changed which set the vehicle flies")


def test_stopped_between_the_last_read_back_and_the_commit_nothing_is_committed():
    vehicle = Reached(BEFORE)
    upload = Upload(make_plan({"FF0_M_U": 81.0}, vehicle.values), SOURCE, 0.0)
    all_read_back = lambda: upload.stage is Stage.STAGE and upload.progress == (3, 4)  # noqa: E731
    assert vehicle.run(upload, all_read_back, 100.0)
    upload.abort("the vehicle was armed during the upload", vehicle.now_s)
    assert vehicle.run(upload, lambda: upload.ending is not None, 200.0)
    assert (upload.ending.outcome, vehicle.flying()) == (Outcome.ROLLED_BACK, BEFORE)
    assert {name: vehicle.values[name] for name in BEFORE} == BEFORE


def test_a_silence_is_counted_from_the_vehicles_last_answer_of_any_kind_and_from_no_other_component():
    upload = Upload(make_plan(TARGETS, Reached(OLD).values), SOURCE, 1.0)
    assert upload.unanswered_s(4.0) == 3.0
    upload.on_value("ELSE", 1.0, SOURCE, 5.0)
    upload.on_value("ELSE", 1.0, (1, 1), 6.0)
    assert upload.unanswered_s(8.0) == 3.0
    upload.on_error("ELSE", 1, SOURCE, 9.0)
    assert upload.unanswered_s(10.0) == 1.0


@pytest.mark.parametrize(("others", "within"), [(14, "84 s"), (15, "88 s")])
def test_an_upload_that_is_answered_all_else_has_the_time_that_its_set_and_its_commit_may_take(
    others, within
):
    values = {f"FF{c}_{kind}_{dof}": 10.0 for c in range(3) for kind in "MD" for dof in "UVW"}
    held = dict(list(values.items())[: others + 1]) | {"FF_ACTIVE": 0.0, "FF_COMMIT": 0.0}
    upload, now_s = Upload(make_plan({"FF0_M_U": 11.0}, held), SOURCE, 0.0), 0.0
    while upload.ending is None:
        now_s += 0.5
        upload.tick(now_s)
        upload.on_value("ELSE", 1.0, SOURCE, now_s)
    assert f"FF0_M_U was not read back as 11 within {within}" in upload.ending.sentence


@pytest.mark.parametrize("stage", [Stage.COMMIT, Stage.LIVE])
def test_a_vehicle_that_started_anew_after_the_commit_has_its_old_set_in_force_again_if_the_rest_fails(stage):
    vehicle = Reached(OLD)
    upload = Upload(make_plan(TARGETS, vehicle.values), SOURCE, 0.0)
    assert vehicle.run(upload, lambda: upload.stage is stage and vehicle.flying() == flown(NEW), 60.0)
    upload.on_reboot(vehicle.now_s)
    upload.abort("the vehicle was armed", vehicle.now_s)
    assert vehicle.run(upload, lambda: upload.ending is not None, 200.0)
    assert upload.ending.outcome is Outcome.ROLLED_BACK
    assert is_old(vehicle)


@pytest.mark.parametrize("forgets", [True, False])
def test_a_vehicle_that_starts_anew_before_the_old_set_is_committed_again_has_it_in_force_in_the_end(forgets):
    vehicle = Reached(OLD, refuses={"FF_MODE"})

    def starts_anew(upload, vehicle):
        if upload.stage is not Stage.UNDO_COMMIT:
            return False
        vehicle.restart(forgets=forgets)
        return True

    ending = upload_to(vehicle, act=starts_anew)
    assert ending.outcome is Outcome.ROLLED_BACK
    assert is_old(vehicle)


def test_a_vehicle_that_starts_anew_at_every_commit_of_the_old_set_ends_at_the_deadline():
    vehicle = Reached(OLD, refuses={"FF_MODE"})
    upload = Upload(make_plan(TARGETS, vehicle.values), SOURCE, 0.0)

    def starts_anew():
        if upload.stage is Stage.UNDO_COMMIT:
            vehicle.restart()
        return upload.ending is not None

    assert vehicle.run(upload, starts_anew, 200.0)
    assert upload.ending.outcome is Outcome.UNVERIFIED
