"""Pages of docs/: made from the code, with its numbers, commands that exist, and promises that have tests."""

import json
import math
import re
import shlex
import subprocess
from pathlib import Path

import figures
import pytest
import yaml

from bridge.schema import build
from bridge.simulator.missions import load_mission
from bridge.vehicle.config import Vehicle
from docs.make import reliability
from docs.make.__main__ import REFERENCE, pages
from gcs_plugin.watch.alarms import Settings
from identify.diagnose import findings, verdict
from identify.diagnose.causes import ambiguity, confidence, evidence, ranking, requirement, selection
from identify.diagnose.filters import regression
from identify.diagnose.gap import drift
from identify.diagnose.remainder import unexplained
from identify.diagnose.shrink import held_out, shrink, shrunk
from identify.estimators.missing_forces import drag_and_timing
from identify.estimators.missing_forces import screening as unmodelled
from identify.estimators.pinn import network, training
from identify.identification import LARGEST_RELATIVE_STD
from identify.ingest.mapping.units import UNITS
from identify.priors import CONFLICT_SIGMA
from tui import cli

MADE = pages()


@pytest.mark.parametrize("name", MADE)
def test_a_page_of_the_reference_is_what_the_code_makes(name):
    kept = (REFERENCE / name).read_text(encoding="utf-8")
    assert kept == MADE[name], f"docs/reference/{name} is not what the code makes: run `make docs`"


def test_the_reference_has_no_page_that_nobody_makes():
    assert {path.name for path in REFERENCE.iterdir()} == set(MADE)


def test_every_picture_stays_small_and_asks_for_no_net():
    pictures = list((REFERENCE.parent / "images").iterdir())
    assert pictures
    for picture in pictures:
        assert picture.stat().st_size < 300_000, f"{picture.name} is too large"
        text = picture.read_text(encoding="utf-8").replace("http://www.w3.org/", "")
        assert "http" not in text, f"{picture.name} names an address"


PAGE = re.sub(
    r"\s+", " ", (Path(__file__).resolve().parents[2] / "docs" / "methods.md").read_text(encoding="utf-8")
)


@pytest.mark.parametrize(
    "words",
    [
        f"at most {100 * LARGEST_RELATIVE_STD:.0f} % of it",
        f"One more than {CONFLICT_SIGMA:.0f} standard errors off",
        f"moves by {100 * training.SETTLED:.0f} % of its standard error",
        rf"$\rho = {1e5 * network.ROUGHNESS:.0f}\cdot10^{{-5}}$ m/s",
        "off by $\\delta$ (`drift.py`)" if drift.HORIZONS_S[1] == shrink.HORIZON_S == 5.0 else "not 5 s",
        f"{1 - shrink.CHANCE:g} to {1 + shrink.CHANCE:g} by chance",
        f"The best {ranking.WEIGHED} are weighed",
        f"pieces of {regression.PIECE_S:.0f} s in {evidence.FOLDS} folds",
        f"by more than {requirement.LEAST_GAIN:.0f} nats ({requirement.LEAST_TIMED_GAIN:.0f} for a sea",
        f"by Wald's test at {100 * confidence.LEAST_CONFIDENCE:.0f} %",
        rf"P = {findings.MOST_PROBABLE}\,\frac{{m}}{{m + {findings.HALF_NATS:.0f}}}",
        f"Under {100 * shrunk.LIKELY:.0f} % a cause",
        f"within {confidence.LEAST_APART:g} nats of each other "
        f"whose columns have a cosine of {ambiguity.LEAST_LIKENESS:g}",
        f"= {unexplained.UNKNOWN_NATS}$ nats deceive",
        f"more than {100 * verdict.FORM_SHARE:.0f} % of what the causes save",
        f"more than {100 * unmodelled.LEAST_FORCE:.0f} % of what the thrusters do",
        f"fitted without it ({held_out.FOLDS} folds)",
    ],
)
def test_what_the_page_says_is_what_the_code_does(words):
    assert words in PAGE


def test_one_dive_in_a_hundred_may_deceive_and_timing_is_doubted_by_half_a_millisecond():
    assert math.log(1200 * 100) == pytest.approx(unexplained.UNKNOWN_NATS, abs=0.01)
    assert drag_and_timing.STAMPED_S == 0.5e-3
    assert findings.TAKEN_UP == 0.25
    assert verdict.LEAST_CLOSED == verdict.MOST_DISTURBED == 1 / 3
    assert selection.MOST_CAUSES == 6


ROOT = REFERENCE.parents[1]


@pytest.fixture(scope="module")
def promises():
    return reliability.promises()


def test_the_page_is_what_its_files_make():
    assert reliability.PAGE.read_text(encoding="utf-8") == reliability.page(), "run `make docs`"


def test_every_test_of_a_promise_is_there_and_a_long_one_is_left_to_make_soak(promises):
    for promise in promises:
        assert promise.tests, f"{promise.name} has no short form, part of `make test`"
        for node in (*promise.tests, *promise.long):
            file, _, test = node.partition("::")
            text = (ROOT / file).read_text(encoding="utf-8")
            before, result, _ = text.partition(f"def {test}(")
            assert result, f"{node} is not there"
            decorators = before.rpartition("\n\n")[2]
            assert ("pytest.mark.soak" in decorators) == (node in promise.long), node


def test_every_figure_belongs_to_a_promise_with_a_long_test(promises):
    measured = {path.stem for path in reliability.FOLDER.glob("*.json")}
    assert measured <= {promise.name for promise in promises if promise.long}


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


TREE = Path(__file__).resolve().parents[2]
PAGES = ("README.md", *sorted(str(page.relative_to(TREE)) for page in (TREE / "docs").rglob("*.md")))

TYPED_INTO_MAVPROXY = "docs/ground_stations.md"


def command_lines(page):
    text = (TREE / page).read_text(encoding="utf-8")
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
    assert "](docs/" in (TREE / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("page", [page for page in PAGES if page.startswith("docs/howto/")])
def test_the_readme_names_each_page_that_says_how_to_do_something(page):
    assert f"]({page})" in (TREE / "README.md").read_text(encoding="utf-8")


def test_each_seatrial_line_is_taken_by_its_verb():
    for line in (line for line in LINES if line.startswith("seatrial ")):
        verb, *options = shlex.split(line)[1:]
        assert verb in cli.VERBS, line
        cli.verb_parser(verb).parse_args(options)


@pytest.mark.parametrize("line", [line for line in LINES if line.startswith("make ")])
def test_each_make_line_names_a_target(line):
    target = line.split()[1]
    done = subprocess.run(["make", "-n", "-C", TREE, target], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_mission_that_the_manual_shows_can_be_dived(tmp_path):
    (block,) = (block for block in yaml_blocks() if "legs:" in block)
    path = tmp_path / "mission.yaml"
    path.write_text(block, encoding="utf-8")
    assert load_mission(path).duration_s == 55.0


def test_the_priors_that_the_manual_shows_are_what_a_vehicle_file_takes():
    (block,) = (yaml.safe_load(block) for block in yaml_blocks() if "priors:" in block)
    whole = yaml.safe_load((TREE / "configs/vehicles/ruvifist.yaml").read_text(encoding="utf-8"))
    whole["thrust_curve"] |= block["thrust_curve"]
    whole["configurations"]["hovering"] |= block["configurations"]["hovering"]
    shape = build(Vehicle, whole, "manual").configurations["hovering"]
    assert [prior.rests_on for prior in shape.priors.values()] == ["weight", "thrust"]
    assert shape.rigid_body(0) == (72.0, 0.3)


def test_the_alarms_that_the_manual_shows_are_what_their_file_takes():
    (block,) = (yaml.safe_load(block) for block in yaml_blocks() if "sound:" in block)
    assert build(Settings, block, "manual").of("ruvifist").depth_m == 10.0


def yaml_blocks():
    return re.findall(r"```yaml\n(.*?)```", (TREE / "docs/commands.md").read_text(encoding="utf-8"), re.S)


def test_the_page_on_foreign_logs_names_every_unit_that_a_column_map_takes():
    text = (TREE / "docs/howto/bring_your_own_log.md").read_text(encoding="utf-8")
    named = {}
    for signals, units in re.findall(r"^\| (`[^|]*) \| [^|]* \| ([^|]*) \|$", text, re.M):
        groups = (
            re.split(r", | or ", re.sub(r" \(.*?\)|[`\"]", "", group.strip())) for group in units.split(";")
        )
        named |= dict(zip(re.findall(r"`(\w+)`", signals), map(set, groups), strict=True))
    assert named == {signal: set(units) for signal, units in UNITS.items()}


def test_every_link_of_a_page_leads_somewhere():
    for page in PAGES:
        links = re.findall(r"\]\(([^)]+)\)", (TREE / page).read_text(encoding="utf-8"))
        inside = [link for link in links if not link.startswith("https://")]
        assert [link for link in inside if not leads_somewhere(page, link)] == [], page


def test_every_page_that_the_program_names_is_there():
    """In a message a crew reads the path of a page, and opens it."""
    named = {
        (str(file.relative_to(TREE)), page)
        for package in ("bridge", "gcs_plugin", "identify", "tui")
        for file in (TREE / package).rglob("*.py")
        for page in re.findall(r"docs/[\w/]+\.md", file.read_text(encoding="utf-8"))
    }
    assert ("bridge/flight/limits.py", "docs/howto/fly_a_plan.md") in named
    assert [(file, page) for file, page in sorted(named) if not (TREE / page).is_file()] == []


def leads_somewhere(page, link):
    path, _, heading = link.partition("#")
    target = (TREE / page).parent / path if path else TREE / page
    if not target.exists():
        return False
    headings = re.findall(r"^#+ (.*)", target.read_text(encoding="utf-8"), re.M) if heading else ()
    return not heading or heading in (
        re.sub(r"[^\w -]", "", item.lower()).replace(" ", "-") for item in headings
    )
