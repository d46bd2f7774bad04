"""docs/architecture.md is a map: each folder of the house is on it, and each folder says what its modules are for."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("bridge", "gcs_plugin", "identify", "tui")
MAP = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")


def row(package):
    """The line of the map that a package has."""
    (line,) = [line for line in MAP.splitlines() if line.startswith(f"| `{package}`")]
    return line


@pytest.mark.parametrize("package", PACKAGES)
def test_every_folder_of_a_package_is_on_the_map_and_every_folder_on_it_is_there(package):
    folders = {path.parent.name for path in (ROOT / package).glob("*/__init__.py")}
    named = set(re.findall(r"`([a-z_]+)`", row(package))) - {package}
    nested = {path.parent.name for path in (ROOT / package).glob("*/*/__init__.py")}
    assert folders <= named
    assert named <= folders | nested


INITS = sorted(
    path for path in ROOT.glob("*/**/__init__.py") if not path.relative_to(ROOT).parts[0].startswith(".")
)
PAGES = sorted([*(ROOT / "docs").glob("*.md"), *(ROOT / "docs" / "howto").glob("*.md")])
FILES = {
    path.name
    for package in (*PACKAGES, "bench", "bundle", "docs", "tests")
    for path in (ROOT / package).rglob("*.py")
}


def docstring(init):
    return ast.get_docstring(ast.parse(init.read_text(encoding="utf-8"))) or ""


def modules(folder):
    """Names of the modules and packages of a folder."""
    files = {path.stem for path in folder.glob("*.py")}
    return files - {"__init__", "__main__"} | {path.parent.name for path in folder.glob("*/__init__.py")}


def is_module(dotted):
    path = ROOT / dotted.replace(".", "/")
    return path.is_dir() or path.with_suffix(".py").is_file()


def files_missing(text):
    """Files NAME.py and FOLDER/NAME.py in backquotes that are not in the tree."""
    named = re.findall(r"`([a-z_0-9/]+\.py)`", text)
    return [name for name in named if not ((ROOT / name).is_file() if "/" in name else name in FILES)]


def test_every_module_that_a_folder_names_is_there():
    for init in INITS:
        text, package = docstring(init), init.relative_to(ROOT).parts[0]
        names = re.findall(r"`([a-z_0-9]+)`", text)
        assert [name for name in names if name not in modules(init.parent)] == [], init
        dotted = re.findall(rf"`((?:{'|'.join(PACKAGES)}|{package})(?:\.[a-z_0-9]+)+)`", text)
        assert [name for name in dotted if not is_module(name)] == [], init
        assert files_missing(text) == [], init


def test_every_module_of_a_folder_is_named():
    for init in (init for init in INITS if init.relative_to(ROOT).parts[0] in PACKAGES):
        if init.parent.name == "commands":  # a module for each verb
            continue
        named = set(re.findall(r"`([a-z_0-9]+)`", docstring(init)))
        unnamed = {name for name in modules(init.parent) if name.removesuffix("_lines") not in named} - named
        assert unnamed == set(), init


def test_every_file_that_a_page_names_is_there():
    for page in PAGES:
        assert files_missing(page.read_text(encoding="utf-8")) == [], page


def test_every_module_that_the_map_names_is_there():
    named = re.findall(r"`((?:bridge|gcs_plugin|identify|tui)/[a-z_/]+)(?:\.[\w*]+)*`", MAP)
    assert len(named) > 15
    assert [name for name in named if not ((ROOT / name).is_dir() or (ROOT / f"{name}.py").is_file())] == []


def test_every_folder_of_the_tests_is_on_the_map():
    section = MAP.split("## Tests")[1].split("## ")[0]
    folders = {
        path.name for path in (ROOT / "tests").iterdir() if any(path.glob("*.*")) and path.name[0] not in "_."
    }
    assert folders - set(re.findall(r"`(?:tests/)?([a-z_]+)`", section)) == set()


def test_the_map_is_one_page():
    assert len(MAP.splitlines()) < 80
