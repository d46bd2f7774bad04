"""Libraries that only some recordings need, imported where such a recording is read."""

from importlib import import_module
from pathlib import Path
from typing import Any

from bridge.errors import LogError


def library(module: str, extra: str, path: Path) -> Any:
    """The module of a library that the extra `extra` of seatrial installs. Raises LogError if it is not there."""
    try:
        return import_module(module)
    except ModuleNotFoundError:
        raise LogError(
            f"needs {module.partition('.')[0]}, which is not installed; pip install 'seatrial[{extra}]'", path
        ) from None
