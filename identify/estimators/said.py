"""What the estimators say of a fit in the same words, and how short a dive may be."""

from collections.abc import Mapping, Sequence

from bridge.errors import FitError
from bridge.vehicle.coefficients import BY_NAME, DAMPINGS, DOFS, MASSES
from identify.dive import Dive
from identify.identification import Doubt, Outcome

SHORTEST_DIVE_S = 20.0


def long_enough(dive: Dive) -> None:
    """Raises FitError where a dive is too short to identify anything from it."""
    if dive.duration_s < SHORTEST_DIVE_S:
        raise FitError(
            f"{dive.name}: the dive lasts {dive.duration_s:.0f} s, identification needs at least "
            f"{SHORTEST_DIVE_S:.0f} s; record a longer one"
        )


def axes_named(dofs: Sequence[int]) -> str:
    """Axes in words: surge, sway and yaw."""
    names = [DOFS[dof] for dof in dofs]
    return " and ".join(", ".join(part) for part in (names[:-1], names[-1:]) if part)


def drag_doubt(dof: int, score: float) -> Doubt:
    """A quadratic drag is missing in an axis, by so many standard errors."""
    return Doubt(
        (MASSES[dof].name, DAMPINGS[dof].name),
        f"In {DOFS[dof]} a force that grows as the speed squared is missing from the model "
        f"({score:+.0f} standard errors): mass and linear damping hold for the speeds of this dive "
        "alone; their intervals are widened by what such a force would change.",
        Outcome.DISAGREES,
    )


def late_doubt(late_s: Mapping[int, float], score: float) -> Doubt:
    """Forces act later than they are taken to, by so many seconds in some axes; `score` in standard errors."""
    least, most = min(late_s.values()), max(late_s.values())
    size = (
        f"{1000 * most:+.0f} ms" if most - least < 0.01 else f"{1000 * least:+.0f} to {1000 * most:+.0f} ms"
    )
    return Doubt(
        tuple(group[dof].name for group in (MASSES, DAMPINGS) for dof in late_s),
        f"In {axes_named(list(late_s))} thrust acts at another time than the vehicle file's lag and the sensors' "
        f"stamps say (later by about {size}; {abs(score):.0f} standard errors): masses and dampings there are off by "
        "more than their intervals; mend the lag in the vehicle file, or the sensors' clocks: seatrial doctor --wet "
        "tells how late each sensor is.",
        Outcome.DISAGREES,
    )


def lateness_note(moved: Mapping[str, float], late_s: float) -> str:
    """What coefficients hang on when thrust acts: by which share each moves, were it `late_s` later."""
    first, *others = [(name, f"by {100 * share:+.1f} %") for name, share in moved.items()]
    shares = [f"{first[0]} would change {first[1]}", *(f"{name} {by}" for name, by in others)]
    return (
        f"The intervals hold given the vehicle file's thruster lag and the sensors' stamps: were thrust "
        f"{1000 * late_s:.0f} ms later, {', '.join(shares)}."
    )


def unsettled_doubt(names: tuple[str, ...], where: str, bound: str) -> Doubt:
    """The search for these coefficients ended at its bound of steps."""
    return Doubt(
        names,
        f"In {where} the search stopped at its bound of {bound} before it settled: don't rely on what it says of "
        f"{where}; dive longer, with more changes of thrust.",
        Outcome.AT_BOUND,
    )


def strange_doubts(strange: str) -> tuple[Doubt, ...]:
    """The recording can hardly be of this vehicle, as `strange` says; none where that is empty."""
    if not strange:
        return ()
    sentence = f"These values hardly mean this vehicle: {strange}. Give the vehicle file and configuration of the dive."
    return (Doubt(tuple(BY_NAME), sentence, Outcome.DISAGREES),)


def too_little(name: str, axis: str, std: float, shift: float, value: float) -> str:
    """Why a coefficient of relative standard error `std`, `shift` of it from a missing drag, is not identifiable."""
    if abs(shift) > 0.5 * std:
        return (
            f"{axis} has a drag that grows as the speed squared, which the model lacks: with it {name} would be "
            f"{value:.3g}"
        )
    return f"the dive says too little of {axis}: the relative standard error is {100 * std:.0f} %"
