"""The tutorial is followed, command by command; on its dives, so is the day."""

import json
import os
import shutil
import socket

import pytest
from page_runner import ROOT, Typist, blocks
from tmux import NEEDS_TMUX, Tmux

pytestmark = pytest.mark.soak

ELSEWHERE = (
    "seatrial simulate --vehicle ruvifist:hovering --mission hovering",  # the tutorial's dive stands in for it
    "seatrial doctor --vehicle ruvifist:hovering --link udpin:127.0.0.1:14550 --wet",
    "seatrial replay",
    "seatrial bridge",
    "seatrial record --vehicle ruvifist:hovering --link udpin:192.168.2.1",
    "seatrial import 00000042.BIN",
    "seatrial batch",
    "seatrial challenge",
    "mkdir answers",
    "for case in",
    "seatrial reproduce",
)
"""Lines of the day that take minutes, or a vehicle: what they do has tests of its own."""


@pytest.fixture(scope="module")
def port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


@pytest.fixture(scope="module")
def first(tmp_path_factory, port):
    typist = Typist(tmp_path_factory.mktemp("first"), port)
    yield typist
    typist.close()


@pytest.fixture(scope="module")
def followed(first):
    first.follow("docs/tutorial.md")
    return first


@pytest.fixture
def day(tmp_path, port, followed):
    typist = Typist(tmp_path, port)
    (dive,) = (followed.folder / "dives").glob("*-first")
    shutil.copytree(dive, tmp_path / "dives" / dive.name.replace("-first", "-hovering-off"))
    yield typist
    typist.close()


def test_the_tutorial_runs_as_it_stands_and_comes_to_what_it_says(followed):
    assert "Weak thruster 1 explains the gap" in followed.said
    data = json.loads((followed.folder / "first.json").read_text(encoding="utf-8"))
    assert data["outcome"] == "converged"
    lines = sum(item["identifiable"] for item in data["parameters"][:12])
    assert lines == 10, f"the page counts the lines of an upload, of which there are {lines}"
    assert list((followed.folder / "receipts").glob("*-accepted.param"))


def test_the_errors_that_the_pages_tell_are_those_of_the_tutorials_dives(followed):
    followed.type("seatrial validate dives/*-first dives/*-both --vehicle ruvifist --json errors.json")
    pid, both = json.loads((followed.folder / "errors.json").read_text(encoding="utf-8"))
    errors_m_s = [run["axes"][0]["overall"] for run in (pid, both)]
    assert [round(100 * errors_m_s[0]), round(1000 * errors_m_s[1])] == [6, 1]


def test_a_day_runs_as_it_stands(day):
    day.follow("docs/a_day.md", but=ELSEWHERE)
    priors = (day.folder / "our.yaml").read_text(encoding="utf-8")
    assert "rests_on: thrust" in priors
    assert {"hovering.html", "gap.html", "plan.yaml"} <= {path.name for path in day.folder.iterdir()}


@pytest.fixture
def typist(tmp_path, port):
    typist = Typist(tmp_path, port)
    yield typist
    typist.close()


@pytest.fixture
def app(typist):
    """A terminal for the app, in the folder of the page."""
    terminal = Tmux(f"seatrial-tutorial-{os.getpid()}", 100, 30, "sh", typist.environment)
    terminal.keys(f"cd {typist.folder}; clear", "Enter")
    yield terminal
    terminal.close()


@NEEDS_TMUX
def test_the_tutorial_works_word_for_word_with_the_app_open_throughout(typist, app):
    page = iter((ROOT / "docs/tutorial.md").read_text(encoding="utf-8").splitlines())
    commands = iter(blocks("docs/tutorial.md"))

    def says(*words):
        for word in words:
            assert any(word in line for line in page), f"the page says no more: {word}"

    def type_next():
        terminal, block = next(commands)
        typist.type(block, terminal)

    type_next()
    app.keys(f"{next(commands)[1].strip()}; echo ended with $?", "Enter")
    app.until("1 Watch", "REC 00:")
    terminal, dive = next(commands)
    typist.begin(dive, terminal)
    says("*Watch* (key `1`)")
    app.keys("1")
    app.until("■ ARMED", "surge u", "NEXT")
    says("Ctrl-X forces the feed-forward off")
    app.keys("C-x")
    app.until("FF OFF,")
    says("the app says *DIVE OVER*")
    app.until("DIVE OVER", "REC 00:", without=("LINK LOST",))
    typist.finish(terminal)
    typist.end("terminal 1")
    app.until(
        "DIVE OVER",
        "nothing is recorded",
        "is over after",
        "^g records the next",
        without=("no recording runs",),
    )
    says("Key `2`, *Dives*")
    app.keys("2")
    app.until("-first", "NEXT  i  identify")
    says("Key `i` identifies the dive under the mark")
    app.keys("i")
    app.until("Converged", "record the vehicle; then: identified, not uploaded")
    type_next()
    says("record again")
    type_next()
    type_next()
    app.until("DISARMED", "REC 00:", "NEXT  5 u  identified, not uploaded")
    says("In the app `p` compares")
    app.keys("p")
    app.until("FF1_M_U", "8 of 8 chosen")
    app.keys("u")
    app.until("Enter")
    app.keys("8", "Enter")
    app.until("NEXT  ^u  uploaded: set the feed-forward to shadow")
    type_next()
    says("End both terminals with Ctrl-C")
    typist.end("terminal 1")
    typist.end("terminal 2")
    app.until("DIVE OVER", "nothing is recorded", without=("no recording runs",))
    type_next()
    says("In the app: `2`, Home for the newest", "dive, and `v`, *Validate*")
    app.keys("2")
    app.until("4 in dives", "validation-both", "validation-shadow")
    app.keys("C-q")
    app.until("ended with 0")
