"""The benchmark of bags: bags that hold what they should, and lines that judge the goal."""

from pathlib import Path

import pytest

from bench.bags import BARE, DECODED, FORMS, MAP, OURS, hour, lines_of
from identify.ingest.open import read_dive

SECONDS = 3


@pytest.mark.parametrize("form", FORMS)
def test_a_bag_of_each_form_holds_every_sample_and_opens_as_a_dive(tmp_path: Path, form: str) -> None:
    bag, columns = hour(form, tmp_path, SECONDS), tmp_path / "map.yaml"
    columns.write_text(MAP, encoding="utf-8")
    dive = read_dive(bag, columns)
    assert {name: len(signal) for name, signal in dive.signals().items()} == dict.fromkeys(
        ("velocity", "gyro", "specific_force", "attitude", "pwm"), 100 * SECONDS
    )
    assert dive.duration_s == pytest.approx(SECONDS - 0.01)
    written = bag.stat().st_mtime_ns
    assert hour(form, tmp_path, SECONDS).stat().st_mtime_ns == written


def measured(bare_s: float, ours_s: float) -> dict[str, object]:
    return {"bytes": 2e6, "messages": 900, "seconds": {BARE: bare_s, OURS: ours_s, DECODED: 9.0}}


def test_the_slowest_form_is_judged_by_the_goal() -> None:
    lines = lines_of({".bag": measured(2.0, 1.0), ".mcap": measured(1.0, 2.5)})
    assert "| `.bag` | 2 | 2 | 1 | 0.5 | 9 |" in lines
    assert "Goal of 3 times bare: 2.5 at most, met." in lines
    assert "Goal of 3 times bare: 4 at most, **missed**." in lines_of({".db3": measured(1.0, 4.0)})
