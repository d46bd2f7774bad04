"""Small changes to Python code, and a draw of them: each changes one comparison, operator, number, condition or step.

Text, docstrings, type hints, decorators and `assert` stay as they are.
"""

import ast
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from random import Random
from typing import cast

SWAPPED = {
    ast.Lt: ("<=", ">"), ast.LtE: ("<", ">"), ast.Gt: (">=", "<"), ast.GtE: (">", "<"),
    ast.Eq: ("!=",), ast.NotEq: ("==",), ast.Is: ("is not",), ast.IsNot: ("is",),
    ast.In: ("not in",), ast.NotIn: ("in",), ast.And: ("or",), ast.Or: ("and",),
    ast.Add: ("-",), ast.Sub: ("+",), ast.Mult: ("/",), ast.Div: ("*",), ast.Mod: ("*",), ast.Pow: ("*",),
    ast.FloorDiv: ("*",), ast.BitOr: ("&",), ast.BitAnd: ("|",),
}  # fmt: skip
UNARY = {ast.Not: ("not", "not not"), ast.USub: ("-", "+"), ast.Invert: ("~", "")}
CALLS = {"min": "max", "max": "min", "any": "all", "all": "any", "minimum": "maximum", "maximum": "minimum"}
STEPS = (ast.AugAssign, ast.Raise, ast.Continue, ast.Break)


@dataclass(frozen=True)
class Mutant:
    """A change of the bytes `begin` to `end` of a file, from `old` to `new`."""

    file: str
    line: int
    begin: int
    end: int
    old: str
    new: str

    def applied(self, source: bytes) -> bytes:
        return source[: self.begin] + self.new.encode() + source[self.end :]

    def __str__(self) -> str:
        old, new = (" ".join(text.split()) or "nothing" for text in (self.old, self.new))
        return f"{self.file}:{self.line}: {old} -> {new}"


def drawn(root: Path, folder: str, count: int, seed: int) -> list[Mutant]:
    """So many mutants of a folder's files: each place as likely as any other, and each change of a place.

    A place's lot depends on its own line alone, so that most of the draw stays when other lines change.
    """
    lots = []
    for file in sorted((root / folder).rglob("*.py")):
        source, seen = file.read_bytes(), Counter[str]()
        lines = source.decode().splitlines()
        for place in places(str(file.relative_to(root)), source):
            line = lines[place[0].line - 1].strip()
            key = f"{seed} {place[0].file} {line} {place[0].old}"
            seen[key] += 1
            lot = Random(f"{key} {seen[key]}")
            lots.append((lot.random(), lot.choice(place)))
    return [mutant for _, mutant in sorted(lots, key=lambda lot: lot[0])[:count]]


def places(file: str, source: bytes) -> Iterator[tuple[Mutant, ...]]:
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))

    def begin_of(node: ast.AST) -> int:
        at = cast(ast.expr, node)
        return starts[at.lineno - 1] + at.col_offset

    def end_of(node: ast.AST) -> int:
        at = cast(ast.expr, node)
        return starts[cast(int, at.end_lineno) - 1] + cast(int, at.end_col_offset)

    def change(begin: int, end: int, news: tuple[str, ...]) -> tuple[Mutant, ...]:
        old, line = source[begin:end].decode(), source[:begin].count(b"\n") + 1
        return tuple(Mutant(file, line, begin, end, old, new) for new in dict.fromkeys(news) if new != old)

    def whole(node: ast.AST, *news: str) -> tuple[Mutant, ...]:
        return change(begin_of(node), end_of(node), news)

    def between(left: ast.expr, right: ast.expr, operator: ast.AST) -> tuple[Mutant, ...]:
        begin = end_of(left)
        gap = source[begin : begin_of(right)]
        old = gap.strip(b" ()\\\n")
        if type(operator) not in SWAPPED or not old or b"\n" in old or b"#" in old:
            return ()
        at = begin + gap.index(old)
        return change(at, at + len(old), SWAPPED[type(operator)])

    def changes(node: ast.AST) -> Iterator[tuple[Mutant, ...]]:
        match node:
            case ast.Compare(left=left, ops=ops, comparators=comparators):
                for a, operator, b in zip([left, *comparators], ops, comparators, strict=False):
                    yield between(a, b, operator)
            case ast.BoolOp(op=operator, values=values):
                for a, b in pairwise(values):
                    yield between(a, b, operator)
            case ast.BinOp(left=left, op=operator, right=right) if not (_is_text(left) or _is_text(right)):
                yield between(left, right, operator)
            case ast.UnaryOp(op=operator) if type(operator) in UNARY:
                old, new = UNARY[type(operator)]
                yield change(begin_of(node), begin_of(node) + len(old), (new,))
            case ast.Constant(value=bool() as value):
                yield whole(node, str(not value))
            case ast.Constant(value=int() as value):
                yield whole(node, str(2 * value), str(value + 1))
            case ast.Constant(value=float() as value):
                yield whole(
                    node, *(f"{new:.10g}" for new in (2.0 * value, value + 1.0, 0.1 * value) if new != value)
                )
            case ast.Call(func=ast.Name(id=name) as called) if name in CALLS:
                yield whole(called, CALLS[name])
            case ast.Call(func=ast.Attribute(attr=name) as called) if name in CALLS:
                yield change(end_of(called) - len(name), end_of(called), (CALLS[name],))
            case ast.Return(value=ast.expr() as value) if not (_is_none(value) or _is_text(value)):
                yield whole(value, "None")
            case ast.Expr(value=ast.Call()) | ast.Assign(targets=[ast.Attribute() | ast.Subscript()]):
                yield whole(node, "pass")
            case _ if isinstance(node, STEPS):
                yield whole(node, "pass")
            case ast.If(test=test) | ast.While(test=test) | ast.IfExp(test=test):
                yield change(
                    begin_of(test), end_of(test), (f"not ({source[begin_of(test) : end_of(test)].decode()})",)
                )
            case ast.comprehension(ifs=tests):
                for test in tests:
                    yield whole(test, f"not ({source[begin_of(test) : end_of(test)].decode()})")

    for node in _walked(ast.parse(source)):
        yield from filter(None, changes(node))


def _walked(node: ast.AST) -> Iterator[ast.AST]:
    """All that can be changed: neither text nor a hint."""
    yield node
    for name, field in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list"):
            continue
        for inner in field if isinstance(field, list) else [field]:
            if isinstance(inner, ast.AST) and not isinstance(inner, ast.JoinedStr | ast.Assert):
                yield from _walked(inner)


def _is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and isinstance(node.value, str))


def _is_none(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and node.value is None
