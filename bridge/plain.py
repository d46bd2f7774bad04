"""Plain data: read from untrusted YAML and JSON, without tags and of bounded size, and written as JSON."""

import json
import math
from pathlib import Path
from typing import Any, Final

import yaml

MOST_BYTES: Final = 1_000_000
MOST_VALUES: Final = 200_000
DEEPEST: Final = 30
MOST_DIGITS: Final = 300
_STANDARD: Final = "tag:yaml.org,2002:"


def from_yaml(text: str) -> Any:
    """Return the data of one YAML document. Raises YAMLError with its place, and ValueError for an invalid date."""
    return yaml.load(text, _Loader)


def from_json(text: str | bytes) -> Any:
    """Return the data of a JSON text.

    Raises ValueError, also if the text nests too deeply or a number is not a finite float64.
    """
    try:
        return json.loads(text, parse_int=_whole, parse_float=_finite, parse_constant=_none)
    except RecursionError:
        raise ValueError("nests too deeply") from None


def plain(data: Any) -> Any:
    """`data` with non-finite numbers as null and paths as text."""
    if isinstance(data, dict):
        return {str(key): plain(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [plain(value) for value in data]
    if isinstance(data, float) and not math.isfinite(data):
        return None
    return str(data) if isinstance(data, Path) else data


def to_json(data: Any, indent: int | None = None) -> str:
    """JSON text of `plain` data, which `from_json` reads."""
    return json.dumps(plain(data), indent=indent, allow_nan=False)


def is_number(value: Any) -> bool:
    """Whether a value read is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _whole(digits: str) -> int:
    if len(digits) > MOST_DIGITS:
        raise ValueError(f"a number of {len(digits)} digits")
    return int(digits)


def _finite(digits: str) -> float:
    """Refuse digits that no float64 holds: Python reads them as infinity, which nobody meant."""
    value = float(digits)
    if math.isinf(value):
        raise ValueError("a number beyond what a float64 holds")
    return value


def _none(name: str) -> float:
    """Refuse NaN and infinities: JSON has no such constants, though Python's module writes and reads them."""
    raise ValueError(f"a number that is {name}")


class _Loader(yaml.SafeLoader):
    """A safe loader that refuses duplicate keys and all tags.

    An anchor (`&`) may be used again (`*`), as long as the data that all aliases stand for stays of a bounded size.
    """

    def __init__(self, stream: str) -> None:
        super().__init__(stream)
        self._depth = 0
        self._values: dict[int, int] = {}

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        event = self.peek_event()  # type: ignore[no-untyped-call]
        again = isinstance(event, yaml.AliasEvent)
        tag = None if again else getattr(event, "tag", None)
        if tag is not None:
            raise _refusal(
                f"the tag '{tag.replace(_STANDARD, '!!')}' is not read; write the plain value", event
            )
        self._depth += 1
        if self._depth > DEEPEST:
            raise _refusal(f"it nests deeper than {DEEPEST}", event)
        node = super().compose_node(parent, index)
        self._depth -= 1
        if node is None:
            return None
        if again and id(node) not in self._values:
            raise _refusal(f"'*{event.anchor}' stands for what it stands in", event)
        if not again:
            self._values[id(node)] = 1 + sum(self._values[id(child)] for child in _children(node))
        if self._values[id(node)] > MOST_VALUES:
            raise _refusal(f"it stands for more than {MOST_VALUES} values", event)
        return node

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen: set[Any] = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if isinstance(key, str) and key in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"the key '{key}' stands there twice", key_node.start_mark
                )
            if isinstance(key, str):
                seen.add(key)
        return super().construct_mapping(node, deep)


def _whole_of_yaml(loader: _Loader, node: yaml.ScalarNode) -> int:
    if len(node.value) > MOST_DIGITS:
        raise _refusal(f"a number of {len(node.value)} digits", node)
    return int(loader.construct_yaml_int(node))


_Loader.add_constructor(f"{_STANDARD}int", _whole_of_yaml)


def _children(node: yaml.Node) -> list[yaml.Node]:
    if isinstance(node, yaml.MappingNode):
        return [child for pair in node.value for child in pair]
    return node.value if isinstance(node, yaml.SequenceNode) else []


def _refusal(problem: str, place: Any) -> yaml.constructor.ConstructorError:
    return yaml.constructor.ConstructorError(None, None, problem, place.start_mark)
