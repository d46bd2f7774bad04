"""A stamp of code, so that a figure of older code is never shown for the present one."""

import ast
import hashlib
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SIMULATED = ("bridge/*.py", "bridge/messages", "bridge/sensors", "bridge/simulator", "bridge/vehicle")
LEARNT = ("identify/*.py", "identify/estimators", "identify/ingest")


@cache
def stamp(*sources: str) -> str:
    """Ten hexadecimal digits of files and folders of code, whatever its layout and its words.

    A source is a pattern from the repository's root; files that are no Python count byte by byte.
    """
    digest = hashlib.sha256()
    for source in sources:
        for path in sorted(ROOT.glob(source)):
            for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
                text = file.read_text(encoding="utf-8")
                digest.update((_meaning(text) if file.suffix == ".py" else text).encode())
    return digest.hexdigest()[:10]


def _meaning(source: str) -> str:
    """A module's syntax without comments, layout and docstrings."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            words = [s for s in body if isinstance(s, ast.Expr) and isinstance(s.value, ast.Constant)]
            node.body = [s for s in body if s not in words]  # type: ignore[attr-defined]
    return ast.dump(tree)
