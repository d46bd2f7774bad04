"""The tutorial is followed, command by command; on its dives, so is the day. Its short form follows its files alone."""

import json
import os
import re
import shlex
import shutil
import socket
from pathlib import PurePath

import pytest
from page_runner import PATIENCE_S, ROOT, Typist, blocks
from tmux import NEEDS_TMUX, Tmux

from tui import cli

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


IDLE = "idle"
READ_FIRST = ("dives", "file", "check", "accepted")
"""Options and arguments that name files which a line before must have made."""


def makes(verb, given):
    """What a line leaves in the folder of the page, as the pages name it."""
    if verb == "record":
        yield f"{given.out}/*-{given.name}"
    if verb == "simulate" and given.mission != IDLE:
        yield f"{given.out}/*-{given.mode or 'off'}"
    yield from filter(
        None, (getattr(given, name, None) for name in ("json", "param", "report", "accept", "parameters"))
    )


def reads(verb, given):
    """What a line wants to find."""
    for name in READ_FIRST:
        value = getattr(given, name, None) or ()
        yield from (value,) if isinstance(value, str) else value
    if verb == "simulate" and (given.mode or "off") != "off":
        yield given.parameters


def test_each_line_of_the_tutorial_reads_what_a_line_before_it_has_made():
    made, verbs = set(), []
    for _, block in blocks("docs/tutorial.md"):
        for line in block.splitlines():
            verb, *options = shlex.split(line)[1:]
            given = cli.verb_parser(verb).parse_args(options)
            missing = [file for file in reads(verb, given) if file not in made]
            assert not missing, f"{line}: nothing makes {missing}"
            made |= set(makes(verb, given))
            verbs.append(verb)
    assert {PurePath(file).name for file in made} >= {"gap.param", "memory.json", "first.param", "*-shadow"}
    # From the first frame to the pay-off: what was accepted is uploaded, flown and compared, and nothing is missing.
    assert verbs[-5:] == ["simulate", "params", "simulate", "validate", "diagnose"]


@pytest.fixture(scope="module")
def port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


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


@pytest.mark.soak
def test_the_tutorial_runs_as_it_stands_and_comes_to_what_it_says(followed):
    data = json.loads((followed.folder / "first.json").read_text(encoding="utf-8"))
    assert data["outcome"] == "converged"
    assert len(list((followed.folder / "receipts").glob("*-accepted.param"))) == 2
    # The last line of the page: what the mended dive still lacks; and the one before: the weak dive and the mended one.
    said = " ".join(followed.said.split())
    assert "No gap" in said
    assert "taken as accepted: weak thruster 1" in said
    followed.type("seatrial validate weak/*-both mended/*-both --vehicle ruvifist")
    said = " ".join(followed.said.split())
    assert "NO-GO, lower the feed-forward to shadow: yaw moves unasked" in said
    assert "As foretold: surge" in said
    assert "GO: the feed-forward may stay at both" in said
    effects = json.loads((followed.folder / "gap.param.json").read_text(encoding="utf-8"))["effects"]
    assert [(effect["name"], effect["number"]) for effect in effects] == [("weak_thruster", 1)]
    assert abs(effects[0]["parameters"]["gain"] - 0.79) < 0.01


@pytest.mark.soak
def test_the_errors_that_the_pages_tell_are_those_of_the_tutorials_dives(followed):
    followed.type("seatrial validate dives/*-first dives/*-both --vehicle ruvifist --json errors.json")
    pid, both = json.loads((followed.folder / "errors.json").read_text(encoding="utf-8"))
    errors_m_s = [run["axes"][0]["overall"] for run in (pid, both)]
    assert [round(100 * errors_m_s[0]), round(1000 * errors_m_s[1])] == [6, 1]


@pytest.mark.soak
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
    terminal = Tmux(f"seatrial-tutorial-{os.getpid()}", 100, 30, "sh", typist.environment, PATIENCE_S)
    terminal.keys(f"cd {typist.folder}; clear", "Enter")
    yield terminal
    terminal.close()


@pytest.mark.soak
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
    over = ("DIVE OVER", "nothing is recorded", "is over after", "Ctrl-G records the next")
    app.until(*over, without=("no recording runs",))
    says("Key `2`, *Dives*")
    app.keys("2")
    app.until("-first", "NEXT  i  identify")
    says("Key `i` identifies the dive under the mark")
    app.keys("i")
    app.until("Converged", "begin a recording; then: compare and upload what was identified")
    type_next()
    says("record again")
    type_next()
    type_next()
    app.until("DISARMED", "REC 00:", "NEXT  5 u  compare and upload what was identified")
    says("In the app key `5`, *Parameters*")
    app.keys("5")
    app.until("FF1_M_U", " chosen")
    app.keys("u")
    lines = re.search(r"type (\d+) and Enter", app.until("and Enter"))[1]
    app.keys(lines, "Enter")
    app.until("NEXT  Ctrl-U  set the feed-forward to shadow")
    type_next()
    says("End both terminals with Ctrl-C")
    typist.end("terminal 1")
    typist.end("terminal 2")
    app.until("DIVE OVER", "nothing is recorded", without=("no recording runs",))
    type_next()
    says("In the app: `2`, Home for the newest", "dive, and `v`, *Validate*")
    # At once, as one types: the dives just made are still being read.
    app.keys("2", "Home", "v")
    app.until("● GO", "-validation-both", "may stay at both")
    says("Find what is wrong")
    type_next()
    says("Make up for it, fly, compare")
    type_next()
    type_next()
    says("End terminal 2")
    typist.end("terminal 2")
    type_next()
    assert "As foretold" in typist.said
    type_next()
    assert "No gap" in typist.said
    assert next(commands, None) is None
    app.keys("C-q")
    app.until("ended with 0")
