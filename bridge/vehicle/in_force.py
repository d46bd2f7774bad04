"""The model in force on board: its coefficients, their accepted effects, and how the feed-forward proves in shadow."""

from collections.abc import Callable, Mapping, Sequence

from bridge.vehicle.accepted_effects import known_effects
from bridge.vehicle.config import Configuration
from bridge.vehicle.mode import Mode
from bridge.vehicle.navigation import Navigation
from bridge.vehicle.references import Six
from bridge.vehicle.shadow import NONE_FLOWN, Shadow
from bridge.wire.status_codes import without_set_faults

ParameterProvider = Callable[[int], Mapping[str, float]]
"""Returns the active coefficients by name, of the configuration of that VEH_CFG."""


class ModelInForce:
    """The active `coefficients` of a configuration and their `effects`; `reach` (6,) is its largest wrench, N and N m.

    Call `renew` once a tick.
    """

    def __init__(
        self, parameters: ParameterProvider, veh_cfg: int, shape: Configuration, reach: Sequence[float]
    ) -> None:
        self._parameters, self._veh_cfg, self._shape = parameters, veh_cfg, shape
        self.coefficients: Mapping[str, float] = {}
        self.effects = known_effects({}, shape)
        self.shadow = Shadow(reach)

    def renew(self) -> bool:
        """Take over coefficients that have changed, with their effects; return whether they have."""
        coefficients = self._parameters(self._veh_cfg)
        if coefficients == self.coefficients:
            return False
        self.shadow.begin_anew()
        self.coefficients = dict(coefficients)
        self.effects = known_effects(coefficients, self._shape)
        return True

    def judge(
        self, mode: Mode, obstacle: str, dt_s: float, given: Six, fed: Six, navigation: Navigation
    ) -> None:
        """Take a tick as evidence for or against the feed-forward if it was flown in shadow.

        `obstacle` says in at most 20 characters why it is no evidence, "" if it is. The rest is as for `Shadow.step`.
        """
        if mode is Mode.OFF:
            self.shadow.begin_anew()
        elif mode is not Mode.SHADOW:
            self.shadow.pause()
        elif obstacle:
            self.shadow.begin_anew(obstacle)
        elif dt_s > 0:
            nu = (*navigation.velocity, *navigation.rate)
            self.shadow.step(dt_s, self.coefficients, self.effects.hull, given, fed, nu)

    def unproven(self) -> str:
        """Say why the feed-forward has not proved good in shadow, "" if it has: for `ParameterServer.unproven`.

        Judges the parameters in force at the time of the call, which may be newer than those of the last tick.
        """
        same = self._parameters(self._veh_cfg) == self.coefficients
        return self.shadow.fault if same else NONE_FLOWN


class FaultTexts:
    """Faults of a control law as texts for the crew: each when it appears, and again when it reappears."""

    def __init__(self) -> None:
        self._faults: tuple[str, ...] = ()
        self._texts: list[str] = []

    def report(self, faults: tuple[str, ...]) -> None:
        """Take the faults of a tick."""
        self._texts += [fault for fault in faults if fault not in self._faults]
        self._faults = faults

    def begin_set(self) -> None:
        """A new set is in force: the faults of a set that this has as well are reported again."""
        self._faults = without_set_faults(self._faults)

    def take(self) -> list[str]:
        """The texts since the last call."""
        texts, self._texts = self._texts, []
        return texts
