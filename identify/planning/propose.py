"""Proposes the manoeuvres to dive next: those that narrow the widest intervals, within the limits.

Greedy over blocks of time, A-optimal: each block goes to the manoeuvre that reduces the sum of the relative variances
most per second (Pukelsheim 2006, chapter 6). The promised result comes from a trial of the whole mission, not from
the sum of its parts.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.errors import FitError
from bridge.simulator.direct import TICK_S
from bridge.vehicle.coefficients import DAMPINGS, DOFS, HEAVE, MASSES, SURGE, SWAY, YAW
from bridge.vehicle.legs import Leg
from identify.dive import STAMPED_S
from identify.planning.knowledge import COUNTED, NAMES, Knowledge, of_motion, of_timing
from identify.planning.limits import REST_S, Limits, Tank, Trial
from identify.planning.manoeuvres import (
    PERIODS_S,
    PUSHES,
    RATES,
    Drive,
    Family,
    Manoeuvre,
    coast_down,
    laps,
    square,
    sweep,
)

Progress = Callable[[float, str], None]

DOFS_PLANNED = (SURGE, SWAY, HEAVE, YAW)
LEAST_PUSH = 0.02
"""Share of the strongest axis's force (of its moment over a metre, in yaw) below which an axis can't be driven."""

WIDEST = 1.0
"""Relative standard deviation assumed for an unknown coefficient, so that the sum is finite."""

NOTHING = 10.0
"""Relative standard deviation from which a coefficient counts as unknown."""

FITS = 1.02
TRIES, NEAR = 10, 1.1
"""Trials of a family at most, and how near to the greatest strength is near enough."""
LAP_SHARE, TURN_RAD = 0.8, math.pi
"""Of the room, in laps along an axis, and the turn of laps in yaw."""

AIM_SHARE, BEYOND = 0.9, 1e-3
"""A plan aims a little below the width asked for, as a trial of the whole tells less than the sum of its parts; what is
narrower already counts by so little that it only decides between equals."""

NO_AIMS: Final[Mapping[str, float]] = {}
"""All are narrowed alike."""

ENDLESS = 1_000_000
"""More cycles than any dive has."""

RESERVE_S, RESERVE_SHARE = 128.0, 0.25
"""Room is reserved for the drift of a manoeuvre of this length, but no more than this share unless a block needs it."""


@dataclass(frozen=True)
class Part:
    """A manoeuvre of the plan and the result of a trial of it alone."""

    manoeuvre: Manoeuvre
    trial: Trial
    drift_m: float

    @property
    def needs_m(self) -> float:
        """Room across, including the possible drift of an axis that is not held."""
        return self.trial.across_m + self.drift_m


@dataclass(frozen=True)
class Proposal:
    """The parts in their order, with the expected uncertainty.

    `before` the dive, by this dive `alone`, and `after` it with both: relative standard deviations (12,) in the order
    of `NAMES`, inf for unknown coefficients. `trial` is that of the whole mission, `duration_s` includes its rests.
    """

    parts: tuple[Part, ...]
    before: Array
    alone: Array
    after: Array
    trial: Trial
    duration_s: float
    dofs: tuple[int, ...]


@dataclass(frozen=True)
class _Candidate:
    """A family at the largest admissible strength.

    `information` of a block, and what it shares with the `timing` of thrust; `most_cycles` in a single part keep the
    room.
    """

    family: Family
    scale: float
    information: Array
    timing: Array
    duration_s: float
    most_cycles: int

    def goes(self, cycles: int) -> int:
        return -(-cycles // self.most_cycles)

    def seconds(self, cycles: int) -> float:
        """Time for `cycles` cycles, with a rest before each part."""
        return cycles * self.family.period_s + self.goes(cycles) * REST_S


def propose(
    tank: Tank,
    limits: Limits,
    seconds: float,
    dofs: Sequence[int] = DOFS_PLANNED,
    progress: Progress = lambda *_: None,
    know: Sequence[str] = (),
    aims: Mapping[str, float] = NO_AIMS,
) -> Proposal:
    """Choose the manoeuvres for `seconds` in total, rests included, that narrow the coefficients `know`, or all of the
    axes, each to its relative standard deviation in `aims`; the time left narrows all further.

    Raises FitError if the thrusters drive none of the axes, or not that of a coefficient of `know`, or if no manoeuvre
    fits into the limits or the time.
    """
    file, knowledge = tank.file, tank.knowledge
    able = drivable(tank, dofs)
    if not able:
        raise FitError(
            f"{file.path}: the thrusters of '{tank.configuration_name}' push along none of "
            f"{', '.join(DOFS[dof] for dof in dofs)}; name other axes, or mend the vehicle file"
        )
    telling = [group[dof].name for dof in able for group in (MASSES, DAMPINGS)]
    if untold := [name for name in know if name not in telling]:
        raise FitError(
            f"{file.path}: no plan tells {', '.join(untold)}; along the axes planned it tells {', '.join(telling)}"
        )
    asked = tuple(dof for dof in able if {MASSES[dof].name, DAMPINGS[dof].name} & {*(know or telling)})
    families = _in_time(_families(tank, asked, limits), seconds)
    candidates = []
    for i, family in enumerate(families):
        progress(i / (len(families) + 1), f"trying {family.kind} in {DOFS[family.drives[0].dof]}")
        candidate = _within(family, tank, limits, able)
        if candidate is not None:
            candidates.append(candidate)
    chosen = _choose(candidates, knowledge, know or telling, seconds, aims)
    if not chosen:
        shortest = min((c.duration_s + 2 * REST_S for c in candidates), default=np.nan)
        why = (
            f"no manoeuvre fits into {limits.space_m:g} m across and {limits.heave_m:g} m up and down at "
            f"{limits.speed_m_s:g} m/s; give more by --space, --depth-space or --speed"
            if not candidates
            else f"the shortest manoeuvre takes {shortest:.0f} s with its rests, and there are {seconds:.0f} s; give "
            f"--minutes {math.ceil(shortest / 6 - 1e-9) / 10:g} or more"
        )
        raise FitError(f"{file.path}: nothing can be planned: {why}")
    parts = tuple(part for candidate, cycles in chosen for part in _parts(candidate, cycles, tank, limits))
    whole_trial = tank.dive(mission_legs([part.manoeuvre for part in parts]))
    timing = of_timing(TICK_S, whole_trial.nu, knowledge, able)
    information = stamped(of_motion(TICK_S, whole_trial.nu, knowledge, able), timing)
    progress(1.0, "done")
    return Proposal(
        parts,
        relative_std(knowledge.precision),
        relative_std(information),
        relative_std(knowledge.precision + information),
        whole_trial,
        len(whole_trial.nu) * TICK_S,
        able,
    )


def mission_legs(manoeuvres: Sequence[Manoeuvre]) -> list[Leg]:
    """Legs of all manoeuvres, with a rest between consecutive manoeuvres."""
    legs: list[Leg] = []
    for i, manoeuvre in enumerate(manoeuvres):
        legs += [Leg(REST_S, "rest", "rest")] if i else []
        legs += manoeuvre.legs()
    return legs


def drivable(tank: Tank, dofs: Sequence[int]) -> tuple[int, ...]:
    """The axes of `dofs` along which the thrusters can push without a force along another axis."""
    reach = {dof: tank.force(dof, 1.0) for dof in DOFS_PLANNED}
    strongest = max(reach.values())
    return tuple(dof for dof in dofs if reach[dof] > LEAST_PUSH * strongest > 0)


def relative_std(precision: Array) -> Array:
    """Standard deviations (12,) of the logarithms; inf for coefficients of which nothing or almost nothing is known."""
    out = np.full(len(precision), np.inf)
    known = _known(precision)
    out[known] = np.sqrt(np.diag(np.linalg.inv(precision[np.ix_(known, known)])))
    return out[: len(NAMES)]


def stamped(precision: Array, timing: Array) -> Array:
    """Information of a dive (18, 18), reduced by the uncertainty in the time of thrust, which is known to STAMPED_S.

    timing (k, 18): information that the coefficients share with that time.
    """
    out, known = np.zeros_like(precision), _known(precision)
    covariance = _covariance(precision[np.ix_(known, known)], timing[:, known])
    out[np.ix_(known, known)] = np.linalg.inv(covariance)
    return out


def _covariance(precision: Array, timing: Array) -> Array:
    """Covariance (k, k) of coefficients, with the error of the time of the thrust, of which `timing` is what they
    share."""
    covariance = np.linalg.inv(precision)
    off = STAMPED_S * timing @ covariance
    return np.asarray(covariance + off.T @ off)


def _known(precision: Array) -> NDArray[np.intp]:
    """Indices of the coefficients of which something is known."""
    return np.flatnonzero(np.diag(precision) > NOTHING**-2)


def _families(tank: Tank, dofs: tuple[int, ...], limits: Limits) -> list[Family]:
    push = {
        dof: Drive(dof, PUSHES[dof], tank.force(dof, limits.thrust_share)) for dof in dofs if dof in PUSHES
    }
    rate = {
        dof: Drive(dof, RATES[dof], limits.turn_rad_s if dof == YAW else limits.heave_m_s)
        for dof in dofs
        if dof not in PUSHES
    }
    together = [tuple(pair.values()) for pair in (push, rate) if len(pair) == 2]
    alone = [(drive,) for drive in (*push.values(), *rate.values())]
    families = [square(period_s, *drives) for drives in (*alone, *together) for period_s in PERIODS_S]
    for drive in push.values():
        families += [sweep(drive), coast_down(PERIODS_S[-1], drive)]
        families.append(
            laps(LAP_SHARE * limits.space_m, Drive(drive.dof, RATES[drive.dof], limits.speed_m_s))
        )
    if YAW in rate:
        families.append(laps(TURN_RAD, rate[YAW]))
    return families


def _in_time(families: Sequence[Family], seconds: float) -> Sequence[Family]:
    """The families of which a block fits into the time; if none does, the shortest, which tells how long it takes.

    Laps are as long as the room: to try what can't be chosen takes memory and time without bound.
    """
    blocks_s = [family.cycles * family.period_s for family in families]
    longest_s = max(seconds - 2 * REST_S, min(blocks_s))
    return [family for family, block_s in zip(families, blocks_s, strict=True) if block_s <= longest_s]


def _within(family: Family, tank: Tank, limits: Limits, dofs: tuple[int, ...]) -> _Candidate | None:
    """The family at nearly the greatest strength that the limits allow; None if they allow none.

    Far too strong a wave tumbles the hull: by its speeds in proportion the next would be far too weak.
    """
    knowledge = tank.knowledge
    drift_m = _drift(family.drives, family.period_s, knowledge)
    block_m = _drift(family.drives, family.cycles * family.period_s, knowledge)
    reserve_m = _drift(family.drives, RESERVE_S, knowledge)
    room_m = limits.space_m - max(block_m, min(reserve_m, RESERVE_SHARE * limits.space_m))
    if room_m <= 0:
        return None
    scale, too_strong, best = 1.0, math.inf, None
    for _ in range(TRIES):
        manoeuvre = family.at(scale, family.cycles)
        trial = tank.dive(manoeuvre.legs())
        over = max(trial.over(limits) / FITS, trial.across_m / room_m, trial.depth_m / limits.heave_m)
        by_ratio = scale * 0.99 / over
        if over <= 1:
            best = scale, manoeuvre, trial
            scale = min(by_ratio, (scale + too_strong) / 2, 1.0)
        else:
            too_strong = scale
            scale = by_ratio if best is None else (best[0] + scale) / 2
        if best is not None and scale < NEAR * best[0]:
            break
    if best is None:
        return None
    scale, manoeuvre, trial = best
    spare = (limits.space_m - trial.across_m) / drift_m if drift_m > 0 else ENDLESS
    most = max(family.cycles, int(min(spare**2, ENDLESS)))
    information = of_motion(TICK_S, trial.nu, knowledge, dofs)
    timing = of_timing(TICK_S, trial.nu, knowledge, dofs)
    return _Candidate(family, scale, information, timing, manoeuvre.duration_s, most)


def _parts(candidate: _Candidate, cycles: int, tank: Tank, limits: Limits) -> list[Part]:
    """Split the cycles into parts of nearly equal length, each within the space."""
    goes = candidate.goes(cycles)
    sizes = [cycles // goes + (i < cycles % goes) for i in range(goes)]
    made = {size: _part(candidate, size, tank, limits) for size in set(sizes)}
    return [made[size] for size in sizes]


def _part(candidate: _Candidate, cycles: int, tank: Tank, limits: Limits) -> Part:
    """Build a part; weaker than its candidate if more cycles swing wider than the candidate's block did."""
    scale = candidate.scale
    while True:
        manoeuvre = candidate.family.at(scale, cycles)
        drift_m = _drift(manoeuvre.drives, manoeuvre.duration_s, tank.knowledge)
        part = Part(manoeuvre, tank.dive(manoeuvre.legs()), drift_m)
        across = part.trial.across_m / (limits.space_m - drift_m)
        over = max(across, part.trial.depth_m / limits.heave_m)
        if over <= 1:
            return part
        scale *= 0.99 / over


def _choose(
    candidates: Sequence[_Candidate],
    knowledge: Knowledge,
    know: Sequence[str],
    seconds: float,
    aims: Mapping[str, float],
) -> list[tuple[_Candidate, int]]:
    """Candidates with their cycles, by axis and period: whole blocks, then single cycles of these for the remaining
    time, and last of any."""
    precision = knowledge.precision + np.eye(len(COUNTED)) / WIDEST**2
    timing = np.zeros_like(candidates[0].timing) if candidates else np.zeros((0, len(COUNTED)))
    wanted = [NAMES.index(name) for name in know]
    cycles = [0] * len(candidates)
    left_s = seconds - REST_S

    known_enough = np.array([AIM_SHARE**2 if name in aims else 0.0 for name in know])
    units = np.array([aims.get(name, 1.0) for name in know])

    def unknown(total: Array, late: Array) -> float:
        variances = np.diag(_covariance(total, late))[wanted] / units**2
        return float(np.sum(np.maximum(variances - known_enough, 0.0) + BEYOND * variances))

    def fill(sizes: dict[int, int]) -> None:
        """Add the best candidate repeatedly, each by its size in cycles, while time is left."""
        nonlocal left_s, precision, timing

        def cost_s(i: int) -> float:
            return candidates[i].seconds(cycles[i] + sizes[i]) - candidates[i].seconds(cycles[i])

        def then(i: int) -> tuple[Array, Array]:
            share = sizes[i] / candidates[i].family.cycles
            return precision + share * candidates[i].information, timing + share * candidates[i].timing

        while fitting := [i for i in sizes if cost_s(i) <= left_s]:
            now = unknown(precision, timing)
            best = max(fitting, key=lambda i: (now - unknown(*then(i))) / cost_s(i))
            left_s -= cost_s(best)
            precision, timing = then(best)
            cycles[best] += sizes[best]

    fill({i: candidate.family.cycles for i, candidate in enumerate(candidates)})
    fill({i: 1 for i, number in enumerate(cycles) if number})
    if any(cycles):
        fill(dict.fromkeys(range(len(candidates)), 1))
    chosen = [(c, n) for c, n in zip(candidates, cycles, strict=True) if n]
    return sorted(chosen, key=lambda pair: ([d.dof for d in pair[0].family.drives], pair[0].family.period_s))


def _drift(drives: Sequence[Drive], seconds: float, knowledge: Knowledge) -> float:
    """Two standard deviations of the drift by the disturbance, in m, of an axis that is pushed and not held."""
    drifts = [
        2 * noise.disturbance * np.sqrt(2 * noise.time_constant_s * seconds) / damping
        for drive in drives
        if drive.key == PUSHES.get(drive.dof)
        for noise, damping in [(knowledge.noise[drive.dof], knowledge.values[DAMPINGS[drive.dof].name])]
    ]
    return float(max(drifts, default=0.0))
