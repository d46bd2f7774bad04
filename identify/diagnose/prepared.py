"""A dive ready for the search of causes: cleaned, its thrust's timing judged, its nominal model fitted, and the effects
to try."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from bridge.vehicle.coefficients import AcceptedEffect
from bridge.vehicle.config import Configuration, VehicleFile
from identify.diagnose.accepted_before import AcceptedCauses, accepted_causes, library_with_changes
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.cleaned import Cleaned
from identify.diagnose.filters.nominal import Nominal
from identify.diagnose.holding import Loop, judged_loop
from identify.diagnose.nominal_fit import fitted_nominal
from identify.diagnose.simulators.simulator import Simulator
from identify.diagnose.unjudged import able, lacking
from identify.dive import Dive
from identify.effects.effect import Effect
from identify.effects.library import accepted_library, library


@dataclass(frozen=True)
class Prepared:
    """A dive ready for the search.

    loop: the dive as its commands are taken, and its nominal fit. nominal: that fit with the effects `accepted` before
    held in it, as far as the dive bears them out. tried: effects to try. lacks: inputs (`Effect.needs`) that the dive
    or its check dive lacks; lacks_itself: those that the dive lacks. check: the check dive, with commands taken as the
    dive's.
    """

    configuration: Configuration
    loop: Loop
    accepted: AcceptedCauses
    nominal: Nominal
    tried: tuple[Effect, ...]
    lacks: frozenset[str]
    lacks_itself: frozenset[str]
    check: Dive | None

    @property
    def dive(self) -> Dive:
        return self.loop.dive

    @property
    def held(self) -> tuple[Cause, ...]:
        """The accepted causes that the nominal model holds."""
        return self.nominal.accepted

    def nominal_of_check(self, file: VehicleFile, configuration_name: str) -> Nominal | None:
        """The nominal fit of the check dive with the accepted effects held in it; None without a check dive.

        Raises FitError as `fitted_nominal` does.
        """
        if self.check is None:
            return None
        return self.accepted.in_force(fitted_nominal(self.check, file, configuration_name, self.loop.nominal))

    def able(self, simulator: Simulator) -> Simulator:
        """A simulator without the causes of which the recording can't tell."""
        causes = tuple(cause for cause in simulator.causes if not self.lacks & {*cause.effect.needs})
        return replace(simulator, causes=causes)


def prepared(
    dive: Cleaned,
    check: Cleaned | None,
    file: VehicleFile,
    configuration_name: str,
    effects: Sequence[Effect] | None,
    effects_accepted: Sequence[AcceptedEffect],
) -> Prepared:
    """Prepare a dive. effects: those to try, None for the whole library; raises FitError as `fitted_nominal` does."""
    vehicle, other = file.vehicle, None if check is None else check.dive
    configuration, lag_s = vehicle.configurations[configuration_name], vehicle.thrust_curve.lag_s
    lacks, lacks_itself = (
        lacking(dive.dive, of_check, configuration, vehicle.water) for of_check in (other, None)
    )
    accepted = accepted_causes(
        effects_accepted, able(accepted_library(configuration, lag_s), lacks, configuration)
    )
    loop = judged_loop(dive.dive, file, configuration_name)
    nominal = accepted.in_force(loop.nominal)
    asked = library(configuration, lag_s) if effects is None else effects
    tried = loop.able(able(asked, lacks, configuration))
    if effects is None:
        of_library = {effect.label for effect in tried}
        held = (cause.effect for cause in nominal.accepted)
        tried = (*tried, *(effect for effect in held if effect.label not in of_library))
    return Prepared(
        configuration,
        loop,
        accepted,
        nominal,
        library_with_changes(tried, nominal.accepted),
        lacks,
        lacks_itself,
        None if other is None else loop.like(other),
    )
