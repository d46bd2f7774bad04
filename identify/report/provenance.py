"""Last part of every page: its inputs with their hashes, software versions, settings."""

import math
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from bridge.vehicle.config import VehicleFile
from identify.dive import Dive
from identify.report.page import Report, Section, Table
from identify.report.text import MISSING, seconds

PACKAGES = ("seatrial", "numpy", "scipy", "numba", "torch", "matplotlib")


@dataclass(frozen=True)
class Read:
    """A recording that was read elsewhere; `duration_s` is NaN if unknown."""

    name: str
    source: Path
    sha256: str
    duration_s: float


def with_provenance(
    report: Report, dives: Sequence[Dive | Read], file: VehicleFile, settings: Mapping[str, str]
) -> Report:
    """The report with its provenance as the last part."""
    return replace(report, sections=(*report.sections, provenance(dives, file, settings)))


def provenance(dives: Sequence[Dive | Read], file: VehicleFile, settings: Mapping[str, str]) -> Section:
    """Each recording once and the vehicle file, with SHA-256; versions of the software; settings as given."""
    seen = {dive.sha256: dive for dive in dives}
    sources = (
        *(
            (dive.name, dive.source.name, _length(dive.duration_s), "recording", sha)
            for sha, dive in seen.items()
        ),
        (file.vehicle.name, file.path.name, MISSING, "vehicle file", file.sha256),
    )
    versions = (("Python", platform.python_version()), *((name, _version(name)) for name in PACKAGES))
    tables = [
        Table(("Name", "File", "Length", "What", "SHA-256"), sources, "What was read."),
        Table(("Made with", "Version"), versions),
    ]
    if settings:
        tables.append(Table(("Setting", "Value"), tuple(settings.items()), "As given on the command line."))
    return Section("Provenance", tables=tuple(tables))


def _length(duration_s: float) -> str:
    return seconds(duration_s) if math.isfinite(duration_s) else MISSING


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
