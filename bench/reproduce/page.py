"""The reproduction on one page, and as plain data for programs."""

from dataclasses import asdict
from typing import Any

from bench.reproduce import sections
from bench.reproduce.comparisons import (
    TURNS,
    configurations,
    coupling_section,
    heave_section,
    table_5,
    validation,
    yaw_section,
)
from bench.reproduce.dives import Campaign
from bench.reproduce.measures import turned
from bench.reproduce.paper import PAPER
from bench.reproduce.points import Point, checks, points
from bench.reproduce.published import PARAMETERS, SOURCE, TABLE_5
from bench.reproduce.run import Reproduction
from bridge.vehicle.coefficients import BY_NAME
from identify.report.page import Report, Section, Table
from identify.validation.tracking import compare
from identify.words import fixed

LABELS = tuple(
    label.replace(" ", "\N{NO-BREAK SPACE}") for label in ("The paper", "What follows", "It fits if")
)


def report(done: Reproduction) -> Report:
    shapes = done.file.vehicle.configurations
    survey, hovering = done.campaigns["survey"], done.campaigns["hovering"]
    numbers = validation(done)
    misfits = points(shapes["survey"].dry_mass_kg)
    return Report(
        "The paper, reproduced",
        f"{SOURCE}, on the simulated vehicle {done.file.vehicle.name}, seed {done.seed}",
        verdict(done),
        (
            about_section(done),
            sections.campaign_section(survey, shapes["survey"]),
            sections.campaign_section(hovering, shapes["hovering"]),
            sections.shadow_section(done, numbers),
            sections.alone_section(done, numbers),
            sections.both_section(done, numbers),
            sections.configuration_section(done),
            misfit_section(misfits),
            fit_section(),
            heave_section(done),
            yaw_section(done),
            coupling_section(hovering.coupling),
        ),
    )


def verdict(done: Reproduction) -> str:
    campaigns = done.campaigns.values()
    misfits = len(points(done.file.vehicle.configurations["survey"].dry_mass_kg))
    low, high = _range(
        [100 * e for campaign in campaigns for e in errors(campaign, campaign.paper.values(), "mass")]
    )
    damping = max(
        abs(e) for campaign in campaigns for e in errors(campaign, campaign.paper.values(), "damping")
    )
    ours = max(
        abs(e)
        for campaign in campaigns
        for kind in ("mass", "damping")
        for e in errors(campaign, campaign.ours.values(), kind)
    )
    return (
        "On a vehicle that is what its tables say, the paper's method finds damping within "
        f"{fixed(100 * damping, 1)} % and total mass and inertia {low} to {high} % off; ours is within "
        f"{fixed(100 * ours, 1)} %. On {misfits} points the paper's text and numbers do not fit together as "
        "printed."
    )


def errors(campaign: Campaign, values: dict[str, float], kind: str) -> list[float]:
    """Relative errors of the coefficients of one kind that the paper's method learns."""
    return [
        values[name] / campaign.truth[name] - 1
        for name in campaign.paper.values()
        if BY_NAME[name].kind == kind and name in values
    ]


def _range(values: list[float]) -> tuple[str, str]:
    return fixed(min(values), 1), fixed(max(values), 1)


def about_section(done: Reproduction) -> Section:
    options, shape = done.options, done.file.vehicle.configurations["survey"]
    paper_size = (options.hidden, options.depth) == (PAPER.hidden, PAPER.depth)
    size = (
        "its own size"
        if paper_size
        else f"the paper's, which the option network takes, is {PAPER.depth} x {PAPER.hidden}"
    )
    text = (
        "The paper's two campaigns and its validation dives, dived by the simulated vehicle through the "
        "bytes of its sensors, the bridge, MAVLink and the recorder, and identified from the recordings. "
        "The paper's own dives are not public, and its figures are pictures: beside ours stand the numbers "
        "that its text, tables and captions give.",
        "The simulated vehicle has the coefficients of Tables 3 and 4, X taken for added mass, on top of a "
        f"dry mass of {shape.dry_mass_kg:g} kg that the paper does not give. Its campaigns run at 0.6 m "
        "depth with double-S changes of 5 s and linear heading references, under a conservative "
        "gain-scheduled PID; its thrusters stand at 34° in hovering and have a dead zone. Sway damping in "
        "survey, heave, roll, pitch, inertia, noise and disturbance are chosen.",
        f"The paper's method is its Algorithm 1, with an LSTM of {options.depth} x {options.hidden} ({size}) "
        f"over {options.epochs} epochs. The size changes no parameter. Before it the data pass a zero-phase "
        f"low-pass at {options.cutoff_hz:g} Hz; how the paper raised its signal-to-noise ratio it does not "
        "say. What noise is left in the acceleration pulls the masses down.",
    )
    return Section("What this is", "\n\n".join(text))


def misfit_section(misfits: tuple[Point, ...]) -> Section:
    return Section(
        "Where the numbers do not fit",
        "The arithmetic is made by the code from the paper's own figures. A point here is a question to the "
        "text, not a fault of the work that it describes.",
        tuple(
            Table(
                (f"{number}.", point.title),
                tuple(zip(LABELS, (point.says, point.follows, point.fits_if), strict=True)),
            )
            for number, point in enumerate(misfits, start=1)
        ),
    )


def fit_section() -> Section:
    rows = tuple((check.what, check.stated, check.computed) for check in checks())
    return Section("Where they fit", "", (Table(("Number", "As printed", "From its other numbers"), rows),))


def to_json(done: Reproduction) -> dict[str, Any]:
    ratios, before, after = configurations(done)
    shape = done.file.vehicle.configurations["survey"]
    runs = table_5(done)
    return {
        "seed": done.seed,
        "network": {
            "hidden": done.options.hidden,
            "depth": done.options.depth,
            "epochs": done.options.epochs,
        },
        "campaigns": {
            name: {
                "published": {key: asdict(number) for key, number in PARAMETERS[name].items()},
                "truth": dict(campaign.truth),
                "paper_method": campaign.paper.values(),
                "least_of_its_loss": dict(campaign.closed),
                "ours": campaign.ours.to_json(),
                "training": {"names": list(campaign.curves.names), "values": campaign.curves.values.tolist()},
            }
            for name, campaign in done.campaigns.items()
        },
        "validation": [asdict(row) for row in validation(done)],
        "table_5": {
            "columns": ["paper", *runs],
            "rows": [
                {"axis": row.axis, "phase": row.phase, "values": [TABLE_5[row.axis, row.phase], *row.values]}
                for row in compare(runs)
                if (row.axis, row.phase) in TABLE_5
            ],
        },
        "configurations": {
            "ratios": [asdict(ratio) for ratio in ratios],
            "survey": asdict(before),
            "hovering": asdict(after),
        },
        "does_not_fit": [asdict(point) for point in points(shape.dry_mass_kg)],
        "fits": [asdict(check) for check in checks()],
        "left_open": {
            "turns": {label: asdict(turned(done.dives[trial])) for label, trial in TURNS.items()},
            "coupling": [asdict(term) for term in done.campaigns["hovering"].coupling],
        },
    }
