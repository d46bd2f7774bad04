"""Which coefficients a dive can separate: correlations of the result, and directions that the dive alone does not
determine.

A direction is null if the Fisher information of the logarithms leaves it a standard deviation above
`LARGEST_RELATIVE_STD` (Rothenberg 1971, theorem 1: singular information means no local identifiability). Coefficients
that share a null direction are found from the projector onto all null directions, which does not depend on the basis.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import DOFS, OF_HULL
from identify.identification import (
    LARGEST_RELATIVE_STD,
    Estimate,
    Identification,
    Information,
    NullDirection,
    Outcome,
    Partner,
)
from identify.words import capital

Array = NDArray[np.float64]

SHARED = 0.1
"""Entries of the projector up to this size are ignored: two parameters share a null direction only if theirs is
larger."""

UNKNOWN = 1.0
"""A direction with a larger relative standard deviation is as good as unknown."""

TRIM = "_trim"
THRUST_SCALE = "thrust_scale"


def with_identifiability(found: Identification) -> Identification:
    """Return the identification with each coefficient's partner, and with the coefficients that the dive can't
    separate.

    If the estimator gave no information matrix, the inverse of its covariance replaces it. A coefficient at a bound
    counts as known there, so a direction of such coefficients alone is left out.
    """
    partners = partners_of(found.covariance_of, found.covariance)
    information = found.information or _information(found)
    at_bound = {name for doubt in found.doubts if doubt.outcome is Outcome.AT_BOUND for name in doubt.about}
    directions = tuple(
        _said(direction, found)
        for direction in (() if information is None else null_directions(information))
        if not set(direction.weights) <= at_bound and _open(direction, found)
    )
    scale = found.thrust_scale
    if scale is not None and not scale.in_intervals and found.covariance_of:
        moved = [name for name in found.covariance_of if name not in found.rest_on_righting]
        directions = (*directions, *((scale_direction(moved),) if moved else ()))
    return replace(
        found,
        parameters=tuple(
            replace(parameter, partner=partners.get(parameter.name)) for parameter in found.parameters
        ),
        null_directions=directions,
    )


def _open(direction: NullDirection, found: Identification) -> dict[str, float]:
    """The weights of the coefficients that are not identifiable, and of the trims; empty if every coefficient is
    identifiable."""
    known = {parameter.name for parameter in found.parameters if parameter.identifiable}
    left = {name: weight for name, weight in direction.weights.items() if name not in known}
    return left if any(not name.endswith(TRIM) for name in left) else {}


def _said(direction: NullDirection, found: Identification) -> NullDirection:
    """The direction with a sentence about its coefficients that are not identifiable, with advice that can be
    followed."""
    left = _open(direction, found)
    righted = [name for name in left if name in found.rest_on_righting]
    if righted:
        axes = " and ".join(dict.fromkeys(_axis(name) for name in righted))
        text = ", ".join(f"{_words(name)} ({name})" for name in righted)
        sentence = f"The dive says too little of {text}: no thruster pushed {axes}; swing it by hand, then let it rest."
    else:
        sentence = _sentence(left, direction.relative_std)
    return replace(direction, sentence=sentence)


def partners_of(of: Sequence[str], covariance: Array) -> dict[str, Partner]:
    """For each name, the coefficient that correlates most with it; empty if there are fewer than two."""
    spread = np.sqrt(np.diag(covariance))
    if len(of) < 2 or not np.all(spread > 0):
        return {}
    correlation = covariance / np.outer(spread, spread)
    np.fill_diagonal(correlation, 0.0)
    strongest = np.argmax(np.abs(correlation), axis=1)
    return {
        name: Partner(of[j], float(np.clip(correlation[i, j], -1.0, 1.0)))
        for i, (name, j) in enumerate(zip(of, strongest, strict=True))
        if correlation[i, j] != 0.0
    }


def null_directions(told: Information) -> tuple[NullDirection, ...]:
    """Return the directions in which the dive alone gives too little information, one for each set of parameters that
    share a direction."""
    strength, vectors = np.linalg.eigh(0.5 * (told.matrix + told.matrix.T))
    null = vectors[:, strength < LARGEST_RELATIVE_STD**-2]
    together = null @ null.T
    out = []
    for members in _groups(np.abs(together) > SHARED):
        names = [told.of[i] for i in members]
        if all(name.endswith(TRIM) for name in names):
            continue
        inner, directions = np.linalg.eigh(told.matrix[np.ix_(members, members)])
        worst = directions[:, 0] * (1.0 if directions[np.argmax(np.abs(directions[:, 0])), 0] > 0 else -1.0)
        std = 1.0 / math.sqrt(inner[0]) if inner[0] > 0 else math.inf
        weights = {name: float(w) for name, w in zip(names, worst, strict=True)}
        out.append(NullDirection(weights, std, _sentence(weights, std)))
    return tuple(out)


def scale_direction(of: Sequence[str]) -> NullDirection:
    """The direction of thrust and all that scales with it: scaling all of them together gives the same motion."""
    share = 1.0 / math.sqrt(len(of) + 1)
    return NullDirection(
        dict.fromkeys((THRUST_SCALE, *of), share),
        math.inf,
        "Thrust scale and all masses and dampings that thrust weighs can't be told apart: weigh the vehicle, or hang "
        f"0.5 kg on it, and give what you find as a prior in the vehicle file.{_of_dvl(of)}",
    )


def _of_dvl(of: Sequence[str]) -> str:
    """A sentence on the effect of the DVL's scale on the coefficients of the axes that it measures."""
    names = [name for name in of if OF_HULL[name].dof < 3]
    if not names:
        return ""
    return (
        f" Nor can the DVL's scale and {', '.join(names)}: one that read 1 % too little would make them 1 % larger; "
        "surface fixes at both ends of a straight leg tell it."
    )


def _groups(bound: NDArray[np.bool_]) -> list[list[int]]:
    """Connected sets of the parameters that take part in a null direction."""
    left = [i for i in range(len(bound)) if bound[i, i]]
    groups = []
    while left:
        group, fresh = [], [left[0]]
        while fresh:
            member = fresh.pop()
            left.remove(member)
            group.append(member)
            fresh += [i for i in left if bound[member, i] and i not in fresh]
        groups.append(sorted(group))
    return groups


def _information(found: Identification) -> Information | None:
    """Inverse of the covariance of the logarithms, over the coefficients that have a value and a variance."""
    by_name = {parameter.name: parameter for parameter in found.parameters}
    kept = [
        i for i, n in enumerate(found.covariance_of) if _usable(by_name[n]) and found.covariance[i, i] > 0
    ]
    if not kept:
        return None
    names = tuple(found.covariance_of[i] for i in kept)
    values = np.array([by_name[name].value for name in names])
    relative = found.covariance[np.ix_(kept, kept)] / np.outer(values, values)
    return Information(names, np.asarray(np.linalg.pinv(relative), dtype=np.float64))


def _usable(one: Estimate) -> bool:
    return math.isfinite(one.value) and one.value != 0.0


def _sentence(weights: dict[str, float], std: float) -> str:
    """A sentence that names the parameters that can't be separated, and the dive that would separate them."""
    names = list(weights)
    axes = list(dict.fromkeys(_axis(name) for name in names))
    masses = [name for name in names if _kind(name) == "mass"]
    dampings = [name for name in names if _kind(name) == "damping"]
    axis = " and ".join(axes)
    if len(names) == 1:
        advice = (
            f"push {axis} back and forth, with thrust that changes quickly"
            if masses
            else f"hold {axis} at steady speeds, both ways"
        )
        return f"The dive says too little of {_words(names[0])} ({names[0]}): {advice}."
    listed = ", ".join(map(_words, names[:-1])) + f" and {_words(names[-1])}"
    if len(axes) > 1:
        advice = f"drive {axis} one at a time"
    elif not masses:
        advice = f"hold {axis} at a second speed, best one in the other direction"
    elif not dampings:
        advice = f"push {axis} back and forth, with thrust that changes quickly"
    elif weights[masses[0]] * weights[dampings[0]] > 0:
        advice = f"push {axis} harder, with thrust that changes quickly and then holds"
        advice += "; only their ratio is known" if std > UNKNOWN else ""
    else:
        advice = f"give {axis} both quick changes of thrust and steady speeds"
    return f"{capital(listed)} can't be told apart: {advice}."


def _axis(name: str) -> str:
    return name.removesuffix(TRIM) if name.endswith(TRIM) else DOFS[OF_HULL[name].dof]


def _kind(name: str) -> str:
    return "trim" if name.endswith(TRIM) else OF_HULL[name].kind


def _words(name: str) -> str:
    """A parameter in words: `surge mass`, `yaw damping`, `surge trim force`."""
    dof = DOFS.index(_axis(name))
    kinds = {
        "mass": "mass" if dof < 3 else "inertia",
        "damping": "damping",
        "trim": "trim force" if dof < 3 else "trim moment",
    }
    return f"{DOFS[dof]} {kinds[_kind(name)]}"
