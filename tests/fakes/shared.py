"""Dives and texts of others, which lie beside the checkout: a test that needs them is skipped where they do not."""

from pathlib import Path

import pytest

CHECKOUT = Path(__file__).resolve().parents[2]


def shared(*parts: str) -> Path:
    path = CHECKOUT.parent.joinpath("shared", *parts)
    if not path.exists():
        pytest.skip(f"needs ../shared/{'/'.join(parts)} beside the checkout")
    return path
