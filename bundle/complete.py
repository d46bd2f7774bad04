"""The requirements that a folder of wheels does not meet on a target.

`pip download` evaluates markers for the Python that it runs on, not for the Python that it downloads for, and leaves
out packages that only another Python or machine needs. This reads the wheels themselves.
"""

import zipfile
from collections.abc import Iterable
from email.parser import Parser
from fnmatch import fnmatch
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name, parse_wheel_filename

from bundle.targets import Target


def lacking(folders: Iterable[Path], requirements: Iterable[str], target: Target) -> list[str]:
    """The requirements, with all that follows from them, that no wheel of the folders meets on `target`."""
    tags = frozenset(target.tags())
    wheels = [wheel for folder in folders for wheel in sorted(folder.glob("*.whl")) if _fits(wheel, tags)]
    asked: list[Requirement] = [Requirement(text) for text in requirements]
    seen: set[str] = set()
    missing: list[str] = []
    while asked:
        requirement = asked.pop()
        if str(requirement) in seen or not holds_on(requirement, target):
            continue
        seen.add(str(requirement))
        wheel = _best(requirement, wheels)
        if wheel is None:
            requirement.marker = None
            missing.append(str(requirement))
            continue
        for follows in _requirements(wheel):
            extras = requirement.extras or {""}
            environments = [target.environment | {"extra": extra} for extra in extras]
            if follows.marker is None or any(
                follows.marker.evaluate(environment) for environment in environments
            ):
                follows.marker = None
                asked.append(follows)
    return sorted(missing)


def _fits(wheel: Path, tags: frozenset[object]) -> bool:
    return not tags.isdisjoint(parse_wheel_filename(wheel.name)[3])


def holds_on(requirement: Requirement, target: Target) -> bool:
    return requirement.marker is None or requirement.marker.evaluate(target.environment | {"extra": ""})


def _best(requirement: Requirement, wheels: Iterable[Path]) -> Path | None:
    fitting = []
    for wheel in wheels:
        name, version, _, _ = parse_wheel_filename(wheel.name)
        if name == canonicalize_name(requirement.name) and requirement.specifier.contains(version):
            fitting.append((version, wheel))
    return max(fitting)[1] if fitting else None


def _requirements(wheel: Path) -> list[Requirement]:
    with zipfile.ZipFile(wheel) as archive:
        # At the top alone: a package may hold others, with metadata of their own.
        (name,) = [
            name
            for name in archive.namelist()
            if fnmatch(name, "*.dist-info/METADATA") and name.count("/") == 1
        ]
        metadata = Parser().parsestr(archive.read(name).decode("utf-8"), headersonly=True)
    return [Requirement(text) for text in metadata.get_all("Requires-Dist", [])]
