"""Writes the figures of a page as files for a paper: SVG and PNG, a column wide, named by their content."""

import re
import unicodedata
from pathlib import Path

from bridge.errors import LogError
from identify.report.page import Report


def write_figures(folder: Path, report: Report) -> tuple[Path, ...]:
    """Write every figure into `folder`, which is created if missing. Raises LogError."""
    # Imported here, because matplotlib takes half a second to import.
    from identify.report.picture import write_files

    drawn = [figure for section in report.sections for figure in section.figures]
    taken: list[str] = []
    written: list[Path] = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for figure in drawn:
            name = file_name(figure.name)
            taken.append(name)
            again = taken.count(name)
            written += write_files(figure.draw, folder / (f"{name}-{again}" if again > 1 else name))
    except OSError as error:
        reason = error.strerror or error
        raise LogError(f"{folder}: the figures can't be written ({reason}); choose another place") from None
    return tuple(written)


def file_name(words: str) -> str:
    """Convert words to a name that every file system accepts: lower case, digits and hyphens."""
    plain = unicodedata.normalize("NFKD", words).encode("ascii", "ignore").decode().lower()
    return re.sub(r"[^a-z0-9]+", "-", plain).strip("-")[:100] or "figure"
