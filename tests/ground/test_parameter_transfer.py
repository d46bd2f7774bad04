"""The transfer and the listing of parameters over a bad link: no answer is believed too early."""

import pytest
from fakes.parameters_over_a_link import SOURCE, Reached
from soak import rest_in_soak

from gcs_plugin.params.deadline import RoundTrips, deadline_s, retry_delay_s
from gcs_plugin.params.listing import Listing, ReadIndex, ReadList
from gcs_plugin.params.session import READ_WITHIN_S
from gcs_plugin.params.transfer import Outcome, ReadValue, SetValue, Transfer, confirm, write

BAD_LINK = {"loss": 0.3, "duplicate": 0.2, "jitter_s": 0.2}
HELD = dict.fromkeys([f"P_{n:02d}" for n in range(40)], 0.0)
NAMES = list(HELD)
TARGETS = {name: 1.5 + n for n, name in enumerate(NAMES)}
PATIENT_S = 120.0


def transfer_to(vehicle, targets=TARGETS, within_s=PATIENT_S):
    transfer = Transfer([write(n, v) for n, v in targets.items()], SOURCE, 0.0, within_s)
    assert vehicle.run(transfer, lambda: transfer.done)
    vehicle.settle(transfer)
    return transfer


def never_false(vehicle, transfer):
    for name, result in transfer.results.items():
        if result.outcome is Outcome.APPLIED:
            assert vehicle.values[name] == TARGETS[name]


@pytest.mark.parametrize("seed", rest_in_soak(range(30), keep=3))
def test_a_vehicle_that_echoes_one_value_and_stores_another_is_found_out(seed):
    vehicle = Reached(HELD, seed, **BAD_LINK, stores={"P_03": 127.0, "P_20": 0.0}, coalesces=True)
    transfer = transfer_to(vehicle, within_s=300.0)
    never_false(vehicle, transfer)
    assert {n for n, r in transfer.results.items() if r.outcome is not Outcome.APPLIED} == {"P_03", "P_20"}
    assert transfer.results["P_03"].sentence == "P_03 = 4.5 refused: the vehicle keeps 127"


@pytest.mark.parametrize("loss", [{}, BAD_LINK], ids=["good link", "bad link"])
@pytest.mark.parametrize("seed", rest_in_soak(range(20), keep=2))
def test_a_vehicle_that_stores_writes_and_never_echoes_them_is_read_back(seed, loss):
    vehicle = Reached(HELD, seed, **loss, silent=NAMES)
    transfer = transfer_to(vehicle)
    assert transfer.succeeded
    assert {name: vehicle.values[name] for name in NAMES} == TARGETS
    assert len(vehicle.sets) <= (200 if loss else 80)


def test_two_writes_without_an_echo_are_read_back_and_a_third_follows_a_difference():
    transfer = Transfer([write("A", 2.0)], SOURCE, 0.0, PATIENT_S)
    set_a, read_a = SetValue("A", 2.0), ReadValue("A")
    sent = [(t / 20, send) for t in range(220) for send in transfer.tick(t / 20)]
    assert sent == [(0.0, set_a), (0.5, set_a), (10.5, read_a)]
    transfer.on_value("A", 1.0, SOURCE, 11.0)
    assert not transfer.done
    assert transfer.tick(19.9) == []
    assert transfer.tick(27.0) == [set_a]


def test_what_the_window_kept_back_until_the_deadline_was_not_sent():
    vehicle = Reached(HELD)
    vehicle.cut()
    transfer = transfer_to(vehicle, within_s=5.0)
    outcomes = [result.outcome for result in transfer.results.values()]
    assert outcomes == [Outcome.UNVERIFIED] * 8 + [Outcome.NOT_SENT] * 32
    assert transfer.results[NAMES[0]].sentence == "P_00 was not read back as 1.5 within 5 s"


def test_a_parameter_that_the_vehicle_lacks_is_refused_by_its_error():
    transfer = transfer_to(Reached({"P_00": 0.0}), {"P_99": 1.0})
    assert transfer.results["P_99"].sentence == "P_99 refused: the vehicle has no such parameter"


@pytest.mark.parametrize(
    ("name", "code", "words", "at_once"),
    [
        ("A", 1, "the vehicle has no such parameter", True),
        ("A", 2, "the vehicle holds the value to be out of range", False),
        ("A", 3, "the vehicle does not permit it; it may take orders from another ground alone", False),
        ("A", 4, "the vehicle has no such component", True),
        ("A", 5, "the vehicle says that it is read-only", False),
        ("A", 6, "the vehicle does not support its type", False),
        ("A", 7, "the vehicle expects another type", False),
        ("A", 8, "the vehicle could not read it", False),
        ("A", 9, "the vehicle answers error 9", False),
        ("FF_MODE", 2, "the vehicle holds the value to be out of range", False),
        ("FF_MODE", 3, "the vehicle does not permit it now", False),
        ("FF_COMMIT", 2, "the vehicle holds another set than was read back from it just now", False),
        ("FF_COMMIT", 3, "the vehicle does not take it: its disk can't be written", False),
    ],
)
def test_an_error_ends_a_write_at_once_where_there_is_nothing_to_write_to_else_by_a_read_back(
    name, code, words, at_once
):
    transfer = Transfer([write(name, 2.0)], SOURCE, 0.0, PATIENT_S)
    transfer.on_error(name, code, SOURCE)
    assert transfer.tick(0.0) == [SetValue(name, 2.0)]
    transfer.on_error(name, code, (SOURCE[0], SOURCE[1] + 1))
    transfer.on_error(name, code, SOURCE)
    assert transfer.done is at_once
    if not at_once:
        assert transfer.tick(9.9) == []
        assert transfer.tick(10.0) == [ReadValue(name)]
        transfer.on_value(name, 1.0, SOURCE, 10.1)
    result = transfer.results[name]
    assert (result.outcome, result.seen) == (Outcome.REFUSED, None if at_once else 1.0)
    assert result.sentence.startswith(
        f"{name} refused: {words}" if at_once else f"{name} = 2 refused: {words}"
    )


def test_the_echo_alone_proves_nothing():
    transfer = Transfer([write("A", 0.7)], SOURCE, 0.0, PATIENT_S)
    assert transfer.tick(0.0) == [SetValue("A", 0.699999988079071)]
    transfer.on_value("A", 0.699999988079071, SOURCE, 0.1)
    transfer.on_value("A", 0.699999988079071, SOURCE, 0.2)
    assert not transfer.done
    assert transfer.tick(3.1) == []
    transfer.on_value("A", 0.699999988079071, SOURCE, 3.15)
    assert not transfer.done
    assert transfer.tick(3.2) == [ReadValue("A")]
    transfer.on_value("A", 0.699999988079071, SOURCE, 3.3)
    assert transfer.succeeded


@pytest.mark.parametrize("count", [1, 3, 12])
@pytest.mark.parametrize("delay_s", rest_in_soak([0.6, 4.0, 1.0, 0.75, 2.0], keep=3))
@pytest.mark.parametrize("seeds", rest_in_soak([range(3), range(12)]), ids=len)
def test_no_echo_passes_for_a_read_back_however_long_it_was_under_way(seeds, count, delay_s):
    names = NAMES[:count]
    for seed in seeds:
        vehicle = Reached(HELD, seed, loss=0.1, duplicate=0.2, jitter_s=delay_s, stores={names[0]: 127.0})
        vehicle.beats = False  # boot times that overtake each other so far would pass for a restart
        transfer = transfer_to(vehicle, {name: TARGETS[name] for name in names})
        assert transfer.results[names[0]].outcome is Outcome.REFUSED, seed
        assert transfer.results[names[0]].seen == 127.0
        assert all(transfer.results[name].outcome is Outcome.APPLIED for name in names[1:]), seed


def test_an_answer_that_shows_the_link_to_be_slow_puts_off_what_was_asked_too_soon():
    transfer = Transfer([write("A", 2.0), write("B", 3.0)], SOURCE, 0.0, PATIENT_S)
    transfer.tick(0.0)
    transfer.on_value("A", 2.0, SOURCE, 0.05)
    assert transfer.tick(0.5) == [SetValue("B", 3.0)]
    assert transfer.tick(1.75) == [ReadValue("A")]
    transfer.on_value("B", 3.0, SOURCE, 1.9)
    transfer.on_value("A", 2.0, SOURCE, 2.0)
    assert transfer.results == {}
    assert transfer.tick(9.9) == []
    assert transfer.tick(10.0) == [ReadValue("A")]
    transfer.on_value("A", 2.0, SOURCE, 10.1)
    assert transfer.results["A"].outcome is Outcome.APPLIED


def test_one_bit_of_difference_is_a_difference():
    transfer = Transfer([confirm("A", 1.0)], SOURCE, 0.0, PATIENT_S)
    transfer.tick(0.0)
    transfer.on_value("A", 1.0000001192092896, SOURCE, 0.1)
    assert transfer.results["A"].outcome is Outcome.REFUSED


@pytest.mark.parametrize("source", [(1, 1), (2, 191), (255, 190)])
def test_an_answer_of_another_component_is_not_taken(source):
    transfer = Transfer([confirm("A", 1.0)], SOURCE, 0.0, PATIENT_S)
    transfer.tick(0.0)
    transfer.on_value("A", 1.0, source, 0.1)
    transfer.on_value("B", 1.0, SOURCE, 0.1)
    assert not transfer.done


def test_an_abort_says_what_was_sent_and_what_was_not():
    transfer = Transfer([write(name, 1.0) for name in NAMES[:9]], SOURCE, 0.0, PATIENT_S)
    transfer.tick(0.0)
    transfer.abort("the vehicle was armed")
    assert [r.outcome for r in transfer.results.values()] == [Outcome.UNVERIFIED] * 8 + [Outcome.NOT_SENT]


def test_a_list_with_holes_ends_at_the_deadline_and_names_them():
    listing = Listing(SOURCE, 0.0, 5.0)
    assert (listing.missing, listing.complete) == ([], False)  # nobody knows yet how many there are
    listing.tick(0.0)
    listing.on_value("A", 1.0, 0, 3, SOURCE, 0.1)
    listing.on_value("C", 1.0, 2, 3, SOURCE, 0.1)
    listing.on_value("B", 1.0, 65535, 3, SOURCE, 0.1)
    assert [send.index for send in listing.tick(1.0)] == [1]
    listing.tick(5.0)
    assert listing.done
    assert not listing.complete
    assert listing.missing == [1]


def asked_by(listing, since_s, until_s):
    """Times, in s to a hundredth, and requests of a listing that is ticked a thousand times a second."""
    ticks = range(round(1000 * since_s), round(1000 * until_s))
    return [(round(tick / 1000, 2), send) for tick in ticks for send in listing.tick(tick / 1000)]


def test_a_list_that_does_not_come_is_asked_for_again_after_ever_longer_and_anew_after_a_restart():
    listing = Listing(SOURCE, 5.0, 30.0)
    assert asked_by(listing, 5.0, 10.0) == [(at_s, ReadList()) for at_s in (5.0, 6.2, 7.65, 9.35)]
    listing.on_value("A", 1.0, 0, 2, SOURCE, 9.9)
    listing.on_reboot(10.0)
    assert listing.values == {}
    assert asked_by(listing, 10.0, 13.0) == [(at_s, ReadList()) for at_s in (10.7, 11.9)]
    listing.tick(34.9)
    assert not listing.done
    assert listing.tick(35.0) == []
    assert listing.done


def test_what_is_missing_of_a_list_that_has_fallen_silent_is_asked_for_eight_at_once():
    listing = Listing(SOURCE, 0.0, 30.0)
    listing.tick(0.0)
    for index, count, source in ((0, 12, SOURCE), (11, 12, SOURCE), (12, 12, SOURCE), (1, 12, (9, 9))):
        listing.on_value(f"P_{index}", 1.0, index, count, source, 0.1)
    asked = asked_by(listing, 0.0, 2.0)
    assert asked == [(at_s, ReadIndex(index)) for at_s in (0.8, 1.3) for index in range(1, 9)]
    listing.on_value("P_4", 1.0, 4, 12, SOURCE, 2.0)
    assert listing.tick(2.0) == [ReadIndex(9)]
    assert set(listing.values) == {"P_0", "P_4", "P_11"}


@pytest.mark.parametrize(("count", "limit_s"), [(1, 30.0), (100, 30.0), (101, 30.1), (1100, 130.0)])
def test_a_list_beyond_a_hundred_is_given_a_tenth_of_a_second_for_each(count, limit_s):
    listing = Listing(SOURCE, 5.0, 30.0)
    assert listing.limit_s == 30.0
    listing.on_value("A", 1.0, 0, count, SOURCE, 5.0)
    assert listing.limit_s == pytest.approx(limit_s)


def test_an_autopilots_long_list_is_whole_on_a_link_that_loses_a_third_each_way():
    """Thirty seconds, which are enough for a companion's own, left a tenth of it out."""
    vehicle = Reached({f"P_{n:04d}": float(n) for n in range(1332)}, seed=1, **BAD_LINK)
    listing = Listing(SOURCE, 0.0, READ_WITHIN_S)
    assert vehicle.run(listing, lambda: listing.done)
    assert listing.complete
    assert vehicle.now_s > READ_WITHIN_S
    assert listing.values == vehicle.values


def test_a_table_that_changes_meanwhile_is_read_anew():
    listing = Listing(SOURCE, 0.0, PATIENT_S)
    listing.on_value("A", 1.0, 0, 2, SOURCE, 0.1)
    listing.on_value("A", 1.0, 0, 3, SOURCE, 0.2)
    assert listing.missing == [1, 2]
    listing.on_value("B", 1.0, 0, 3, SOURCE, 0.3)
    assert listing.values == {"B": 1.0}


def test_a_delay_grows_by_half_to_a_second_and_a_deadline_with_what_is_asked():
    assert [retry_delay_s(n) for n in (1, 2, 3, 100)] == [0.5, 0.75, 1.0, 1.0]
    assert [deadline_s(requests) for requests in (1, 8, 9, 40)] == [72.5, 78.5, 82.5, 100.5]


@pytest.mark.parametrize(
    ("count", "after_s", "answered", "quiet_s"),
    [
        (40, 0.05, 0, 10.0),
        (40, 0.05, 40, 1.0),
        (40, 0.8, 40, 2 * 0.8 * 55 / 40),
        (1, 0.05, 1, 2 * 0.05 * 16),
        (40, 0.8, 10, 2 * 0.8 * 55 / 10),
        (40, 0.8, 2, 10.0),
    ],
)
def test_many_answers_that_came_soon_make_a_quiet_period_short(count, after_s, answered, quiet_s):
    trips = RoundTrips()
    for n in range(count):
        trips.on_sent(f"P_{n}", 0.0)
    for n in range(answered):
        trips.on_heard(f"P_{n}", after_s)
    assert trips.quiet_s == quiet_s


def test_an_answer_to_a_question_that_was_repeated_often_tells_nothing_until_all_was_quiet():
    trips = RoundTrips()
    for time_s in (0.0, 0.5, 1.25):
        trips.on_sent("A", time_s)
    trips.on_heard("A", 1.3)
    assert not trips.known
    trips.on_quiet("A")
    trips.on_sent("A", 20.0)
    trips.on_sent("A", 20.5)
    trips.on_heard("A", 20.25)
    assert trips.known
    trips.on_quiet("A")
    trips.on_heard("A", 99.0)
    assert trips.quiet_s == 2 * 0.25 * 16
