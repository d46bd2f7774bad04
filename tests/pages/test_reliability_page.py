"""docs/reliability.md tells of tests that there are, and of figures that were measured."""

import json

import figures
import pytest

from docs.make import reliability
from docs.make.__main__ import REFERENCE

ROOT = REFERENCE.parents[1]
PROMISES = {one.name: one for one in reliability.promises()}


def test_the_page_is_what_its_files_make():
    assert reliability.PAGE.read_text(encoding="utf-8") == reliability.page(), "run `make docs`"


@pytest.mark.parametrize("name", PROMISES)
def test_every_test_of_a_promise_is_there_and_a_long_one_is_left_to_make_soak(name):
    promise = PROMISES[name]
    assert promise.tests, "a promise has a short form, part of `make test`"
    for node in (*promise.tests, *promise.long):
        file, _, test = node.partition("::")
        text = (ROOT / file).read_text(encoding="utf-8")
        before, found, _ = text.partition(f"def {test}(")
        assert found, f"{node} is not there"
        decorators = before.rpartition("\n\n")[2]
        assert ("pytest.mark.soak" in decorators) == (node in promise.long), node


def test_every_figure_belongs_to_a_promise_with_a_long_test():
    measured = {path.stem for path in reliability.FOLDER.glob("*.json")}
    assert measured <= {name for name, promise in PROMISES.items() if promise.long}


def test_a_figure_is_kept_where_it_is_wanted_and_stands_on_the_page(tmp_path, monkeypatch):
    (tmp_path / "kills.yaml").write_text("order: 1\npromise: None is lost.\ntests: [a.py::test_b]\n")
    monkeypatch.delenv(figures.WANTED, raising=False)
    figures.keep("kills", "0 of 100 lost", tmp_path)
    assert reliability.promise_of(tmp_path / "kills.yaml").measured == ""
    monkeypatch.setenv(figures.WANTED, "1")
    figures.keep("kills", "0 of 100 lost", tmp_path)
    date = json.loads((tmp_path / "kills.json").read_text())["date"]
    assert reliability.promise_of(tmp_path / "kills.yaml").measured == f"0 of 100 lost ({date})"
