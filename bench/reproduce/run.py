"""Run the whole reproduction: both campaigns, then the validation dives with the identified coefficients."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from bench.campaigns import CONFIGURATIONS, VEHICLE
from bench.reproduce import dives
from bench.reproduce.dives import Campaign, Trial, campaign
from bench.reproduce.paper import PaperOptions
from bridge.vehicle.config import VehicleFile, load_vehicle
from bridge.vehicle.mode import Mode
from gcs_plugin.job import side_by_side
from identify.dive import Dive
from identify.identification import Identification

CAMPAIGN_SHARE = 0.75
SHARED = 1_000
"""Added to the seed for the validation dives, so that all of them meet the same sea."""

Tell = Callable[[float, str], None]


@dataclass(frozen=True)
class Reproduction:
    """Results of the whole reproduction; `dives` are the validation dives by the name of their trial."""

    file: VehicleFile
    options: PaperOptions
    seed: int
    campaigns: Mapping[str, Campaign]
    dives: Mapping[str, Dive]


def reproduce(root: Path, seed: int, unix_s: float, options: PaperOptions, tell: Tell) -> Reproduction:
    """Run the campaigns and the validation dives; the recordings go under the new folder `root`."""
    file = load_vehicle(VEHICLE)

    def heard(done: Mapping[str, float]) -> None:
        words = ", ".join(f"{name} {share:.0%}" for name, share in done.items())
        tell(CAMPAIGN_SHARE * sum(done.values()) / len(done), f"campaigns: {words}")

    campaigns = side_by_side(
        {name: partial(campaign, name, options, root, seed, unix_s) for name in CONFIGURATIONS}, heard
    )

    def flown(done: Mapping[str, float]) -> None:
        share = sum(done.values()) / len(done)
        finished = sum(share_done >= 1.0 for share_done in done.values())
        tell(CAMPAIGN_SHARE + (1 - CAMPAIGN_SHARE) * share, f"validation: {finished} of {len(done)} dives")

    dives = side_by_side(
        {
            trial.name: partial(dives.dive, trial, root, seed + SHARED, unix_s)
            for trial in planned(file, campaigns)
        },
        flown,
    )
    tell(1.0, "done")
    return Reproduction(file, options, seed, campaigns, dives)


def planned(file: VehicleFile, campaigns: Mapping[str, Campaign]) -> tuple[Trial, ...]:
    """The validation dives: the paper's with the values of its method, then those with ours."""
    survey, hovering = (campaigns[name] for name in CONFIGURATIONS)
    by_paper, by_ours = flyable(survey.paper), flyable(survey.ours)
    eq_16 = dives.without_inertia(by_paper, file, "survey")
    return (
        Trial("surge shadow", "survey", "line", Mode.SHADOW, by_paper),
        Trial("surge alone", "survey", "line", Mode.ALONE, by_paper),
        Trial("heading shadow", "survey", "heading, linear", Mode.SHADOW, eq_16),
        Trial("heading alone", "survey", "heading, linear", Mode.ALONE, eq_16),
        Trial("heading smooth", "survey", "heading, smooth", Mode.ALONE, eq_16),
        Trial("heading inertia", "survey", "heading, smooth", Mode.ALONE, by_ours),
        Trial("hovering PID", "hovering", "surge and sway", Mode.SHADOW, flyable(hovering.paper)),
        Trial("hovering alone", "hovering", "surge and sway", Mode.ALONE, flyable(hovering.paper)),
        Trial("hovering both", "hovering", "surge and sway", Mode.BOTH, flyable(hovering.paper)),
        Trial("hovering alone ours", "hovering", "surge and sway", Mode.ALONE, flyable(hovering.ours)),
        Trial("hovering both ours", "hovering", "surge and sway", Mode.BOTH, flyable(hovering.ours)),
    )


def flyable(identified: Identification) -> dict[str, float]:
    """The coefficients that the feed-forward of surge, sway and yaw uses, as far as they were identified."""
    names = ("M_u", "M_v", "I_r", "D_u", "D_v", "D_r")
    return {name: value for name, value in identified.values().items() if name in names}
