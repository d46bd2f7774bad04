"""A figure is kept under the stamp of what it ran through: the stamp covers every file that its making reads."""

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from bench.accuracy.answers import OWN
from bench.accuracy.trials import SOURCES
from bench.sections import SECTIONS
from bench.stamp import KEEPING, ROOT, files, makes_answer, reached
from identify.estimators.table import METHODS

SEED = 100_010
KEPT_BY = {ROOT / name for name in (*KEEPING, "gcs_plugin/job.py")}
"""What keeps the figures, and runs the processes that make them."""
READ = """
import sys
read = set()
sys.addaudithook(lambda event, args: read.add(str(args[0])) if event == "open" else None)
{work}
read = {{path for path in read if not path.endswith(".py")}}  # stamps read code that no work runs through
parts = ("bench", "bridge", "configs", "gcs_plugin", "identify", "tui")
read |= {{m.__file__ for n, m in list(sys.modules.items()) if n.split(".")[0] in parts and m.__file__}}
print("\\n".join(read))
"""
MISSION = f"from bench.missions.mission import draw_one\nm = draw_one({SEED})\n"
ASKED = "estimate(m.dive, m.file, m.configuration, lambda *_report: None)"
PRODUCT = "from importlib import import_module\nfrom identify.estimators.table import METHODS\n" + "".join(
    f"import_module(METHODS['{name}'])\n" for name in ("likelihood", "pinn")
)


def _read(work):
    """The repository's files that some work reads, those of its compilers' caches and of mere packages left out."""
    code = READ.format(work=work)
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    paths = {Path(line) for line in ran.stdout.splitlines() if line.startswith(str(ROOT))}
    kinds = (".py", ".csv", ".yaml")
    files_read = {
        p for p in paths if p.suffix in kinds and p.name != "__init__.py" and ".venv" not in p.parts
    }
    assert len(files_read) > 8
    return files_read


@pytest.mark.soak
@pytest.mark.parametrize("method", [name for name in OWN if "SINDy" not in name or find_spec("pysindy")])
def test_a_baseline_reads_nothing_outside_its_sources(method):
    read = _read(MISSION + f"from {OWN[method]} import estimate\n{ASKED}")
    assert read - set(files(*SOURCES["own"])) == set()


@pytest.mark.soak
def test_the_bound_reads_nothing_outside_its_sources():
    read = _read(MISSION + "from bench.bound.bound import cramer_rao\ncramer_rao(m)")
    assert read - set(files(*SOURCES["bound"])) == set()


@pytest.mark.soak
def test_the_products_methods_load_nothing_outside_their_sources():
    assert _read(MISSION + PRODUCT) - set(files(*SOURCES["product"])) == set()


def test_the_products_methods_and_the_missions_reach_no_code_outside_their_sources():
    methods = [f"{METHODS[name].replace('.', '/')}.py" for name in ("likelihood", "pinn")]
    behind = files(reached("bench/missions/mission.py", *methods))
    assert len(behind) > 30
    assert set(behind) - set(files(*SOURCES["product"])) == set()


@pytest.mark.soak
def test_a_campaigns_dive_and_its_answer_load_nothing_outside_the_sources_of_coverage():
    from bench.accuracy import coverage

    work = "import bench.accuracy.coverage\nimport identify.estimators.likelihood.answer\n"
    work += "from bridge.simulator.truth import load_truth\nfrom bridge.vehicle.config import load_vehicle\n"
    work += "load_truth(load_vehicle('ruvifist:survey'), 'survey')"
    assert _read(work) - KEPT_BY - set(files(*coverage.SOURCES)) == set()


@pytest.mark.soak
def test_a_diagnosis_loads_nothing_outside_its_sources():
    from bench.diagnosis.trials import SOURCES

    assert _read("import bench.diagnosis.trials") - KEPT_BY - set(files(*SOURCES)) == set()


BROAD = {"power", "ardusub", "mutants"}
"""Sections whose figures take too long to be measured anew for each change of the code around them."""


@pytest.mark.parametrize("name", [name for name in SECTIONS if name not in BROAD])
def test_the_code_behind_a_section_is_all_that_its_page_is_made_by(name):
    behind = files(reached(str(Path(SECTIONS[name].module.__file__).relative_to(ROOT))))
    if ROOT / "bench/campaigns.py" in behind:
        behind += files("configs/vehicles/ruvifist*.yaml", "configs/thrusters/*.csv")
    if ROOT / "tui/cli.py" in behind:
        behind += files(reached("tui/commands/diagnose.py"))
        behind = [file for file in behind if makes_answer(str(file.relative_to(ROOT)))]
    assert set(behind) - set(files(*SECTIONS[name].sources)) == set()


def test_a_page_that_is_drawn_otherwise_discards_no_figure_and_another_verdict_or_verb_does():
    behind = {str(file.relative_to(ROOT)) for file in files(*SECTIONS["field"].sources)}
    assert {"identify/diagnose/verdict.py", "identify/run/diagnose.py", "tui/commands/diagnose.py"} <= behind
    assert not behind & {"identify/report/page.py", "tui/show.py", "gcs_plugin/params/upload.py"}


def test_the_power_of_the_diagnosis_is_kept_under_the_code_that_scores_it():
    from bench.diagnosis.power import DECIDED

    assert ROOT / "identify/challenge/score.py" in files(*DECIDED)
