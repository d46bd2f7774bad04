"""Reading and writing parameter files: `NAME,value`, `NAME value`, and QGroundControl's tab-separated form.

The whole file is read and checked before any of it is used. Values are written as the shortest text that reads back to
the same float32, so that two files can be compared by eye.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bridge.errors import ParamRejected, ParamUnwritten
from bridge.files import size_to_read, write_whole
from bridge.schema import why_unread
from bridge.text import printable
from gcs_plugin.params import float32

LARGEST_FILE_BYTES: Final = 4_000_000
NAME_LENGTH: Final = 16
REAL32: Final = 9
SUFFIXES: Final = (".param", ".parm", ".params")

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
LINE_END = re.compile(r"\r\n|\n|\r")
"""`splitlines` also splits at form feeds, where other programs don't."""
_SAVED_OF = "Onboard parameters for Vehicle"
"""Start of the first line of QGroundControl's files."""
_SAVED_OF_LINE = re.compile(rf"#\s*{_SAVED_OF} (\d{{1,3}})\s*")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity)(\(.*\))?", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Entry:
    """Line of a parameter file; `system` is None in formats without it."""

    name: str
    value: float
    line: int
    system: int | None = None


def parse(text: str, source: str) -> list[Entry]:
    """Parse every entry of a file's text; `source` names the file in messages.

    Raises ParamRejected with the line number for anything that is not a name and a finite float32, and for a file
    without parameters.
    """
    entries = []
    for number, line in enumerate(LINE_END.split(text), start=1):
        content = line.split("#", 1)[0].strip()
        if content:
            entries.append(_entry(content, number, source))
    if not entries:
        raise ParamRejected(f"{source}: holds no parameters; give a file with lines such as 'FF0_M_U,24.4'")
    return entries


def _entry(content: str, line: int, source: str) -> Entry:
    place = f"{source}, line {line}"
    parts = [part for part in re.split(r"[\s,]+", content) if part]
    if len(parts) == 5 and parts[0].isdecimal() and parts[1].isdecimal() and parts[4].isdecimal():
        return Entry(_name(parts[2], place), _value(parts[2], parts[3], place), line, int(parts[0]))
    if len(parts) != 2:
        raise ParamRejected(f"{place}: '{_shown(content)}' is not a name and a value; mend that line")
    return Entry(_name(parts[0], place), _value(parts[0], parts[1], place), line)


def _name(word: str, where: str) -> str:
    if not _NAME.fullmatch(word):
        raise ParamRejected(
            f"{where}: '{_shown(word)}' is no parameter name (letters, digits, _); mend that line"
        )
    if len(word) > NAME_LENGTH:
        raise ParamRejected(
            f"{where}: '{_shown(word)}' is longer than {NAME_LENGTH} characters; mend that line"
        )
    return word


def _value(name: str, word: str, where: str) -> float:
    if _NOT_FINITE.fullmatch(word):
        raise ParamRejected(
            f"{where}: {name} is {word}, not a finite number; nothing was sent, mend that line"
        )
    if not _NUMBER.fullmatch(word):
        raise ParamRejected(f"{where}: {name} has '{_shown(word)}' for a number; mend that line")
    value = float(word)
    if value == 0.0 and word.lower().partition("e")[0].strip("+-0."):
        raise ParamRejected(f"{where}: {name} is {_shown(word)}, too small for any number; mend that line")
    try:
        return float32.from_user(value)
    except ValueError as error:
        raise ParamRejected(f"{where}: {name}: {error}; mend that line") from None


def _shown(text: str) -> str:
    return printable(text[:40], "?")


def system_of(path: Path) -> int | None:
    """The MAVLink system whose values a file holds, from its comment or its lines; None if it names no system.

    Raises ParamRejected for an unreadable file and for a file with the values of several systems.
    """
    text = text_in(path)
    saved = (int(match[1]) for line in LINE_END.split(text) if (match := _SAVED_OF_LINE.fullmatch(line)))
    listed = (entry.system for entry in parse(text, str(path)) if entry.system is not None)
    systems = sorted({*saved, *listed})
    if len(systems) > 1:
        both = ", ".join(map(str, systems))
        raise ParamRejected(f"{path}: holds values of several vehicles ({both}); keep the lines of one")
    return systems[0] if systems else None


def check_system(path: Path, named: int | None, system: int, otherwise: str) -> None:
    """Raise ParamRejected if the file was saved from another system (`named`) than the target `system`.

    `otherwise` ends the message: the option that lets the file pass.
    """
    if named not in (None, system):
        raise ParamRejected(
            f"{path}: saved from vehicle {named}, this is vehicle {system}; nothing was sent. Use this vehicle's "
            f"file{otherwise}"
        )


def text_in(path: Path) -> str:
    """Text of a parameter file. Raises ParamRejected if it can't be read or is too long."""
    try:
        size = size_to_read(path)
        if size is None:
            raise ParamRejected(f"{path}: is no file; give a .param file")
        if size > LARGEST_FILE_BYTES:
            raise ParamRejected(f"{path}: {size} bytes is too long for a parameter file; give another")
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise ParamRejected(f"{path}: no such file; check the name") from None
    except (OSError, UnicodeDecodeError) as error:
        raise ParamRejected(f"{path}: {why_unread(error)}; give a .param file") from None


def read_parameters(path: Path) -> dict[str, float]:
    """The values of a file by name, each exactly a float32.

    Raises ParamRejected for a file that can't be read, a malformed line, NaN, or a name that is given twice.
    """
    entries: dict[str, Entry] = {}
    for entry in parse(text_in(path), str(path)):
        if (before := entries.get(entry.name)) is not None:
            both = f"{before.line} and {entry.line}"
            raise ParamRejected(f"{path}: {entry.name} is given twice, on lines {both}; keep one")
        entries[entry.name] = entry
    return {name: entry.value for name, entry in entries.items()}


def text_of(
    values: Mapping[str, float],
    suffix: str,
    comments: Iterable[str] = (),
    system: int = 1,
    component: int = 1,
) -> str:
    """Text of a file in the form that its suffix stands for.

    `.param`, of Mission Planner and MAVProxy: name, comma, value. `.parm`, the classic form: name padded to 16
    characters, a blank, value. `.params`, of QGroundControl: system, component, name, value and type, between tabs.
    Raises ValueError, with its name, for a value that is not finite.
    """
    head = [f"# {comment}" for comment in comments]
    texts = {name: _text(name, value) for name, value in values.items()}
    if suffix == ".param":
        lines = [f"{name},{text}" for name, text in texts.items()]
    elif suffix == ".parm":
        lines = [f"{name:<{NAME_LENGTH}} {text}" for name, text in texts.items()]
    else:
        head.append("# Vehicle-Id Component-Id Name Value Type")
        lines = [f"{system}\t{component}\t{name}\t{text}\t{REAL32}" for name, text in texts.items()]
    return "\n".join(head + lines) + "\n"


def _text(name: str, value: float) -> str:
    try:
        return float32.text(value)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None


def write_parameters(
    path: Path,
    values: Mapping[str, float],
    comments: Iterable[str] = (),
    system: int | None = None,
    component: int = 1,
) -> None:
    """Write a parameter file atomically, in the form that its suffix names (.param, .parm, .params).

    `system` is the vehicle that the values were read from, None for values of no particular vehicle. Names that no
    parameter can have are left out, and a comment in the file lists them. Raises ParamRejected for another suffix or a
    value that is not finite, ParamUnwritten if the file can't be written.
    """
    saved_of = () if system is None else (f"{_SAVED_OF} {system}",)
    words = (*saved_of, *(printable(" ".join(comment.split()), "?") for comment in comments))
    strange = [name for name in values if not _NAME.fullmatch(name)]
    if strange:
        words += (f"left out, since no parameter has such a name: {', '.join(map(_shown, strange))}",)
        values = {name: value for name, value in values.items() if name not in strange}
    if path.suffix not in SUFFIXES:
        raise ParamRejected(f"{path}: a parameter file ends in .param, .parm or .params; name it so")
    try:
        text = text_of(values, path.suffix, words, 1 if system is None else system, component)
    except ValueError as error:
        raise ParamRejected(f"{path}: not written, {error}; mend the value") from None
    replace_text(path, text)


def replace_text(path: Path, text: str) -> None:
    """Replace the content of `path` by `text`, atomically. Raises ParamUnwritten if that fails."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, text, synced=True)
    except OSError as error:
        raise unwritten(path, error) from None


def unwritten(path: Path, error: OSError) -> ParamUnwritten:
    """The error for a file that can't be written."""
    if not path.parent.is_dir():
        return ParamUnwritten(f"{path}: {path.parent} is no folder; choose another place")
    return ParamUnwritten(f"{path}: can't be written ({error.strerror}); choose another place")
