"""Builds nested frozen dataclasses from plain YAML data; errors name the file, the key and the nearest known key."""

import dataclasses
import difflib
import re
import sys
import types
import typing
from pathlib import Path
from typing import Any, Final, TypeVar, Union, get_args, get_origin

import yaml

from bridge import plain
from bridge.errors import ConfigError
from bridge.files import size_to_read
from bridge.text import printable

T = TypeVar("T")

LONGEST_SHOWN: Final = 80
_POWER_OF_TEN: Final = re.compile(r"[-+]?[0-9]{1,40}([.][0-9]{0,40})?[eE][-+]?[0-9]{1,3}")
"""Numbers such as 8e-05 and 1.5e3, which YAML 1.1 takes for text: it asks for a dot and the exponent's sign."""


def load_yaml(path: Path) -> Any:
    """Return the plain data of a YAML file. Raises ConfigError if the file can't be read as YAML."""
    try:
        if size_to_read(path) is None:
            raise ConfigError(f"{path}: is no file, but a pipe or a device; give a YAML file")
        with path.open("rb") as file:
            data = file.read(plain.MOST_BYTES + 1)
        if len(data) > plain.MOST_BYTES:
            raise ConfigError(
                f"{path}: is longer than the {plain.MOST_BYTES // 1000} kB that a YAML file of ours may have; "
                "give another"
            )
        text = data.decode("utf-8")
    except FileNotFoundError:
        raise ConfigError(f"{path}: no such file; check the name") from None
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: {why_unread(error)}; give a YAML file") from None
    try:
        return plain.from_yaml(text)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = f" at line {mark.line + 1}, column {mark.column + 1}" if mark else ""
        problem = getattr(error, "problem", None) or "malformed"
        advice = "mend that line" if mark else "give a YAML file"
        raise ConfigError(f"{path}: not valid YAML{place} ({problem}); {advice}") from None
    except ValueError as error:
        raise ConfigError(f"{path}: a value in it can't be read ({error}); mend that value") from None


def why_unread(error: OSError | UnicodeDecodeError) -> str:
    """Say why a file could not be read as text, in words that follow its name."""
    if isinstance(error, IsADirectoryError):
        return "is a folder"
    if isinstance(error, UnicodeDecodeError):
        return "is no text"
    return f"can't be read ({error.strerror})"


def build(cls: type[T], data: Any, where: str) -> T:
    """Return an instance of dataclass `cls` from plain `data`; `where` names the place in error messages.

    Raises ConfigError for an unknown or missing key, a value of the wrong type, a number that is not finite, or a
    value that the class refuses in `__post_init__` with ValueError.
    """
    if not isinstance(data, dict):
        raise ConfigError(_no_keys(data, where))
    hints = typing.get_type_hints(cls)
    fields = {f.name: f for f in dataclasses.fields(cls) if f.init}  # type: ignore[arg-type]
    for key in data:
        if key not in fields:
            near = difflib.get_close_matches(_short(key), fields, n=1, cutoff=0.5)
            hint = f"did you mean '{near[0]}'?" if near else f"known keys: {', '.join(fields)}"
            raise ConfigError(f"{where}: unknown key '{_short(key)}'; {hint}")
    values = {}
    for name, field in fields.items():
        if name in data:
            values[name] = _convert(hints[name], data[name], f"{where}: {name}")
        elif field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING:
            raise ConfigError(f"{where}: the key '{name}' is missing; add it")
    try:
        return cls(**values)
    except ValueError as error:
        raise ConfigError(f"{where}: {error}") from None


def _convert(hint: Any, value: Any, where: str) -> Any:
    origin, args = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        if value is None and type(None) in args:
            return None
        return _convert(next(a for a in args if a is not type(None)), value, where)
    if dataclasses.is_dataclass(hint):
        return build(hint, value, where)  # type: ignore[arg-type]
    if origin is tuple:
        return _tuple(args, value, where)
    if origin is dict:
        if not isinstance(value, dict):
            raise ConfigError(_no_keys(value, where))
        return {printable(_text(k)): _convert(args[1], v, f"{where}: {_short(k)}") for k, v in value.items()}
    if origin is typing.Literal:
        if value in args:
            return value
        raise ConfigError(f"{where}: {_kind(value)} is not one of {', '.join(map(str, args))}")
    return _scalar(hint, value, where)


def _tuple(args: tuple[Any, ...], value: Any, where: str) -> tuple[Any, ...]:
    if not isinstance(value, list):
        raise ConfigError(f"{where}: expected a list, found {_kind(value)}")
    if len(args) == 2 and args[1] is Ellipsis:
        return tuple(_convert(args[0], v, f"{where}[{i}]") for i, v in enumerate(value))
    if len(value) != len(args):
        raise ConfigError(f"{where}: expected {len(args)} values, found {len(value)}")
    return tuple(_convert(a, v, f"{where}[{i}]") for i, (a, v) in enumerate(zip(args, value, strict=True)))


def _scalar(hint: Any, value: Any, where: str) -> Any:
    if hint is float and isinstance(value, str) and _POWER_OF_TEN.fullmatch(value):
        value = float(value)
    if hint is float and isinstance(value, int | float) and not isinstance(value, bool):
        if not abs(value) <= sys.float_info.max:
            raise ConfigError(f"{where}: {_short(value)} is not a finite number")
        return float(value)
    if hint is int and isinstance(value, int) and not isinstance(value, bool):
        return value
    if hint is bool and isinstance(value, bool):
        return value
    if hint is str and isinstance(value, str):
        return printable(value, keep="\n\t")
    wanted = {float: "a number", int: "a whole number", bool: "true or false", str: "text"}[hint]
    raise ConfigError(f"{where}: expected {wanted}, found {_kind(value)}")


def _no_keys(value: Any, where: str) -> str:
    return f"{where}: expected keys and values, found {_kind(value)}; give lines such as 'name: value'"


def _kind(value: Any) -> str:
    if value is None:
        return "nothing"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    if isinstance(value, dict):
        return "keys and values"
    return f"'{_short(value)}'"


def _short(value: Any) -> str:
    text = _text(value)
    return text if len(text) <= LONGEST_SHOWN else f"{text[:LONGEST_SHOWN]}…"


def _text(value: Any) -> str:
    # Python refuses to write out thousands of digits.
    return hex(value) if isinstance(value, int) and value.bit_length() > 1000 else str(value)
