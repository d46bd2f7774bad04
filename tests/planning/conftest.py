"""Trials that were dived, shared by all tests of planning."""

import pytest

from identify.planning.limits import Tank, Trial

DIVED: dict[str, Trial] = {}


@pytest.fixture(scope="module", autouse=True)
def _a_trial_is_dived_once():
    """Proposals try mostly the same trials, and one of the same legs in the same tank comes to the same."""
    dive = Tank.dive

    def once(tank, legs):
        key = repr((tank.file.vehicle, tank.configuration_name, tank.knowledge.values, legs))
        if key not in DIVED:
            DIVED[key] = dive(tank, legs)
        return DIVED[key]

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(Tank, "dive", once)
        yield
