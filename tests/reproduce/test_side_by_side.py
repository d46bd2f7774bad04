"""Jobs in processes of their own: their results by name, their progress, and their errors."""

import os
from functools import partial

import pytest

from bridge.errors import FitError
from gcs_plugin.side_by_side import side_by_side


def square(number, progress):
    progress(0.5)
    progress(1.0)
    return number * number, os.getpid()


def refuse(_progress):
    raise FitError("a dive without velocity; record the DVL")


def test_each_result_comes_back_under_its_own_name_from_another_process():
    heard = []
    found = side_by_side(
        {"a": partial(square, 3), "b": partial(square, 4)}, lambda done: heard.append(dict(done))
    )
    assert {name: value for name, (value, _) in found.items()} == {"a": 9, "b": 16}
    assert os.getpid() not in {process for _, process in found.values()}
    assert heard[0] == {"a": 0.0, "b": 0.0}


def test_the_error_of_a_job_reaches_the_one_that_waits():
    with pytest.raises(FitError, match="record the DVL"):
        side_by_side({"a": refuse}, lambda _: None)
