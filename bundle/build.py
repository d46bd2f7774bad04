"""The archive: wheels in two folders, for the bridge, and for the ground station in addition."""

import hashlib
import shutil
import tarfile
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from packaging.requirements import Requirement

from bridge.files import remedy, whole
from bundle.complete import holds_on, lacking
from bundle.targets import Target

Pip = Callable[[Sequence[str]], str]
"""Runs pip with these words; returns its last complaint, "" if it succeeded."""
OFFLINE: Final = Path(__file__).with_name("offline")
ROUNDS: Final = 4
PARTS: Final = ("bridge", "ground")
PROJECT, READERS = "seatrial", "logs"
"""The extra of all libraries that read recordings of other programs, which goes with the ground station."""


class BundleError(Exception):
    """The archive can't be made, with a sentence for whoever made it."""


@dataclass(frozen=True)
class Bundle:
    """The archive, and the parts that it installs on each target; `left_out` are sentences."""

    file: Path
    holds: tuple[tuple[str, Target], ...]
    left_out: tuple[str, ...]


def build(
    project: Path, out: Path, targets: Sequence[Target], pip: Pip, say: Callable[[str], None]
) -> Bundle:
    """Make `out`/seatrial-VERSION-offline.tar of the checkout `project`. Raises BundleError."""
    about = tomllib.loads((project / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    base, extras = about["dependencies"], about["optional-dependencies"]
    folder = out / f"seatrial-{about['version']}-offline"
    shutil.rmtree(folder, ignore_errors=True)
    folders = {part: folder / "wheels" / part for part in PARTS}
    for path in folders.values():
        path.mkdir(parents=True)
    trouble = pip(["wheel", "--no-deps", "--wheel-dir", str(folders["bridge"]), str(project)])
    if trouble:
        raise BundleError(f"seatrial's own wheel could not be made: {trouble}")
    holds, left_out = [], []
    for target in targets:
        say(f"bridge: {target.words} ...")
        trouble = _fetch(folders["bridge"], base, target, pip)
        if trouble:
            raise BundleError(f"the bridge for {target.words}: {trouble}")
        holds.append(("bridge", target))
        ground = [*base, *_without_cuda(extra("ground", extras, target), target)]
        # Fetched with the ground station, so that both agree on the versions of what they share.
        for parts, wanted in (
            (("ground", READERS), [*ground, *extra(READERS, extras, target)]),
            (("ground",), ground),
        ):
            say(f"{' and '.join(parts)}: {target.words} ...")
            trouble = _fetch(folders["ground"], wanted, target, pip)
            if not trouble:
                holds += [(part, target) for part in parts]
                break
            left_out.append(f"{parts[-1]}: {target.words}: {trouble}")
    for wheel in folders["bridge"].iterdir():
        (folders["ground"] / wheel.name).unlink(missing_ok=True)
    _furnish(folder, about["version"], holds, left_out)
    return Bundle(_packed(folder), tuple(holds), tuple(left_out))


def extra(name: str, extras: Mapping[str, Sequence[str]], target: Target) -> list[str]:
    """Requirements of an extra on a target, with those of the extras that it names."""
    wanted: list[str] = []
    for text in extras[name]:
        requirement = Requirement(text)
        if not holds_on(requirement, target):
            continue
        if requirement.name == PROJECT:
            wanted += [each for inner in sorted(requirement.extras) for each in extra(inner, extras, target)]
        else:
            requirement.marker = None
            wanted.append(str(requirement))
    return list(dict.fromkeys(wanted))


def _without_cuda(requirements: Sequence[str], target: Target) -> list[str]:
    """With PyTorch's CPU build if there are two: the other brings 3 GB of CUDA."""
    cpu = "+cpu" if target.builds_for_cpu else ""
    return [f"{text}{cpu}" if text.startswith("torch==") else text for text in requirements]


def _fetch(folder: Path, requirements: Sequence[str], target: Target, pip: Pip) -> str:
    """Download `requirements` and their own for `target`; return why that failed, "" if it did not.

    Into a folder of its own first: a part of the wheels is of no use.
    """
    fetched = folder.with_name("fetched")
    shutil.rmtree(fetched, ignore_errors=True)
    words = ["download", "--only-binary=:all:", "--dest", str(fetched), *target.pip]
    wanted = list(requirements)
    for _ in range(ROUNDS):
        trouble = pip([*words, *wanted])
        if trouble:
            break
        missing = lacking([fetched], wanted, target)
        if not missing:
            break
        wanted += missing
    else:
        trouble = f"no wheel for {', '.join(missing)}"
    if not trouble:
        for wheel in fetched.glob("*.whl"):
            wheel.replace(folder / wheel.name)
    shutil.rmtree(fetched, ignore_errors=True)
    return trouble


def _furnish(
    folder: Path, version: str, holds: Sequence[tuple[str, Target]], left_out: Sequence[str]
) -> None:
    """Add to the wheels: the installer, a description with the targets, and checksums."""
    shutil.copy(OFFLINE / "install.sh", folder / "install.sh")
    (folder / "install.sh").chmod(0o755)
    lines = [f"{part} {target.machine} {target.python}" for part, target in holds]
    (folder / "holds.txt").write_text("".join(f"{line}\n" for line in lines), encoding="ascii")
    table = "\n".join(f"| {part} | {target.words} |" for part, target in holds)
    missing = "".join(f"\nLeft out: {sentence}.\n" for sentence in left_out)
    readme = (OFFLINE / "README.md").read_text(encoding="utf-8")
    readme = readme.replace("VERSION", version).replace(
        "HOLDS", f"| part | for |\n|---|---|\n{table}\n{missing}"
    )
    (folder / "README.md").write_text(readme, encoding="utf-8")
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    sums = [f"{_sha256(path)}  {path.relative_to(folder).as_posix()}\n" for path in files]
    (folder / "SHA256SUMS").write_text("".join(sums), encoding="utf-8")


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _packed(folder: Path) -> Path:
    """Not compressed: wheels are so already."""
    file = folder.with_name(f"{folder.name}.tar")
    try:
        with whole(file) as out, tarfile.open(fileobj=out, mode="w") as archive:
            archive.add(folder, folder.name)
    except OSError as error:
        raise BundleError(f"{file}: can't be written ({error.strerror}); {remedy(error)}") from None
    shutil.rmtree(folder)
    return file
