"""docs/reliability.md tells of tests that there are, and of figures that were measured."""

import json
import re
import subprocess

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
    kept = json.loads((tmp_path / "kills.json").read_text())
    assert kept["code"] == figures.commit()
    assert (
        reliability.promise_of(tmp_path / "kills.yaml").measured
        == f"0 of 100 lost ({kept['date']}, {kept['code']})"
    )


def test_a_figure_names_the_commit_and_whether_files_differ_from_it(tmp_path):
    def git(*words):
        subprocess.run(["git", "-c", "user.name=a", "-c", "user.email=a@b", *words], cwd=tmp_path, check=True)

    assert figures.commit(tmp_path) == ""
    git("init", "-q")
    (tmp_path / "code.py").write_text("1\n")
    git("add", ".")
    git("commit", "-qm", "first")
    clean = figures.commit(tmp_path)
    assert re.fullmatch("[0-9a-f]{8}", clean)
    (tmp_path / "code.py").write_text("2\n")
    assert figures.commit(tmp_path) == f"{clean}+"


def test_a_long_test_that_fails_takes_the_figure_of_its_promise_away(tmp_path, monkeypatch):
    (tmp_path / "kills.yaml").write_text(
        "order: 1\npromise: None is lost.\ntests: [a.py::b]\nlong: [a.py::c]\n"
    )
    monkeypatch.setenv(figures.WANTED, "1")
    figures.keep("kills", "0 of 100 lost", tmp_path)
    figures.take_away("a.py::b", tmp_path)
    assert (tmp_path / "kills.json").exists()
    monkeypatch.delenv(figures.WANTED)
    figures.take_away("a.py::c", tmp_path)
    assert (tmp_path / "kills.json").exists()
    monkeypatch.setenv(figures.WANTED, "1")
    figures.take_away("a.py::c", tmp_path)
    assert reliability.promise_of(tmp_path / "kills.yaml").measured == ""
