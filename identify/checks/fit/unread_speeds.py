"""Warnings about speeds and rates of turn that no sensor read, though their Coriolis forces act on other axes."""

from collections.abc import Sequence

import numpy as np

from identify.doubt import Doubt, Outcome, coefficients_of
from identify.estimators.axes.axis import Axes, Axis
from identify.words import axes_named

LONGEST_GAP_S = 5.0
"""Over a shorter gap the vehicle's speed follows from its earlier speed and from its thrust."""

LEAST_UNREAD_SHARE = 0.1
"""Share of the dive in longer gaps above which a warning is given."""


def unread_doubts(built: Axes) -> tuple[Doubt, ...]:
    """Warnings about the axes on which a velocity acts that was not read, or not for a good part of the dive."""
    return (*_unread_speeds(built), *_unread_turning(built))


def _unread_turning(built: Axes) -> tuple[Doubt, ...]:
    """A warning about surge, sway or heave if an unread rate of turn acts on it."""
    nu = built.motion.nu
    never = [dof for dof in range(3, 6) if not nu[:, dof].any()]
    # Turning about one axis with speed along a second pushes along the third.
    along_third = {
        3 - (turn - 3) - along
        for turn in never
        for along in range(3)
        if along != turn - 3 and nu[:, along].any()
    }
    pushed = sorted(along_third & {axis.dof for axis in built.axes})
    if not pushed:
        return ()
    about = coefficients_of(pushed)
    return (
        Doubt(
            about,
            f"No rate of turn was recorded in {axes_named(never)}",
            f"the forces that turning at speed makes in {axes_named(pushed)} (Coriolis) are left out, so "
            f"{', '.join(about)} may be off by more than their intervals; record a gyro, or dive without turning.",
            _outcome(never, pushed),
        ),
    )


def _unread_speeds(built: Axes) -> tuple[Doubt, ...]:
    """A warning for speeds that were never read, and one for those unread for a good part of the dive: about all
    rotations, and about other translations if the vehicle turns."""
    moving = {axis.dof: axis for axis in built.axes if axis.dof < 3}
    never = [dof for dof in range(3) if dof not in moving]
    gaps = {dof: silent_share(axis) for dof, axis in moving.items()}
    seldom = [dof for dof, share in gaps.items() if share > LEAST_UNREAD_SHARE]
    cases = []
    if never:
        cases.append((never, f"No velocity was recorded in {axes_named(never)}"))
    if seldom:
        worst = f"For {100 * max(gaps[dof] for dof in seldom):.0f} % of the dive"
        cases.append((seldom, f"{worst} no velocity was read in {axes_named(seldom)}"))
    doubts = []
    for dofs, words in cases:
        affected = [axis.dof for axis in built.axes if axis.dof >= 3 or _turned_into(axis.dof, dofs, built)]
        about = coefficients_of(affected)
        remedy = (
            f"what speed there does to the vehicle's {axes_named(affected)} is guessed, so {', '.join(about)} may be "
            "off by more than their intervals; dive with the DVL's bottom lock, or without speed while it turns."
        )
        if about:
            doubts.append(Doubt(about, words, remedy, _outcome(never if dofs is never else (), affected)))
    return tuple(doubts)


def _turned_into(dof: int, unread: Sequence[int], built: Axes) -> bool:
    """Whether turning causes a force along this axis from an unread speed along another."""
    return any(dof != along and built.motion.nu[:, 6 - dof - along].any() for along in unread)


def _outcome(never: Sequence[int], affected: Sequence[int]) -> Outcome:
    """Outcome of a fit in the `affected` axes without the velocities `never` read. Vehicles turn mostly in the
    horizontal plane, where the Coriolis force in surge and sway is not small."""
    return Outcome.DISAGREES if {0, 1, 5} & set(never) and {0, 1} & set(affected) else Outcome.CONVERGED


def silent_share(axis: Axis) -> float:
    """Share of an axis's time in gaps of its readings longer than LONGEST_GAP_S."""
    silent_s = lasting_s = 0.0
    for run in axis.runs:
        time_s = axis.time_s[run]
        read = time_s[np.isfinite(axis.reading[run])]
        gaps_s = np.diff(np.concatenate([time_s[:1], read, time_s[-1:]]))
        silent_s += float(gaps_s[gaps_s > LONGEST_GAP_S].sum())
        lasting_s += float(time_s[-1] - time_s[0])
    return silent_s / max(lasting_s, 1e-9)
