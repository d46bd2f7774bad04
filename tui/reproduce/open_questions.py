"""Questions that the paper leaves open: heave, yaw inertia in the feed-forward, off-diagonal terms."""

from identify.report.page import Section, Table
from identify.words import MISSING, fixed, significant, unit, with_interval
from tui.reproduce import figures
from tui.reproduce.coupling import Term
from tui.reproduce.measures import turned
from tui.reproduce.run import Reproduction

HEAVE = ("M_w", "D_w")
TURNS = {
    "linear reference, no inertia": "heading alone",
    "smooth reference, no inertia": "heading smooth",
    "smooth reference, inertia": "heading inertia",
}


def heave_section(done: Reproduction) -> Section:
    """Heave, identified from the two changes of depth of each campaign."""
    rows = []
    for name, campaign in done.campaigns.items():
        for coefficient in HEAVE:
            estimate = campaign.ours[coefficient]
            value, interval = with_interval(estimate.value, estimate.low95, estimate.high95)
            shown = (value, interval) if estimate.identifiable else (MISSING, estimate.reason)
            rows.append(
                (
                    f"{coefficient}, {unit(estimate.unit)}",
                    name,
                    *shown,
                    significant(campaign.truth[coefficient], 4),
                )
            )
    return Section(
        "Left open: heave",
        "Both campaigns go down to 0.6 m and come up again, 0.4 m each way. That is enough for heave, if "
        "with wider intervals than surge; the feed-forward leaves heave to its PID.",
        (
            Table(
                ("Parameter", "Campaign", "Ours", "95 % interval", "Simulated vehicle"),
                tuple(rows),
                "Heave, from the changes of depth alone.",
            ),
        ),
    )


def yaw_section(done: Reproduction) -> Section:
    """Yaw inertia: identified, and used in the feed-forward."""
    runs = {label: turned(done.dives[trial]) for label, trial in TURNS.items()}
    rows = tuple(
        (label, fixed(run.lag_s, 2), fixed(run.error_deg, 1), fixed(run.overshoot_deg, 1))
        for label, run in runs.items()
    )
    inertia = done.campaigns["survey"].ours["I_r"]
    value, interval = with_interval(inertia.value, inertia.low95, inertia.high95)
    truth = done.campaigns["survey"].truth["I_r"]
    return Section(
        "Left open: yaw inertia in the feed-forward",
        f"The survey campaign tells I_r = {value} kg m² ({interval}; the simulated vehicle has "
        f"{significant(truth, 4)}). Under eq. 16 the heading trails its reference. A smooth reference has "
        "the acceleration that the inertia needs; a linear one has none to give, so there inertia changes "
        "nothing. What trails with inertia is the thrusters' dead zone. An overshoot takes more than "
        "missing inertia: see above.",
        (
            Table(
                ("Feed-forward alone", "Behind the ramp, s", "Mean |error|, °", "Past its end, °"),
                rows,
                "Half a turn in survey. No inertia: the least that the vehicle's parameters take.",
            ),
        ),
        (
            figures.heading_errors(
                {label: done.dives[trial] for label, trial in TURNS.items()},
                "heading behind its reference",
                "How far the heading trails its reference.",
            ),
        ),
    )


def coupling_section(terms: tuple[Term, ...]) -> Section:
    """Off-diagonal terms of the mass and damping matrices."""
    off = [term for term in terms if not term.diagonal]
    rows = tuple(
        (
            term.name,
            f"{significant(term.value, 2)} ± {significant(term.std, 2)}",
            f"{fixed(100 * term.share, 1)} %",
            fixed(abs(term.value) / term.std, 1),
        )
        for term in off
    )
    beyond = sum(abs(term.value) > 1.96 * term.std for term in off)
    return Section(
        "Left open: terms off the diagonal",
        "Full matrices of mass (symmetric) and damping for surge, sway and yaw, fitted to the hovering "
        "campaign by least squares, each with its Coriolis terms. The simulated vehicle has none off the "
        f"diagonal, so this shows what such a dive can tell: {beyond} of {len(off)} lie beyond 1.96 of their "
        f"standard errors, and the largest is {fixed(100 * max(abs(term.share) for term in off), 1)} % of "
        "its diagonal neighbours.",
        (
            Table(
                ("Term, SI", "Value ± standard error", "Share of the diagonal", "|value| / error"),
                rows,
                "Share: over the root of the product of the diagonal terms of its row and column.",
            ),
        ),
    )
