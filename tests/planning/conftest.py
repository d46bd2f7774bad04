"""Trials that were dived, shared by all tests of planning, and few of them."""

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


@pytest.fixture(autouse=True)
def _waves_of_few_lengths(request, monkeypatch):
    """Each length of wave is tried many times over; in `make soak` all of them are."""
    if not request.node.get_closest_marker("soak"):
        monkeypatch.setattr("identify.planning.propose.PERIODS_S", (4.0, 32.0))
