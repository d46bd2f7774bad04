"""A bridge in lock-step for every test of the wire."""

import pytest
from service_rig import Rig


@pytest.fixture
def rig():
    return Rig()
