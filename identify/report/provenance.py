"""What a page rests on: recordings and vehicle file by their hashes, versions, settings. It ends every page."""

import platform
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version

from bridge.vehicle.config import VehicleFile
from identify.dive import Dive
from identify.report.page import Report, Section, Table
from identify.report.text import MISSING, seconds

PACKAGES = ("seatrial", "numpy", "scipy", "numba", "torch", "matplotlib")


def with_provenance(
    report: Report, dives: Sequence[Dive], file: VehicleFile, settings: Mapping[str, str]
) -> Report:
    """The report with what it rests on as its last part."""
    return replace(report, sections=(*report.sections, provenance(dives, file, settings)))


def provenance(dives: Sequence[Dive], file: VehicleFile, settings: Mapping[str, str]) -> Section:
    """Each recording once and the vehicle file by SHA-256; versions of what computed; settings as they were given."""
    seen = {dive.sha256: dive for dive in dives}
    sources = (
        *(
            (dive.name, dive.source.name, seconds(dive.duration_s), "recording", sha)
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


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
