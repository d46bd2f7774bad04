"""Docstrings say things by their names: words that stand for nothing are no more frequent than in other libraries."""

import ast
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("bridge", "gcs_plugin", "identify", "tui")

MOST = {
    "what": 1.2,
    "one": 8.7,
    "where": 4.5,
    "told": 0.3,
    "beside": 0.6,
    "whom": 0.3,
    "which": 12.0,
    "there": 4.5,
}
"""Times in 1 000 words: three times as often as the most that rich, textual, distributed, hypothesis, matplotlib and
aiohttp come to."""


def words():
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            for node in statements(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
                    yield from str(node.value.value).lower().replace("`", " ").split()


def statements(node):
    """All in a node, however deep; a docstring is never within an expression."""
    for part in ("body", "orelse", "finalbody", "handlers", "cases"):
        for inner in getattr(node, part, ()):
            yield inner
            yield from statements(inner)


def test_words_that_stand_for_nothing_are_rare():
    counted = Counter(word.strip(".,;:()'\"") for word in words())
    share = 1000.0 / counted.total()
    often = {word: counted[word] * share for word in MOST}
    assert {word: rate for word, rate in often.items() if rate > MOST[word]} == {}


NO_NOUNS = {"told", "one", "beside", "kin", "sure", "own"}


def test_nothing_is_named_by_a_word_that_does_not_say_what_it_is():
    names = {
        f"{path.relative_to(ROOT)}: {name}"
        for package in PACKAGES
        for path in (ROOT / package).rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        for name in _given_names(node)
        if name.strip("_").lower() in NO_NOUNS
    }
    assert not names


def _given_names(node):
    """The names that a node of the syntax tree gives: of a function, class, argument or variable."""
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        return (node.name,)
    if isinstance(node, ast.arg):
        return (node.arg,)
    return (node.id,) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store) else ()
