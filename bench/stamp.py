"""A stamp of code, so that a figure of older code is never shown for the present code."""

import ast
import hashlib
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("bench", "bridge", "gcs_plugin", "identify", "tui")
KEEPING = ("bench/remembered.py", "bench/stamp.py", "bench/words.py")
"""What keeps results and writes them down makes no figure: a change there discards none."""

SHOWING = (
    *("gcs_plugin/", "identify/diagnose/words/", "identify/report/", "identify/words.py", "tui/"),
    *("bridge/ardusub/", "bridge/command_line.py", "bridge/flight/", "bridge/onboard/"),
)
"""What puts a verb's answer into words, shows it, or sends it to a vehicle, and what runs on board of one. The verb
itself belongs to the answer."""

_BY_NAME = re.compile(r'"((?:bench|identify)(?:\.\w+)+)"')
"""A module that is imported as its name in a table says."""


@dataclass(frozen=True)
class Reached:
    """The files or folders of `modules` and all files of PACKAGES that they import, directly or not; of these those
    whose path from the repository's root `belongs`.

    Looked for where a stamp is taken and not where the source is named: every file on the way is parsed. So an import
    inside a function counts too. A package's own `__init__` is left out.
    """

    modules: tuple[str, ...]
    belongs: Callable[[str], bool]


Source = str | Reached
"""A source that is a text is a pattern from the repository's root."""


@cache
def stamp(*sources: Source) -> str:
    """Ten hexadecimal digits of the code in files and folders, independent of layout, comments and docstrings.

    Nor does it depend on the names and folders of the files, so that code that only moves keeps its figures. Files
    other than Python count byte by byte. It is that of the first call: what runs is the code from then.
    """
    return afresh(*sources)


def afresh(*sources: Source) -> str:
    """The stamp of the files as they are now."""
    texts = ((file, file.read_text(encoding="utf-8")) for file in files(*sources))
    digests = sorted(_digest(text, file.suffix == ".py") for file, text in texts)
    return hashlib.sha256(b"".join(digests)).hexdigest()[:10]


@cache
def _digest(text: str, is_code: bool) -> bytes:
    """Of a file's text, once for all the stamps that it is in."""
    return hashlib.sha256((_meaning(text) if is_code else text).encode()).digest()


def files(*sources: Source) -> list[Path]:
    return sorted({file for source in sources for file in _of_source(source)})


def reached(*modules: str, belongs: Callable[[str], bool] = lambda _: True) -> Reached:
    return Reached(modules, belongs)


def makes_answer(path: str) -> bool:
    """Whether the code at a path, reached by a verb, makes its answer: a page that is drawn otherwise changes none."""
    return path.startswith("tui/commands/") or not path.startswith(SHOWING)


def _of_source(source: Source) -> Iterable[Path]:
    if isinstance(source, Reached):
        return walked(source)
    paths = ROOT.glob(source)
    return (file for path in paths for file in (path.rglob("*.py") if path.is_dir() else [path]))


@cache
def walked(source: Reached) -> frozenset[Path]:
    seen: set[Path] = set()
    ahead = files(*source.modules)
    while ahead:
        file = ahead.pop()
        if file not in seen:
            seen.add(file)
            ahead += _imported(file)
    return frozenset(file for file in seen if source.belongs(str(file.relative_to(ROOT))))


@cache
def _imported(file: Path) -> list[Path]:
    text = file.read_text(encoding="utf-8")
    names = set(_BY_NAME.findall(text))
    for node in _statements(ast.parse(text)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    paths = {name.replace(".", "/") + ".py" for name in names if name.split(".")[0] in PACKAGES} - {*KEEPING}
    return [ROOT / path for path in paths if (ROOT / path).is_file()]


def _statements(node: ast.AST) -> Iterator[ast.AST]:
    """All statements in a node, however deep; to walk through their expressions too takes ten times as long."""
    for part in ("body", "orelse", "finalbody", "handlers", "cases"):
        for inner in getattr(node, part, ()):
            yield inner
            yield from _statements(inner)


def _meaning(source: str) -> str:
    """A module's syntax without comments, layout and docstrings, and the names that it imports, not where from."""
    tree = ast.parse(source)
    imported: set[str] = set()
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            imports = [s for s in body if isinstance(s, ast.Import | ast.ImportFrom)]
            imported |= {f"{alias.name} {alias.asname}" for s in imports for alias in s.names}
            words = [s for s in body if isinstance(s, ast.Expr) and isinstance(s.value, ast.Constant)]
            node.body = [s for s in body if s not in words and s not in imports]  # type: ignore[attr-defined]
    return f"{sorted(imported)} {ast.dump(tree)}"


CURVES = "configs/thrusters/*.csv"
PAPERS_VEHICLE = (CURVES, "configs/gains.yaml", "configs/vehicles/ruvifist*.yaml")
VEHICLES = (CURVES, "configs/vehicles/*.yaml")
"""Files that the simulated dives of the source paper's vehicle and of the drawn ones read beside the code."""
