"""Why each form loses, and how each was set: the words of docs/network_forms.md."""

from bench.forms import lstm, neural_ode, shooting, strong
from bench.forms.task import STEP_S
from bench.forms.training import LEAST_FALL, MEMORY
from bench.words import paragraph


def why() -> list[str]:
    """Three sentences a form, after what all have in common."""
    return [
        *paragraph(
            "**What they share.** All four look for the one best path of the vehicle and its disturbance together with",
            "the coefficients, where `pinn` integrates the path out. What is left out is the log determinant of the",
            "path's curvature, which depends on the coefficients: a body that forgets more slowly (larger mass, smaller",
            "damping) lets the same disturbance explain more, and nothing charges it for that. Better training does not",
            "help, because the bias lies in the optimum: it is worst in yaw, where damping over inertia is fastest and",
            "the gyro densest, so that most of the path's freedom is at stake.",
        ),
        "",
        *paragraph(
            "**Coupled LSTM.** It loses to the shared bias, and in full, because it weighs paths of velocity, whose",
            "curvature hangs on the coefficients the most. Its recurrent weights add nothing: the best they can do is to",
            "write down a smoothed velocity, one that costs `pinn` one weight an instant and a solve of banded equations",
            "costs them thousands of passes of Adam. Its derivative is a difference over a step, so a fibre-optic gyro has",
            "to be blunted before the loss can be trained at all.",
        ),
        "",
        *paragraph(
            "**Neural ODE.** One integration through the whole dive makes every reading hang on every wave of the",
            "disturbance before it, and the Fourier weights shake the whole dive at once: the loss is a long narrow valley",
            "along which coefficients and disturbance trade, and the time is up before its floor is reached. Where it",
            "stops then depends on where it began, which shows as masses and dampings off either way instead of leaning",
            "one way. In yaw, half-trained, it can come nearer to the truth than the forms that reach their optimum: an",
            "unfinished disturbance is a stiffer one.",
        ),
        "",
        *paragraph(
            "**Multiple shooting.** The best conditioned of them once its disturbance was written as the white numbers",
            "that drive it; surge and sway come near the bound. What is left is the shared bias, smaller than that of the",
            "strong form because white numbers have the same volume whatever the coefficients are. First-order steps over",
            "thousands of node states still take it a minute for what one banded solve a pass gives `pinn`.",
        ),
        "",
        *paragraph(
            "**Strong form.** It reaches its optimum, and its optimum is biased in full, as the LSTM's is. A network of",
            "time has to carry every edge of the thrust, for a smooth one books the edges as disturbance and the masses",
            f"with them: with waves up to 2 Hz masses came out several times too large, with {strong.HIGHEST_HZ:g} Hz not.",
            "Its residual differentiates twice over in effect (velocity, then the disturbance's own innovations), so the",
            "fastest waves are some thousand times stiffer than the slowest and need a scale of their own.",
        ),
        "",
    ]


def settings() -> list[str]:
    """What was set how, and what was tried beside it, on other missions (seeds from 100 000)."""
    return [
        *paragraph(
            f"All: float64, steps of {STEP_S:g} s; masses and dampings through softplus, scaled so that a step of 1 is",
            "1 %, masses from 1.5 times the dry one, dampings from rms force over rms velocity; full Coriolis; a trim an",
            "axis; the disturbance an acceleration with its true Gauss-Markov prior. Adam's rates fall as a cosine over",
            f"its share of the time; it ends once the loss falls by less than {LEAST_FALL:g} in 200 steps. L-BFGS keeps",
            f"{MEMORY} pairs.",
        ),
        "",
        f"- Coupled LSTM: two-way, {lstm.HIDDEN} units, windows of {lstm.WINDOW} steps with {lstm.OVERLAP} more on "
        f"either side; Adam {lstm.RATE:g}.",
        f"- Neural ODE: Runge-Kutta 4, compiled, with its exact discrete adjoint; waves to {neural_ode.HIGHEST_HZ:g} "
        f"Hz and two hidden layers of {neural_ode.WIDTH}; Adam {neural_ode.RATE:g} for "
        f"{100 * neural_ode.ADAM_SHARE:.0f} % of the time, then L-BFGS.",
        f"- Multiple shooting: the same integration, segments of {shooting.SEGMENT_STEPS * STEP_S:g} s, gaps held to "
        f"{1000 * shooting.PENALTY_STD:g} mm/s or mrad/s; Adam for {100 * shooting.ADAM_SHARE:.0f} % of the time, then L-BFGS.",
        f"- Strong form: waves to {strong.HIGHEST_HZ:g} Hz and two hidden layers of {strong.WIDTH}, begun at the smoothed "
        f"readings; collocation at every step; Adam {strong.RATE:g} for {100 * strong.ADAM_SHARE:.0f} % of the time, then L-BFGS.",
        "",
        *paragraph(
            f"No form takes a velocity for finer than {1e6 * lstm.FINEST:g} um/s or urad/s: with the fibre-optic gyro's",
            "own noise, ten times finer, none of them came near its optimum. Tried and left: a disturbance straight over",
            "0.25 s (it books what it can't carry as inertia); node states in m/s and coefficients unscaled (L-BFGS ended",
            "four times higher); a neural ODE of one or two hertz, or of 64 units (slower, no better); the strong form",
            "begun at nothing, or given to L-BFGS early.",
        ),
        "",
    ]
