"""Plan the next dive: from the vehicle file alone, or from all that an earlier dive tells."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from bridge.errors import ConfigError
from bridge.vehicle.config import VehicleFile
from identify.dive import Dive
from identify.estimators.table import DEFAULT, estimator
from identify.planning.knowledge import Knowledge, after, before_any_dive
from identify.planning.limits import Limits, Tank
from identify.planning.propose import DOFS_PLANNED, Proposal, propose
from identify.planning.writing import to_json
from identify.progress import Step, Steps, ignore_step

OF: Final = "plan"


@dataclass(frozen=True)
class Planned:
    """A proposal for a configuration, with the knowledge that it starts from and the limits that it keeps."""

    file: VehicleFile
    configuration: str
    knowledge: Knowledge
    limits: Limits
    proposal: Proposal

    @property
    def tank(self) -> Tank:
        """The vehicle in its limits."""
        return Tank(self.file, self.configuration, self.knowledge)

    def to_json(self) -> dict[str, Any]:
        """Vehicle, configuration and proposal as plain data."""
        about = {"name": self.file.vehicle.name, "sha256": self.file.sha256}
        return {
            "vehicle": about,
            "configuration": self.configuration,
            **to_json(self.proposal, self.knowledge, self.limits),
        }


def plan(
    file: VehicleFile,
    limits: Limits,
    seconds: float,
    dofs: Sequence[int] = DOFS_PLANNED,
    *,
    known: "Dive | Mapping[str, Any] | None" = None,
    source: str = "",
    progress: Steps = ignore_step,
) -> Planned:
    """Propose the manoeuvres for `seconds` in total.

    `known` is an earlier dive, which is identified first, or the JSON of an identification; `source` is named in
    messages about it. Raises ConfigError if the configuration is open, or `known` fits neither vehicle nor
    configuration, and FitError if the dive tells nothing or no manoeuvre fits.
    """

    def passed_on(share: float, words: str, *_: object) -> None:
        progress(Step(OF, share, words))

    if known is None:
        configuration_name = file.configuration or _only(file)
        knowledge = before_any_dive(file, configuration_name)
    else:
        if isinstance(known, Dive):
            configuration_name = file.configuration_of(known.configuration_index())
            known = estimator(DEFAULT)(known, file, configuration_name, passed_on).to_json()
        else:
            configuration_name = file.configuration or file.vehicle.configuration_named(
                str(known.get("configuration"))
            )
        knowledge = after(known, file, configuration_name, source)
    proposal = propose(file, configuration_name, knowledge, limits, seconds, dofs, passed_on)
    return Planned(file, configuration_name, knowledge, limits, proposal)


def _only(file: VehicleFile) -> str:
    names = list(file.vehicle.configurations)
    if len(names) > 1:
        raise ConfigError(
            f"vehicle '{file.vehicle.name}' has {', '.join(names)}; name one: --vehicle FILE:CONFIGURATION"
        )
    return names[0]
