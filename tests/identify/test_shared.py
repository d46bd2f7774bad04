"""What two methods both need is worked out once while one of them holds it, and anew after."""

from threading import Barrier, Thread

import closed_loop
import numpy as np
import pytest

from identify.estimators.axes import build_axes
from identify.estimators.likelihood_fit import rough_fit
from identify.side_by_side import shared


class Made:
    pass


def counted():
    """Work that is shared, and what it was asked with."""
    asked = []

    def work(*arguments):
        asked.append(arguments)
        return Made()

    return shared(work), asked


def test_two_who_ask_at_the_same_time_get_one_result_of_one_piece_of_work():
    of, asked = counted()
    both, thing, got = Barrier(2), Made(), []

    def ask():
        held = of(thing, "survey")
        both.wait(10)
        got.append(held.value)

    threads = [Thread(target=ask) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(10)
    assert got[0] is got[1]
    assert len(asked) == 1


def test_nothing_is_kept_once_nobody_holds_it():
    of, asked = counted()
    thing = Made()
    first = of(thing, "survey").value
    assert of(thing, "survey").value is not first
    assert len(asked) == 2


def test_text_and_tuples_are_the_same_where_they_are_equal_and_all_else_where_it_is_the_same_object():
    of, _ = counted()
    thing, like = Made(), Made()
    held = of(thing, "survey", (1, 2))
    assert of(thing, "".join(("sur", "vey")), (1, *[2])) is held
    assert of(thing, "hovering", (1, 2)) is not held
    assert of(like, "survey", (1, 2)) is not held


def test_what_the_work_raises_everybody_hears():
    def fails():
        raise ValueError("no axes")

    held = shared(fails)()
    for _ in range(2):
        with pytest.raises(ValueError, match="no axes"):
            _ = held.value


def test_axes_that_are_doubted_are_begun_apart_from_those_that_are_not():
    file = closed_loop.vehicle_file()
    built = build_axes(closed_loop.dive(np.random.default_rng(3), seconds=30.0), file, "only")
    shape = file.vehicle.configurations["only"]
    plain, doubted = rough_fit(built, shape, ()), rough_fit(built, shape, (0,))
    assert rough_fit(built, shape, ()) is plain
    assert plain.value.joint.apart == ()
    assert doubted.value.joint.apart == (0,)
