"""Comparison of a dive with the errors foretold for it and with the gains accepted before it."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final

from bridge.arrays import Array
from bridge.clock import date_in_name, utc_text
from bridge.vehicle.foretold import TWICE, Credit, Foretold
from bridge.vehicle.mode import Mode
from identify.dive import Dive
from identify.words import fixed, speed

if TYPE_CHECKING:
    from identify.validate import WholeError  # loads scipy.optimize

THIRD: Final = 4 / 3
"""An error up to this multiple of the foretold one is as foretold: another sea does as much."""
TWOFOLD: Final = 2.0
"""From this multiple on the model that foretold it is not the vehicle's."""
SMALL: Final = {"m/s": 0.005, "rad/s": 0.0026}
"""Errors below this (5 mm/s, 0.15 deg/s) never contradict: a rougher sea makes a multiple of the smallest of them."""


@dataclass(frozen=True)
class Foretelling:
    """The contents of a sidecar about the next dive.

    dive, sha256, dived: name, SHA-256 and beginning (UTC text, "" if unknown) of the diagnosed dive. effects: labels of
    the accepted effects. rows: foretold errors. credits: of thrusters with an accepted gain.
    """

    vehicle: str
    configuration: str
    dive: str
    sha256: str
    dived: str
    effects: tuple[str, ...]
    rows: tuple[Foretold, ...] = ()
    credits: tuple[Credit, ...] = ()


@dataclass(frozen=True)
class Held:
    """An axis foretold and flown. flown, asked: of this dive, rms, m/s or rad/s. kept: whether it came as foretold,
    None if that can't be said."""

    foretold: Foretold
    flown: float
    asked: float
    kept: bool | None

    @property
    def name(self) -> str:
        """`surge as foretold`, `surge not as foretold`."""
        if not self.comparable:
            return f"{self.foretold.axis} in another mission than foretold"
        how = "nearly as" if self.kept is None else "as" if self.kept else "not as"
        return f"{self.foretold.axis} {how} foretold"

    @property
    def figures(self) -> str:
        """`13 -> 6.0 mm/s, flown 6.1`."""
        flown, _ = speed(self.flown, self.foretold.unit).rsplit(" ", 1)
        return f"{change_words(self.foretold)}, flown {flown}"

    @property
    def comparable(self) -> bool:
        """Whether this axis was asked to move as much as in the dive that was diagnosed, within a third."""
        return is_alike(self.asked, self.foretold.asked)

    def to_json(self) -> dict[str, Any]:
        return {
            **asdict(self.foretold),
            "flown_now": self.flown,
            "asked_now": self.asked,
            "kept": self.kept,
            "figures": self.figures,
        }


def change_words(row: Foretold) -> str:
    """`13 -> 6.0 mm/s`; with the mode in which it was 13, if that was another."""
    before = speed(row.before, row.unit).rsplit(" ", 1)[0]
    flown = "" if row.flown == row.mode else f" ({row.flown})"
    return f"{before}{flown} -> {speed(row.after, row.unit)}"


def rows_words(rows: Sequence[Foretold]) -> tuple[str, ...]:
    """A sentence for each mode: `foretold for the next dive in both, ...: surge 13 -> 6.0 mm/s`."""
    return tuple(
        f"foretold for the next dive in {mode}, rms over the whole mission: "
        + ", ".join(f"{row.axis} {change_words(row)}" for row in rows if row.mode == mode)
        for mode in dict.fromkeys(row.mode for row in rows)
    )


def began(dive: Dive) -> str:
    """When a dive began, by the vehicle's clock or else by its name: UTC text, "" if unknown."""
    unix_s = date_in_name(dive.name) if dive.unix_at_boot_s is None else dive.unix_at_boot_s + dive.span_s[0]
    return "" if unix_s is None else utc_text(unix_s)


def is_next(dive: Dive, of: Foretelling) -> bool:
    """Whether a dive was made after the one that was diagnosed, as far as is known."""
    if dive.sha256 == of.sha256:
        return False
    begun = began(dive)
    return not (begun and of.dived) or begun > of.dived


def is_alike(speed: float, other: float) -> bool:
    """Whether two speeds differ by a third at most, or are both next to nothing."""
    low, high = sorted((speed, other))
    return high < 1e-3 or low * THIRD >= high


def held_against(errors: Sequence["WholeError"], rows: Sequence[Foretold], mode: Mode) -> tuple[Held, ...]:
    """The errors of a dive flown in one mode beside those foretold for that mode."""
    by_axis = {error.axis: error for error in errors}
    return tuple(
        _held(row, by_axis[row.axis]) for row in rows if row.mode == mode.word and row.axis in by_axis
    )


def _held(row: Foretold, error: "WholeError") -> Held:
    within = error.rms <= THIRD * row.after
    far = error.rms > TWOFOLD * row.after and error.rms > SMALL[row.unit]
    kept = None if not is_alike(error.asked, row.asked) else True if within else False if far else None
    return Held(row, error.rms, error.asked, kept)


@dataclass(frozen=True)
class MadeUp:
    """How a dive made up for a weak thruster. went_by: gain over its curve that the allocation went by, accepted
    effects included; `credit.true` is its thrust as diagnosed."""

    credit: Credit
    went_by: float

    @property
    def once(self) -> bool:
        return abs(self.went_by / self.credit.true - 1) <= TWICE

    @property
    def twice(self) -> bool:
        """Whether more was made up for than there is; else, if not `once`, less."""
        return not self.once and (self.went_by < self.credit.true) == (self.credit.true < 1)

    @property
    def unmended(self) -> bool:
        """Whether the accepted gain was not in force."""
        return not self.once and not self.twice

    @property
    def name(self) -> str:
        how = "" if self.once else " twice" if self.twice else " too little"
        return f"thruster {self.credit.thruster} made up for{how}"

    @property
    def words(self) -> str:
        return (
            f"asked as if it gave {fixed(100 * self.went_by, 0)} % of its curve; it gives "
            f"{fixed(100 * self.credit.true, 0)} %, as diagnosed"
        )

    @property
    def mend(self) -> str:
        if self.twice:
            return (
                "take back the accepted effect (seatrial params rollback), or the gain of that thruster in the "
                "vehicle's own file: one of the two"
            )
        return "upload what was accepted"


def made_up(gains: Array | None, credits: Sequence[Credit]) -> tuple[MadeUp, ...]:
    """The accepted thrusters whose gain (n,) the dive tells."""
    if gains is None:
        return ()
    places = ((credit, credit.thruster - 1) for credit in credits)
    return tuple(
        MadeUp(credit, float(gains[at]))
        for credit, at in places
        if at < len(gains) and gains[at] == gains[at]
    )


def verdict_of(held: Sequence[Held]) -> str:
    """One sentence on a dive: whether it came as foretold."""
    comparable = [each for each in held if each.comparable]
    if not comparable:
        return (
            ""
            if not held
            else "Another mission than the one that was diagnosed: not held against what was foretold."
        )
    worse = [each for each in comparable if each.kept is False]
    clause = "; ".join(f"{each.foretold.axis} {each.figures}" for each in comparable)
    head = (
        "Not as foretold"
        if worse
        else "As foretold"
        if all(each.kept for each in comparable)
        else "Nearly as foretold"
    )
    return f"{head}: {clause}."
