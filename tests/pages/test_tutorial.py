"""The tutorial is followed, command by command; on its dives, so is the day."""

import json
import socket

import pytest
from page_runner import Typist

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def typist(tmp_path_factory):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        port = one.getsockname()[1]
    typist = Typist(tmp_path_factory.mktemp("first"), port)
    yield typist
    typist.close()


def test_the_tutorial_runs_as_it_stands_and_comes_to_what_it_says(typist):
    typist.follow("docs/tutorial.md")
    assert "Weak thruster 1 explains the gap" in typist.said
    found = json.loads((typist.folder / "first.json").read_text(encoding="utf-8"))
    assert found["outcome"] == "converged"
    lines = sum(one["identifiable"] for one in found["parameters"][:12])
    assert lines == 10, f"the page counts the lines of an upload, of which there are {lines}"
    assert list((typist.folder / "receipts").glob("*-accepted.param"))
