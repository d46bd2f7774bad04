"""Compiles the kernels that tests run through, and the tests: once, else each of their workers would, all of it.

`make test` runs it where a kernel is newer than when it last did. A kernel that is left out here is compiled by the
test that needs it first.
"""

import os
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

SEED, SECONDS = 100_010, 80.0
LEGS = "name: short\nlegs:\n  - {name: surge, duration_s: 2, push_surge_n: 24, alternate: 2}\n"


def told() -> None:
    """A drawn mission, what is identified of it, and its diagnosis."""
    from bench.missions.mission import draw_one
    from identify.diagnose.diagnose import diagnose
    from identify.estimators.table import estimator

    mission = draw_one(SEED, seconds=SECONDS)
    estimator("likelihood")(mission.dive, mission.file, mission.configuration, _quiet)
    diagnose(mission.dive, mission.file, mission.configuration, progress=_quiet)


def dived() -> None:
    """A planted dive; a field dive, whose hull is that of a planted one; a dive of the simulated vehicle, read."""
    from bench.field.draw import draw
    from identify.challenge.case import dive_of, draw_case
    from identify.ingest.open import read_dive
    from tui import cli

    dive_of(draw_case(391_001, names=["quadratic_drag"], size=0.9, seconds=SECONDS))
    field = draw(5, 2, "tether", 1.0, 8.0)
    field.recording(0)
    field.truth()
    with tempfile.TemporaryDirectory() as folder:
        os.environ["XDG_STATE_HOME"] = folder
        legs = Path(folder) / "legs.yaml"
        legs.write_text(LEGS, encoding="utf-8")
        words = f"simulate --vehicle ruvifist:hovering --mission {legs} --out {folder}/dives"
        assert cli.main(words.split()) == 0
        (dive,) = (Path(folder) / "dives").iterdir()
        read_dive(dive)


def collected() -> None:
    """The bytecode of the tests, with their assertions rewritten; and the table of characters that texts are drawn by,
    which Hypothesis makes once."""
    import pytest

    pytest.main(["--collect-only", "-qq"])
    # After it, for pytest can't rewrite the assertions of a library that is loaded already.
    from hypothesis import given, settings, strategies

    settings(max_examples=1)(given(strategies.text())(lambda _: None))()


def _quiet(*_report: object) -> None:
    pass


def _alone(work: Callable[[], None]) -> None:
    # What a dive's making tells is for a terminal.
    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), sys.stdout.fileno())
        os.dup2(nowhere.fileno(), sys.stderr.fileno())
    work()


if __name__ == "__main__":
    sys.stdout.write("compiling what the tests run through ...\n")
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        list(pool.map(_alone, (told, dived, collected)))
