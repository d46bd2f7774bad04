"""The parameter client against the vehicle's own parameter server, over a link in simulated time."""

import json

import pytest
from fakes.vehicle import SMALL, FakeVehicle
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import LinkError, LinkTimeout, ParamRejected, ParamUnverified
from bridge.vehicle.mode import Mode
from bridge.vehicle.parameters import set_crc
from bridge.wire.framing import Encoder
from gcs_plugin.feedforward.off_orders import OffMarks
from gcs_plugin.feedforward.switch import Switch
from gcs_plugin.params.client import ParameterClient
from gcs_plugin.params.files import read_parameters
from gcs_plugin.params.plan import make_plan
from gcs_plugin.params.session import Order
from gcs_plugin.params.transfer import Outcome
from gcs_plugin.params.upload import Stage

TARGETS = {"FF0_M_U": 96.5, "FF0_D_U": 42.25, "FF1_I_R": 15.5, "FF_MODE": 3.0}
MESSAGES_A_READ = 4
STATION = Encoder(255, 230)


class SimulatedVehicle(FakeVehicle):
    """A small vehicle behind a link that brings few messages at a time."""

    name = "simulated:"

    def __init__(self, clock, store=None, component=1, autopilot=0):
        super().__init__(
            clock,
            (1, component),
            vehicle=SMALL,
            store=store,
            autopilot=autopilot,
            messages_a_read=MESSAGES_A_READ,
        )
        self.values_a_read = 10


def beat_of(system, component, kind, autopilot=8):
    encoder = Encoder(system, component)
    return lambda: encoder.encode(dialect.MAVLink_heartbeat_message(kind, autopilot, 0, 0, 4, 3))


@pytest.fixture
def vehicle(clock, tmp_path):
    return SimulatedVehicle(clock, tmp_path / "store.json")


@pytest.fixture
def client(vehicle, clock):
    return ParameterClient(vehicle, clock)


@pytest.fixture
def plan(client):
    return plan_of(client)


def truth(vehicle):
    return {name: vehicle.server.value(name) for name in vehicle.server.names}


def plan_of(client, targets=TARGETS):
    client.find_vehicle()
    return make_plan(targets, client.read_all())


def upload(client, tmp_path, targets=TARGETS, even_armed=False):
    return applied(client, tmp_path, plan_of(client, targets), even_armed)


def applied(client, tmp_path, plan, even_armed=False):
    return client.apply(Order(plan, tmp_path / "before.param", even_armed=even_armed))


def test_a_set_goes_into_the_vehicle_and_flies(client, vehicle, tmp_path):
    before = truth(vehicle)
    receipt = upload(client, tmp_path)
    assert receipt.outcome is Outcome.APPLIED
    assert receipt.good
    assert truth(vehicle) == before | TARGETS | {
        "FF_COMMIT": receipt.active_crc,
        "FF_ACTIVE": receipt.active_crc,
    }
    assert vehicle.server.active(0)["M_u"] == 96.5
    assert read_parameters(tmp_path / "before.param") == before
    data = json.loads(json.dumps(receipt.to_json(), allow_nan=False))
    assert data["outcome"] == "applied"
    assert data["parameters"][0] == {
        "name": "FF0_M_U",
        "unit": "kg",
        "before": 72.0,
        "target": 96.5,
        "after": 96.5,
        "outcome": "applied",
        "sentence": "FF0_M_U = 96.5",
    }


def test_the_values_before_lie_on_the_disk_before_anything_is_written(clock, tmp_path):
    at_first_write = []

    class Witness(SimulatedVehicle):
        def write(self, data):
            before = len(self.sets), truth(self)
            super().write(data)
            if self.sets and not before[0]:
                at_first_write.append((before[1], read_parameters(tmp_path / "before.param")))

    vehicle = Witness(clock, tmp_path / "store.json")
    assert upload(ParameterClient(vehicle, clock), tmp_path).good
    ((held, kept),) = at_first_write
    assert kept == held != truth(vehicle)


def test_the_pre_image_brings_everything_back(client, vehicle, tmp_path):
    before = truth(vehicle)
    upload(client, tmp_path)
    plan = make_plan(read_parameters(tmp_path / "before.param"), client.read_all())
    receipt = client.apply(Order(plan, tmp_path / "between.param"))
    assert receipt.good
    assert truth(vehicle) == before
    assert read_parameters(tmp_path / "between.param")["FF0_M_U"] == 96.5


def test_an_armed_vehicle_takes_no_set_that_is_to_fly_at_once_for_none_has_been_shadowed(
    client, vehicle, tmp_path
):
    before = truth(vehicle)
    vehicle.armed = True
    receipt = upload(client, tmp_path, even_armed=True)
    assert receipt.outcome is Outcome.ROLLED_BACK
    assert receipt.sentence.startswith("FF_MODE = 3 refused: the vehicle does not permit it now")
    assert truth(vehicle) == before


@pytest.mark.parametrize("mode", [2.0, 3.0])
def test_an_armed_vehicle_whose_feed_forward_acts_is_left_alone_whatever_is_said(
    client, vehicle, tmp_path, mode
):
    vehicle.server.write("FF_MODE", mode, armed=False)
    vehicle.armed = True
    with pytest.raises(ParamRejected, match="force the feed-forward off first; nothing was sent"):
        upload(client, tmp_path, {"FF0_M_U": 96.5}, even_armed=True)
    assert vehicle.sets == []


def test_one_whose_feed_forward_is_raised_meanwhile_refuses_the_commit_and_is_as_it_was(
    client, vehicle, tmp_path
):
    before = truth(vehicle) | {"FF_MODE": 3.0}
    vehicle.armed = True
    plan = plan_of(client)
    vehicle.server.write("FF_MODE", 3.0, armed=False)
    receipt = applied(client, tmp_path, plan, even_armed=True)
    assert receipt.outcome is Outcome.ROLLED_BACK
    assert truth(vehicle) == before


def test_an_armed_vehicle_may_change_its_mode(client, vehicle, tmp_path):
    vehicle.armed = True
    assert upload(client, tmp_path, {"FF_MODE": 1.0}).outcome is Outcome.APPLIED
    assert vehicle.server.mode == 1


@pytest.mark.parametrize("after_s", [0.1, 0.8, 1.6, 2.4])
def test_a_vehicle_armed_meanwhile_gets_its_values_back_or_has_them_all(
    client, vehicle, clock, tmp_path, after_s, plan
):
    before = truth(vehicle)
    vehicle.arms_at_s = clock.now_s + 1.0 + after_s
    receipt = applied(client, tmp_path, plan)
    assert receipt.outcome in (Outcome.APPLIED, Outcome.ROLLED_BACK)
    if receipt.good:
        assert {n: vehicle.server.value(n) for n in TARGETS} == TARGETS
    else:
        assert truth(vehicle) == before


def test_values_of_before_and_after_a_reboot_are_not_mixed_in_one_reading(client, vehicle, clock):
    clock.advance_to(clock.now_s + 10.0)
    client.find_vehicle()
    vehicle.server.write("FF0_M_U", 96.5, armed=False)
    vehicle.values_a_read = 1
    vehicle.reboots_at_s = clock.now_s + 0.2
    assert client.read_all()["FF0_M_U"] == 72.0


@pytest.mark.parametrize("after_s", [0.1, 1.0, 2.2, 3.4])
def test_a_reboot_at_any_moment_ends_with_the_whole_set(client, vehicle, clock, tmp_path, after_s, plan):
    vehicle.reboots_at_s = clock.now_s + after_s
    receipt = applied(client, tmp_path, plan)
    assert receipt.outcome is Outcome.APPLIED
    assert vehicle.server.active_crc == receipt.active_crc
    assert vehicle.server.active(0)["D_u"] == 42.25


@pytest.mark.parametrize("after_s", [0.05, 1.5, 2.5])
def test_a_cable_pulled_at_any_moment_is_said_and_the_upload_can_be_finished(
    client, vehicle, clock, tmp_path, after_s, plan
):
    vehicle.lost_at_s = clock.now_s + 1.0 + after_s
    receipt = applied(client, tmp_path, plan)
    if receipt.outcome is not Outcome.APPLIED:
        assert receipt.outcome in (Outcome.UNVERIFIED, Outcome.NOT_SENT)
        assert "the cable is out" in receipt.sentence
        assert Outcome.APPLIED not in {line.outcome for line in receipt.lines}
    vehicle.lost_at_s = float("inf")
    again = client.apply(Order(make_plan(TARGETS, client.read_all()), tmp_path / "again.param"))
    assert again.good
    assert vehicle.server.active_crc == set_crc(
        {n: vehicle.server.value(n) for n in vehicle.server.names[:-4]}
    )
    assert {n: vehicle.server.value(n) for n in TARGETS} == TARGETS


def test_a_pre_image_is_never_overwritten(client, vehicle, tmp_path):
    (tmp_path / "before.param").write_text("A,1\n")
    before = truth(vehicle)
    receipt = upload(client, tmp_path)
    assert (tmp_path / "before.param").read_text() == "A,1\n"
    assert receipt.preimage == tmp_path / "before-2.param"
    assert read_parameters(receipt.preimage) == before


def test_a_companion_is_chosen_before_its_autopilot_and_alone_written_to(clock, tmp_path):
    companion = SimulatedVehicle(clock, None, 191, 8)
    companion.others = [beat_of(1, 1, dialect.MAV_TYPE_SUBMARINE, 3), beat_of(255, 190, dialect.MAV_TYPE_GCS)]
    client = ParameterClient(companion, clock)
    assert client.find_vehicle() == (1, 191)
    assert client.thrusters == (1, 1)
    assert client.apply(Order(make_plan(TARGETS, client.read_all()), tmp_path / "b.param")).good
    assert {item.component for item in companion.sets} == {191}


def test_of_two_vehicles_one_must_be_named(client, vehicle):
    vehicle.others = [beat_of(2, 1, dialect.MAV_TYPE_SUBMARINE, 0)]
    with pytest.raises(
        LinkError, match=r"several vehicles beat \(systems 1, 2\) and none is chosen; name one"
    ):
        client.find_vehicle()
    assert client.find_vehicle(system=2) == (2, 1)


def test_a_vehicle_that_holds_back_its_parameters_is_said(client, vehicle):
    client.find_vehicle()
    vehicle.server.handle = lambda *_: []
    with pytest.raises(LinkTimeout, match="sent no parameter within 30 s"):
        client.read_all()


def test_a_list_with_a_hole_is_no_list(client, vehicle):
    client.find_vehicle()
    step = vehicle.server.step
    vehicle.server.step = lambda most: [m for m in step(most) if m.param_index != 3]
    vehicle.server._read = lambda *_: []
    with pytest.raises(ParamUnverified, match="1 of 68 parameters"):
        client.read_all()


def test_a_heart_that_stopped_stops_the_upload_before_it_begins(client, vehicle, tmp_path, plan):
    vehicle.beats = False
    vehicle.queue.clear()
    with pytest.raises(LinkTimeout, match="no HEARTBEAT"):
        applied(client, tmp_path, plan)
    assert vehicle.sets == []


def test_a_vehicle_that_beats_and_answers_nothing_is_given_up_with_the_cause(vehicle, clock, tmp_path):
    reports = []
    client = ParameterClient(vehicle, clock, progress=reports.append)
    plan = plan_of(client)
    begun_s, before = clock.now_s, truth(vehicle)
    vehicle.server.handle = lambda *_: []
    receipt = applied(client, tmp_path, plan)
    assert clock.now_s - begun_s < 55.0
    assert receipt.outcome is Outcome.UNVERIFIED
    assert receipt.sentence == (
        "the vehicle has answered nothing for 20 s: the link may carry one way only, or what keeps its parameters "
        "has stopped; nor did it answer the roll back; what it flies was not changed; connect again and roll back "
        "to the values before"
    )
    assert truth(vehicle) == before
    words = {progress.words for progress in reports}
    assert {f"staging, no answer for {n} s" for n in range(2, 20)} <= words
    assert "rolling back, no answer for 15 s" in words
    assert {Stage.STAGE, Stage.UNDO} <= {progress.stage for progress in reports}


@pytest.mark.parametrize("after_s", [0.1, 1.5, 2.5, 3.5])
def test_a_vehicle_that_goes_silent_is_given_up_soon_and_said(
    client, vehicle, clock, tmp_path, after_s, plan
):
    begun_s, read = clock.now_s, vehicle.read

    def fade(timeout_s):
        data = read(timeout_s)
        return data if clock.now_s < begun_s + 1.0 + after_s else b""

    vehicle.read = fade
    receipt = applied(client, tmp_path, plan)
    assert clock.now_s - begun_s < 1.0 + after_s + 13.0
    if receipt.outcome is not Outcome.APPLIED:
        assert receipt.outcome is Outcome.UNVERIFIED
        assert "went silent, nothing came from it for 12 s" in receipt.sentence
        assert "roll back to the values before" in receipt.sentence


def test_two_vehicles_with_one_id_are_not_even_read(client, vehicle, tmp_path, plan):
    vehicle.contested = frozenset(((1, 1),))
    for ask in (
        client.find_vehicle,
        client.read_all,
        lambda: applied(client, tmp_path, plan),
    ):
        with pytest.raises(LinkError, match="two vehicles beat as system 1, component 1"):
            ask()
    assert vehicle.sets == []
    assert not (tmp_path / "before.param").exists()


def test_a_second_vehicle_that_comes_on_during_an_upload_ends_it_without_another_write(
    client, vehicle, clock, tmp_path, plan
):
    flying = vehicle.server.active_crc
    twin = SimulatedVehicle(clock)
    twin.booted_s = clock.now_s - 500.0
    twin.next_beat_s = clock.now_s + 0.3
    write, read = vehicle.write, vehicle.read
    vehicle.write = lambda data: (write(data), twin.write(data))
    vehicle.read = lambda timeout_s: read(timeout_s) + twin.read(0.0)
    vehicle.server.write = lambda *_, **__: None
    begun_s = clock.now_s
    receipt = applied(client, tmp_path, plan)
    assert clock.now_s - begun_s < 6.0
    assert "two vehicles beat as system 1" in receipt.sentence
    assert "staged and none of them flies" in receipt.sentence
    assert receipt.outcome is Outcome.UNVERIFIED
    assert vehicle.server.active_crc == flying
    sent = len(vehicle.sets)
    for _ in range(100):
        vehicle.read(0.05)
    assert len(vehicle.sets) == sent


def to_first_write(client, vehicle, tmp_path, targets=TARGETS):
    """A session driven until its first write is sent; `go_on` drives it to its end."""
    plan = plan_of(client, targets)
    session = client.session
    session.write(Order(plan, tmp_path / "before.param"))

    def step():
        for message in session.tick():
            vehicle.write(STATION.encode(message))
        for news in client._receive():
            session.on_news(news)

    def go_on():
        while session.busy:
            step()
        return session.receipt

    while not vehicle.sets:
        step()
    return session, go_on


def test_a_session_that_is_stopped_while_reading_ends_at_once_and_while_staging_rolls_back(
    client, vehicle, tmp_path
):
    before = truth(vehicle)
    client.find_vehicle()
    client.session.read()
    assert client.session.stop("stopped by the user")
    assert (client.session.busy, str(client.session.failure)) == (False, "stopped by the user")
    session, go_on = to_first_write(client, vehicle, tmp_path)
    assert session.stop("stopped by the user")
    assert go_on().outcome is Outcome.ROLLED_BACK
    assert truth(vehicle) == before


@pytest.mark.parametrize("ordered", ["before the upload", "during the upload"])
def test_off_that_was_ordered_since_the_vehicle_was_read_keeps_the_mode_down_and_takes_the_rest_back(
    client, vehicle, tmp_path, ordered
):
    targets, off = {"FF0_M_U": 96.5, "FF_MODE": 1.0}, Switch(Mode.OFF, 1)
    before = truth(vehicle)
    plan = plan_of(client, targets)
    if ordered == "before the upload":
        OffMarks().mark(off.tick(0.0))
        receipt = applied(client, tmp_path, plan)
    else:
        vehicle.sets.clear()
        _, go_on = to_first_write(client, vehicle, tmp_path, targets)
        OffMarks().mark(off.tick(0.0))
        receipt = go_on()
    assert receipt.outcome is Outcome.ROLLED_BACK
    assert receipt.sentence.startswith("OFF was ordered meanwhile and wins: FF_MODE is not raised")
    assert truth(vehicle) == before


def test_a_link_on_which_no_vehicle_beats_is_given_up_after_five_seconds(client, vehicle, clock):
    vehicle.beats, began_s = False, clock.now_s
    vehicle.queue.clear()
    with pytest.raises(LinkTimeout, match="HEARTBEAT within 5 s"):
        client.find_vehicle()
    assert 5.0 <= clock.now_s - began_s < 6.0
