"""A stamp of code, so that a figure of older code is never shown for the present code."""

import ast
import hashlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
ROOMS = ("bridge", "gcs_plugin", "identify", "tui")


@cache
def stamp(*sources: str) -> str:
    """Ten hexadecimal digits of the code in files and folders, independent of layout, comments and docstrings.

    Nor does it depend on the names and folders of the files, so that code that only moves keeps its figures. A source
    is a pattern from the repository's root; files other than Python count byte by byte.
    """
    texts = ((file, file.read_text(encoding="utf-8")) for file in files(*sources))
    meanings = (_meaning(text) if file.suffix == ".py" else text for file, text in texts)
    digests = sorted(hashlib.sha256(meaning.encode()).digest() for meaning in meanings)
    return hashlib.sha256(b"".join(digests)).hexdigest()[:10]


def files(*sources: str) -> list[Path]:
    """All files of the sources, each once, in order."""
    paths = [path for source in sources for path in ROOT.glob(source)]
    return sorted({file for path in paths for file in (path.rglob("*.py") if path.is_dir() else [path])})


@cache
def reached(*modules: str) -> tuple[str, ...]:
    """The given files or folders and all files of ROOMS that they import, directly or not, as sources of a stamp.

    Found by parsing, so that an import inside a function counts too. A package's own `__init__` and files of the
    benchmark are left out unless they are given.
    """
    seen: set[Path] = set()
    ahead = files(*modules)
    while ahead:
        file = ahead.pop()
        if file not in seen:
            seen.add(file)
            ahead += _imported(file)
    return tuple(sorted(str(file.relative_to(ROOT)) for file in seen))


@cache
def _imported(file: Path) -> list[Path]:
    names: set[str] = set()
    for node in _statements(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    paths = [name.replace(".", "/") + ".py" for name in names if name.split(".")[0] in ROOMS]
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
SIMULATED = (
    *reached("bridge/simulator", "bridge/onboard"),
    CURVES,
    "configs/gains.yaml",
    "configs/vehicles/ruvifist*.yaml",
)
MISSIONS = (*reached("bench/missions"), "bench/accuracy/trial.py", CURVES, "configs/vehicles/*.yaml")
LEARNT = (
    *reached(
        "bench/reproduce/paper.py",
        "identify/estimators/likelihood",
        "identify/estimators/pinn",
        "identify/estimators/table.py",
        "identify/ingest/open.py",
    ),
    CURVES,
)
BASELINES = (*reached("bench/baselines", "bench/reproduce/paper.py"), CURVES)
"""Code behind the paper's campaigns, the drawn missions, the product's answers and those of the baselines."""
