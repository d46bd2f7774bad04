"""Every command that a page shows exists and takes the options that it is shown with; every link leads somewhere."""

import re
import shlex
import subprocess
from pathlib import Path

import pytest
import yaml

from bridge.schema import build
from bridge.simulator.missions import load_mission
from bridge.vehicle.config import Vehicle
from tui import cli

ROOT = Path(__file__).resolve().parents[2]
PAGES = ("README.md", *sorted(str(page.relative_to(ROOT)) for page in (ROOT / "docs").rglob("*.md")))

TYPED_INTO_MAVPROXY = "docs/ground_stations.md"


def command_lines(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    blocks = "\n".join(re.findall(r"^```sh\n(.*?)^```", text, re.M | re.S))
    if page == TYPED_INTO_MAVPROXY:
        text = ""
    indented = "\n".join(line.strip() for line in text.splitlines() if line.startswith("    "))
    return [
        line for line in (blocks + "\n" + indented).splitlines() if line.startswith(("seatrial ", "make "))
    ]


LINES = sorted({line for page in PAGES for line in command_lines(page)})


def test_there_are_commands_and_links_to_check():
    assert len(LINES) > 10
    assert "](docs/" in (ROOT / "README.md").read_text(encoding="utf-8")


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
    (block,) = (block for block in yaml_blocks() if "legs:" in block)
    path = tmp_path / "mission.yaml"
    path.write_text(block, encoding="utf-8")
    assert load_mission(path).duration_s == 55.0


def test_the_priors_that_the_manual_shows_are_what_a_vehicle_file_takes():
    (block,) = (yaml.safe_load(block) for block in yaml_blocks() if "priors:" in block)
    whole = yaml.safe_load((ROOT / "configs/vehicles/ruvifist.yaml").read_text(encoding="utf-8"))
    whole["thrust_curve"] |= block["thrust_curve"]
    whole["configurations"]["hovering"] |= block["configurations"]["hovering"]
    shape = build(Vehicle, whole, "manual").configurations["hovering"]
    assert [prior.rests_on for prior in shape.priors.values()] == ["weight", "thrust"]
    assert shape.rigid_body(0) == (72.0, 0.3)


def yaml_blocks():
    return re.findall(r"```yaml\n(.*?)```", (ROOT / "docs/commands.md").read_text(encoding="utf-8"), re.S)


@pytest.mark.parametrize("page", PAGES)
def test_every_link_of_a_page_leads_somewhere(page):
    links = re.findall(r"\]\(([^)]+)\)", (ROOT / page).read_text(encoding="utf-8"))
    inside = [link for link in links if not link.startswith("https://")]
    assert [link for link in inside if not leads_somewhere(page, link)] == []


def leads_somewhere(page, link):
    path, _, heading = link.partition("#")
    target = (ROOT / page).parent / path if path else ROOT / page
    if not target.exists():
        return False
    headings = re.findall(r"^#+ (.*)", target.read_text(encoding="utf-8"), re.M) if heading else ()
    return not heading or heading in (
        re.sub(r"[^\w -]", "", one.lower()).replace(" ", "-") for one in headings
    )
