"""Which coefficients a dive can separate, and the limits of each: bounds, the rigid body's mass, plausible added mass.

A direction is null if the Fisher information of the logarithms leaves it a standard deviation above
`LARGEST_RELATIVE_STD` (Rothenberg 1971, theorem 1: singular information means no local identifiability). Coefficients
that share a null direction follow from the projector onto all null directions, which does not depend on the basis.

At speeds that hardly vary, linear and quadratic damping trade off: each is known loosely, but the drag at those speeds
well. Then both are kept with their uncertainty.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.vehicle.coefficients import BY_NAME, DAMPINGS, DOFS, MASSES, OF_HULL, QUADRATICS, Coefficient
from bridge.vehicle.config import Configuration
from identify.doubt import Doubt, Outcome
from identify.identification import (
    LARGEST_RELATIVE_STD,
    DragForce,
    Estimate,
    Identification,
    Information,
    NullDirection,
    Partner,
)
from identify.statistics import Z95
from identify.words import capital

SHARED = 0.1
"""Entries of the projector up to this size are ignored: two parameters share a null direction only if theirs is
larger."""

UNKNOWN = 1.0
"""A direction with a larger relative standard deviation is as good as unknown."""

TRIM = "_trim"
THRUST_SCALE = "thrust_scale"


def with_identifiability(answer: Identification) -> Identification:
    """Return the identification with each coefficient's partner, and with the coefficients that the dive can't
    separate.

    If the estimator gave no information matrix, the inverse of its covariance replaces it. A coefficient at a bound
    counts as known there, so a direction of such coefficients alone is left out.
    """
    partners = partners_of(answer.covariance_of, answer.covariance)
    information = answer.information or _information(answer)
    at_bound = {name for doubt in answer.doubts if doubt.outcome is Outcome.AT_BOUND for name in doubt.about}
    directions = tuple(
        _said(direction, answer)
        for direction in (() if information is None else null_directions(information))
        if not set(direction.weights) <= at_bound and _open(direction, answer)
    )
    scale = answer.thrust_scale
    if scale is not None and not scale.weighed and answer.covariance_of:
        moved = [name for name in answer.covariance_of if name not in answer.rest_on_righting]
        directions = (*directions, *((scale_direction(moved),) if moved else ()))
    return replace(
        answer,
        parameters=tuple(
            replace(parameter, partner=partners.get(parameter.name)) for parameter in answer.parameters
        ),
        null_directions=directions,
    )


def _open(direction: NullDirection, answer: Identification) -> dict[str, float]:
    """The weights of the coefficients that are not identifiable, and of the trims; empty if every coefficient is
    identifiable."""
    known = {parameter.name for parameter in answer.parameters if parameter.identifiable}
    left = {name: weight for name, weight in direction.weights.items() if name not in known}
    return left if any(not name.endswith(TRIM) for name in left) else {}


def _said(direction: NullDirection, answer: Identification) -> NullDirection:
    """The direction with a sentence about its coefficients that are not identifiable, with advice that can be
    followed."""
    left = _open(direction, answer)
    righted = [name for name in left if name in answer.rest_on_righting]
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


def null_directions(information: Information) -> tuple[NullDirection, ...]:
    """Return the directions in which the dive alone gives too little information, one for each set of parameters that
    share a direction."""
    strength, vectors = np.linalg.eigh(0.5 * (information.matrix + information.matrix.T))
    null = vectors[:, strength < LARGEST_RELATIVE_STD**-2]
    together = null @ null.T
    out = []
    for members in _groups(np.abs(together) > SHARED):
        names = [information.of[i] for i in members]
        if all(name.endswith(TRIM) for name in names):
            continue
        inner, directions = np.linalg.eigh(information.matrix[np.ix_(members, members)])
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


def _information(answer: Identification) -> Information | None:
    """Inverse of the covariance of the logarithms, over the coefficients that have a value and a variance."""
    by_name = {parameter.name: parameter for parameter in answer.parameters}
    kept = [
        i
        for i, n in enumerate(answer.covariance_of)
        if math.isfinite(by_name[n].value) and by_name[n].value != 0.0 and answer.covariance[i, i] > 0
    ]
    if not kept:
        return None
    names = tuple(answer.covariance_of[i] for i in kept)
    values = np.array([by_name[name].value for name in names])
    relative = answer.covariance[np.ix_(kept, kept)] / np.outer(values, values)
    return Information(names, np.asarray(np.linalg.pinv(relative), dtype=np.float64))


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


TRADED = 0.9
"""Absolute correlation from which on either of two coefficients means little without the other."""


def with_drag_forces(answer: Identification) -> Identification:
    """Return the identification with the drag of each axis that has both dampings; if that drag is known well, both
    dampings are kept."""
    forces = tuple(force for dof in range(6) if (force := _force(answer, dof)) is not None)
    known = [force for force in forces if force.relative_std <= LARGEST_RELATIVE_STD]
    kept = {name for force in known for name in (force.linear, force.quadratic)}
    kept -= {name for doubt in answer.doubts if doubt.outcome is Outcome.AT_BOUND for name in doubt.about}
    return replace(
        answer,
        parameters=tuple(
            replace(parameter, identifiable=True, reason="") if parameter.name in kept else parameter
            for parameter in answer.parameters
        ),
        drag_forces=forces,
        notes=(*answer.notes, *(_note(force) for force in known if abs(force.correlation) > TRADED)),
    )


def trades(answer: Identification, name: str) -> bool:
    """Whether a coefficient is one of two dampings of an axis that were fitted together."""
    if OF_HULL[name].kind == "mass":
        return False
    dof = OF_HULL[name].dof
    return {DAMPINGS[dof].name, QUADRATICS[dof].name} <= set(answer.covariance_of)


def _force(answer: Identification, dof: int) -> DragForce | None:
    linear, quadratic = DAMPINGS[dof].name, QUADRATICS[dof].name
    speed = answer.usual_speeds.get(DOFS[dof], 0.0)
    if not {linear, quadratic} <= set(answer.covariance_of) or speed <= 0.0:
        return None
    values = np.array([answer[linear].value, answer[quadratic].value])
    if not np.isfinite(values).all():
        return None
    at = [answer.covariance_of.index(linear), answer.covariance_of.index(quadratic)]
    covariance = answer.covariance[np.ix_(at, at)]
    by = np.array([speed, speed * speed])
    force, std = float(by @ values), math.sqrt(float(by @ covariance @ by))
    correlation = float(covariance[0, 1] / math.sqrt(covariance[0, 0] * covariance[1, 1]))
    low, high = max(force - Z95 * std, 0.0), force + Z95 * std
    return DragForce(DOFS[dof], linear, quadratic, speed, force, std, low, high, correlation)


def _note(force: DragForce) -> str:
    unit, per = ("N", "m/s") if force.axis in DOFS[:3] else ("N m", "rad/s")
    return (
        f"{force.linear} and {force.quadratic} hold together (correlation {force.correlation:+.2f}): take both or "
        f"neither. At {force.speed:.2g} {per}, the usual speed of this dive, drag in {force.axis} is {force.force:.3g} "
        f"{unit} ({force.low95:.3g} to {force.high95:.3g})."
    )


NEAR = 1e-3
"""Relative distance from a nonzero bound within which a value counts as at the bound."""

TELLING_PER_S = 0.1
"""A damping with a standard error below this share of the rigid body's mass (1/s) is small, not unknown."""

MOST_ADDED = 3.0
"""Largest added mass in a translation over the dry mass. A disc moving broadside has 8/3 rho r^3 (DNV-RP-H103 2011,
table A-2): three times the mass of its own water if its thickness is a seventh of its width. Vehicles have less: open
frames in heave have two."""


FARTHEST = 10.0
"""A mass or inertia more than this many times above or below the rigid body's own says nothing about this vehicle."""

WIDEST = 5.0
"""Ratio of the upper to the lower end of a mass's interval: a wider interval says nothing either."""


def with_bounds(answer: Identification, configuration: Configuration) -> Identification:
    """Return the identification with values held to their bounds and reported, implausible masses doubted and called
    not identifiable, and so the damping of an axis with an absurd mass.

    A logarithm can't reach a bound of 0. A damping counts as at that bound if the dive determines it well in N/(m/s)
    and its interval includes zero. If an axis has two dampings, either may well be zero, so neither counts as at the
    bound.
    """
    parameters, doubts = [], list(answer.doubts)
    for parameter in answer.parameters:
        held, doubt = (
            _held(parameter, configuration, trades(answer, parameter.name))
            if parameter.name in OF_HULL
            else (parameter, None)
        )
        parameters.append(held)
        doubts += [] if doubt is None else [doubt]
    absurd = _absurd_axes(parameters, configuration)
    doubted = {name for doubt in doubts for name in doubt.about}
    for dof, (problem, what_follows) in absurd.items():
        if MASSES[dof].name not in doubted:
            about = MASSES[dof].name, DAMPINGS[dof].name
            remedy = f"{what_follows}; check the vehicle file's thrusters and mass, and the sensors' axes and units."
            doubts.append(Doubt(about, problem, remedy, Outcome.DISAGREES))
    return without_implausible(
        replace(answer, parameters=tuple(parameters), doubts=tuple(doubts)), configuration
    )


def without_implausible(answer: Identification, configuration: Configuration) -> Identification:
    """Return the identification with masses that no such vehicle has, and the damping of an axis whose mass is absurd,
    called not identifiable."""
    absurd = _absurd_axes(answer.parameters, configuration)

    def why(parameter: Estimate) -> str:
        coefficient = BY_NAME.get(parameter.name)
        if coefficient is None or not parameter.identifiable:
            return ""
        if coefficient.dof in absurd:
            return ": ".join(absurd[coefficient.dof])
        impossible = _impossible(parameter, configuration)
        return "" if impossible is None else impossible[0]

    return replace(
        answer,
        parameters=tuple(
            replace(parameter, identifiable=False, reason=reason) if (reason := why(parameter)) else parameter
            for parameter in answer.parameters
        ),
    )


def _absurd_axes(parameters: Iterable[Estimate], configuration: Configuration) -> dict[int, tuple[str, str]]:
    """The degrees of freedom with an absurd mass; why it is, and what follows."""
    return {
        BY_NAME[parameter.name].dof: reason
        for parameter in parameters
        if parameter.name in BY_NAME and (reason := _absurd(parameter, configuration))
    }


def _absurd(parameter: Estimate, configuration: Configuration) -> tuple[str, str] | None:
    """Why a mass is absurd for this vehicle, and what follows; None if it is plausible, or not identifiable anyway."""
    coefficient = BY_NAME[parameter.name]
    if coefficient.kind != "mass" or not parameter.identifiable or not math.isfinite(parameter.value):
        return None
    rigid, axis = configuration.rigid_body(coefficient.dof)[0], DOFS[coefficient.dof]
    came_out = f"{parameter.name} came out at {_written_out(parameter.value)} {parameter.unit}"
    if parameter.low95 > FARTHEST * rigid or parameter.high95 < rigid / FARTHEST:
        return (
            f"{came_out}, where the rigid body's own is {rigid:g}",
            f"the fit of {axis} is none of this vehicle's, and tells neither its mass nor its damping",
        )
    if parameter.high95 > WIDEST * parameter.low95:
        ends = f"{_written_out(parameter.low95)} to {_written_out(parameter.high95)}"
        return f"{came_out}, with an interval from {ends}", f"it tells nothing of {axis}"
    return None


def _held(parameter: Estimate, configuration: Configuration, traded: bool) -> tuple[Estimate, Doubt | None]:
    coefficient = OF_HULL[parameter.name]
    rigid, _ = configuration.rigid_body(coefficient.dof)
    if not math.isfinite(parameter.value):
        return parameter, None
    small = 0 < parameter.std < TELLING_PER_S * rigid and parameter.value < Z95 * parameter.std
    if coefficient.low == 0.0 and small and not traded:
        return _at(parameter, coefficient, "lower", 0.0)
    if coefficient.low > 0 and parameter.value <= coefficient.low * (1 + NEAR):
        return _at(parameter, coefficient, "lower", coefficient.low)
    if parameter.value >= coefficient.high * (1 - NEAR):
        return _at(parameter, coefficient, "upper", coefficient.high)
    if parameter.identifiable and (impossible := _impossible(parameter, configuration)):
        return parameter, Doubt((parameter.name,), *impossible, Outcome.DISAGREES)
    return parameter, None


def _impossible(parameter: Estimate, configuration: Configuration) -> tuple[str, str] | None:
    """Why no rigid body in water has this mass, and what to do; None if one may have it."""
    coefficient = OF_HULL[parameter.name]
    rigid, _ = configuration.rigid_body(coefficient.dof)
    came_out = f"{parameter.name} came out at {_written_out(parameter.value)} {parameter.unit}"
    if is_too_light(coefficient, parameter.high95, configuration):
        problem = f"{came_out}, below the rigid body's own {rigid:g}, which no water can take away"
        return problem, "the vehicle file's thrust is too weak or its mass too large; measure both again."
    if is_too_heavy(coefficient, parameter.low95, configuration):
        times = f"{parameter.value / rigid:.1f} times the vehicle file's dry mass"
        remedy = (
            "it can hardly be this vehicle's; check the DVL's axes and scale, the order of the thrusters, and that the "
            "vehicle file and its dry mass are this vehicle's."
        )
        return f"{came_out}, {times}, which no water round it can make up", remedy
    return None


def is_too_light(coefficient: Coefficient, high95: float, configuration: Configuration) -> bool:
    """Whether a mass is below the rigid body's own, which no water can take away; high95: end of its interval."""
    rigid, std = configuration.rigid_body(coefficient.dof)
    return coefficient.kind == "mass" and high95 < rigid - Z95 * std


def is_too_heavy(coefficient: Coefficient, low95: float, configuration: Configuration) -> bool:
    """Whether a mass in a translation is more than water can add; low95: end of its interval."""
    rigid, std = configuration.rigid_body(coefficient.dof)
    most = (1.0 + MOST_ADDED) * (rigid + Z95 * std)
    return coefficient.kind == "mass" and coefficient.dof < 3 and low95 > most


def _at(parameter: Estimate, coefficient: Coefficient, side: str, bound: float) -> tuple[Estimate, Doubt]:
    """The estimate held to its bound, and the doubt that names both."""
    upper = max(parameter.value + Z95 * parameter.std, bound) if math.isfinite(parameter.std) else math.nan
    dive_limit = (
        f"; the dive puts it below {_written_out(upper)}" if bound == 0.0 and math.isfinite(upper) else ""
    )
    reason = f"{parameter.name} stopped at its {side} bound of {bound:g} {parameter.unit}{dive_limit}"
    low, high = (bound, upper) if side == "lower" else (min(parameter.low95, bound), bound)
    held = replace(
        parameter,
        value=min(max(parameter.value, coefficient.low), coefficient.high),
        low95=low,
        high95=high,
        identifiable=False,
        reason=reason,
    )
    remedy = (
        "the signs of its thrust and of its readings, or a force that the model lacks, drive it there; look at these "
        "before you rely on what else was identified."
    )
    return held, Doubt((parameter.name,), reason, remedy, Outcome.AT_BOUND)


def _written_out(value: float) -> str:
    """Three significant digits, never as a power of ten."""
    return np.format_float_positional(value, 3, unique=False, fractional=False, trim="-")
