"""The installed version of this program and of its libraries."""

from importlib.metadata import PackageNotFoundError, version


def installed(package: str = "seatrial") -> str:
    """The version of a package, such as `0.1.0`."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "(not installed)"
