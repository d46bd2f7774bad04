"""Wall time of the sections over all the runs that measured them, and whether it meets the goal."""

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from bench.goals import in_a_word
from bench.remembered import Remembered
from bench.words import paragraph

GOAL_MIN = 90.0


@contextmanager
def timed(cache: Path, section: str, code: str) -> Iterator[None]:
    """Add the wall time of the `with` block to that of a section of this code, even if it is interrupted."""
    began_s = time.perf_counter()
    try:
        yield
    finally:
        kept = Remembered(cache / "wall.jsonl")
        before_s = _kept_s(kept, section, code)
        kept.put(f"{section} {code}", {"seconds": before_s + time.perf_counter() - began_s})


def wall_s(cache: Path, section: str, code: str) -> float:
    """Wall time of a section of this code in all runs so far, s; 0 if none was kept."""
    return _kept_s(Remembered(cache / "wall.jsonl"), section, code)


def _kept_s(kept: Remembered, section: str, code: str) -> float:
    key = f"{section} {code}"
    return float(kept.get(key, dict)["seconds"]) if key in kept else 0.0


def lines(whole: Mapping[str, float | None]) -> list[str]:
    """The paragraph at the top of the page: the time of `make bench` from its sections' times, None if not kept."""
    known = {name: seconds for name, seconds in whole.items() if seconds is not None}
    lacking = [name for name in whole if name not in known]
    if not known:
        return paragraph("How long `make bench` took was not kept when these sections were measured.")
    minutes = sum(known.values()) / 60
    each = ", ".join(f"{name} {seconds / 60:.1f}" for name, seconds in known.items())
    if not lacking:
        verdict = f"Goal: within {GOAL_MIN:g} min: {in_a_word(minutes <= GOAL_MIN)}."
    else:
        verdict = (
            f"It was not kept of {', '.join(lacking)}, so that the goal of {GOAL_MIN:g} min can't be judged."
        )
    return paragraph(
        f"`make bench` took {minutes:.0f} min of wall time, the runs of its sections added up ({each}); what",
        f"they took over from an earlier run is not in it. {verdict}",
    )
