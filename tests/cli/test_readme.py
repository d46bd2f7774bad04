"""Every command that the README shows exists and takes the options that it is shown with."""

import re
import shlex
import subprocess
from pathlib import Path

import pytest

from bridge.simulator.missions import load_mission
from tui import cli

ROOT = Path(__file__).resolve().parents[2]
PAGES = ("README.md", "docs/commands.md")


def command_lines(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    blocks = "\n".join(re.findall(r"^```sh\n(.*?)^```", text, re.M | re.S))
    indented = "\n".join(line.strip() for line in text.splitlines() if line.startswith("    "))
    return [
        line for line in (blocks + "\n" + indented).splitlines() if line.startswith(("seatrial ", "make "))
    ]


LINES = sorted({line for page in PAGES for line in command_lines(page)})


def test_there_are_commands_to_check():
    assert len(LINES) > 10


@pytest.mark.parametrize("line", [line for line in LINES if line.startswith("seatrial ")])
def test_each_seatrial_line_is_taken_by_its_verb(line):
    verb, *rest = shlex.split(line)[1:]
    assert verb in cli.VERBS
    cli.verb_parser(verb).parse_args(rest)


@pytest.mark.parametrize("line", [line for line in LINES if line.startswith("make ")])
def test_each_make_line_names_a_target(line):
    target = line.split()[1]
    done = subprocess.run(["make", "-n", "-C", ROOT, target], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_mission_that_the_manual_shows_can_be_dived(tmp_path):
    (block,) = re.findall(r"```yaml\n(.*?)```", (ROOT / "docs/commands.md").read_text(encoding="utf-8"), re.S)
    path = tmp_path / "mission.yaml"
    path.write_text(block, encoding="utf-8")
    assert load_mission(path).duration_s == 25.0


def test_every_link_of_the_readme_leads_somewhere():
    links = re.findall(r"\]\(([^)]+)\)", (ROOT / "README.md").read_text(encoding="utf-8"))
    assert links
    assert all((ROOT / link).exists() for link in links)
