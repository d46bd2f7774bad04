"""Run the main flows, with every sentence of ours replaced by "x" if asked to, and print their outcome without words.

python tests/wordless.py FOLDER SECONDS_OF_THE_DIVE [x]
"""

import ast
import dataclasses
import importlib.machinery
import json
import math
import os
import re
import sys
from enum import Enum
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("bridge", "gcs_plugin", "identify", "tui")
TRIED = {"quadratic_drag", "weak_thruster", "dead_zone", "steady_current", "dvl_delay", "battery_sag"}
"""Effects of each kind: of the hull, thrusters, water, sensors and supply."""
SENTENCE = re.compile(r"[A-Za-z,;:)] +[A-Za-z(]*[a-z]{2,}|[a-z]{2,} [A-Za-z(]")
"""Two words, one of them at least in small letters: no key, code, unit, format or pattern of ours looks like that."""


class Wordless(ast.NodeTransformer):
    """Replaces sentences of `least` words, but for the codes of an enumeration, patterns, and what a docstring says."""

    def __init__(self, least: int) -> None:
        self._least = least

    def _is_sentence(self, text: str) -> bool:
        return SENTENCE.search(text) is not None and len(text.split()) >= self._least

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.AST:
        if any(isinstance(base, ast.Name) and base.id.endswith("Enum") for base in node.bases):
            node.body = [part if isinstance(part, ast.Assign) else self.visit(part) for part in node.body]
            return node
        return self.generic_visit(node)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        # The label of an effect is its key, in sidecars too.
        return node if node.name == "label" else self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> ast.AST:
        called = node.func
        is_pattern = isinstance(called, ast.Attribute) and (
            (isinstance(called.value, ast.Name) and called.value.id == "re")
            or called.attr in ("strptime", "strftime")
        )
        return node if is_pattern else self.generic_visit(node)

    def visit_Expr(self, node: ast.Expr) -> ast.AST:
        return node if isinstance(node.value, ast.Constant) else self.generic_visit(node)

    def visit_JoinedStr(self, node: ast.JoinedStr) -> ast.AST:
        text = "".join(str(part.value) if isinstance(part, ast.Constant) else "{}" for part in node.values)
        return ast.copy_location(ast.Constant("x"), node) if self._is_sentence(text) else node

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        if isinstance(node.value, str) and self._is_sentence(node.value):
            return ast.copy_location(ast.Constant("x"), node)
        return node


class Loader(importlib.machinery.SourceFileLoader):
    """Compiles a module of ours without its sentences."""

    def get_code(self, fullname: str) -> Any:
        path = self.get_filename(fullname)
        tree = ast.parse(self.get_data(path), path)
        # The variants of an effect are part of its key, in sidecars too.
        least = 5 if fullname.startswith("identify.effects") else 2
        return compile(Wordless(least).visit(tree), path, "exec")


class Finder(importlib.machinery.PathFinder):
    """Finds modules of ours."""

    @classmethod
    def find_spec(cls, fullname: str, path: Any = None, target: Any = None) -> Any:
        spec = super().find_spec(fullname, path, target) if fullname.partition(".")[0] in PACKAGES else None
        if spec is not None and isinstance(spec.loader, importlib.machinery.SourceFileLoader):
            spec.loader = Loader(spec.loader.name, spec.loader.path)
        return spec


def bare(value: Any) -> Any:
    """A value without its words: only numbers, switches and codes are left."""
    if isinstance(value, Enum):
        return value.name
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    if isinstance(value, dict):
        kept = {str(bare(key)): bare(part) for key, part in value.items()}
        return {key: part for key, part in kept.items() if part not in (None, [], {}) and key != "x"}
    if isinstance(value, list | tuple | set | frozenset):
        return [part for part in map(bare, value) if part is not None]
    if isinstance(value, str):
        return None if not value or value == "x" or " " in value or value.startswith("/") else value
    if isinstance(value, float):
        return round(value, 6 - int(math.log10(abs(value)))) if value and math.isfinite(value) else None
    return value if isinstance(value, int | bool) else None


def identified_and_diagnosed(folder: Path, seconds: float) -> Any:
    """A dive with a hidden effect: identified and diagnosed, its check dive too short at first; then on the app."""
    from bridge.errors import FitError
    from bridge.plain import plain
    from identify.challenge.case import check_of, dive_of, draw_case
    from identify.effects.library import library
    from identify.estimators.table import estimator
    from identify.run.diagnose import diagnose
    from identify.run.identify import identify
    from tui.app.diagnosis import answer as shown_diagnosis
    from tui.app.identification import load_identified

    case = draw_case(300_051, names=["quadratic_drag"], seconds=seconds)
    dive, check = dive_of(case), check_of(case)
    steps: list[Any] = []
    identification = identify(
        dive, case.file, case.configuration, {"likelihood": estimator("likelihood")}, steps.append
    )
    start_s = check.span_s[0]
    try:
        diagnose(dive, case.file, case.configuration, check=check.between(start_s, start_s + 5.0))
        refused = ""
    except FitError as error:
        refused = type(error).__name__
    untried = {effect.name for effect in library(case.vehicle.configuration, 0.1)} - TRIED
    done = diagnose(dive, case.file, case.configuration, check=check, without=sorted(untried))
    kept = folder / "identified.json"
    kept.write_text(json.dumps(plain(identification.to_json())), encoding="utf-8")
    # The outcome holds when it was written, and the other run writes its own later.
    os.utime(kept, (1.79e9, 1.79e9))
    return {
        "outcome": identification.answer.outcome,
        "values": identification.answer.values(),
        "doubts": [(doubt.about, doubt.outcome, doubt.culprit) for doubt in identification.answer.doubts],
        "steps": [(step.of, step.answered, step.values) for step in steps if step.answered],
        "refused": refused,
        "diagnosis": done.diagnosis.verdict,
        "gap": done.diagnosis.gap,
        "screens": (shown_diagnosis(plain(done.to_json())), load_identified(folder, folder)),
        "accepted": done.diagnosis.accepted.values,
        "findings": [(finding.cause.effect.name, finding.probability) for finding in done.diagnosis.findings],
    }


def uploaded(folder: Path) -> Any:
    """Parameters compared, refused, written and rolled back, at a vehicle in simulated time."""
    import pytest
    from fakes.vehicle import FakeVehicle

    from tui import cli

    patch = pytest.MonkeyPatch()
    vehicle = FakeVehicle()
    patch.chdir(folder)
    patch.setattr("bridge.links.open.open_link", lambda _: vehicle)
    patch.setattr("bridge.clock.SystemClock", lambda: vehicle.clock)
    (folder / "new.param").write_text("FF1_M_U,111.5\nFF1_D_U,56.25\n", encoding="utf-8")
    (folder / "half.param").write_text("FF1_M_U,99.5\n", encoding="utf-8")
    lines = (
        ("diff", "new.param"),
        ("upload", "half.param", "--yes"),
        ("upload", "new.param", "--yes"),
        ("upload", "new.param", "--yes"),
        ("diff", "new.param"),
        ("rollback", "--yes"),
        ("rollback", "--yes"),
        ("upload", "none.param", "--yes"),
    )
    outcomes = []
    for number, line in enumerate(lines):
        result = folder / f"{number}.json"
        code = cli.main(["params", *line, "--link", "any", "--json", str(result)])
        answer = json.loads(result.read_text(encoding="utf-8")) if result.exists() else None
        outcomes.append((code, answer, dict(vehicle.server.active(1))))
        if line[0] == "upload" and number == 2:
            vehicle.armed = True
            armed = cli.main(["params", "upload", "new.param", "--yes", "--link", "any"])
            vehicle.armed = False
            outcomes.append((armed, None, {}))
    patch.undo()
    return outcomes


def switched() -> Any:
    """The feed-forward off at a vehicle that obeys, stuck at first, and raised at one without an active set."""
    from test_ff_switch import Craft, drive

    from bridge.clock import SimulatedClock
    from bridge.vehicle.mode import Mode
    from gcs_plugin.feedforward.switch import Switch

    outcomes = []
    for mode, stuck in ((Mode.OFF, False), (Mode.OFF, True), (Mode.BOTH, False)):
        clock = SimulatedClock()
        craft, switch = Craft(clock, mode=3.0 if mode is Mode.OFF else 0.0), Switch(mode)
        craft.stuck = stuck
        done = drive(switch, craft, clock, 20.0)
        outcomes.append((done, switch.heard, switch.sent, bool(switch.refusal), craft.server.mode))
    return outcomes


if __name__ == "__main__":
    if "x" in sys.argv[3:]:
        sys.meta_path.insert(0, Finder)  # type: ignore[arg-type]
    sys.path += [str(ROOT / "tests"), str(ROOT / "tests" / "ground")]
    place = Path(sys.argv[1])
    flows = {
        "uploaded": uploaded(place),
        "switched": switched(),
        "identified": identified_and_diagnosed(place, float(sys.argv[2])),
    }
    (place / "flows.json").write_text(json.dumps(bare(flows), indent=1), encoding="utf-8")
