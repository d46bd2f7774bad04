"""A dive of two minutes without any effect: its nominal model and its configuration."""

import pytest
from fakes.planted import drawn_nominal


@pytest.fixture(scope="session")
def nominal():
    return drawn_nominal()


@pytest.fixture(scope="session")
def shape(nominal):
    return nominal.course.configuration
