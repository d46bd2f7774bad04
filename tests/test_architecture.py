"""docs/architecture.md names what is there, all of it and nothing else."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
ROOMS = ("bridge", "gcs_plugin", "identify", "tui")


def named(room: str) -> list[str]:
    """The modules in the first column of a room's table."""
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    section = re.split(r"^## ", text, flags=re.MULTILINE)[1 + ROOMS.index(room)]
    assert section.startswith(room)
    first_cells = [line.split("|")[1] for line in section.splitlines() if line.startswith("| `")]
    return [name for cell in first_cells for name in re.findall(r"`([^`]+)`", cell)]


@pytest.mark.parametrize("room", ROOMS)
def test_every_module_is_named_once_and_every_name_is_a_module(room: str) -> None:
    modules = [
        str(path.relative_to(ROOT / room).with_suffix(""))
        for path in (ROOT / room).rglob("*.py")
        if path.name != "__init__.py"
    ]
    assert sorted(named(room)) == sorted(modules)
