"""The plan of an upload, made before anything is sent: which lines change, are set already or can't be written.

Also notes on a staged set that the vehicle does not fly.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import Final

from bridge.errors import ParamRejected, ParamUnknown
from bridge.vehicle.coefficients import EffectCoefficient
from bridge.vehicle.mode import Mode
from bridge.vehicle.parameters import ACTIVE, COMMIT, MODE, VERSION, set_crc
from gcs_plugin.params import float32
from gcs_plugin.params.meaning import is_staged, objection, part_of_set

READ_ONLY: Final = {
    COMMIT: "the upload raises it itself, last of all",
    ACTIVE: "the vehicle alone says which set is active",
    VERSION: "the vehicle alone says which version it speaks",
}

HULL: Final = "FF_HULL"
"""The applet's mark of the hull that the set in force was committed on."""
NO_HULL: Final = 0.0
ACCEPT_IMPLAUSIBLE: Final = "--accept-implausible"


class Verdict(Enum):
    """Verdict on a line of a parameter file; the value is the word shown to the operator.

    STAGED: the vehicle holds the value in a staged set that is not in force; a commit puts it in force.
    """

    CHANGED = "changed"
    STAGED = "staged"
    SAME = "same"
    UNKNOWN = "not on the vehicle"
    READ_ONLY = "read-only"
    REFUSED = "refused"
    IMPLAUSIBLE = "implausible"


TAKES_EFFECT: Final = (Verdict.CHANGED, Verdict.STAGED)


@dataclass(frozen=True, slots=True)
class Row:
    """Line of the plan; `present` is None if the vehicle has no such parameter."""

    name: str
    present: float | None
    target: float
    verdict: Verdict
    reason: str = ""


@dataclass(frozen=True)
class Plan:
    """Every line of the file with its verdict; `present` holds all parameters read from the vehicle.

    `withdraws`: no set is to be in force in the end.
    """

    rows: tuple[Row, ...]
    present: Mapping[str, float]
    withdraws: bool = False

    @property
    def restarts_scripts(self) -> bool:
        """Whether that takes a restart of an applet, which takes no commit of 0."""
        return self.withdraws and HULL in self.present

    def named(self, verdict: Verdict) -> dict[str, float]:
        return {row.name: row.target for row in self.rows if row.verdict is verdict}

    @property
    def changes(self) -> dict[str, float]:
        return self.named(Verdict.CHANGED)

    @property
    def staged(self) -> dict[str, float]:
        """Targets that the vehicle already holds in its staged set; an upload need only commit them."""
        return self.named(Verdict.STAGED)

    def code(self, *, armed: bool) -> str:
        """Confirmation code: number of lines that are written or put in force, and the CRC of their names and values;
        prefixed with "armed-" for an armed vehicle.
        """
        lines = self.changes | self.staged
        return f"{'armed-' if armed else ''}{len(lines)}-{set_crc(lines):06x}"

    def summary(self) -> str:
        """Number of lines with each verdict, in one sentence."""
        counts = Counter(row.verdict for row in self.rows)
        parts = [f"{counts[verdict]} {verdict.value}" for verdict in Verdict if counts[verdict]]
        return f"{len(self.rows)} parameters: {', '.join(parts) or 'none'}"

    def explained(self, names: Iterable[str], reason: str) -> "Plan":
        """The plan with `reason` on the named lines."""
        held = set(names)
        return self._each(lambda row: replace(row, reason=reason) if row.name in held else row)

    def judged(self, reasons: Mapping[str, str]) -> "Plan":
        """The plan with the lines in `reasons` (name to reason) marked IMPLAUSIBLE if they were to take effect."""
        return self._each(
            lambda row: (
                replace(row, verdict=Verdict.IMPLAUSIBLE, reason=reasons[row.name])
                if row.name in reasons and row.verdict in TAKES_EFFECT
                else row
            )
        )

    def with_implausible(self) -> "Plan":
        """The plan with its IMPLAUSIBLE lines accepted as changes."""
        return self._each(
            lambda row: replace(row, verdict=Verdict.CHANGED) if row.verdict is Verdict.IMPLAUSIBLE else row
        )

    def _each(self, change: Callable[[Row], Row]) -> "Plan":
        return replace(self, rows=tuple(map(change, self.rows)))

    def check(self) -> None:
        """Check that every line can be sent.

        Raises ParamRejected for refused and implausible lines, ParamUnknown for parameters that the vehicle lacks; the
        caller then sends nothing.
        """
        for row in self.rows:
            if row.verdict is Verdict.REFUSED:
                raise ParamRejected(f"{row.name}: {row.reason}; nothing was sent, mend the value")
        doubted = [row for row in self.rows if row.verdict is Verdict.IMPLAUSIBLE]
        if doubted:
            reasons = "; ".join(f"{row.name}: {row.reason}" for row in doubted)
            names = " ".join(row.name for row in doubted)
            raise ParamRejected(
                f"{reasons}; nothing was sent; look at the dive again, leave them out, or take them by name: "
                f"{ACCEPT_IMPLAUSIBLE} {names}"
            )
        missing = self.named(Verdict.UNKNOWN)
        if (
            missing
            and all(name == MODE or part_of_set(name) is not None for name in missing)
            and len(missing) == len(self.rows)
        ):
            raise ParamUnknown(
                "the vehicle has no parameters of a feed-forward, as an autopilot alone has none; nothing was sent. "
                "Beside ArduSub the companion brings them (start seatrial bridge --ardusub), or the applet in it "
                "(seatrial applet deploy), and PX4 is not supported: recordings of any vehicle can be identified and "
                "diagnosed"
            )
        if missing:
            raise ParamUnknown(
                f"the vehicle has no {', '.join(missing)}; nothing was sent, choose lines that it has"
            )


def make_plan(targets: Mapping[str, float], present: Mapping[str, float]) -> Plan:
    """Make the plan that brings a vehicle that holds `present` to `targets`."""
    rows = tuple(_row(name, target, present) for name, target in targets.items())
    after = {**present, **{row.name: row.target for row in rows if row.verdict is Verdict.CHANGED}}
    if staged_is_in_force(present) is False and staged_is_in_force(after) is False:
        rows = tuple(_waiting(row, present[ACTIVE]) for row in rows)
    return Plan(rows, dict(present))


def staged_crc(present: Mapping[str, float]) -> int | None:
    """The CRC of the set that a commit would put in force; None for a vehicle that takes no sets."""
    staged = {name: value for name, value in present.items() if is_staged(name)}
    return set_crc(staged) if staged and COMMIT in present and ACTIVE in present else None


def staged_is_in_force(present: Mapping[str, float]) -> bool | None:
    """Whether the staged set is the one that the vehicle flies; None for a vehicle that takes no sets."""
    crc = staged_crc(present)
    return None if crc is None else float32.same(present[ACTIVE], float(crc))


def taken_back(targets: Mapping[str, float], present: Mapping[str, float]) -> dict[str, float]:
    """Zeros for the effects that the vehicle holds and the new model does not mention, by id.

    A model without an effect was fitted without it and accounts for the vehicle's whole motion, so the old effect must
    not act in addition. Only configurations that `targets` mentions are affected.
    """
    about = {part[0] for part in map(part_of_set, targets) if part is not None}
    return {
        name: 0.0
        for name, value in present.items()
        if value != 0.0
        and name not in targets
        and (part := part_of_set(name)) is not None
        and isinstance(part[1], EffectCoefficient)
        and part[0] in about
    }


def obstacle(present: Mapping[str, float]) -> str:
    """Why an armed vehicle with the values `present` must not be given parameters, "" if it may."""
    if present.get(MODE) in (Mode.ALONE, Mode.BOTH):
        return "is armed and its feed-forward acts on the thrusters: force the feed-forward off first"
    return ""


def not_raised(targets: Mapping[str, float], present: Mapping[str, float]) -> dict[str, float]:
    """`targets` without FF_MODE if that would raise the feed-forward's mode: a roll back is no order to act."""
    mode = present.get(MODE)
    return {
        name: value
        for name, value in targets.items()
        if name != MODE or mode is None or _is_no_rise(value, mode)
    }


def _is_no_rise(value: float, mode: float) -> bool:
    """Whether mode `value` gives the feed-forward no more authority than `mode`; the numbers are in another order."""
    if value not in set(Mode) or mode not in set(Mode):
        return value == mode
    if Mode(int(value)).applies_feedforward or Mode(int(mode)).applies_feedforward:
        return not Mode(int(value)).raises(Mode(int(mode)))
    return value <= mode


def _row(name: str, target: float, present: Mapping[str, float]) -> Row:
    now = present.get(name)
    try:
        # Adding zero turns -0 into the 0 that every vehicle stores.
        value = float32.from_user(target) + 0.0
    except ValueError as error:
        return Row(name, now, target, Verdict.REFUSED, str(error))
    if name in READ_ONLY:
        return Row(name, now, value, Verdict.READ_ONLY, READ_ONLY[name])
    against = objection(name, value)
    if against:
        return Row(name, now, value, Verdict.REFUSED, against)
    if now is None:
        return Row(name, None, value, Verdict.UNKNOWN, "the vehicle has no such parameter")
    if float32.same(now, value):
        return Row(name, now, value, Verdict.SAME)
    return Row(name, now, value, Verdict.CHANGED)


def _waiting(row: Row, active: float) -> Row:
    """Mark a SAME line of the staged set as STAGED, for a staged set that is not in force.

    If no set is in force (FF_ACTIVE 0), a target of 0 stays SAME: the vehicle behaves as if it were in force.
    """
    if row.verdict is not Verdict.SAME or not is_staged(row.name) or (active == 0.0 and row.target == 0.0):
        return row
    return replace(row, verdict=Verdict.STAGED)


def staging_notes(present: Mapping[str, float]) -> tuple[str, ...]:
    """A line for the crew if the vehicle's staged set is not the set in force; otherwise empty."""
    active = present.get(ACTIVE)
    if staged_is_in_force(present) is not False or active is None:
        return ()
    if active != 0.0:
        return (
            f"note: what the vehicle holds is staged as set {staged_crc(present)} and does not fly: set {active:.0f} "
            "does, which is another; an upload puts in force all that is staged",
        )
    waits = any(value for name, value in present.items() if is_staged(name))
    held = "what the vehicle holds is staged, and none of it flies: " if waits else ""
    return (
        f"note: {held}no set is in force on the vehicle ({ACTIVE} is 0), so its feed-forward is zero: upload one; "
        "where one was in force before, its vehicle file has another hull or other thrusters since",
    )


def action_of(plan: Plan) -> str:
    """The upload of a plan in words, for its confirmation prompt: `write 1 parameter and put 9 in force`."""
    changes, staged = len(plan.changes), len(plan.staged)
    if plan.withdraws:
        first = ", start the autopilot's scripts anew" if plan.restarts_scripts else ""
        return f"write {_count(changes)}{first} and leave no set in force"
    if changes and staged:
        return f"write {_count(changes)} and put the {staged} staged in force"
    if staged:
        return f"put {_count(staged)} in force"
    return f"write {_count(changes)}" if changes else "put the staged set in force"


def _count(lines: int) -> str:
    return f"{lines} parameter{'' if lines == 1 else 's'}"
