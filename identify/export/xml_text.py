"""XML for other simulators: elements, and numbers that read back exactly."""

import xml.etree.ElementTree as ET
from collections.abc import Iterable

from identify.export.model import Model


def number(value: float) -> str:
    """Shortest text that reads back as the same number; no negative zero."""
    return repr(float(value) + 0.0)


def numbers(values: Iterable[float]) -> str:
    """Several numbers, separated by spaces."""
    return " ".join(number(value) for value in values)


def element(parent: ET.Element, tag: str, text: str | float = "", **attributes: str) -> ET.Element:
    """Append a new child to `parent`."""
    child = ET.SubElement(parent, tag, attributes)
    words = text if isinstance(text, str) else number(text)
    if words:
        child.text = words
    return child


def told(parent: ET.Element, model: Model, sentence: str) -> None:
    """Add a comment with the file's purpose, the unknown values, and the intervals, for which XML has no element."""
    intervals = ", ".join(f"{name} {low:.4g} to {high:.4g}" for name, (low, high) in model.intervals.items())
    words = f"{model.name}: {sentence}"
    words += f" Unknown: {', '.join(model.unknown)}." if model.unknown else ""
    words += f" 95 % intervals: {intervals}." if intervals else ""
    parent.append(ET.Comment(f" {words.replace('--', '- -')} "))


def document(root: ET.Element) -> str:
    """Text of the XML file."""
    ET.indent(root)
    return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"
