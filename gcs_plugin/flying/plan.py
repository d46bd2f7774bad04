"""The manoeuvres of a plan, cut into pieces short enough to stop as soon as enough is known."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby, zip_longest
from pathlib import Path
from typing import Final

from bridge import schema
from bridge.errors import ConfigError
from bridge.flight.orders import MOST_LEGS, leg_numbers
from bridge.vehicle.coefficients import DAMPINGS, DOFS, MASSES
from bridge.vehicle.legs import DEPTH_M, Leg

REST: Final = "rest"
FIRST_S, LONGEST_S = 8.0, 64.0
"""Lengths of the pieces that waves and laps are cut into: two short ones first, for masses are soon known, and then
each twice as long as the one before, for a width halves in four times the time, and each piece costs a way back to the
station."""
_DRIVEN: Final = {
    0: ("surge_m_s", "push_surge_n"),
    1: ("sway_m_s", "push_sway_n"),
    2: ("heave_m_s", "push_heave_n"),
    5: ("yaw_rad_s", "push_yaw_nm"),
}


@dataclass(frozen=True)
class _File:
    """A mission file as it is written, with its alternations not yet taken apart."""

    legs: tuple[Leg, ...]
    name: str = "plan"
    start_depth_m: float = DEPTH_M
    start_heading_rad: float = 0.0
    vehicle: str = ""


@dataclass(frozen=True)
class Piece:
    """Legs flown without a break, of the manoeuvre of that number, from 1."""

    manoeuvre: int
    legs: tuple[Leg, ...]

    @property
    def duration_s(self) -> float:
        return sum(leg.duration_s * leg.alternate for leg in self.legs)

    @property
    def dofs(self) -> tuple[int, ...]:
        return tuple(
            dof for dof, keys in _DRIVEN.items() if any(getattr(leg, k) for leg in self.legs for k in keys)
        )

    @property
    def title(self) -> str:
        return f"{self.manoeuvre}. {' and '.join(DOFS[dof] for dof in self.dofs)}"

    @property
    def name(self) -> str:
        return f"{self.title}, {self.duration_s:g} s"

    @property
    def coefficients(self) -> tuple[str, ...]:
        """Names of the coefficients that it makes known."""
        return tuple(group[dof].name for dof in self.dofs for group in (MASSES, DAMPINGS))


@dataclass(frozen=True)
class FlightPlan:
    """A plan: the depth at which each manoeuvre begins, and its pieces in the order in which they are flown.

    `vehicle`: NAME:CONFIGURATION that it was made for, "" for any.
    """

    name: str
    depth_m: float
    pieces: tuple[Piece, ...]
    vehicle: str = ""

    @property
    def manoeuvres(self) -> dict[str, list[float]]:
        """Lengths in seconds of each manoeuvre's pieces, by its title."""
        lengths_s: dict[str, list[float]] = {}
        for piece in self.pieces:
            lengths_s.setdefault(piece.title, []).append(piece.duration_s)
        return lengths_s

    @property
    def coefficients(self) -> tuple[str, ...]:
        """Names of the coefficients that it makes known."""
        names = {name for piece in self.pieces for name in piece.coefficients}
        return tuple(c.name for c in (*MASSES, *DAMPINGS) if c.name in names)


def load_plan(path: Path) -> FlightPlan:
    """Load a plan that `seatrial plan` wrote. Raises ConfigError for a file that is none, or can't be flown."""
    file = schema.build(_File, schema.load_yaml(path), str(path))
    groups = groupby(file.legs, key=lambda leg: leg.name == REST and leg.phase == REST)
    manoeuvres = [tuple(legs) for is_rest, legs in groups if not is_rest]
    try:
        return replace(flight_plan(file.name, file.start_depth_m, manoeuvres), vehicle=file.vehicle)
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from None


def flight_plan(name: str, depth_m: float, manoeuvres: Sequence[Sequence[Leg]]) -> FlightPlan:
    """The plan of manoeuvres; the pieces of all take turns, so that all axes are known soon.

    Raises ConfigError without a manoeuvre, or with one that can't be flown.
    """
    cut_up = [[Piece(number, legs) for legs in cut(legs)] for number, legs in enumerate(manoeuvres, start=1)]
    pieces = tuple(piece for turn in zip_longest(*cut_up) for piece in turn if piece is not None)
    if not pieces:
        raise ConfigError("has no manoeuvre to fly; give a plan that seatrial plan wrote")
    for piece in pieces:
        if len(piece.legs) > MOST_LEGS:
            raise ConfigError(
                f"manoeuvre {piece.manoeuvre} has {len(piece.legs)} legs, and {MOST_LEGS} can be flown at a time; part "
                "it by a rest"
            )
        for number, leg in enumerate(piece.legs):
            leg_numbers(number, leg)
    return FlightPlan(name, depth_m, pieces)


def cut(legs: Sequence[Leg]) -> list[tuple[Leg, ...]]:
    """Cut a square wave, or laps that each end at rest, into pieces of FIRST_S, twice, and then of twice as much each,
    up to LONGEST_S; any other manoeuvre stays whole."""
    if len(legs) == 3:
        first, halves, last = legs
        if first == last and halves.alternate % 2 and halves.duration_s == 2 * first.duration_s:
            sizes = _sizes((halves.alternate + 1) // 2, 2 * halves.duration_s)
            return [(first, replace(halves, alternate=2 * size - 1), last) for size in sizes]
    lengths = (length for length in range(1, len(legs) + 1) if len(legs) % length == 0)
    cycle = next(tuple(legs[:n]) for n in lengths if tuple(legs[:n]) * (len(legs) // n) == tuple(legs))
    # Legs that go on from one to the next make another motion where the vehicle stops in between.
    if any(cycle[-1].velocity) or any(push is not None for push in cycle[-1].push):
        return [tuple(legs)]
    cycle_s = sum(leg.duration_s * leg.alternate for leg in cycle)
    return [cycle * size for size in _sizes(len(legs) // len(cycle), cycle_s)]


def _sizes(cycles: int, cycle_s: float) -> list[int]:
    """The cycles of each piece."""
    sizes: list[int] = []
    size = begin = max(1, round(FIRST_S / cycle_s))
    while (left := cycles - sum(sizes)) > 0:
        sizes.append(size if left - size >= begin else left)
        size = min(sum(sizes), max(1, round(LONGEST_S / cycle_s)))
    return sizes
