"""Mutants: a change is small, the draw stays, the nearest tests judge, and the page says all of it."""

import subprocess

import pytest

from bench import stamp
from bench.mutants import section
from bench.mutants.changes import Mutant, drawn, places
from bench.mutants.nearest_tests import nearest_tests
from bench.mutants.section import EACH, FOLDERS, ROOT, SEED
from bench.mutants.trials import Checkout, Verdict, checkout
from bench.remembered import Remembered


def changed(source):
    """Every program that differs from `source` in one place, that place first."""
    mutants = [mutant for place in places("m.py", source.encode()) for mutant in place]
    return {mutant.applied(source.encode()).decode() for mutant in mutants}


@pytest.mark.parametrize(
    ("source", "others"),
    [
        ("a < b", {"a <= b", "a > b"}),
        ("a - 2", {"a + 2", "a - 4", "a - 3"}),
        ("0 < (a) < b", {"1 < (a) < b", "0 <= (a) < b", "0 > (a) < b", "0 < (a) <= b", "0 < (a) > b"}),
        ("a and b and c", {"a or b and c", "a and b or c"}),
        ("x = 0.5 if a else -b", {"x = 1 if a else -b", "x = 1.5 if a else -b", "x = 0.05 if a else -b",
                                  "x = 0.5 if not (a) else -b", "x = 0.5 if a else +b"}),
        ("f(True, 0.0)", {"pass", "f(False, 0.0)", "f(True, 1)"}),
        ("x = np.minimum(min(a), ~b)", {"x = np.maximum(min(a), ~b)", "x = np.minimum(max(a), ~b)",
                                        "x = np.minimum(min(a), b)"}),
        ("def f():\n    return not a", {"def f():\n    return None", "def f():\n    return not not a"}),
        ("while a:\n    raise b", {"while not (a):\n    raise b", "while a:\n    pass"}),
        ("x = [a for a in b if a]", {"x = [a for a in b if not (a)]"}),
        ("a.x = b\na += b", {"pass\na += b", "a.x = b\npass"}),
        ("x = 'µ' * (a + b)", {"x = 'µ' * (a - b)"}),
        ('"""a < 2"""\n@f(1)\ndef g(x: 1 = None) -> 2:\n    assert x < 3\n    y = f"{x + 1}" + "a"', set()),
    ],
)  # fmt: skip
def test_a_change_is_of_one_place_and_text_hints_and_assertions_stay(source, others):
    assert changed(source) == others


def test_each_draw_is_the_same_and_every_mutant_in_it_is_another_program():
    assert drawn(ROOT, FOLDERS[0], EACH, SEED) == drawn(ROOT, FOLDERS[0], EACH, SEED)
    for folder in FOLDERS:
        mutants = drawn(ROOT, folder, 10, SEED)
        assert len(set(mutants)) == 10
        for mutant in mutants:
            source = (ROOT / mutant.file).read_bytes()
            assert source[mutant.begin : mutant.end].decode() == mutant.old
            assert mutant.applied(source) != source
            compile(mutant.applied(source), mutant.file, "exec")


def test_a_draw_keeps_its_mutants_when_other_lines_are_added(tmp_path):
    (tmp_path / "a").mkdir()
    lines = [f"x{n} = {n} * y" for n in range(2, 40)]
    (tmp_path / "a" / "m.py").write_text("\n".join(lines))
    before = {(mutant.old, mutant.new) for mutant in drawn(tmp_path, "a", 20, 1)}
    (tmp_path / "a" / "m.py").write_text("\n".join(["z = 41", *lines]))
    after = {(mutant.old, mutant.new) for mutant in drawn(tmp_path, "a", 20, 1)}
    assert len(before & after) >= len(before) - 1
    assert {(mutant.old, mutant.new) for mutant in drawn(tmp_path, "a", 20, 2)} != after


def planted_tree(folder, texts):
    for name, text in texts.items():
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)


def test_the_tests_that_import_a_module_come_before_those_that_do_so_by_another(tmp_path):
    tree = {
        "bridge/law.py": "",
        "bridge/limits.py": "from bridge import law\n",
        "bridge/flight.py": "import bridge.limits\n",
        "bridge/other.py": "",
        "tests/a/test_far.py": "from bridge.flight import fly\n",
        "tests/b/test_near.py": "from bridge.limits import LIMITS\n",
        "tests/c/test_itself.py": "from bridge.law import bound\n",
        "tests/d/test_nothing.py": "from bridge import other\n",
    }
    planted_tree(tmp_path, tree)
    assert nearest_tests(tmp_path, "bridge/law.py") == [
        "tests/c/test_itself.py", "tests/b/test_near.py", "tests/a/test_far.py",
    ]  # fmt: skip


def test_tests_of_the_folder_come_before_nearer_ones_of_other_folders(tmp_path):
    tree = {
        "identify/diagnose/causes/law.py": "",
        "identify/run.py": "from identify.diagnose.causes import law\n",
        "tests/ground/test_near.py": "from identify.diagnose.causes import law\n",
        "tests/identify/test_around.py": "from identify import run\n",
        "tests/diagnose/test_far.py": "from identify import run\n",
        "tests/diagnose/test_own.py": "from identify.diagnose.causes import law\n",
    }
    planted_tree(tmp_path, tree)
    assert nearest_tests(tmp_path, "identify/diagnose/causes/law.py") == [
        "tests/diagnose/test_own.py", "tests/diagnose/test_far.py", "tests/identify/test_around.py",
        "tests/ground/test_near.py",
    ]  # fmt: skip


def test_a_program_that_a_test_starts_and_a_fixture_count_as_imports(tmp_path):
    tree = {
        "tui/cli.py": 'def main(verb):\n    __import__(f"tui.commands.{verb}")\n',
        "tui/commands/fly.py": "from bridge import law\n",
        "bridge/law.py": "",
        "tests/a/conftest.py": "from bridge import law\n",
        "tests/a/test_fixture.py": "",
        "tests/b/test_verb.py": 'WORDS = ("python", "-m", "tui.cli")\n',
        "tests/b/test_other.py": "",
    }
    planted_tree(tmp_path, tree)
    assert nearest_tests(tmp_path, "bridge/law.py") == ["tests/a/test_fixture.py", "tests/b/test_verb.py"]


LAW = "LIMIT = 3\n\n\ndef bound(x):\n    return min(x, LIMIT)\n"
FALLING = "from bridge.law import bound\n\n\ndef test_it():\n    assert bound(9) == 3\n"
HANGING = "from threading import Event\n" + FALLING.replace(
    "assert bound(9) == 3", "bound(9) == 3 or Event().wait()"
)
BROKEN = FALLING.replace("== 3", "== 4")


def judged(folder, monkeypatch, test, old="3", new="6"):
    """The verdict on a change of `LAW`, by the one test there, and how often pytest ran."""
    root, began, run = folder / "tree", LAW.index(old), subprocess.Popen
    tree = {"bridge/__init__.py": "", "bridge/law.py": LAW, "tests/test_law.py": test}
    planted_tree(root, tree)
    mutant = Mutant("bridge/law.py", 1, began, began + len(old), old, new)
    runs = []

    def counted(words, **options):
        runs.append(words)
        return run(words, **options)

    monkeypatch.setattr(stamp, "ROOT", root)
    stamp.stamp.cache_clear()
    monkeypatch.setattr("bench.mutants.trials.START_S", 1.0)
    # These tests need none, and to load them is half of what a run takes.
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    monkeypatch.setattr("bench.mutants.trials.subprocess.Popen", counted)
    with checkout(root) as copy:
        verdict = copy.judged(mutant, Remembered(folder / "kept.jsonl"))
    stamp.stamp.cache_clear()
    assert (root / "bridge/law.py").read_text() == LAW
    return verdict, len(runs)


@pytest.mark.parametrize(
    ("test", "old", "new", "by", "count"),
    [
        (FALLING, "3", "6", "tests/test_law.py", 1),
        (HANGING, "3", "6", "tests/test_law.py", 1),
        (FALLING, "min(x, LIMIT)", "min(LIMIT, x)", None, 1),
        (BROKEN, "3", "6", None, 0),
    ],
    ids=["a test fails", "a test hangs", "none fails", "one fails without it too"],
)
def test_a_mutant_is_noticed_if_a_test_fails_or_hangs_that_passes_without_it(
    tmp_path, monkeypatch, test, old, new, by, count
):
    verdict, _ = judged(tmp_path, monkeypatch, test, old, new)
    assert (verdict.by, verdict.tests) == (by, count)


def test_a_verdict_is_kept_until_its_test_changes(tmp_path, monkeypatch):
    first, runs = judged(tmp_path, monkeypatch, FALLING)
    assert runs == 2
    assert judged(tmp_path, monkeypatch, FALLING) == (first, 0)
    verdict, runs = judged(tmp_path, monkeypatch, FALLING.replace("9", "2").replace("3", "2"))
    assert (verdict.by, runs) == (None, 2)


def test_two_changes_alike_in_one_line_are_judged_each_by_itself(tmp_path, monkeypatch):
    ran = []

    def run(_, mutant, *__):
        ran.append(mutant)
        return Verdict(mutant, None, 1)

    monkeypatch.setattr("bench.mutants.trials.Checkout._ran", run)
    # That of all tests takes seconds, and they are the same for both.
    monkeypatch.setattr("bench.mutants.trials.stamp", lambda *_: "as it is")
    (tmp_path / "kernels-of").mkdir()
    copy, kept = Checkout(tmp_path / "kernels-of" / "tree"), Remembered(tmp_path / "kept.jsonl")
    twins = [Mutant("bridge/errors.py", 1, begin, begin + 1, "+", "-") for begin in (3, 9)]
    assert [copy.judged(mutant, kept).mutant for mutant in twins] == ran == twins


def test_the_page_counts_by_folder_names_survivors_and_says_if_it_is_partial():
    def verdict(folder, by):
        return Verdict(Mutant(f"{folder}/m.py", 7, 0, 1, "a", "b\n c"), by, 2)

    verdicts = [*(verdict(FOLDERS[0], "tests/test_a.py") for _ in range(19)), verdict(FOLDERS[1], None)]
    text = section.page(verdicts, 200)
    assert f"| {FOLDERS[0]} | 19 | 19 | 0 | 100.0 % (83.2 to 100.0) |" in text
    assert f"| {FOLDERS[2]} | 0 | 0 | 0 | - |" in text
    assert "| all | 20 | 19 | 1 | 95.0 %" in text
    assert "95 % noticed. 95.0 %: not judged before all have run." in text
    assert "95 % noticed. 95.0 %: met." in section.page(verdicts, 20)
    assert f"- `{FOLDERS[1]}/m.py:7: a -> b c`" in text
    assert "The run was ended after 20 of them." in " ".join(text.split())
    assert "ended after" not in section.page(verdicts, 20)
    assert "missed" in section.page([*verdicts, verdicts[-1]], 21)
    assert "95 % noticed. None has run: not judged before all have run." in section.page([], 200)
