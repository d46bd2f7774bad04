"""The reproduction as plain data, for programs."""

from dataclasses import asdict
from typing import Any

from identify.validate import compare
from tui.reproduce.comparisons import configurations, lever, table_5, validation
from tui.reproduce.measures import turned
from tui.reproduce.open_questions import TURNS
from tui.reproduce.points import checks, points
from tui.reproduce.published import PARAMETERS, TABLE_5
from tui.reproduce.run import Reproduction


def to_json(done: Reproduction) -> dict[str, Any]:
    """Return all numbers of the page as JSON data."""
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
                for row in compare(runs, lever(done.file))
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
