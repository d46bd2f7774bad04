"""Decides from a dive whether its feed-forward may be raised: go or no-go.

While the PID drives the vehicle (FF_MODE 0 and 1), the feed-forward is right if it asks for the forces that the PID
had to apply. The PID is deliberately late (source paper, section 4.3), so the two are not compared in time. Instead,
the mass and damping behind the feed-forward (TAU_FF fitted to the reference of the same instant) are compared with
those that the PID's force shows on the measured motion. The criteria, and the reasons for their limits:

- TAU_FF is never missing, nor zero while the reference moves: that is how the vehicle reports that it refuses a
  coefficient.
- The fed mass and damping, applied to the measured motion, rise and fall with the PID's force (correlation at least
  0.8). Below that, over a third of the PID's work was against other forces, such as a current, which no feed-forward
  knows.
- Mass and damping are each 0.71 to 1.41 times the PID's: half-way, in ratio, to the factor of two with which FF_MODE 3
  has been flown and settled (docs/onboard.md). The criterion fails if the 95 % interval lies outside. If the interval
  exceeds the factor of two, the dive does not show the value: other forces moved the vehicle more.
- Neither the PID in this dive nor the feed-forward in its place asks a thruster for over 80 % of its limit, in 99 % of
  the time: a fifth is left for corrections, and a saturated force shows no mass.

An axis that was not driven is not judged: the feed-forward gives nothing there until a reference moves it. Nor is a
dive in which thrusters were pushed beside the controller (TAU_CMD is not what it asked for), as in a flight that
identifies: its motion is not the reference's.

Feed-forward alone (FF_MODE 2) has no PID to compare with and is judged by its tracking errors, as in the paper: up to
twice the paper's share of the speed (Figs 12, 13: 0.0212 m/s of 0.5 while accelerating, 0.0336 m/s at constant
speed). With both (3) there is nothing to raise: the PID's force at a held speed must be at most half of the
feed-forward's.

In every mode, every axis is watched over the whole mission:

- An axis that is not asked to move stays within 10 mm/s, or 0.3 deg/s, rms while another moves. The simulated vehicle
  stays within half of that in every mode; with a thruster a fifth too weak it does not. Where the vehicle moves half as
  much while nothing is asked of it, that is the sea's doing, and not judged; surge and sway by the larger of both, for
  a vehicle that turns meets the sea from another side. With the feed-forward, what the PID does in an axis that the sea
  moves beyond these limits is not judged either.
- Where a diagnosis was accepted before the dive, the errors are at most a third above those that it foretold. The
  criterion fails at twice as much, if the sea does not move the vehicle half as much while it rests.
- A thruster with an accepted gain is made up for once: the allocation goes by what the thruster gave in this dive, to
  5 % beyond its interval; without one, by the gain that the diagnosis fitted. In shadow nothing is made up for yet, and
  the gain that the allocation will use is compared: a dive that does not show the thruster's gain is a NO GO,
  because the compensation would begin unjudged. If that gain is right, motion in shadow that was not asked for is not
  judged: the weak thruster causes it, until it is made up for.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from bridge.arrays import Array, Mask
from bridge.errors import FitError
from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.feedforward import FEEDFORWARD_DOFS
from bridge.vehicle.mode import Mode, word_of
from bridge.vehicle.thrusters import Allocator, thrust_curve
from identify.align import aligned
from identify.dive import Dive
from identify.validation.against_forecast import MOST_OF_REST, Held, MadeUp, sea_of
from identify.validation.axis_criteria import OF_THE_TIME, RATE_HZ, Criterion, of_axis
from identify.validation.tracking import CUTOFF_HZ, SHORTEST_RUN_S, WholeError, lever_of, whole_errors
from identify.words import capital, listed, speed

MARKS: Final = {True: "ok", False: "no", None: "unknown"}

MOVES: Final = 1e-3
"""Speed of a reference, m/s or rad/s, above which the reference moves."""
AROUND_S: Final = 2.0
OUT_OF_MODE: Final = "find out why it was taken back, and dive the mission again in one mode"

LEFT_ALONE_S: Final = 90.0
"""An axis with neither PID nor feed-forward for so long is not the controller's, but the autopilot's or nobody's."""

PUSHED: Final = 0.5
"""Share of the commanded force, of at least 2 N or 2 N m, that others than controller and feed-forward ask for in a
push of an axis whose reference rests."""
PUSH_S: Final = 1.0
"""A push lasts at least so long: a tap of the sticks moves a vehicle of tens of kilograms by next to nothing."""
SAME_FORCE: Final = 0.05
"""A push holds its force to this share. A force that varies more comes from other feedback, such as an autopilot that
holds the heading in STABILIZE."""

MOST_THRUST: Final = 0.8
MOST_UNASKED: Final = {"m/s": 0.010, "rad/s": 0.3 * np.pi / 180}
BASELINE: Final = "the baseline, flown by the PID with nothing fed forward: the others are compared with it."
BY_CONTROLLER: Final = "fly a minute by its controller: by hand, or the validation mission"
LOOK_CLOSER: Final = "see what moves it: diagnose this dive"
CALMER: Final = "dive in shadow again in a calmer sea"
NO_REACH: Final = 1e-6


@dataclass(frozen=True)
class Raising:
    """The criteria, the mode in which the dive was flown, and the mode to which the criteria let it be raised."""

    flown: Mode
    to: Mode
    criteria: tuple[Criterion, ...]

    @property
    def go(self) -> bool:
        return all(criterion.passed is not False for criterion in self.criteria)

    @property
    def sentence(self) -> str:
        if not self.go:
            failed = [criterion for criterion in self.criteria if criterion.passed is False]
            mends = dict.fromkeys(criterion.mend for criterion in failed)
            back = "lower the feed-forward to shadow" if self.flown.applies_feedforward else "don't raise it"
            return f"NO-GO, {back}: {_listed(failed)}. {capital('; '.join(mends))}."
        flown, to = self.flown.word, self.to.word
        unknown = [criterion for criterion in self.criteria if criterion.passed is None]
        remark = f" Not known from this dive: {_listed(unknown)}." if unknown else ""
        if self.flown is self.to:
            return f"GO: the feed-forward may stay at {flown}.{remark}"
        return f"GO: the feed-forward may be raised from {flown} to {to} (seatrial ff {to}, in the app Ctrl-U).{remark}"

    def to_json(self) -> dict[str, Any]:
        return {
            "go": self.go,
            "from": self.flown.word,
            "to": self.to.word,
            "sentence": self.sentence,
            "criteria": [
                {"what": criterion.quantity, "passed": criterion.passed, "words": criterion.words}
                for criterion in self.criteria
            ],
        }


def _listed(criteria: Sequence[Criterion]) -> str:
    return ", ".join(criterion.quantity for criterion in criteria)


@dataclass(frozen=True)
class OneMode:
    """A mode (None if the dive reports no known mode) and the part of the dive flown in it.

    `changed` judges the changes of mode; None if there were none.
    """

    mode: Mode | None
    dive: Dive
    changed: Criterion | None = None


def in_one_mode(dive: Dive) -> OneMode:
    """Select the part between two changes of FF_MODE in which the reference moved longest, otherwise the longest part.

    If the crew or the vehicle lowered the mode out of feed-forward while the reference moved, that fails the
    criterion.
    """
    reported = None if dive.ff_mode is None else dive.ff_mode.finite()
    if reported is None or not len(reported):
        return OneMode(None, dive)
    time_s, value = reported.time_s, reported.value[:, 0]
    starts = np.concatenate([[0], np.flatnonzero(np.diff(value)) + 1])
    modes = [int(mode_number) for mode_number in value[starts]]
    begins_s = np.concatenate([[-np.inf], time_s[starts[1:]]])
    ends_s = np.concatenate([time_s[starts[1:]], [np.inf]])
    parts = [dive.between(float(begin), float(end)) for begin, end in zip(begins_s, ends_s, strict=True)]
    lasts_s = np.minimum(ends_s, time_s[-1]) - np.maximum(begins_s, time_s[0])
    chosen = max(range(len(parts)), key=lambda n: (_moves_for(parts[n]), lasts_s[n]))
    mode = Mode(modes[chosen]) if modes[chosen] in set(Mode) else None
    if len(parts) == 1:
        return OneMode(mode, parts[0])
    flown = ", ".join(
        f"{word_of(mode_number)} {seconds:.0f} s" for mode_number, seconds in zip(modes, lasts_s, strict=True)
    )
    words = f"changed in the dive ({flown}); judged is the part in {word_of(modes[chosen])} of {lasts_s[chosen]:.0f} s"
    taken_back = any(
        _applies(before)
        and not _applies(after)
        and _moves_for(dive.between(at_s - AROUND_S, at_s + AROUND_S))
        for before, after, at_s in zip(modes, modes[1:], begins_s[1:], strict=False)
    )
    if taken_back:
        words = f"taken back while the reference moved: {words}"
    return OneMode(mode, parts[chosen], Criterion("mode", not taken_back, words, OUT_OF_MODE))


def _moves_for(dive: Dive) -> int:
    """Number of readings in which the reference moves."""
    if dive.nu_ref is None:
        return 0
    return int(np.count_nonzero(np.any(np.abs(np.nan_to_num(dive.nu_ref.value[:, :6])) > MOVES, axis=1)))


def _applies(mode: int) -> bool:
    return mode in set(Mode) and Mode(mode).applies_feedforward


def go_no_go(
    dive: Dive,
    file: VehicleFile,
    configuration: str,
    held: Sequence[Held] = (),
    made_up: Sequence[MadeUp] = (),
    instead: str = "",
) -> Raising | None:
    """Judge the part of a dive flown in one mode; None if the dive reports no FF_MODE or no reference, and for a
    baseline: flown by the PID with no feed-forward beside it.

    `held`: axes of that part with the errors foretold for them; `made_up`: thrusters with an accepted gain;
    `instead`: the advice where an axis moves that should not, rather than to diagnose the dive.
    """
    part = in_one_mode(dive)
    mode, dive = part.mode, part.dive
    if mode is None or dive.nu_ref is None or not len(dive.nu_ref):
        return None
    if dive.tau_ff is None or dive.tau_pid is None or not (len(dive.tau_ff) and len(dive.tau_pid)):
        lacking = Criterion("TAU_FF", False, "TAU_FF or TAU_PID is not recorded", "record both")
        return Raising(mode, Mode.BOTH, (lacking,))
    if mode is Mode.OFF and not np.nan_to_num(dive.tau_ff.value).any():
        return None
    changed = () if part.changed is None else (part.changed,)
    pushed_s = _pushed_s(dive, mode)
    if pushed_s > SHORTEST_RUN_S:
        words = f"thrusters were pushed beside the controller for {pushed_s:.0f} s, as in a flight that identifies"
        return Raising(mode, Mode.BOTH, (*changed, Criterion("motion", False, words, BY_CONTROLLER)))
    try:
        motion = aligned(dive, file, configuration, RATE_HZ, CUTOFF_HZ)
    except FitError as error:
        return Raising(mode, Mode.BOTH, (Criterion("motion", False, str(error), "dive longer"),))
    shape = file.vehicle.configurations[configuration]
    thrusters = Allocator(shape, thrust_curve(file.vehicle.thrust_curve, file.path.parent))
    reach = thrusters.reach()
    driven = [dof for dof in FEEDFORWARD_DOFS if reach[dof] > NO_REACH]
    whole = whole_errors(dive, lever_of(file))
    sea = sea_of(whole)
    rough = {error.axis for error in whole if sea.get(error.axis, 0.0) > MOST_UNASKED[error.unit]}
    of_axes = {DOFS[dof]: of_axis(dof, mode, dive, motion, file) for dof in driven}
    criteria = [
        _in_the_sea(criterion, mode) if axis in rough else criterion
        for axis, of_axis in of_axes.items()
        for criterion in of_axis
    ]
    if all(criterion.passed is None for of_axis in of_axes.values() for criterion in of_axis):
        criteria = [Criterion("motion", False, "no axis held a speed", "dive the validation mission")]
    closer = instead or next((each.mend for each in made_up if each.passed is False), LOOK_CLOSER)
    weak = [str(each.credit.thruster) for each in made_up if each.awaits]
    unasked = _unasked([error for error in whole if np.isfinite(error.unasked)], sea, weak, closer)
    foretold = [Criterion(each.name, each.kept, f"foretold {each.figures}", closer) for each in held]
    credited = [Criterion(each.name, each.passed, each.words, each.mend) for each in made_up]
    thrust = _thrust(dive, mode, thrusters)
    return Raising(mode, Mode.BOTH, (*changed, *criteria, *unasked, *foretold, *credited, thrust))


def _pushed_s(dive: Dive, mode: Mode) -> float:
    """Time for which the commanded force differed from the controller's, with the feed-forward of `mode`."""
    if dive.tau_cmd is None or dive.tau_pid is None or dive.tau_ff is None or dive.nu_ref is None:
        return 0.0
    if len(dive.tau_cmd) < 2:
        return 0.0
    time_s, dofs = dive.tau_cmd.time_s, list(FEEDFORWARD_DOFS)
    moves = np.abs(np.nan_to_num(dive.nu_ref.at(time_s)[:, dofs])) > MOVES
    commanded = dive.tau_cmd.value[:, dofs]
    pid, fed = (np.nan_to_num(tau.at(time_s)[:, dofs]) for tau in (dive.tau_pid, dive.tau_ff))
    asked = {Mode.ALONE: fed, Mode.BOTH: pid + fed}.get(mode, pid)
    step_s = 1.0 / max(dive.tau_cmd.rate_hz, 1e-9)
    least = max(round(PUSH_S / step_s), 1)
    # A command that only its limits hold back is smaller than what was asked for; an axis without a reference, as under
    # an autopilot that holds its heading, is not the controller's, and one that it leaves alone for long is not then.
    alone = (pid == 0.0) & (fed == 0.0)
    others = _long_runs(alone, round(LEFT_ALONE_S / step_s)) | (alone & ~_held(commanded, least))
    more = ~moves & ~others & moves.any(axis=0) & (np.abs(commanded) > np.abs(asked))
    pushed = more & (np.abs(commanded - asked) > PUSHED * np.maximum(np.abs(commanded), 2.0))
    return float(np.count_nonzero(_long_runs(pushed, least).any(axis=1)) * step_s)


def _held(force: Array, least: int) -> Mask:
    """Whether each force (n, k) lies in a stretch of at least so many samples over which it stays the same."""
    held = np.zeros(force.shape, bool)
    if len(force) < least:
        return held
    stretches = np.lib.stride_tricks.sliding_window_view(force, least, axis=0)
    span = stretches.max(axis=2) - stretches.min(axis=2)
    same = span <= SAME_FORCE * np.abs(stretches).max(axis=2)
    for later in range(least):
        held[later : later + len(same)] |= same
    return held


def _long_runs(mask: Mask, least: int) -> Mask:
    """Those of a mask (n, k) that lie in runs of at least so many along its first axis."""
    long = np.zeros_like(mask)
    for column in range(mask.shape[1]):
        edges = np.flatnonzero(np.diff(np.r_[False, mask[:, column], False].astype(int)))
        for start, stop in edges.reshape(-1, 2):
            long[start:stop, column] = stop - start >= least
    return long


def _in_the_sea(criterion: Criterion, mode: Mode) -> Criterion:
    """A criterion of an axis that the sea moves more than it is asked to, as far as that rests on forces or errors.

    With the feed-forward a failure is not judged: the PID answers the sea. Before that, it is no GO, and a dive in a
    calmer sea shows more.
    """
    if criterion.passed is not False or not criterion.by_motion:
        return criterion
    if mode.applies_feedforward:
        return replace(criterion, passed=None, words=f"{criterion.words}; but the sea moves it")
    return replace(criterion, mend=CALMER)


def _unasked(
    errors: Sequence[WholeError], sea: Mapping[str, float], weak: Sequence[str], mend: str
) -> list[Criterion]:
    """How much each axis moves that is not asked to: one criterion for those within their limits.

    `sea`: its motion of each axis at rest; `weak`: numbers of thrusters that are not made up for until the
    feed-forward acts.
    """
    still = [error for error in errors if error.unasked <= MOST_UNASKED[error.unit]]
    said = ", ".join(f"{error.axis} {speed(error.unasked, error.unit)}" for error in still)
    most = " and ".join(speed(limit, unit) for unit, limit in MOST_UNASKED.items())
    together = [Criterion("not asked to move", True, f"{said} rms, at most {most}")] if still else []
    moving = (_moving(error, sea.get(error.axis, 0.0), weak, mend) for error in errors if error not in still)
    return [*together, *moving]


def _moving(error: WholeError, sea: float, weak: Sequence[str], mend: str) -> Criterion:
    """An axis that moves beyond its limit while others are asked to."""
    name, most = f"{error.axis} not asked to move", speed(MOST_UNASKED[error.unit], error.unit)
    words = f"{speed(error.unasked, error.unit)} rms while others move, at most {most}"
    if error.unasked <= MOST_OF_REST * sea:
        return Criterion(name, None, f"{words}; but {speed(sea, error.unit)} at rest: the sea")
    if weak and DOFS.index(error.axis) in FEEDFORWARD_DOFS:
        are = "is" if len(weak) == 1 else "are"
        return Criterion(name, None, f"{words}; but thruster {listed(weak)} {are} not made up for in shadow")
    return Criterion(f"{error.axis} moves unasked", False, words, mend)


def _thrust(dive: Dive, mode: Mode, thrusters: Allocator) -> Criterion:
    """Share of its limit used by the hardest-driven thruster, with the PID as flown and with the feed-forward
    instead.
    """
    assert dive.tau_pid is not None
    assert dive.tau_ff is not None
    time_s = dive.tau_pid.time_s
    pid, fed = dive.tau_pid.value, np.nan_to_num(dive.tau_ff.at(time_s))
    alone = pid.copy()
    alone[:, FEEDFORWARD_DOFS] = fed[:, FEEDFORWARD_DOFS]
    asked = (alone, pid + fed) if mode is Mode.BOTH else (alone, pid)
    share = max(float(np.quantile([_share(thrusters, tau) for tau in taus], OF_THE_TIME)) for taus in asked)
    words = f"{100 * share:.0f} % of its limit for the hardest-driven, at most {100 * MOST_THRUST:.0f} %"
    return Criterion("thrusters", share <= MOST_THRUST, words, "dive slower")


def _share(thrusters: Allocator, tau: Array) -> float:
    thrust, _, scale = thrusters.allocate(tau)
    share = np.maximum(thrust / thrusters.high_n, thrust / thrusters.low_n).max(initial=0.0)
    return float(share) / scale
