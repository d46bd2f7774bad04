"""Small changes to a module's source: a comparison, a sum, a condition or a number is another; and which tests are
closest to it."""

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from math import inf
from pathlib import Path
from random import Random

SWAPPED = {
    ast.Lt: "<=", ast.LtE: "<", ast.Gt: ">=", ast.GtE: ">", ast.Eq: "!=", ast.NotEq: "==",
    ast.Is: "is not", ast.IsNot: "is", ast.In: "not in", ast.NotIn: "in",
    ast.Add: "-", ast.Sub: "+", ast.Mult: "/", ast.Div: "*", ast.And: "or", ast.Or: "and",
}  # fmt: skip


@dataclass(frozen=True)
class Mutant:
    """A change of what stands in a file from byte `begin` to byte `end`."""

    file: str
    line: int
    begin: int
    end: int
    old: str
    new: str

    def applied(self, source: bytes) -> bytes:
        assert source[self.begin : self.end] == self.old.encode()
        return source[: self.begin] + self.new.encode() + source[self.end :]

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.old} -> {self.new}"


def mutants_of(file: str, source: bytes) -> list[Mutant]:
    """All of a file, in its order; decorators and text stay."""
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    mutants: list[Mutant] = []

    def add(line: int, begin: int, end: int, new: str) -> None:
        old = source[begin:end].decode()
        if old != new:
            mutants.append(Mutant(file, line, begin, end, old, new))

    def between(left: ast.expr, right: ast.expr, new: str) -> None:
        begin = starts[left.end_lineno - 1] + left.end_col_offset
        gap = source[begin : starts[right.lineno - 1] + right.col_offset].decode()
        old = gap.strip(" ()\\\n")
        if old and "\n" not in old and "#" not in old:
            at = begin + len(gap[: gap.index(old)].encode())
            add(left.end_lineno, at, at + len(old.encode()), new)

    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            node.decorator_list = []
    for node in ast.walk(tree):
        match node:
            case ast.Compare(ops=[op]) if type(op) in SWAPPED:
                between(node.left, node.comparators[0], SWAPPED[type(op)])
            case ast.BinOp() if type(node.op) in SWAPPED and not isinstance(
                node.left, ast.Constant | ast.JoinedStr
            ):
                between(node.left, node.right, SWAPPED[type(node.op)])
            case ast.BoolOp(values=[left, right]):
                between(left, right, SWAPPED[type(node.op)])
            case ast.Constant(value=bool() | int() | float() as value):
                begin = starts[node.lineno - 1] + node.col_offset
                other = str(not value) if isinstance(value, bool) else repr(10 * value if value else 1)
                add(node.lineno, begin, starts[node.end_lineno - 1] + node.end_col_offset, other)
            case ast.If() | ast.IfExp():
                begin = starts[node.test.lineno - 1] + node.test.col_offset
                end = starts[node.test.end_lineno - 1] + node.test.end_col_offset
                add(node.test.lineno, begin, end, f"not ({source[begin:end].decode()})")
    return sorted(mutants, key=lambda mutant: (mutant.begin, mutant.end, mutant.new))


def drawn(root: Path, folders: tuple[str, ...], count: int, seed: int) -> list[Mutant]:
    """So many, each folder's share alike, each change of a folder as likely as any other."""
    rng, each = Random(seed), count // len(folders)
    picked = []
    for folder in folders:
        files = sorted((root / folder).rglob("*.py"))
        all_of_it = [m for f in files for m in mutants_of(str(f.relative_to(root)), f.read_bytes())]
        picked += rng.sample(all_of_it, each)
    return picked


def closest_first(root: Path, judges: tuple[str, ...], file: str) -> list[str]:
    """The test files of `judges`, folders or files, by the number of imports between them and `file`, then by the
    order of `judges`."""
    away = _away(root, file)
    tests = [
        str(path.relative_to(root))
        for judge in judges
        for path in ([root / judge] if judge.endswith(".py") else sorted((root / judge).rglob("test_*.py")))
    ]
    return sorted(tests, key=lambda test: away.get(test, inf))


def _away(root: Path, file: str) -> dict[str, int]:
    """The number of imports from each file of the tree to `file`."""
    importers, away, reached = _importers(root), {file: 0}, [file]
    for near in reached:
        for importer in sorted(importers.get(near, ())):
            if importer not in away:
                away[importer] = away[near] + 1
                reached.append(importer)
    return away


@cache
def _importers(root: Path) -> dict[str, set[str]]:
    """The files that import each file of the tree."""
    importers: dict[str, set[str]] = {}
    for folder in ("bridge", "gcs_plugin", "identify", "bench", "tui", "tests"):
        for path in (root / folder).rglob("*.py"):
            for imported in _imported(root, path):
                importers.setdefault(imported, set()).add(str(path.relative_to(root)))
    return importers


def _imported(root: Path, path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_bytes())):
        match node:
            case ast.Import(names):
                dotted = [alias.name for alias in names]
            case ast.ImportFrom(module=str() as module, names=names):
                dotted = [module, *(f"{module}.{alias.name}" for alias in names)]
            case _:
                continue
        for name in dotted:
            # Tests name what lies beside them, and what lies in `tests`, without a folder.
            for base in (root, path.parent, root / "tests"):
                module_file = base / f"{name.replace('.', '/')}.py"
                if module_file.is_file():
                    yield str(module_file.relative_to(root))
