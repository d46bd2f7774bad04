"""The how-to for a foreign log is followed, command by command, on a log in axes of ROS."""

import json

import pytest
from foreign_log import write_foreign_log
from page_runner import Typist
from soak import rest_in_soak

NO_LINK = 0


@pytest.fixture(scope="module", params=rest_in_soak((66.0, 150.0)))
def followed(tmp_path_factory, request):
    typist = Typist(tmp_path_factory.mktemp("own"), NO_LINK)
    write_foreign_log(typist.folder, request.param)
    typist.follow("docs/howto/bring_your_own_log.md", but=("cp ",))
    yield typist
    typist.close()


def test_the_page_comes_from_the_log_to_its_masses_and_to_a_diagnosis(followed):
    fitted = json.loads((followed.folder / "hull.json").read_text(encoding="utf-8"))
    assert fitted["outcome"] == "converged"
    assert "No gap" in followed.said
    assert (followed.folder / "gap.html").stat().st_size > 10_000


def test_the_map_that_was_proposed_turns_the_log_to_forward_right_down(followed):
    text = (followed.folder / "columns.yaml").read_text(encoding="utf-8")
    assert text.count("scale: [1, -1, -1]") == 4
    assert "depth: {columns: [position.z], unit: m, scale: [-1]}" in text


def test_a_folder_of_runs_comes_to_one_answer_and_a_page(followed):
    fitted = json.loads((followed.folder / "runs.json").read_text(encoding="utf-8"))
    assert [run["name"] for run in fitted["runs"]["used"]] == ["run1", "run2", "run3"]
    assert (followed.folder / "runs.html").stat().st_size > 10_000
