"""docs/reliability.md: each promise of a bad day, the tests that inject its fault, and the figure that was measured.

A promise is a file of its own, docs/reliability/NAME.yaml; a long test writes the figure that it measured into
NAME.json there (`tests/figures.py`).
"""

import json
from dataclasses import dataclass
from pathlib import Path

import yaml

from docs.make.markdown import table

FOLDER = Path(__file__).resolve().parents[1] / "reliability"
PAGE = FOLDER.with_suffix(".md")

HEAD = """# Reliability

What holds on a bad day, and how it is known. Each promise has tests that inject the fault: a short form in `make
test`, and most a long one in `make soak`, which writes the figure of its last run. The last column leads to their
names. A figure comes with the day and the commit that it was measured on (the oldest were kept without the commit); a
long test that fails takes its figure away. `make docs` makes this page.

"""


@dataclass(frozen=True)
class Promise:
    """A promise. tests: nodes of pytest that hold it in `make test`; long: in `make soak`. measured: a sentence with
    the figure of the last long run, its day and commit; empty before the first."""

    name: str
    order: int
    promise: str
    tests: tuple[str, ...]
    long: tuple[str, ...]
    measured: str


def promises() -> list[Promise]:
    return sorted(
        (promise_of(path) for path in FOLDER.glob("*.yaml")),
        key=lambda promise: (promise.order, promise.name),
    )


def promise_of(path: Path) -> Promise:
    written = yaml.safe_load(path.read_text(encoding="utf-8"))
    figure = path.with_suffix(".json")
    measured = _measured(json.loads(figure.read_text(encoding="utf-8"))) if figure.exists() else ""
    tests, long = tuple(written.get("tests", ())), tuple(written.get("long", ()))
    return Promise(path.stem, written["order"], written["promise"], tests, long, measured)


def _measured(figure: dict[str, str]) -> str:
    """A figure with its day and, if it was kept, the commit."""
    code = f", {figure['code']}" if figure.get("code") else ""
    return f"{figure['measured']} ({figure['date']}{code})"


def page() -> str:
    rows = [
        (
            promise.promise,
            promise.measured or ("not measured at length yet" if promise.long else "tested, not measured"),
            _tests(promise),
        )
        for promise in promises()
    ]
    return HEAD + table(("promise", "measured", "tests"), rows)


def _tests(promise: Promise) -> str:
    """How many tests hold a promise, with a link to the file that names them."""
    count = len(promise.tests) + len(promise.long)
    long = f", {len(promise.long)} long" if promise.long else ""
    return f"[{count} test{'s' if count > 1 else ''}{long}]({FOLDER.name}/{promise.name}.yaml)"
