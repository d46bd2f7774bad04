"""How long to be quiet: longer than any answer is under way, and no longer than it need be."""

from gcs_plugin.params.deadline import RoundTrips, Timing

TIMING = Timing()


def asked(count, after_s=0.05, answered=None):
    trips = RoundTrips(TIMING)
    for n in range(count):
        trips.on_sent(f"P_{n}", 0.0)
    for n in range(count if answered is None else answered):
        trips.on_heard(f"P_{n}", after_s)
    return trips


def test_where_nothing_was_answered_the_quiet_is_longest():
    assert RoundTrips(TIMING).quiet_s == asked(40, answered=0).quiet_s == TIMING.quiet_max_s
    assert not asked(40, answered=0).known


def test_many_answers_that_came_soon_make_it_short():
    assert asked(40).quiet_s == TIMING.quiet_s
    assert asked(40, after_s=0.8).quiet_s == 2 * 0.8 * 55 / 40


def test_few_answers_make_it_longer_than_many():
    assert asked(1).quiet_s == 2 * 0.05 * 16
    assert asked(40, after_s=0.8, answered=10).quiet_s == 2 * 0.8 * 55 / 10
    assert asked(40, after_s=0.8, answered=2).quiet_s == TIMING.quiet_max_s


def test_an_answer_to_a_question_that_was_repeated_often_tells_nothing_until_all_was_quiet():
    trips = RoundTrips(TIMING)
    for time_s in (0.0, 0.5, 1.25):
        trips.on_sent("A", time_s)
    trips.on_heard("A", 1.3)
    assert not trips.known
    trips.on_quiet("A")
    trips.on_sent("A", 20.0)
    trips.on_heard("A", 20.25)
    assert trips.quiet_s == 2 * 0.25 * 16


def test_what_nobody_asked_for_tells_nothing():
    trips = asked(1, answered=0)
    trips.on_heard("B", 10.01)
    assert not trips.known
