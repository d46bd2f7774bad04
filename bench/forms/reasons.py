"""Why each form loses, and how each was set: the words of docs/network_forms.md."""

from bench.forms import lstm, neural_ode, shooting, strong
from bench.forms.task import STEP_S
from bench.forms.training import LEAST_FALL, MEMORY, PATIENCE
from bench.words import paragraph


def why() -> list[str]:
    """What all have in common, then three sentences a form."""
    return [
        *paragraph(
            "**What they share.** All four look for the one best path of the vehicle and its disturbance",
            "together with the coefficients, where `pinn` integrates the paths out. What is left out so is",
            "the log determinant of the path's curvature, which depends on the coefficients: a body that",
            "forgets more slowly (more mass, less damping) lets the same disturbance explain more, and",
            "nothing charges it for that. Better training does not help, for the bias lies in the optimum:",
            "the disturbance eats the mass, most of all in yaw, where the gyro is densest and damping over",
            "inertia fastest (the last table).",
        ),
        "",
        *paragraph(
            "**Coupled LSTM.** It has the shared bias, and more, because its derivative is a difference over",
            "a step: what the fastest of its steps can't follow is booked as disturbance, too. Its recurrent",
            "weights earn nothing: the best that they can write down is a smoothed velocity, which costs",
            "`pinn` one weight an instant and a few solves of banded equations, and costs them thousands of",
            "steps of Adam. Where the dive is long its time is up first.",
        ),
        "",
        *paragraph(
            "**Neural ODE.** One integration through the whole dive makes every reading hang on every wave",
            "of the disturbance before it, so the loss is a long narrow valley along which disturbance and",
            "coefficients trade, and the time is up, or its steps have become too small, before the floor is",
            "reached. Where it stops depends on where it began: surge, sway and heave err either way, by",
            "more than those of any other form. Yaw can come out better than where the optimum is reached,",
            "for an unfinished disturbance is a stiff one.",
        ),
        "",
        *paragraph(
            "**Multiple shooting.** It is the best of them, once its disturbance is written as the white",
            "numbers that drive it and every unknown is scaled by how finely readings know it. What is left",
            "in surge and sway is small; in yaw it comes to the shared bias and stays there. First-order",
            "steps over thousands of unknowns take a minute for it, and the answer has no interval.",
        ),
        "",
        *paragraph(
            "**Strong form.** It comes closest to its optimum, which has the shared bias and more, as the",
            "LSTM's has: its residual stands at instants alone and says nothing of what happens between.",
            "A network of time has to carry every edge of the thrust, for a smooth one books edges as",
            "disturbance and the masses with them: with waves to 2 Hz masses came out several times too",
            f"large, with {strong.HIGHEST_HZ:g} Hz not. The disturbance's prior, taken on a second derivative of the",
            "network, makes the fastest waves stiffer than the slowest by orders of magnitude.",
        ),
        "",
    ]


def settings() -> list[str]:
    """What was set how, and what was tried beside it, on other missions (seeds from 100 000)."""
    return [
        *paragraph(
            f"All: float64, steps of {STEP_S:g} s; masses and dampings through softplus, so scaled that a step of",
            "1 is about 1 %; masses from 1.5 times the rigid body's, dampings from rms force over rms velocity;",
            "full Coriolis; a trim an axis; the disturbance an acceleration with its true Gauss-Markov prior.",
            "Adam's rates fall as a cosine over its share of the time. Settled: no span of steps (50 of Adam,",
            f"20 of L-BFGS), of {PATIENCE} in a row, brought the loss down by {LEAST_FALL:g}.",
            f"L-BFGS keeps {MEMORY} pairs. No form takes a velocity for finer than {1e3 * lstm.FINEST:g} mm/s, mrad/s:",
            "with the fibre-optic gyro's own noise, ten times finer, none of them came near its optimum in the time.",
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
            "Tried and left: a disturbance straight over 0.25 s (what it can't carry is booked elsewhere); node",
            "states in m/s and coefficients unscaled (L-BFGS ended four times higher on a dive with a fibre-optic",
            "gyro); a single segment instead of many (as good, and slower); for the neural ODE waves to 1, 2, 4 and",
            "10 Hz, 8 and 64 units, L-BFGS early, Adam alone; for the strong form waves to 2 Hz, L-BFGS early.",
        ),
        "",
    ]
