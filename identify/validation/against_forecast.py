"""Comparison of a dive with the errors foretold for it and with the gains accepted before it."""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

from bridge.arrays import Array
from bridge.clock import date_in_name, utc_text
from bridge.vehicle.forecast import TWICE, Credit, ForecastRow
from bridge.vehicle.mode import Mode
from identify.dive import Dive
from identify.thrust.given_thrust import Given
from identify.words import fixed, speed

if TYPE_CHECKING:
    from identify.validation.tracking import WholeError  # loads scipy.optimize

THIRD: Final = 4 / 3
"""An error up to this multiple of the foretold one is as foretold: another sea does as much."""
TWOFOLD: Final = 2.0
"""From this multiple on the model that foretold it is not the vehicle's."""
SMALL: Final = {"m/s": 0.005, "rad/s": 0.0026}
"""Errors below this (5 mm/s, 0.15 deg/s) never contradict: a rougher sea makes a multiple of the smallest of them."""
MOST_OF_REST: Final = 2.0
"""An error up to this multiple of the sea's own in a vehicle at rest is the sea's, and not judged."""
LEVEL: Final = ("surge", "sway")
NONE_GIVEN: Final[Mapping[int, Given]] = MappingProxyType({})


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
    rows: tuple[ForecastRow, ...] = ()
    credits: tuple[Credit, ...] = ()


Foretellings = Callable[[Dive, Mode, str], Foretelling | None]
"""The foretelling of a dive in one mode, of a configuration by name; None for nothing."""


def nothing_foretold(_dive: Dive, _mode: Mode, _configuration: str) -> None:
    """Compares a dive with nothing."""


@dataclass(frozen=True)
class Held:
    """An axis foretold and flown. flown, asked: of this dive, rms, m/s or rad/s. kept: whether it came as foretold,
    None if that can't be said. rough: it did not, and the sea alone moved the vehicle half as much while it rested."""

    foretold: ForecastRow
    flown: float
    asked: float
    kept: bool | None
    rough: bool = False

    @property
    def name(self) -> str:
        """`surge as foretold`, `surge not as foretold`."""
        if not self.comparable:
            return f"{self.foretold.axis} in another mission than foretold"
        if self.rough:
            return f"{self.foretold.axis} in a rougher sea than foretold"
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


def change_words(row: ForecastRow) -> str:
    """`13 -> 6.0 mm/s`; with the mode in which it was 13, if that was another."""
    before = speed(row.before, row.unit).rsplit(" ", 1)[0]
    flown = "" if row.flown == row.mode else f" ({row.flown})"
    return f"{before}{flown} -> {speed(row.after, row.unit)}"


def rows_words(rows: Sequence[ForecastRow]) -> tuple[str, ...]:
    """A sentence for each mode: `foretold for the next dive in both, ...: surge 13 -> 6.0 mm/s`."""
    return tuple(
        f"foretold for the next dive in {mode}, rms over the whole mission: "
        + ", ".join(f"{row.axis} {change_words(row)}" for row in rows if row.mode == mode)
        for mode in dict.fromkeys(row.mode for row in rows)
    )


def began(dive: Dive) -> str:
    """When a dive began, by the vehicle's clock or else by its name: UTC text, "" if unknown."""
    return _when(dive, dive.unix_at_boot_s, 0.0, dive.span_s[0])


def began_for_receipts(dive: Dive) -> str:
    """As `began`, by the clock of the computer that recorded the dive, which uploads are dated by too."""
    return _when(dive, _by_recorder(dive), 0.0, dive.span_s[0])


def ended_for_receipts(dive: Dive) -> str:
    """When a dive ended, as `began_for_receipts`."""
    return _when(dive, _by_recorder(dive), dive.duration_s, dive.span_s[1])


def _when(dive: Dive, at_boot_s: float | None, after_s: float, boot_s: float) -> str:
    """The time at a boot time, which is `after_s` after the time in the dive's name."""
    named_s = date_in_name(dive.name)
    if at_boot_s is not None:
        return utc_text(at_boot_s + boot_s)
    return "" if named_s is None else utc_text(named_s + after_s)


def _by_recorder(dive: Dive) -> float | None:
    return dive.unix_at_boot_s if dive.recorded_at_boot_s is None else dive.recorded_at_boot_s


def is_next(dive: Dive, of: Foretelling) -> bool:
    """Whether a dive was made after the diagnosed dive, as far as is known."""
    if dive.sha256 == of.sha256:
        return False
    begun = began(dive)
    return not (begun and of.dived) or begun > of.dived


def is_alike(speed: float, other: float) -> bool:
    """Whether two speeds differ by a third at most, or are both next to nothing."""
    low, high = sorted((speed, other))
    return high < 1e-3 or low * THIRD >= high


def held_against(errors: Sequence["WholeError"], rows: Sequence[ForecastRow], mode: Mode) -> tuple[Held, ...]:
    """The errors of a dive flown in a mode, compared with those foretold for it; not those that it does not tell."""
    by_axis = {error.axis: error for error in errors if math.isfinite(error.rms)}
    sea = sea_of(errors)
    return tuple(
        _held(row, by_axis[row.axis], sea.get(row.axis, 0.0))
        for row in rows
        if row.mode == mode.word and row.axis in by_axis
    )


def _held(row: ForecastRow, error: "WholeError", sea: float) -> Held:
    within = error.rms <= THIRD * row.after
    far = error.rms > TWOFOLD * row.after and error.rms > SMALL[row.unit]
    rough = far and error.rms <= MOST_OF_REST * sea
    alike = is_alike(error.asked, row.asked)
    kept = None if not alike or rough else True if within else False if far else None
    return Held(row, error.rms, error.asked, kept, rough and alike)


def sea_of(errors: Sequence["WholeError"]) -> dict[str, float]:
    """How far the sea moves each axis, by the rms while nothing is asked of the vehicle. It comes from one side, and a
    vehicle that turns meets it in surge and in sway: both have the larger of their two."""
    at_rest = {error.axis: error.rest for error in errors if math.isfinite(error.rest)}
    level = [at_rest[axis] for axis in LEVEL if axis in at_rest]
    return at_rest | (dict.fromkeys(LEVEL, max(level)) if level else {})


@dataclass(frozen=True)
class MadeUp:
    """How a dive made up for a thruster with an accepted gain, or in shadow: how the feed-forward will once it acts.

    went_by: gain over its curve by which the allocation went, or will, accepted effects included. gave: thrust over its
    curve that it gave in the dive, None if the dive does not tell; `credit.true` is that of the diagnosis. acts:
    whether the feed-forward acted. pushes: whether the thruster pushes an axis of the feed-forward.
    """

    credit: Credit
    went_by: float
    gave: Given | None = None
    acts: bool = True
    pushes: bool = True

    @property
    def passed(self) -> bool | None:
        """Whether it was, or will be, made up for once; None if it is not known and no axis of the feed-forward needs
        it."""
        if self.acts or self.shown is not None:
            return self.once
        return False if self.pushes else None

    @property
    def shown(self) -> Given | None:
        """Its gain, if the dive tells clearly whether the allocation went by that."""
        if self.gave is None or TWICE + self._unsure < self._off <= TWICE + 2 * self._unsure:
            return None
        return self.gave

    @property
    def once(self) -> bool:
        return self.as_diagnosed if self.shown is None else self._off <= TWICE + self._unsure

    @property
    def awaits(self) -> bool:
        """Whether it is weak, or strong, and the feed-forward will make up for it as soon as it acts."""
        return not self.acts and self.shown is not None and self.once and abs(self.credit.found - 1) > TWICE

    @property
    def _unsure(self) -> float:
        return 0.0 if self.gave is None else self.gave.half95 / self.gave.gain

    @property
    def _off(self) -> float:
        """Relative difference of the allocation's gain from the thruster's."""
        return 0.0 if self.gave is None else abs(self.went_by / self.gave.gain - 1)

    @property
    def as_diagnosed(self) -> bool:
        """Whether the allocation went by the diagnosis."""
        return abs(self.went_by / self.credit.true - 1) <= TWICE

    @property
    def changed(self) -> bool:
        """Whether the thruster gives another thrust than it was diagnosed and made up for with."""
        return self.as_diagnosed and not self.once

    @property
    def twice(self) -> bool:
        """Whether more was made up for than the diagnosis found, and than there is."""
        return self._more and not self.once

    @property
    def unmended(self) -> bool:
        """Whether the accepted gain was not in force."""
        return not self.as_diagnosed and not self._more

    @property
    def _more(self) -> bool:
        """Whether more was made up for than the diagnosis found."""
        return not self.as_diagnosed and (self.went_by < self.credit.true) == (self.credit.true < 1)

    @property
    def name(self) -> str:
        if self.shown is None and not self.acts:
            return f"thruster {self.credit.thruster} not known in shadow"
        if self.changed:
            return f"thruster {self.credit.thruster} changed since it was diagnosed"
        how = "" if self.once else " twice" if self.twice else " too little"
        return f"thruster {self.credit.thruster} made up for{how}"

    @property
    def words(self) -> str:
        asked = f"{'' if self.acts else 'will be '}asked as if it gave {fixed(100 * self.went_by, 0)} % of its curve"
        if self.gave is not None and (self.shown is not None or not self.acts):
            half = fixed(100 * self.gave.half95, 0)
            return f"{asked}; in this dive it gave {fixed(100 * self.gave.gain, 0)} ± {half} %"
        if not self.acts:
            return f"{asked}; this dive does not tell what it gives"
        return f"{asked}; it gives {fixed(100 * self.credit.true, 0)} %, as diagnosed"

    @property
    def mend(self) -> str:
        if self.shown is None and not self.acts:
            return (
                "dive surge, sway and yaw in shadow without current and waves, so that it shows what it gives"
            )
        if self.changed:
            return (
                "roll back what was accepted (seatrial params rollback), or diagnose this dive, and accept and upload "
                "the new value"
            )
        if self.twice:
            return (
                "take back the accepted effect (seatrial params rollback), or the gain of that thruster in the "
                "vehicle's own file: one of the two"
            )
        return "upload what was accepted"


def made_up(
    gains: Array | None, credits: Sequence[Credit], gave: Mapping[int, Given] = NONE_GIVEN
) -> tuple[MadeUp, ...]:
    """The accepted thrusters of a dive in which the feed-forward acted and which shows their gain (n,); `gave`: the
    gain of each in this dive, by its number."""
    return tuple(
        MadeUp(credit, gain, gave.get(credit.thruster))
        for credit in credits
        if (gain := _gain_of(credit.thruster, gains)) is not None
    )


def to_make_up(
    gains: Array | None,
    credits: Sequence[Credit],
    gave: Mapping[int, Given] = NONE_GIVEN,
    idle: Collection[int] = (),
) -> tuple[MadeUp, ...]:
    """The accepted thrusters of a dive in shadow: `gains` (n,) are the vehicle's own, on top of which the accepted ones
    will act; `idle`: those that push no axis of the feed-forward."""
    made = []
    for credit in credits:
        before = _gain_of(credit.thruster, gains) or credit.assumed
        pushes = credit.thruster not in idle
        made.append(
            MadeUp(credit, before * credit.found, gave.get(credit.thruster), acts=False, pushes=pushes)
        )
    return tuple(made)


def _gain_of(thruster: int, gains: Array | None) -> float | None:
    gain = math.nan if gains is None or thruster > len(gains) else float(gains[thruster - 1])
    return gain if math.isfinite(gain) else None


def verdict_of(held: Sequence[Held]) -> str:
    """One sentence on a dive: whether it came as foretold."""
    comparable = [each for each in held if each.comparable and not each.rough]
    if not comparable:
        rough = any(each.rough for each in held)
        other = "A rougher sea" if rough else "Another mission than the one that was diagnosed"
        return f"{other}: not held against what was foretold." if held else ""
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
