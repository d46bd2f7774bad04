"""What every test of the app begins with."""

import pytest


@pytest.fixture(autouse=True)
def _with_colour(monkeypatch):
    """Whatever the terminal of these tests asks for."""
    monkeypatch.delenv("NO_COLOR", raising=False)
