"""Text of the record: how the forms differ, which effect that has, how each was set, and their tallies in words.

The text explains mechanisms; every comparison is computed from the tallies.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from bench.forms import lstm, neural_ode, shooting, strong
from bench.forms.judge import FORMS, MASS_NAMES, Judged, leaning
from bench.forms.task import STEP_S
from bench.forms.training import LEAST_FALL, MEMORY, PATIENCE
from bench.tally import root_mean_square
from bench.words import paragraph

LeftOut = dict[int, dict[str, tuple[float, float]]]
REFERENCE = "pinn"
MECHANISMS: Mapping[str, str] = {
    "coupled LSTM": (
        "It looks for one best path, so it has the shared bias. Its derivative is a difference over a step: what the "
        "fastest of its steps can't follow is booked as disturbance, too. The best that its recurrent weights can "
        "write down is a smoothed velocity, which costs `pinn` one weight an instant and a few solves of banded "
        "equations, and costs them steps of Adam over every window of the dive: the longer the dive, the fewer in "
        "the time."
    ),
    "neural ODE": (
        "One integration through the whole dive makes every reading hang on every wave of the disturbance before it, "
        "so the loss is a long narrow valley along which disturbance and coefficients trade. Where the time is up, "
        "or its steps have become too small, before the floor is reached, the answer depends on where it began. An "
        "unfinished disturbance acts as a stiff one, which can hide the shared bias."
    ),
    "multiple shooting": (
        "Its disturbance is written as the white numbers that drive it, and every unknown is scaled by how finely "
        "readings know it, so that short segments, and not the whole dive, carry each slope. At its optimum it has "
        "the shared bias. It takes first-order steps over thousands of unknowns, and the answer has no interval."
    ),
    "strong form": (
        "Its optimum has the shared bias, and more, as the LSTM's has: its residual stands at instants alone and says "
        "nothing of what happens between. A network of time has to carry every edge of the thrust, for a smooth one "
        "books edges as disturbance and the masses with them. The disturbance's prior, taken on a second derivative "
        "of the network, makes the fastest waves stiffer than the slowest by orders of magnitude."
    ),
}


def standing(found: Sequence[Judged]) -> list[str]:
    """State the rms errors in ascending order, and how many of the forms err more than the product's network."""
    rows = sorted((root_mean_square(form.tally.cases), form.method) for form in found)
    rms = {method: value for value, method in rows}
    order = ", ".join(f"{method} {value:.2f}" for method, value in rms.items())
    sentences = [f"By rms error over the bound, the least first: {order}."]
    if REFERENCE in rms:
        methods = [method for method in rms if method in FORMS]
        more = sum(rms[method] > rms[REFERENCE] for method in methods)
        who = {len(methods): f"All {len(methods)} forms err", 0: "No form errs"}
        words = who.get(more, f"Of the {len(methods)} forms, {more} err{'s' if more == 1 else ''}")
        sentences.append(f"{words} by more than `{REFERENCE}`.")
    return paragraph(*sentences)


def why(found: Sequence[Judged], left_out: LeftOut) -> list[str]:
    """Say what all forms share, then for each form its own figures and its mechanism."""
    lines = [
        *paragraph(
            "**What they share.** All of them look for the one best path of the vehicle and its disturbance",
            "together with the coefficients, where `pinn` integrates the paths out. What is left out so is",
            "the log determinant of the path's curvature, which depends on the coefficients: a body that",
            "forgets more slowly (more mass, less damping) lets the same disturbance explain more, and",
            "nothing charges it for that. Better training does not take this away, for it lies in the optimum; how",
            "much of an error is this, and how much a form that had not settled, the figures do not tell.",
            "The denser the readings and the faster damping over inertia, the more the disturbance can eat.",
            _exactly(left_out),
        ),
        "",
    ]
    for form in found:
        if form.method in FORMS:
            title = form.method[0].upper() + form.method[1:]
            lines += [*paragraph(f"**{title}.** {_here(form)} {MECHANISMS[form.method]}"), ""]
    return lines


def _exactly(left_out: LeftOut) -> str:
    """Means of the last table over missions, by axis, as a sentence."""
    axes = list(dict.fromkeys(axis for row in left_out.values() for axis in row))
    figures = []
    for axis in axes:
        fitted, integrated = np.mean([row[axis] for row in left_out.values() if axis in row], axis=0)
        figures.append(f"{axis} {fitted:.2f} (integrated out: {integrated:.2f})")
    return f"By the last table the mass over the true one comes out, on the mean over missions: {', '.join(figures)}."


def _here(one: Judged) -> str:
    """A form's own figures: the lean of its masses by axis, and on how many missions it settled."""
    by_axis = {name: [case for case in one.masses if case.name == name] for name in MASS_NAMES}
    leans = ", ".join(f"{name} {leaning(cases):+.1f}" for name, cases in by_axis.items() if cases)
    return (
        f"Rms error over the bound {root_mean_square(one.tally.cases):.2f}; masses lean by {leans} bounds; settled "
        f"within its time on {one.settled} of {one.tally.missions} missions."
    )


def settings() -> list[str]:
    """How each form was set, and which settings were also tried, on other missions (seeds from 100 000)."""
    return [
        *paragraph(
            f"All: float64, steps of {STEP_S:g} s; masses and dampings through softplus, so scaled that a step of",
            "1 is about 1 %; masses from 1.5 times the rigid body's, dampings from rms force over rms velocity;",
            "full Coriolis; a trim an axis; the disturbance an acceleration with its true Gauss-Markov prior.",
            "Adam's rates fall as a cosine over its share of the time. Settled: no span of steps (50 of Adam,",
            f"20 of L-BFGS), of {PATIENCE} in a row, brought the loss down by {LEAST_FALL:g}.",
            f"L-BFGS keeps {MEMORY} pairs. No form takes a velocity for finer than {1e3 * lstm.FINEST:g} mm/s, mrad/s,",
            "though the fibre-optic gyro's own noise is finer, so that the problem can be solved in the time.",
        ),
        "",
        f"- Coupled LSTM: two-way, {lstm.HIDDEN} units, windows of {lstm.WINDOW} steps and {lstm.OVERLAP} more on "
        "either side;",
        f"  in: thrust and smoothed velocity; out: a correction to the latter; Adam {lstm.RATE:g}.",
        "- Neural ODE: Runge-Kutta 4, compiled, with its exact discrete adjoint; the disturbance a network of waves to",
        f"  {neural_ode.HIGHEST_HZ:g} Hz with two hidden layers of {neural_ode.WIDTH}; Adam {neural_ode.RATE:g} for "
        f"{100 * neural_ode.ADAM_SHARE:.0f} % of the time, then L-BFGS.",
        f"- Multiple shooting: the same integration, segments of {shooting.SEGMENT_STEPS * STEP_S:g} s, gaps held to "
        f"{1e3 * shooting.PENALTY_STD:g} mm/s or mrad/s;",
        f"  a free disturbance at every step; Adam {shooting.RATE:g} for {100 * shooting.ADAM_SHARE:.0f} % of the "
        "time, then L-BFGS.",
        f"- Strong form: waves to {strong.HIGHEST_HZ:g} Hz with two hidden layers of {strong.WIDTH}, begun at the "
        "smoothed readings; collocation",
        f"  at every step; Adam {strong.RATE:g} for {100 * strong.ADAM_SHARE:.0f} % of the time, then L-BFGS.",
        "",
        *paragraph(
            "Tried while building them and left, not measured on this page: a disturbance straight over 0.25 s",
            "(what it can't carry is booked elsewhere); node states in m/s and coefficients unscaled; a single segment",
            "instead of many; for the neural ODE waves to 1, 2, 4 and 10 Hz, 8 and 64 units, L-BFGS early, Adam alone;",
            "for the strong form waves to 2 Hz, L-BFGS early.",
        ),
        "",
    ]
