"""The example of real faults, on a few of its runs where they are at hand."""

import importlib.util
import sys
from pathlib import Path

import pytest
from fakes.shared import shared

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "haizhe"


@pytest.fixture
def example(monkeypatch):
    """The example's script as a module."""
    specification = importlib.util.spec_from_file_location("haizhe_run", EXAMPLE / "run.py")
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    monkeypatch.setitem(sys.modules, "haizhe_run", module)
    specification.loader.exec_module(module)
    return module


def test_the_example_tells_a_weight_and_a_wrong_depth_from_sound_runs(example):
    table = example.run(shared("data", "haizhe"), most=50).splitlines()
    for kind in ("AddWeight", "PressureGain_constant"):
        ours = next(line.split() for line in table if line.startswith(kind))
        assert ours[1] == ours[2] != "0"


def test_without_the_forests_library_a_sentence_says_what_to_install(example, monkeypatch):
    monkeypatch.setattr(example, "find_spec", lambda _: None)
    (line,) = example.forest_lines([], [], {})
    assert "pip install scikit-learn" in line


def test_runs_are_split_by_a_hash_of_their_kind_and_number_and_left_over_runs_are_no_group(example):
    runs = [example.Recorded("A", str(number), None) for number in range(400)]
    assert 150 < sum(run.is_to_develop for run in runs) < 250
    groups = list(example.groups_of(runs[:25], 10))
    assert [(kind, len(group)) for kind, group in groups] == [("A", 10), ("A", 10)]
    assert [run.mark for _, group in groups for run in group] == sorted(
        run.mark for _, group in groups for run in group
    )


def test_each_hash_judges_both_halves_and_the_shares_and_wrong_kinds_are_summed_up(example, monkeypatch):
    runs = [example.Recorded("A", str(number), None) for number in range(200)]
    judged: list[set[str]] = []

    def answers(known, judged_runs, _file, _group):
        assert not {run.number for run in known} & {run.number for run in judged_runs}
        judged.append({run.number for run in judged_runs})
        return 1, {"A": [(True, "no_gap"), (len(judged) > 1, "no_gap")]}

    monkeypatch.setattr(example, "recorded", lambda *_: iter(runs))
    monkeypatch.setattr(example, "our_answers", answers)
    lines = example.splits(Path("folder"), 2).splitlines()
    assert judged[0] | judged[1] == judged[2] | judged[3] == {run.number for run in runs}
    assert judged[0] not in (judged[2], judged[3])
    assert lines[0] == "hash 0: 1 of 2 right, 50%"
    assert lines[-2:] == ["50% to 100%, 88% on average", "wrong: A 1 of 8"]
