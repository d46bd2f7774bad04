"""Trials that were dived, shared by all tests of planning."""

from collections.abc import Iterator

import pytest

from bridge.vehicle.legs import Leg
from identify.planning.limits import Tank, Trial

DIVED: dict[str, Trial] = {}


@pytest.fixture(scope="module", autouse=True)
def _a_trial_is_dived_once() -> Iterator[None]:
    """Proposals try mostly the same trials, and one of the same legs in the same tank comes to the same."""
    dive = Tank.dive

    def once(tank: Tank, legs: list[Leg]) -> Trial:
        key = repr((tank.file.vehicle, tank.configuration_name, tank.knowledge.values, legs))
        if key not in DIVED:
            DIVED[key] = dive(tank, legs)
        return DIVED[key]

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(Tank, "dive", once)
        yield
