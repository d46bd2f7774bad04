"""docs/architecture.md is a map: each folder of the house is on it, and each folder says what its modules are for."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
ROOMS = ("bridge", "gcs_plugin", "identify", "tui")
MAP = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")


def row(room: str) -> str:
    """The line of the map that a package has."""
    (line,) = [line for line in MAP.splitlines() if line.startswith(f"| `{room}`")]
    return line


@pytest.mark.parametrize("room", ROOMS)
def test_every_folder_of_a_package_is_on_the_map_and_every_folder_on_it_is_there(room: str) -> None:
    folders = {path.parent.name for path in (ROOT / room).glob("*/__init__.py")}
    named = set(re.findall(r"`([a-z_]+)`", row(room))) - {room}
    nested = {path.parent.name for path in (ROOT / room).glob("*/*/__init__.py")}
    assert folders <= named
    assert named <= folders | nested


@pytest.mark.parametrize(
    "folder",
    sorted(path.parent for room in ROOMS for path in (ROOT / room).rglob("__init__.py")),
    ids=lambda folder: str(folder.relative_to(ROOT)),
)
def test_every_folder_says_what_its_modules_are_for(folder: Path) -> None:
    text = ast.get_docstring(ast.parse((folder / "__init__.py").read_text(encoding="utf-8")))
    assert text
    assert len(text) > 30


def test_every_module_that_the_map_names_is_there() -> None:
    named = re.findall(r"`((?:bridge|gcs_plugin|identify|tui)/[a-z_/]+)(?:\.[\w*]+)*`", MAP)
    assert len(named) > 15
    assert [name for name in named if not ((ROOT / name).is_dir() or (ROOT / f"{name}.py").is_file())] == []


def test_the_map_is_one_page() -> None:
    assert len(MAP.splitlines()) < 80
