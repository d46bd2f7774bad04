"""Which tests could notice a change of a file: those that import it, those of its own folder first."""

import ast
import re
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

FOLDERS = ("bench", "bridge", "configs", "gcs_plugin", "identify", "tests", "tui")
DOTTED = re.compile(rf"({'|'.join(FOLDERS)})(\.\w+)*\.?")


def nearest_tests(root: Path, file: str) -> list[str]:
    """Test files that import `file`, directly or through others: those in a tests' folder of the name of the file's
    own first, then those of the folder around it; of these fewest steps first, then the smallest."""
    steps = import_steps(root, file)
    tests = [path for path in steps if path.startswith("tests/") and Path(path).name.startswith("test_")]
    folders = Path(file).parts[-2::-1]

    def far(test: str) -> tuple[int, int, int, str]:
        folder = Path(test).parent.name
        away = folders.index(folder) if folder in folders else len(folders)
        return away, steps[test], _size(root, test), test

    return sorted(tests, key=far)


@cache
def import_steps(root: Path, file: str) -> dict[str, int]:
    """How many imports lie between `file` and each file that imports it, directly (1) or through others."""
    importers: dict[str, set[str]] = {}
    for importer, imported in _imports(root).items():
        for name in imported:
            importers.setdefault(name, set()).add(importer)
    return _steps(importers, file)


@cache
def _size(root: Path, file: str) -> int:
    """The number of files that a file imports, directly or through others."""
    return len(_steps(_imports(root), file))


def _steps(neighbours: Mapping[str, set[str]], file: str) -> dict[str, int]:
    steps, ahead = {file: 0}, [file]
    for near in ahead:
        for far in neighbours.get(near, set()) - steps.keys():
            steps[far] = steps[near] + 1
            ahead.append(far)
    return steps


@cache
def _imports(root: Path) -> dict[str, set[str]]:
    return {
        str(path.relative_to(root)): {
            str(file.relative_to(root)) for file in _imported(root, path) if file.is_file()
        }
        for folder in FOLDERS
        for path in (root / folder).rglob("*.py")
    }


def _imported(root: Path, path: Path) -> Iterator[Path]:
    """What a file imports, or names in a text, as for a program that it starts; a folder's `conftest` of a test."""
    # Tests name what lies beside them, and what lies in `tests`, without a folder.
    is_test = path.relative_to(root).parts[0] == "tests"
    bases = (root, root / "tests", path.parent) if is_test else (root,)
    if is_test:
        yield path.parent / "conftest.py"
    for node in ast.walk(ast.parse(path.read_bytes())):
        match node:
            case ast.Import(names=names):
                dotted = [alias.name for alias in names]
            case ast.ImportFrom(module=str() as module, names=names):
                dotted = [module, *(f"{module}.{alias.name}" for alias in names)]
            case ast.Constant(value=str() as text) if DOTTED.fullmatch(text):
                # A name that goes on, as in f"tui.commands.{verb}", may be any of a folder.
                yield from (root / text.replace(".", "/")).glob(
                    "*.py" if text.endswith(".") else "__main__.py"
                )
                parts = text.split(".")
                dotted = [".".join(parts[:n]) for n in range(2, len(parts) + 1)]
            case _:
                continue
        for name in dotted:
            yield from (base / f"{name.replace('.', '/')}.py" for base in bases)
