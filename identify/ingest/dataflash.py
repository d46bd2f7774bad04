from pathlib import Path
from typing import Any


def read_dataflash(path: Path) -> dict[str, Any]:
    raise NotImplementedError
