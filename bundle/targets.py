"""The computers that the archive is for."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from packaging.tags import Tag, compatible_tags, cpython_tags

LINUX: Final = (
    "manylinux_2_28",
    "manylinux_2_27",
    "manylinux_2_26",
    "manylinux_2_24",
    "manylinux_2_17",
    "manylinux2014",
)
"""Of glibc 2.28 or newer: Debian 10, Raspberry Pi OS 11, Ubuntu 20.04 and later."""
MACOS: Final = ("macosx_14_0", "macosx_13_0", "macosx_12_0", "macosx_11_0", "macosx_10_12")
SYSTEMS: Final = {"x86_64": ("Linux", LINUX), "aarch64": ("Linux", LINUX), "arm64": ("Darwin", MACOS)}


@dataclass(frozen=True)
class Target:
    """A machine by `uname -m`, and a version of Python such as "3.11"."""

    machine: str
    python: str

    @property
    def words(self) -> str:
        return f"{SYSTEMS[self.machine][0]} {self.machine}, Python {self.python}"

    @property
    def platforms(self) -> list[str]:
        return [f"{name}_{self.machine}" for name in SYSTEMS[self.machine][1]]

    @property
    def pip(self) -> list[str]:
        """Options of `pip download` for this target."""
        platforms = [word for name in self.platforms for word in ("--platform", name)]
        return ["--implementation", "cp", "--python-version", self.python, *platforms]

    @property
    def environment(self) -> dict[str, str]:
        """Values of the markers in requirements; see PEP 508."""
        system = SYSTEMS[self.machine][0]
        return {
            "implementation_name": "cpython",
            "implementation_version": f"{self.python}.0",
            "os_name": "posix",
            "platform_machine": self.machine,
            "platform_python_implementation": "CPython",
            "platform_release": "",
            "platform_system": system,
            "platform_version": "",
            "python_full_version": f"{self.python}.0",
            "python_version": self.python,
            "sys_platform": system.lower(),
        }

    def tags(self) -> Iterator[Tag]:
        """Of wheels that install there, the best first."""
        major, minor = map(int, self.python.split("."))
        yield from cpython_tags((major, minor), platforms=self.platforms)
        yield from compatible_tags((major, minor), f"cp{major}{minor}", self.platforms)

    @property
    def builds_for_cpu(self) -> bool:
        """Whether PyTorch has a separate build without CUDA for this target."""
        return SYSTEMS[self.machine][0] == "Linux"
